"""The verb sensitivity: what the way in which a projection is written down changes."""

from __future__ import annotations

import shlex
import sys
from typing import Annotated

import typer

from strainbench.cli.display import console, playing, say, tracking
from strainbench.cli.options import (
    LOCAL,
    Folder,
    FrameNumber,
    OneScenario,
    ProjectionSeconds,
    Solvers,
    SolversValues,
    Tolerance,
)
from strainbench.options import whole

Draws = Annotated[
    int,
    typer.Option(
        "--draws",
        parser=whole("--draws", 1000),
        metavar="N",
        help="orders, rotations and translations, of each so many",
    ),
]


def measure_sensitivity(
    scenario: OneScenario,
    frame: FrameNumber,
    solver: Solvers,
    set_: SolversValues = None,
    draws: Draws = 20,
    tolerance: Tolerance = 1e-6,
    time_limit: ProjectionSeconds = 20.0,
    results: Folder = LOCAL / "sensitivity",
) -> None:
    """Write a projection down in other orders, rotations, places and units: what that changes."""
    from strainbench.bench.machine import describe_machine
    from strainbench.bench.plan import plan_available
    from strainbench.bench.recording import record, recorder
    from strainbench.bench.records import open_folder
    from strainbench.document.writers import terminal
    from strainbench.files import locked
    from strainbench.report.provenance import remember_study
    from strainbench.studies.sensitivity import Outcome, measure

    cells = plan_available(scenario, solver, set_ or [], 1, tolerance, time_limit)
    solvers = [cell.solver.solver() for cell in cells]
    open_folder(results)
    with playing(recorder(cells[0]), frame) as asked:
        problem = record(recorder(cells[0]), frame, asked)
    machine, facts = describe_machine(threads=1)
    with tracking() as track:
        found = measure(solvers, problem, draws, tolerance, time_limit, track)
    title = f"{cells[0].scenario.label}, projection {frame}, tolerance {tolerance:g}"
    command = shlex.join(["strainbench", *sys.argv[1:]])
    outcome = Outcome(title, command, {machine: facts}, found)
    console.print(terminal(outcome.table()))
    with locked(results):
        remember_study(results, "sensitivity", machine, facts)
    for written in outcome.write(results):
        say(f"wrote {written}")
