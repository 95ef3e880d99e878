"""Stability where derivatives of limits are singular: repeated values, and inverted starts."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import islice, product

import numpy as np

from strainbench.arrays import FloatArray
from strainbench.physics.solid import Solid, SolidMaterial
from strainbench.problem.grid import box_grid
from strainbench.problem.principal import PrincipalLimits
from strainbench.problem.problem import Problem
from strainbench.solver.registry import find_solver
from strainbench.studies.volumes.march import in_metric, march, stretches
from strainbench.studies.volumes.part import Cell, Part, Plan, numbers

LIMIT, STEP, STEPS = 0.05, 5e-3, 20  # the step in [s]
SIZE, CELLS = 0.2, 2  # [m]
YOUNG = 5e3  # [Pa]
RATE = 20.0  # [1/s] at which a start expands
MATERIALS = {
    "anisotropic": PrincipalLimits(
        "hyperbolic", (None, 1 - LIMIT, 1 - LIMIT), (None, 1 + LIMIT, 1 + LIMIT)
    ),
    "isotropic": PrincipalLimits("isotropic", 1 - LIMIT, 1 + LIMIT),
}
METHODS = ("none", "lcp-pgs-literal", "lcp-pgs", "lcp-qp", "sequential-cuts")
STARTS = {
    "F = I, expanding": ((1.0, 1.0, 1.0), RATE),
    "F = 1.01 I, expanding": ((1.01, 1.01, 1.01), RATE),
    "F = 1.5 I": ((1.5, 1.5, 1.5), 0.0),
    "opposite, F = diag(1, -1, 1)": ((1.0, -1.0, 1.0), 0.0),
    "flat, F = diag(1, 0, 1)": ((1.0, 0.0, 1.0), 0.0),
    "a point, F = 0": ((0.0, 0.0, 0.0), 0.0),
}
"""F of all elements, and the rate at which it grows."""


@dataclass(frozen=True)
class Came:
    """What came of a start."""

    start: str
    material: str
    method: str
    gap: float  # least difference of singular values in the first 20 steps
    worst: float  # violation
    last: float
    largest: float  # principal stretch
    inverted: int | None  # elements after the last step
    upright: int | None  # the first step after which none is inverted
    unconverged: int  # steps
    steps: int


def cells(_: Plan) -> Iterable[Cell]:
    """Starts, and limits and methods that go together."""
    return (c for c in product(STARTS, MATERIALS, METHODS) if _takes(*c[1:]))


def block() -> tuple[Solid, FloatArray]:
    """A cube that floats freely, and its vertices about its centre, one of them."""
    rest, elements = box_grid((CELLS,) * 3, np.full(3, SIZE))
    none = np.zeros(0, dtype=np.int64)
    body = Solid(rest, elements, SolidMaterial(YOUNG), none, gravity=np.zeros(3))
    return body, rest - rest.mean(axis=0)


def limited(body: Solid, material: str) -> Problem:
    """The cube at rest under limits."""
    return Problem(body.rest, body.elements, body.rest, MATERIALS[material], mass=body.mass)


def _takes(material: str, method: str) -> bool:
    return not find_solver(method).supports(limited(block()[0], material))


def came(start: str, material: str, method: str) -> Iterator[Came]:
    """Play a start."""
    body, about = block()
    problem = limited(body, material)
    stretch, rate = STARTS[start]
    x = about * np.array(stretch)
    frame = in_metric(body, problem, STEP)
    played = list(islice(march(body, frame, method, STEP, x, rate * x), STEPS))
    ends = [s.solution.positions for s in played if np.all(np.isfinite(s.solution.positions))]
    worst = [float(problem.violations(y).max()) for y in ends] or [np.nan]
    s = [stretches(problem, y) for y in ends]
    inverted = [int(np.sum(k[:, 2] < 0)) for k in s]
    yield Came(
        start,
        material,
        method,
        gap=min(map(_gap, s), default=np.nan),
        worst=max(worst),
        last=worst[-1],
        largest=max((float(k.max()) for k in s), default=np.nan),
        inverted=inverted[-1] if inverted else None,
        upright=next((k for k, n in enumerate(inverted, 1) if n == 0), None),
        unconverged=sum(p.solution.details.get("unconverged", 0.0) > 0 for p in played),
        steps=len(ends),
    )


def _gap(s: FloatArray) -> float:
    return float(np.diff(np.sort(np.abs(s), axis=1)).min())


PART = Part(
    "repeated",
    3,
    cells,
    came,
    "Repeated values and inverted starts",
    f"A free cube of 40 tetrahedra, E = 5 kPa, without gravity, {STEPS} steps of 5 ms: all its "
    f"elements start with the same F, so with singular values that are equal, or opposite, or 0, "
    f"where derivatives of limits do not exist. Expanding ones start at a rate of {RATE:g} / s. "
    f"Limits are {100 * LIMIT:g}%, anisotropic ones of y and z alone. The gap is the least "
    "difference of two singular values that a step ends with. Fewer steps than that: there was no "
    "answer.",
    [
        *("start", "limits", "method"),
        *numbers(("gap", "", ".1g"), ("worst violation", "", ".2g"), ("last", "", ".2g")),
        *numbers(
            ("largest stretch", "", ".3g"), ("inverted", "", ".0f"), ("upright after", "", ".0f")
        ),
        *numbers(("unconverged steps", "", ""), ("of", "", "")),
    ],
    nothing="none",
)
