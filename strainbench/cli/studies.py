"""The verbs that look at projections of one scene, or at what scenes model."""

from __future__ import annotations

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
    Folder,
    FrameNumbers,
    FramesFolder,
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
    results: FramesFolder = LOCAL / "duel",
    output: TableFile = None,
) -> None:
    """Let solvers take turns on the same projections: ratios of times in one run."""
    from strainbench.bench.machine import describe_machine
    from strainbench.bench.plan import plan_available
    from strainbench.document.writers import terminal
    from strainbench.report.output import check_ending, write_output
    from strainbench.studies.duel.measure import duel, parse_frames
    from strainbench.studies.duel.report import Outcome

    sequences = parse_frames(frame)
    if output is not None:
        check_ending(output)
    cells = plan_available(scenario, solver, set_ or [], 1, tolerance, time_limit)
    solvers = [cell.solver.solver() for cell in cells]
    machine, about = describe_machine(threads=1)
    recording = _recorded(cells[0], max(map(max, sequences)), None if units else results)
    with progress() as bar:
        turns = repeats * sum(map(len, sequences)) * len(cells)
        turn = partial(bar.advance, bar.add_task("projections", total=turns))
        entries = duel(solvers, recording, sequences, repeats, tolerance, time_limit, units, turn)
    for entry, cell in zip(entries, cells, strict=False):  # units of time may follow
        entry.label = cell.solver.label
    title = f"{cells[0].scenario.label}, projections {frame}, tolerance {tolerance:g}"
    outcome = Outcome(title, shlex.join(["strainbench", *sys.argv[1:]]), {machine: about}, entries)
    Console(width=max(console.width, 200)).print(terminal(outcome.table()))  # many columns
    if output is not None:
        write_output(output, outcome.document(), outcome.cells())
        say(f"wrote {output}")


def keep_ledger(
    scenarios: AnyScenarios = None,
    solver: OneSolver = DEFAULT_SOLVER,
    set_: ScenariosValues = None,
    steps: Steps = 60,
    tolerance: Tolerance = 1e-6,
    results: Folder = LOCAL / "ledger",
) -> None:
    """Write what each scene models, and what each part of its physics changes in the answer."""
    from strainbench.bench.plan import plan
    from strainbench.studies.ledger import of_cloth, write_ledger

    names = scenarios or of_cloth()
    cells = plan(names, [solver], set_ or [], "simulate", steps, [tolerance], None)
    with tracking() as track:
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
    from strainbench.bench.machine import fixed_threads
    from strainbench.bench.recording import record_all, recorded, recorder

    fed = recorder(cell)
    with fixed_threads(1), playing(fed, last) as asked:
        if results is None:
            return record_all(fed, last, asked)
        return recorded(fed, last, results / "frames", asked)
