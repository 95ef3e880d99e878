"""What limits make of the look of a motion: how smooth it is, how its cloth is compressed.

    python -m strainbench.studies.looks swing --set resolution=10,20,40 --set limit=10%,1%,0.1%

plays each combination of settings with each solver, unjudged, and tells from positions alone

1. jitter: how much accelerations change in a step, over how large they are (root mean squares)
2. which part of the triangles, over all steps, has a least principal stretch below .99, .95 and .9,
   and the least of all
3. how far the stretch goes beyond the limits' curve at any of 180 material angles, the sampled ones
   and those between; where a scene has no curve its loosest limit stands for one

`-o FILE` writes the table to a .md or .csv file.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
import pandas as pd
import typer
from rich.console import Console

from strainbench.arrays import FloatArray
from strainbench.bench.cell import Cell
from strainbench.bench.plan import plan
from strainbench.document import Column, Table
from strainbench.document.writers import terminal
from strainbench.referee.motion import jitter
from strainbench.render.polar import ANGLES, directional_stretches
from strainbench.report.output import check_ending
from strainbench.scenario.scenario import Scenario
from strainbench.scenario.stage import Stage, StageError
from strainbench.studies.program import start, watched, write_table


@dataclass(frozen=True)
class Look:
    """Of a motion; see above."""

    steps: int
    jitter: float
    below_99: float
    below_95: float
    below_90: float
    least: float
    beyond: float

    @classmethod
    def of(cls, positions: list[FloatArray], least: FloatArray, beyond: float) -> Look:
        """Of positions after each step, and of all triangles' least stretches."""
        below = (float(np.mean(least < level)) for level in (0.99, 0.95, 0.9))
        parts = dict(zip(("below_99", "below_95", "below_90"), below, strict=True))
        smooth = jitter(positions)
        return cls(len(positions), smooth, least=float(least.min()), beyond=beyond, **parts)


def play(cell: Cell) -> Look:
    """A cell's motion, every step of it.

    Raises
    ------
    StageError
        If scene and solver do not come so far.
    """
    scene = cell.scenario.scenario()
    stage = Stage.opened(scene, cell.solver.solver(), cell.tolerance)
    allowed = bounds(scene, stage)
    positions, least, beyond = list[FloatArray](), list[FloatArray](), -np.inf
    for _ in stage.steps(cell.steps):
        positions.append(stage.positions)
        F = stage.problem.deformation_gradients(stage.positions)
        least.append(np.linalg.svd(F, compute_uv=False)[:, -1].astype(float))
        stretches = directional_stretches(stage.problem, stage.positions, ANGLES)
        beyond = max(beyond, float((stretches - allowed).max()))
    return Look.of(positions, np.array(least), beyond)


def bounds(scene: Scenario, stage: Stage) -> FloatArray:
    """(180,) largest stretch that the scene's curve allows at ANGLES, or its loosest limit."""
    curve = scene.curve()
    if curve is None:
        return np.full(len(ANGLES), stage.problem.bounds.max())
    return np.interp(ANGLES, *curve, period=np.pi)


def row(cell: Cell) -> dict[str, object]:
    """The scene, its settings, the solver, and what was seen."""
    scene = {"scenario": cell.scenario.name, **dict(cell.scenario.parameters)}
    return {**scene, "solver": cell.solver.label, **asdict(play(cell))}


def table(rows: list[dict[str, object]]) -> Table:
    """A line a cell."""
    whole = Table.of(pd.DataFrame(rows))
    return Table("", [Column(name, form=".3g") for name in whole.headings], whole.lines)


def run(
    names: Annotated[list[str], typer.Argument(metavar="SCENARIO...")],
    choices: Annotated[list[str], typer.Option("--set", metavar="KEY=V1,V2")] = [],  # noqa: B006
    solver: Annotated[str, typer.Option(help="names, with commas")] = "newton-ipm",
    steps: Annotated[int | None, typer.Option(min=4)] = None,
    duration: Annotated[float | None, typer.Option(help="of the scene's time [s]")] = None,
    output: Annotated[Path | None, typer.Option("--output", "-o")] = None,
) -> None:
    """Print how smooth motions are, how compressed, and how far beyond their limits' curve."""
    try:
        if output is not None:
            check_ending(output)
        solvers = solver.split(",")
        cells = plan(names, solvers, choices, "simulate", steps, [1e-6], None, duration)
        rows = [row(cell) for cell in watched(cells, "motions", len(cells))]
    except (ValueError, StageError) as error:
        raise SystemExit(f"strainbench.studies.looks: {error}") from None
    found = table(rows)
    Console(width=200).print(terminal(found))
    if output is not None:
        write_table(output, "looks", "Looks of motions", found)


if __name__ == "__main__":
    start(run)
