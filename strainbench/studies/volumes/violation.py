"""How far a step ends beyond the limits, linearised or not, at each step and at tight limits."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import partial
from itertools import product

import numpy as np

from strainbench.arrays import FloatArray
from strainbench.document import Column
from strainbench.scenario.stage import Stage, StageError
from strainbench.solver.registry import find_solver
from strainbench.studies.volumes.part import Cell, Part, Plan, numbers, scene_of

METHODS = (
    *("lcp-pgs-literal", "lcp-pgs", "lcp-pgs-biot", "lcp-qp-literal", "lcp-qp"),
    "sequential-cuts",
)
MATERIALS = ("anisotropic", "isotropic")
LASTS = 0.24  # [s]
USUAL, TIGHT = 0.04, 0.02  # limits
TIGHT_STEP = 5.0  # [ms]


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


def cells(plan: Plan) -> Iterable[Cell]:
    """Materials and methods that go together, and steps."""
    steps = [1e3 * h for h in plan.steps]
    return ((m, s, h) for m, s, h in product(MATERIALS, METHODS, steps) if _takes(s, m))


def tight_cells(_: Plan) -> Iterable[Cell]:
    """The same at one step."""
    return cells(Plan((1e-3 * TIGHT_STEP,)))


def _takes(method: str, material: str) -> bool:
    return not find_solver(method).supports(scene_of("beam", material=material).problem())


def held(material: str, method: str, step_ms: float, limit: float = USUAL) -> Iterator[Held]:
    """Play `beam` with a method."""
    step = 1e-3 * step_ms
    scene = scene_of("beam", material=material, step=step, limit=limit, alpha=0.0)
    stage, steps = Stage.opened(scene, find_solver(method)), max(1, round(LASTS / step))
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
    worst, median = max(violations, default=float("nan")), float(np.median(late))
    yield Held(material, method, step_ms, worst, median, unconverged, len(violations), ended)


HEADER: list[str | Column] = [
    "material",
    "method",
    *numbers(("step", "ms", "g"), ("worst", "", ".2g"), ("median of the second half", "", ".2g")),
    *numbers(("unconverged steps", "", ""), ("of", "", "")),
    "ended by",
]
PART = Part(
    "violation",
    3,
    cells,
    held,
    "How far a linearised step ends beyond the limits",
    "A beam fixed at one end, limited to 4% and without damping, from rest: nonlinear violation "
    "after each step, of methods that solve it with limits linearised where it starts; what they "
    "solve they solve to a residual of 1e-5, where not counted as unconverged. Beside them "
    "sequential-cuts, which takes isotropic limits as they are.",
    HEADER,
)
TIGHT_PART = Part(
    "tight",
    3,
    tight_cells,
    partial(held, limit=TIGHT),
    "Tight limits",
    "The same beam with limits of .98 to 1.02.",
    HEADER,
)
