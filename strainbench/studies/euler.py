"""Where the time of implicit Euler goes, for each way of factorising that is installed.

    python -m strainbench.studies.euler swing --resolution 60 --steps 20

plays a cloth scene without projection, or with that of `--solver NAME`. Each step is solved with
every linear solver in turn, so that they share whatever else the machine does; the first one's
positions go on. Printed are medians over the steps: seconds a step, its split, and the ratio of the
whole step to the assembly and factorisation in it; `-o FILE` writes them to a .md or .csv file too.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from statistics import median
from time import perf_counter
from typing import Annotated

import numpy as np
import typer
from rich.console import Console

from strainbench.arrays import FloatArray
from strainbench.document import Column, Table
from strainbench.document.writers import terminal
from strainbench.physics.cloth import Cloth
from strainbench.physics.implicit_euler import NewtonReport, NewtonSettings, minimise_step
from strainbench.physics.integrators import Motion, Project, step_and_project
from strainbench.physics.linear import LinearSolver, available_linear_solvers
from strainbench.progress import Track, untracked
from strainbench.report.output import check_ending
from strainbench.scenario.cloth import ClothScenario
from strainbench.scenario.registry import find_scenario
from strainbench.scenario.stage import Stage
from strainbench.solver.registry import find_solver
from strainbench.solver.solver import Solver
from strainbench.studies.program import start, watched, write_table

HEADER = (
    *("solver", "converged", "iterations", "factor.", "evaluations", "step [ms]"),
    *("assembly", "factorisation", "line search", "other", "ratio", "worst"),
)
CAPTION = "medians over the steps; ratio: step / (assemb. + factor.)"


@dataclass(frozen=True)
class Measured:
    """One step with one linear solver."""

    seconds: float
    report: NewtonReport

    @property
    def ratio(self) -> float:
        """The step's time over that of the assemblies and factorisations in it."""
        r = self.report
        return self.seconds / max(r.assembly_seconds + r.factorisation_seconds, 1e-12)


def profile(
    scenario: ClothScenario,
    steps: int,
    project: Project = lambda target: target,
    track: Track = untracked,
) -> dict[str, list[Measured]]:
    """Every step of every installed linear solver, by the solver's name."""
    cloth = scenario.cloth()
    solvers = [kind(cloth.pattern.matrix()) for kind in available_linear_solvers()]
    measured: dict[str, list[Measured]] = {solver.name: [] for solver in solvers}

    def minimise(
        start: FloatArray,
        inertial: FloatArray,
        h: float,
        time: float,  # noqa: ARG001 - no pin moves here
    ) -> FloatArray:
        found = [_measure(cloth, start, inertial, h, solver) for solver in solvers]
        for solver, (_, one) in zip(solvers, found, strict=True):
            measured[solver.name].append(one)
        return found[0][0]

    positions = scenario.sheet()[2]
    motion = Motion(positions, np.zeros_like(positions), 0.0)
    for _ in track(range(steps), "steps", steps):
        motion = step_and_project(motion, scenario.step, minimise, project)
    return measured


def projection(scenario: ClothScenario, solver: Solver, tolerance: float = 1e-6) -> Project:
    """Onto the limits of a scene."""
    return Stage.opened(scenario, solver, tolerance).project


def _measure(
    cloth: Cloth, start: FloatArray, inertial: FloatArray, h: float, solver: LinearSolver
) -> tuple[FloatArray, Measured]:
    begin = perf_counter()
    positions, report = minimise_step(cloth, start, inertial, h, NewtonSettings(), solver)
    return positions, Measured(perf_counter() - begin, report)


def table(measured: dict[str, list[Measured]], title: str) -> Table:
    """A row a linear solver."""
    lines = []
    for name, steps in measured.items():
        reports = [m.report for m in steps]
        parts = {
            "assembly": [r.assembly_seconds for r in reports],
            "factorisation": [r.factorisation_seconds for r in reports],
            "line search": [r.line_search_seconds for r in reports],
        }
        shares = [
            median(s / m.seconds for s, m in zip(seconds, steps, strict=True))
            for seconds in parts.values()
        ]
        lines.append(
            (
                name,
                f"{sum(r.converged for r in reports)}/{len(reports)}",
                f"{median(r.iterations for r in reports):g}",
                f"{median(r.factorisations for r in reports):g}",
                f"{median(r.evaluations for r in reports):g}",
                f"{1e3 * median(m.seconds for m in steps):.2f}",
                *(f"{share:.1%}" for share in [*shares, 1 - sum(shares)]),
                f"{median(m.ratio for m in steps):.2f}",
                f"{max(m.ratio for m in steps):.2f}",
            )
        )
    return Table(title, [Column(name, right=True) for name in HEADER], lines, notes=[CAPTION])


def run(
    name: Annotated[str, typer.Argument(metavar="SCENARIO")],
    resolution: Annotated[int, typer.Option(min=1)] = 60,
    steps: Annotated[int, typer.Option(min=1)] = 20,
    step: Annotated[float, typer.Option(help="time step [s]")] = 1 / 60,
    solver: Annotated[str, typer.Option(help="of the projection; none leaves it out")] = "none",
    output: Annotated[Path | None, typer.Option("--output", "-o")] = None,
) -> None:
    """Print the split of implicit Euler's time on SCENARIO."""
    try:
        if output is not None:
            check_ending(output)
        kind = find_scenario(name)
        if not issubclass(kind, ClothScenario):
            raise ValueError(f"{name} has no cloth that moves by implicit Euler")
        small, scene = (kind(resolution=n, step=step) for n in (2, resolution))
        project = projection(scene, find_solver(solver))
    except ValueError as error:
        raise SystemExit(f"strainbench.studies.euler: {error}") from None
    profile(small, 1)  # compiles
    measured = profile(scene, steps, project, watched)
    title = f"{name} {resolution}x{resolution}, {steps} steps of {step:.4g} s, solver {solver}"
    found = table(measured, title)
    Console(width=150).print(terminal(found))
    if output is not None:
        write_table(output, "euler", "Where implicit Euler's time goes", found)


if __name__ == "__main__":
    start(run)
