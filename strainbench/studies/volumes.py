"""Limits on principal stretches of volumes, after Hernandez et al. 2013: what they forbid and hold.

    python -m strainbench.studies.volumes --step 1,5,20 -o results/volumes

plays the scene `beam-compress` without limits until each kind of them is violated first (Fig. 4),
and the scene `beam` with the methods that take one linearised step, which tells how far beyond the
limits the linearisation leaves it and what a step costs (`sweeps.py`); and it presses the scene
`finger` (Fig. 3, `press.py`). Written are `volumes.md`, `fig4.csv`, `violation.csv`, `sweeps.csv`
and `press.csv`. There are no times in it but as ratios.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from itertools import islice, product
from pathlib import Path
from typing import Annotated, TypeVar

import numpy as np
import pandas as pd
import typer

from strainbench.arrays import FloatArray
from strainbench.bench.machine import describe_machine
from strainbench.bench.records import open_folder, remember_machine
from strainbench.document import Code, Column, Document, Table
from strainbench.document.writers import csv, markdown
from strainbench.files import locked, write_whole
from strainbench.problem.problem import Problem
from strainbench.scenario.registry import find_scenario
from strainbench.scenario.stage import Stage, StageError
from strainbench.scenario.volume import VolumeScenario
from strainbench.solver.registry import find_solver
from strainbench.studies import press, sweeps
from strainbench.studies.press import Press
from strainbench.studies.sweeps import Sweeps

KINDS = ("orthogonal", "isotropic", "hyperbolic", "ellipsoid", "linear")
METHODS = ("lcp-pgs-literal", "lcp-pgs", "lcp-pgs-biot", "lcp-qp-literal", "lcp-qp")
MATERIALS = ("anisotropic", "isotropic")
LASTS = {"beam-compress": 0.3, "beam": 0.24}  # [s]
FIG_4 = (
    "The first step after which a limit is violated, of a beam that collapses under its weight "
    "with its limits not enforced. Its z axis is limited to 5%, x and the height y are free; "
    "isotropic limits hold for all. Orthogonal limits forbid all but rest, linear ones allow a "
    "stretch of a quarter."
)
VIOLATION = (
    "A beam fixed at one end, without damping, from rest: nonlinear violation after each step, of "
    "methods that solve it with limits linearised where it starts; what they solve they solve to a "
    "residual of 1e-5, where not counted as unconverged."
)


FIG_4_COLUMNS = (("after", "ms", ".0f"), ("top", "m", ".3f"), ("‖F e_z‖", "", ".3f"))
VIOLATION_COLUMNS = (
    *(("worst", "", ".2g"), ("median of the second half", "", ".2g")),
    *(("unconverged steps", "", ""), ("of", "", "")),
)


def _number(name: str, unit: str, form: str) -> Column:
    return Column(name, unit, form, right=True)


STEP = _number("step", "ms", "g")


@dataclass(frozen=True)
class First:
    """When limits are violated first, and what the beam looks like then."""

    limits: str
    step_ms: float
    time_ms: float | None  # None is never
    top: float | None  # y of the middle of the upper end [m]
    stretch: float | None  # largest ||F e_z||


@dataclass(frozen=True)
class Held:
    """How far beyond its limits a method leaves the beam."""

    material: str
    method: str
    step_ms: float
    worst: float
    median: float  # of the second half
    unconverged: int  # steps
    steps: int
    ended: str = ""  # why there are no more


def first_violated(kind: str, step: float, resolution: int) -> First:
    """Play `beam-compress` until limits of this kind are violated."""
    scene = _scene("beam-compress", kind=kind, step=step, resolution=resolution)
    stage = Stage.opened(scene, find_solver("none"))
    for report in islice(stage.steps(), _steps("beam-compress", step)):
        x = stage.positions
        if np.any(stage.problem.violations(x)):
            stretch = np.linalg.norm(stage.problem.deformation_gradients(x)[:, :, 2], axis=1)
            height = _top(stage.problem, x)
            return First(kind, 1e3 * step, 1e3 * report.time, height, float(stretch.max()))
    return First(kind, 1e3 * step, None, None, None)


def _top(problem: Problem, x: FloatArray) -> float:
    """Height of the vertex that is nearest to the middle of the upper end at rest."""
    rest = problem.rest
    middle = [*(0.5 * rest.max(axis=0) * [1, 2, 1])]
    return float(x[np.argmin(np.linalg.norm(rest - middle, axis=1)), 1])


def held(material: str, method: str, step: float, resolution: int) -> Held:
    """Play `beam` with a method."""
    scene = _scene("beam", material=material, step=step, resolution=resolution, alpha=0.0)
    stage, steps = Stage.opened(scene, find_solver(method)), _steps("beam", step)
    violations: list[float] = []
    unconverged, ended = 0, ""

    def project(target: FloatArray) -> FloatArray:
        nonlocal unconverged
        found = stage.solve(target)
        unconverged += found.solution.details.get("unconverged", 0.0) > 0
        return stage.accept(found)

    try:
        for _ in stage.steps(steps, project):
            violations.append(float(stage.problem.violations(stage.positions).max()))
    except StageError as error:  # what a method comes to is a finding
        ended = str(error)
    late = violations[len(violations) // 2 :] or [float("nan")]
    worst = max(violations, default=float("nan"))
    median = float(np.median(late))
    given = (material, method, 1e3 * step, worst, median, unconverged, len(violations), ended)
    return Held(*given)


def _takes(method: str, material: str) -> bool:
    return not find_solver(method).supports(_scene("beam", material=material).problem())


def _scene(name: str, **settings: object) -> VolumeScenario:
    scene = find_scenario(name)(**settings)  # type: ignore[arg-type]
    assert isinstance(scene, VolumeScenario)
    return scene


def _steps(scene: str, step: float) -> int:
    return max(1, round(LASTS[scene] / step))


def documented(
    firsts: Sequence[First],
    beams: Sequence[Held],
    costs: Sequence[Sweeps],
    fingers: Sequence[Press],
    about: str,
    command: str,
) -> Document:
    """All tables."""
    fig_4 = Table(
        "When limits are violated first (Fig. 4)",
        ["limits", STEP, *(_number(*c) for c in FIG_4_COLUMNS)],
        [tuple(asdict(row).values()) for row in firsts],
        about=FIG_4,
        nothing="never",
    )
    violation = Table(
        "How far a linearised step ends beyond the limits",
        ["material", "method", STEP, *(_number(*c) for c in VIOLATION_COLUMNS), "ended by"],
        [tuple(asdict(row).values()) for row in beams],
        about=VIOLATION,
    )
    return Document(
        "Limits on principal stretches of volumes",
        [Code(command), about, fig_4, violation, sweeps.table(costs), press.table(fingers)],
    )


Row = TypeVar("Row", First, Held, Sweeps, Press)


def measured(
    steps: Sequence[float], resolution: int
) -> tuple[list[First], list[Held], list[Sweeps], list[Press]]:
    """All rows, said as they are found."""

    def said(rows: Iterator[Row]) -> Iterator[Row]:
        for row in rows:
            typer.echo(", ".join(f"{k} {v}" for k, v in asdict(row).items()))
            yield row

    firsts = (first_violated(k, h, resolution) for k, h in product(KINDS, steps))
    cells = product(MATERIALS, METHODS, steps)
    beams = (held(m, s, h, resolution) for m, s, h in cells if _takes(s, m))
    costs = list(said(sweeps.swept()))
    return list(said(firsts)), list(said(beams)), costs, list(said(press.presses()))


def write(folder: Path, steps: Sequence[float], resolution: int) -> None:
    """Measure, and write tables and rows to a folder."""
    open_folder(folder, "-o")
    with locked(folder):
        firsts, beams, costs, fingers = measured(steps, resolution)
        name, facts = describe_machine(1)
        remember_machine(folder, name, facts)
        spelled = ",".join(f"{1e3 * h:g}" for h in steps)
        command = (
            f"python -m strainbench.studies.volumes --step {spelled} --resolution {resolution}"
        )
        document = documented(firsts, beams, costs, fingers, f"Measured on {name}.", command)
        write_whole(folder / "volumes.md", markdown(document).encode())
        parts = (
            ("fig4.csv", firsts),
            ("violation.csv", beams),
            ("sweeps.csv", costs),
            ("press.csv", fingers),
        )
        for file, rows in parts:
            table = Table.of(pd.DataFrame([asdict(row) for row in rows]))
            write_whole(folder / file, csv(table).encode())


def main(
    step: Annotated[str, typer.Option(help="time steps [ms], with commas")] = "5,20",
    resolution: Annotated[int, typer.Option(min=1, help="cells across the beam")] = 2,
    output: Annotated[Path, typer.Option("--output", "-o")] = Path("results/local/volumes"),
) -> None:
    """Tabulate what limits on principal stretches forbid, and how well they are held."""
    try:
        steps = [1e-3 * float(word) for word in step.split(",")]
        if not all(0 < h < 1 for h in steps):
            raise ValueError
    except ValueError:
        raise SystemExit(
            f"--step {step}: milliseconds with commas, such as 5,20, are valid"
        ) from None
    try:
        write(output, steps, resolution)
    except ValueError as error:
        raise SystemExit(f"strainbench.studies.volumes: {error}") from None


if __name__ == "__main__":
    typer.run(main)
