"""When limits of each kind are violated first, in a beam that collapses (Fig. 4)."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import islice, product

import numpy as np

from strainbench.arrays import FloatArray
from strainbench.problem.principal import PrincipalLimits
from strainbench.problem.problem import Problem
from strainbench.scenario.stage import Stage
from strainbench.scenario.volume import VolumeScenario
from strainbench.solver.registry import find_solver
from strainbench.studies.volumes.part import Cell, Part, Plan, numbers, scene_of

KINDS = ("orthogonal", "isotropic", "hyperbolic", "ellipsoid", "linear")
LASTS = 0.3  # [s]
STEP = 5e-3  # [s]
FREES = (10.0, 100.0, 1e4, 1e6)
"""Stretches that stand for no limit, where limits are interpolated between."""
ENFORCED = (
    ("hyperbolic", "none", 5.0),
    *((kind, "lcp-qp", 5.0) for kind in ("orthogonal", "hyperbolic", "linear")),
)
"""Kind of limits, method and step [ms]."""


@dataclass(frozen=True)
class First:
    """When limits are violated first, and what the beam looks like then."""

    limits: str
    resolution: int
    step_ms: float
    time_ms: float | None  # None is never
    top: float | None  # y of the middle of the upper end [m]
    stretch: float | None  # largest ||F e_z||


@dataclass(frozen=True)
class Freed:
    """The same, by the number that stands for no limit."""

    limits: str
    resolution: int
    free: float
    time_ms: float | None
    top: float | None
    stretch: float | None


@dataclass(frozen=True)
class Kept:
    """Where the beam is after `LASTS`, with limits enforced."""

    limits: str
    method: str
    step_ms: float
    top: float  # [m]
    violation: float  # the worst


def cells(plan: Plan) -> Iterable[Cell]:
    """Kinds, meshes and steps."""
    return product(KINDS, plan.resolutions, (1e3 * h for h in plan.steps))


def free_cells(plan: Plan) -> Iterable[Cell]:
    """Kinds that interpolate between limits, meshes and numbers."""
    return product(("linear", "ellipsoid"), plan.resolutions, FREES)


def kept_cells(_: Plan) -> Iterable[Cell]:
    """Kinds that a method takes, beside the beam without limits."""
    return ENFORCED


def first_violated(kind: str, resolution: int, step_ms: float) -> Iterator[First]:
    """Play `beam-compress` until limits of this kind are violated."""
    scene = scene_of("beam-compress", kind=kind, step=1e-3 * step_ms, resolution=resolution)
    yield First(kind, resolution, step_ms, *_first(scene, scene.principal()))


def freed(kind: str, resolution: int, free: float) -> Iterator[Freed]:
    """Play it until limits are violated whose free axes are limited to `free`."""
    scene = scene_of("beam-compress", step=STEP, resolution=resolution)
    limits = PrincipalLimits(kind, (0, 0, 1 - scene.limit), (free, free, 1 + scene.limit))
    yield Freed(kind, resolution, free, *_first(scene, limits))


def kept(kind: str, method: str, step_ms: float) -> Iterator[Kept]:
    """Play it with its limits enforced."""
    scene = scene_of("beam-compress", kind=kind, step=1e-3 * step_ms)
    stage, worst = Stage.opened(scene, find_solver(method)), 0.0
    for _ in stage.steps(round(LASTS / scene.step)):
        worst = max(worst, float(stage.problem.violations(stage.positions).max()))
    yield Kept(kind, method, step_ms, _top(stage.problem, stage.positions), worst)


def _first(
    scene: VolumeScenario, limits: PrincipalLimits
) -> tuple[float, float, float] | tuple[None, None, None]:
    """Time [ms], height [m] and transverse stretch when limits are violated first."""
    stage = Stage.opened(scene, find_solver("none"))
    for report in islice(stage.steps(), max(1, round(LASTS / scene.step))):
        x = stage.positions
        F = stage.problem.deformation_gradients(x)
        if np.any(limits.values(F) < 0):
            stretch = np.linalg.norm(F[:, :, 2], axis=1)
            return 1e3 * report.time, _top(stage.problem, x), float(stretch.max())
    return None, None, None


def _top(problem: Problem, x: FloatArray) -> float:
    """Height of the vertex that is nearest to the middle of the upper end at rest."""
    rest = problem.rest
    middle = [*(0.5 * rest.max(axis=0) * [1, 2, 1])]
    return float(x[np.argmin(np.linalg.norm(rest - middle, axis=1)), 1])


PART = Part(
    "fig4",
    3,
    cells,
    first_violated,
    "When limits are violated first (Fig. 4)",
    "The first step after which a limit is violated, of a beam that collapses under its weight "
    "with its limits not enforced. Its z axis is limited to 5%, x and the height y are free; "
    "isotropic limits hold for all. Orthogonal limits forbid all but rest, linear ones allow a "
    "stretch of a quarter. Two cells across are 200 tetrahedra, four are 1,600.",
    [
        "limits",
        *numbers(("cells across", "", ""), ("step", "ms", "g"), ("after", "ms", ".0f")),
        *numbers(("top", "m", ".3f"), ("‖F e_z‖", "", ".3f")),
    ],
    nothing="never",
)
FREE_PART = Part(
    "free",
    3,
    free_cells,
    freed,
    "What stands for no limit",
    "The same in steps of 5 ms, where limits are interpolated between axes, by the stretch that "
    "stands for no limit on an axis: linear ones, which are printed in the paper, depend on it.",
    [
        "limits",
        *numbers(("cells across", "", ""), ("free", "", "g"), ("after", "ms", ".0f")),
        *numbers(("top", "m", ".3f"), ("‖F e_z‖", "", ".3f")),
    ],
    nothing="never",
)
ENFORCED_PART = Part(
    "enforced",
    3,
    kept_cells,
    kept,
    "The same beam with its limits enforced",
    "After 0.3 s, from 1 m, beside the beam with nothing enforced: orthogonal limits freeze it.",
    [
        *("limits", "method"),
        *numbers(("step", "ms", "g"), ("top", "m", ".3f"), ("worst violation", "", ".2g")),
    ],
)
