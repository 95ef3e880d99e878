"""The verbs that write projections as files: export, testset."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from strainbench import __version__
from strainbench.cli.display import playing, progress, say
from strainbench.cli.interrupt import keeping
from strainbench.cli.options import (
    RECORDER,
    ManyValues,
    ProblemFormat,
    ProblemPlace,
    Scaled,
    Scenarios,
    Small,
    SolverBefore,
    SomeFrames,
    SomeSteps,
    TestSetFolder,
    Tolerance,
)
from strainbench.escape import plain

if TYPE_CHECKING:
    from strainbench.bench.cell import Cell
    from strainbench.studies.testset.collection import Collection


def export_frames(
    scenarios: Scenarios,
    frame: SomeFrames,
    output: ProblemPlace,
    every: SomeSteps = None,
    format_: ProblemFormat = None,
    scaled: Scaled = False,
    solver: SolverBefore = RECORDER,
    set_: ManyValues = None,
    tolerance: Tolerance = 1e-6,
) -> None:
    """Write projections as conic instances (CBF) and arrays (npz): one file, or a folder of many.

    A folder has an index, README, licence and citation.
    """
    many = len(scenarios) > 1 or every is not None or any(sign in frame for sign in "-,")
    if many and not frame.startswith("-"):
        _export_many(scenarios, frame, every or 1, output, format_, scaled, solver, set_, tolerance)
    else:
        _export_one(scenarios[0], frame, output, format_, scaled, solver, set_, tolerance)


def _export_one(
    scenario: str,
    frame: str,
    output: Path,
    format_: str | None,
    scaled: bool,
    solver: str,
    set_: list[str] | None,
    tolerance: float,
) -> None:
    """One projection as one file."""
    from strainbench.bench.plan import plan_one
    from strainbench.bench.recording import record
    from strainbench.files import open_folder
    from strainbench.options import whole
    from strainbench.problem.export import check_format, write_problem

    number = whole("--frame")(frame)
    if output.is_dir():
        raise ValueError(
            f"-o {output} is a folder: a file is valid, such as {output / 'frame.cbf'}"
        )
    kind = check_format(output.suffix.removeprefix(".") if format_ is None else format_)
    if scaled and kind != "cbf":
        raise ValueError(f"--scaled: --format cbf is valid, and {kind} has metres")
    cell = plan_one(scenario, solver, set_ or [], number, tolerance)
    open_folder(output.parent, "-o")
    with playing(cell, number) as asked:
        problem = record(cell, number, asked)
    before = f"those before by {cell.solver.label}"
    about = f"{cell.scenario.label}, projection {number}, {before}; strainbench {__version__}"
    write_problem(problem, output, kind, about, scaled)
    size = f"{3 * len(problem.free)} variables, {problem.constraints} constraints"
    say(f"wrote {output}: {size}")


def _export_many(
    scenarios: list[str],
    frame: str,
    every: int,
    output: Path,
    format_: str | None,
    scaled: bool,
    solver: str,
    set_: list[str] | None,
    tolerance: float,
) -> None:
    """Projections of scenes as a folder."""
    from strainbench.bench.plan import plan
    from strainbench.problem.export import FORMATS, check_format
    from strainbench.studies.duel.measure import parse_frames
    from strainbench.studies.testset.collection import Collection, named

    numbers = [number for sequence in parse_frames(frame) for number in sequence][
        every - 1 :: every
    ]
    if not numbers:
        raise ValueError(f"--every {every}: --frame {frame} has fewer; at most as many is valid")
    if output.suffix.removeprefix(".") in FORMATS:
        raise ValueError(
            f"-o {output}: several projections are files of a folder; its name is valid"
        )
    formats = list(FORMATS) if format_ is None else [check_format(format_)]
    if scaled and "cbf" not in formats:
        raise ValueError("--scaled: --format cbf is valid, and npz has metres")
    last = max(numbers)
    cells = plan(scenarios, [solver], set_ or [], "simulate", last, [tolerance], None)
    title = f"Projections of {', '.join(dict.fromkeys(c.scenario.name for c in cells))}"
    wanted = [w for cell in cells for w in named(cell, numbers)]
    _write(Collection(output, title, wanted, formats, scaled))


def make_test_set(folder: TestSetFolder, small: Small = False, scaled: Scaled = False) -> None:
    """Write our test set: named instances with certified optima; resumes by itself."""
    from strainbench.studies.testset.collection import Collection
    from strainbench.studies.testset.ours import TITLE, our_set

    _write(Collection(folder, TITLE, our_set(small), scaled=scaled))


def _write(collection: Collection) -> None:
    """Make what is missing of a folder, with a line for each."""
    from strainbench.bench.recording import Recording, record_all

    missing, done = collection.missing(), [0]
    if there := len(collection.wanted) - len(missing):
        say(f"{there} of {len(collection.wanted)} instances are there")

    def kept() -> str:
        return f"; {there + done[0]} of {len(collection.wanted)} instances are kept"

    with keeping(kept), progress("instances,") as bar:
        task = bar.add_task("starting", total=len(missing))

        def record(cell: Cell, last: int) -> Recording:
            bar.update(task, description=plain(cell.scenario.label))
            return record_all(cell, last)

        for row in collection.write(record):
            done[0] += 1
            bar.advance(task)
            say(f"{row['name']}: {row['variables']} variables, {_found(row)}")
    say(f"wrote {collection.folder}: {len(collection.wanted)} instances")


def _found(row: Mapping[str, object]) -> str:
    """What is certain of an instance, in words."""
    if row["relative_gap"] == "":
        return str(row["status"])
    return f"{row['status']}, gap {row['relative_gap']:.1e}, {row['active']} constraints active"
