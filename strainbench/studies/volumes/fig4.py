"""When limits of each kind are violated first, in a beam that collapses (Fig. 4)."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import islice, product

import numpy as np

from strainbench.arrays import FloatArray
from strainbench.problem.problem import Problem
from strainbench.scenario.stage import Stage
from strainbench.solver.registry import find_solver
from strainbench.studies.volumes.part import Cell, Part, Plan, numbers, scene_of

KINDS = ("orthogonal", "isotropic", "hyperbolic", "ellipsoid", "linear")
LASTS = 0.3  # [s]


@dataclass(frozen=True)
class First:
    """When limits are violated first, and what the beam looks like then."""

    limits: str
    resolution: int
    step_ms: float
    time_ms: float | None  # None is never
    top: float | None  # y of the middle of the upper end [m]
    stretch: float | None  # largest ||F e_z||


def cells(plan: Plan) -> Iterable[Cell]:
    """Kinds, meshes and steps."""
    return product(KINDS, plan.resolutions, (1e3 * h for h in plan.steps))


def first_violated(kind: str, resolution: int, step_ms: float) -> Iterator[First]:
    """Play `beam-compress` until limits of this kind are violated."""
    step = 1e-3 * step_ms
    scene = scene_of("beam-compress", kind=kind, step=step, resolution=resolution)
    stage = Stage.opened(scene, find_solver("none"))
    for report in islice(stage.steps(), max(1, round(LASTS / step))):
        x = stage.positions
        if np.any(stage.problem.violations(x)):
            stretch = np.linalg.norm(stage.problem.deformation_gradients(x)[:, :, 2], axis=1)
            found = 1e3 * report.time, _top(stage.problem, x), float(stretch.max())
            yield First(kind, resolution, step_ms, *found)
            return
    yield First(kind, resolution, step_ms, None, None, None)


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
