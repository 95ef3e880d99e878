"""The verbs that look at projections of one scene, or at what scenes model."""

from __future__ import annotations

import re
import shlex
import sys
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console

from strainbench.cli.display import console, playing, progress, say, tracking
from strainbench.cli.interrupt import keeping
from strainbench.cli.options import (
    DEFAULT_SOLVER,
    LOCAL,
    AllSolvers,
    AnyScenarios,
    Checkout,
    ComparedSeconds,
    Enough,
    Folder,
    FrameNumbers,
    FramesFolder,
    ManyValues,
    OneScenario,
    OneSolver,
    ProjectionSeconds,
    Repeats,
    ScenariosValues,
    Solvers,
    SolverSeconds,
    SolversValues,
    Steps,
    TableFile,
    TightestTolerance,
    Tolerance,
    Units,
)

if TYPE_CHECKING:
    from strainbench.bench.cell import Cell
    from strainbench.bench.recording import Recording
    from strainbench.problem.problem import Problem


def follow_solvers(
    scenario: OneScenario,
    frame: FrameNumbers,
    solver: AllSolvers = None,
    set_: SolversValues = None,
    tolerance: TightestTolerance = 1e-8,
    time_limit: SolverSeconds = 60.0,
    results: Folder = LOCAL / "convergence",
) -> None:
    """Follow solvers on projections of a scene: violation, gap and distance against time."""
    from strainbench.bench.machine import memory_share
    from strainbench.bench.plan import plan_scene
    from strainbench.bench.recording import recorder
    from strainbench.studies.convergence.measure import CANDIDATE, converge
    from strainbench.studies.convergence.report import write_convergence
    from strainbench.studies.duel.measure import parse_frames

    numbers = list(dict.fromkeys(number for sequence in parse_frames(frame) for number in sequence))
    cells = plan_scene(scenario, solver or ["all"], set_ or [], 1, tolerance, time_limit)
    if all(cell.solver.label == CANDIDATE for cell in cells):
        there = "the candidate itself is there in any case"
        raise ValueError(f"--solver {CANDIDATE}: {there}; the names of other solvers are valid")
    problems = _record_all(recorder(cells[0]), numbers)
    ended = (
        (number, *end)
        for number, problem in zip(numbers, problems, strict=True)
        for end in converge(cells, problem, number, results, memory_share(), problems)
    )
    told: list[Cell] = []
    count = len(cells) * len(numbers)

    def kept() -> str:
        return f"; the rows of {len(told)} of {count} solvers are kept" if told else ""

    with keeping(kept), progress() as bar:
        for number, cell, ending in bar.track(ended, count, description="solvers"):
            where = f", projection {number}" if len(numbers) > 1 else ""
            say(f"{cell.solver.label}{where}: {ending}", bar.console)
            told.append(cell)
    for written in write_convergence(results):
        say(f"wrote {written}")


def let_duel(
    scenario: OneScenario,
    frame: FrameNumbers,
    solver: Solvers,
    set_: SolversValues = None,
    repeats: Repeats = 5,
    tolerance: Tolerance = 1e-6,
    time_limit: ProjectionSeconds = 60.0,
    units: Units = False,
    against: Checkout = None,
    results: FramesFolder = LOCAL / "duel",
    output: TableFile = None,
) -> None:
    """Let solvers, or two versions of them, take turns on the same projections: ratios of times."""
    from strainbench.bench.machine import describe_machine
    from strainbench.bench.plan import plan_available
    from strainbench.document.writers import terminal
    from strainbench.report.output import check_ending, write_output
    from strainbench.studies.duel.measure import duel, parse_frames
    from strainbench.studies.duel.report import Outcome
    from strainbench.studies.duel.trees import check_tree

    sequences = parse_frames(frame)
    if output is not None:
        check_ending(output)
    other = None if against is None else check_tree(against)
    cells = plan_available(scenario, solver, set_ or [], 1, tolerance, time_limit)
    solvers = [cell.solver.solver() for cell in cells]
    machine, about = describe_machine(threads=1)
    recording = _recorded(cells[0], max(map(max, sequences)), None if units else results)
    with progress() as bar:
        turns = repeats * sum(map(len, sequences)) * len(cells) * (1 if other is None else 2)
        turn = partial(bar.advance, bar.add_task("projections", total=turns))
        entries = duel(
            *(solvers, recording, sequences, repeats, tolerance, time_limit, units, turn, other)
        )
    racing = cells if other is None else 2 * cells
    for entry, cell in zip(entries, racing, strict=False):  # units of time may follow
        entry.label = cell.solver.label
    title = f"{cells[0].scenario.label}, projections {frame}, tolerance {tolerance:g}"
    outcome = Outcome(title, shlex.join(["strainbench", *sys.argv[1:]]), {machine: about}, entries)
    for table in (outcome.table(), *([outcome.versions()] if other else [])):
        Console(width=max(console.width, 200)).print(terminal(table))  # many columns
    if output is not None:
        write_output(output, outcome.document(), outcome.cells())
        say(f"wrote {output}")


def compare_steps(
    scenario: OneScenario,
    solver: Solvers,
    set_: ManyValues = None,
    duration: ComparedSeconds = 0.5,
    tolerance: Tolerance = 1e-6,
    results: Folder = LOCAL / "step",
) -> None:
    """Compare closed loops with the motion whose steps are constrained whole: distances in mm."""
    from strainbench.bench.plan import plan
    from strainbench.document.writers import terminal
    from strainbench.studies.step import measure, tables, write_distances
    from strainbench.studies.threads import one_thread

    words = [as_decimals(word) for word in set_ or []]
    cells = plan([scenario], solver, words, "simulate", None, [tolerance], None, duration)
    with one_thread(), tracking() as track:
        rows = list(track(measure(cells), "playing", len(cells)))
    command = shlex.join(["strainbench", *sys.argv[1:]])
    for table in tables(rows):
        Console(width=max(console.width, 160)).print(terminal(table))
    for file in write_distances(rows, command, results):
        say(f"wrote {file}")


def as_decimals(word: str) -> str:
    """KEY=V1,V2 with fractions of whole numbers, such as 1/60, as decimals."""
    key, equals, values = word.partition("=")
    return key + equals + re.sub(r"(?<![\w./])(\d+)/([1-9]\d*)(?![\w./])", _decimal, values)


def _decimal(fraction: re.Match[str]) -> str:
    return repr(int(fraction[1]) / int(fraction[2]))


def keep_ledger(
    scenarios: AnyScenarios = None,
    solver: OneSolver = DEFAULT_SOLVER,
    set_: ScenariosValues = None,
    steps: Steps = 60,
    tolerance: Tolerance = 1e-6,
    enough: Enough = False,
    results: Folder = LOCAL / "ledger",
) -> None:
    """Write what each scene models, and what each part of its physics changes in the answer."""
    from strainbench.bench.plan import plan
    from strainbench.studies.ledger import of_cloth, write_enough, write_ledger
    from strainbench.studies.threads import one_thread

    names = scenarios or of_cloth()
    cells = plan(names, [solver], set_ or [], "simulate", steps, [tolerance], None)
    if enough and len(cells) != 1:
        raise ValueError(f"--enough: {len(cells)} scenes; one, with one value a setting, is valid")
    with one_thread(), tracking() as track:
        if enough:
            written = write_enough(cells[0], results, track)
        else:
            written = write_ledger(cells, results, track)
    for file in written:
        say(f"wrote {file}")


def _record_all(cell: Cell, numbers: Sequence[int]) -> list[Problem]:
    """Several projections of a scene, in one pass."""
    from strainbench.bench.recording import record_all

    with playing(cell, max(numbers)) as asked:
        recording = record_all(cell, max(numbers), asked)
    return [recording.frame(number) for number in numbers]


def _recorded(cell: Cell, last: int, results: Path | None) -> Recording:
    """A scene's projections, those kept in a folder or, with times, those played now."""
    from strainbench.bench.recording import record_all, recorded, recorder

    fed = recorder(cell)
    with playing(fed, last) as asked:
        if results is None:
            return record_all(fed, last, asked)
        return recorded(fed, last, results / "frames", asked)
