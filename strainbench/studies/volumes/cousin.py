"""The convex cousin: upper limits in directions, beside hyperbolic limits on principal stretches.

They are different materials. The first table has what rules on one axis forbid, in two dimensions;
the second one has the beam of the scene `beam` under each of them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from itertools import islice, product

import numpy as np

from strainbench.arrays import FloatArray
from strainbench.problem.kinds import Limits
from strainbench.problem.limits import StretchLimits
from strainbench.problem.principal import PrincipalLimits
from strainbench.problem.problem import Problem
from strainbench.scenario.volume import VolumeScenario
from strainbench.solver.registry import find_solver
from strainbench.studies.volumes.march import Frame, in_metric, march, stretches
from strainbench.studies.volumes.part import Cell, Part, Plan, numbers, scene_of

D, MOST = 0.05, 3.0
ANGLES = np.pi * (np.arange(360) + 0.5) / 360  # of directions, from e1
LOOSE = 4.0  # the stretch of the free axis that exact limits cannot be without
RULES: dict[str, Limits | None] = {
    "hyperbolic": PrincipalLimits("hyperbolic", (None, 1 - D), (None, 1 + D)),
    "‖F e2‖ <= 1 + d": StretchLimits(np.array([[0.0, 1.0]]), np.array([1 + D])),
    "‖E e2‖ <= d": None,
    "‖F u‖ <= 1 + d / |u . e2|": StretchLimits.sampled(ANGLES, 1 + D / np.abs(np.sin(ANGLES))),
    "exact, ‖F diag(1/4, 1/(1 + d))‖ <= 1": StretchLimits.exact(LOOSE, 1 + D),
}


def _uniaxial(degrees: float) -> Callable[[float], FloatArray]:
    u = np.array([np.sin(np.deg2rad(degrees)), np.cos(np.deg2rad(degrees))])
    return lambda a: np.eye(2) + a * np.outer(u, u)


MODES: dict[str, Callable[[float], FloatArray]] = {
    "uniaxial along e2": _uniaxial(0),
    **{f"uniaxial at {k} degrees to e2": _uniaxial(k) for k in (30, 45, 60, 85)},
    "uniaxial along the free e1": _uniaxial(90),
    "biaxial": lambda a: np.array([[1 + a, 0.0], [0.0, 1 + a]]),
    "shear F12": lambda a: np.array([[1.0, a], [0.0, 1.0]]),
    "shear F21": lambda a: np.array([[1.0, 0.0], [a, 1.0]]),
}


@dataclass(frozen=True)
class Allowed:
    """The largest amount of a mode that a rule allows, up to `MOST`."""

    mode: str
    rule: str
    amount: float


def within(rule: str, F: FloatArray) -> bool:
    """Whether F (2, 2) is within a rule."""
    if (problem := _triangle(rule)) is None:
        s, V = np.linalg.eigh(F.T @ F)
        biot = (V * np.sqrt(s)) @ V.T - np.eye(2)
        return bool(np.linalg.norm(biot[:, 1]) <= D + 1e-12)
    x = np.column_stack([problem.rest @ F.T, np.zeros(3)])
    return bool(np.all(problem.violations(x) <= 1e-12))


@cache
def _triangle(rule: str) -> Problem | None:
    """One triangle with the rule's limits, if they are of a kind that the suite has."""
    corners = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    limits = RULES[rule]
    at_rest = np.column_stack([corners, np.zeros(3)])
    return None if limits is None else Problem(corners, [[0, 1, 2]], at_rest, limits)  # type: ignore[arg-type]


def allowed(mode: str, rule: str) -> Iterator[Allowed]:
    """By a scan for the first amount beyond, and bisection."""
    amounts = np.concatenate([np.arange(0, 0.3, 0.01), np.arange(0.3, MOST + 0.05, 0.05)])
    kept = [within(rule, MODES[mode](a)) for a in amounts]
    low = MOST
    if not all(kept):
        first = kept.index(False)
        low, high = float(amounts[first - 1]), float(amounts[first])
        for _ in range(20):
            middle = (low + high) / 2
            low, high = (middle, high) if within(rule, MODES[mode](middle)) else (low, middle)
    yield Allowed(mode, rule, low)


PART = Part(
    "allowed",
    2,
    lambda _: product(MODES, RULES),
    allowed,
    "What the convex cousin forbids",
    f"The largest amount of a deformation that limits of {100 * D:g}% on e2 alone allow, up to "
    f"{MOST:g}. Hyperbolic limits on principal stretches are not convex, and neither is the bound "
    "on the Biot strain E; bounds on ‖F u‖ are, in one direction, in 360 along the hyperbolic "
    "curve, or in all of an ellipse (exact). No convex one is the hyperbolic material: the first "
    "leaves shear and slanted stretch, the second one limits the free axis.",
    ["deformation", "limits", *numbers(("largest amount", "", ".4f"))],
)

LIMIT, STEP, LASTS, ALPHA = 0.04, 20e-3, 1.2, 2.0  # the beam's; the step in [s]
SLANTED = np.array([k for k in product((-1, 0, 1), repeat=3) if k > (0, 0, 0)], dtype=float)
BESIDE = ("newton-ipm", "clarabel")


def _curve() -> StretchLimits:
    """The hyperbolic curve in the 12 directions of a cube's edges, faces and corners but e1."""
    u = SLANTED[np.abs(SLANTED[:, 1:]).max(axis=1) > 0]
    u = u / np.linalg.norm(u, axis=1)[:, None]
    return StretchLimits(u, 1 + LIMIT / np.abs(u[:, 1:]).max(axis=1))


BEAMS: dict[str, Limits] = {
    "hyperbolic": scene_of("beam", limit=LIMIT).principal(),
    "‖F e_j‖ <= 1 + d": StretchLimits(np.eye(3)[1:], np.full(2, 1 + LIMIT)),
    "‖F u‖ <= 1 + d / |u . e_j|, 12 directions": _curve(),
    "isotropic": scene_of("beam", limit=LIMIT, material="isotropic").principal(),
    "exact, ‖F‖ <= 1 + d": StretchLimits.exact(1 + LIMIT, dim=3),
}


@dataclass(frozen=True)
class Cousin:
    """A beam under limits."""

    limits: str
    method: str
    tip_x: float  # [m]
    tip_y: float
    along: float  # largest ||F e_x||
    least: float  # least principal stretch; negative where inverted
    own: float  # worst violation of its own limits
    hyperbolic: float  # violation of hyperbolic limits at the end
    apart: float  # farthest vertex from the beam with hyperbolic limits [m]
    count: float  # iterations a step, mean
    ratio: float  # of thread time, over lcp-qp's with hyperbolic limits


def beam_cells(_: Plan) -> Iterator[Cell]:
    """Principal limits by the linearised step, upper ones by two convex methods."""
    for name, limits in BEAMS.items():
        methods = ("lcp-qp",) if isinstance(limits, PrincipalLimits) else BESIDE
        problem = _problem(limits)
        yield from ((name, m) for m in methods if not find_solver(m).supports(problem))


def _scene() -> VolumeScenario:
    return scene_of("beam", limit=LIMIT, step=STEP, alpha=ALPHA)


def _problem(limits: Limits) -> Problem:
    """The beam's, in the norm of the masses of its step."""
    body = _scene().solid()
    mass = (1 + ALPHA * STEP) * body.mass
    return Problem(body.rest, body.elements, body.rest, limits, body.pinned, mass)


@cache
def _played(name: str, method: str) -> tuple[FloatArray, float, list[float], list[int]]:
    """Positions at the end, worst violation, thread times [s] and iterations of all steps.

    It is played twice: the first time is that of imports and compiled loops, too.
    """
    body, limits = _scene().solid(), BEAMS[name]
    problem = _problem(limits)
    masses: Frame = lambda target, start: problem.with_target(target)  # noqa: E731, ARG005
    frame = in_metric(body, problem, STEP) if isinstance(limits, PrincipalLimits) else masses
    for _ in range(2):
        x, v = body.rest.copy(), np.zeros_like(body.rest)
        steps = list(islice(march(body, frame, method, STEP, x, v), round(LASTS / STEP)))
    worst = max(float(problem.violations(s.solution.positions).max()) for s in steps)
    counts = [s.solution.iterations for s in steps]
    return steps[-1].solution.positions, worst, [s.seconds for s in steps], counts


def beside(name: str, method: str) -> Iterator[Cousin]:
    """Play the beam, and the hyperbolic one that it is compared to."""
    x, worst, seconds, counts = _played(name, method)
    there, _, least, _ = _played("hyperbolic", "lcp-qp")
    problem = scene_of("beam", limit=LIMIT).problem()
    middle = problem.rest.max(axis=0) * [1, 0.5, 0.5]
    tip = x[int(np.argmin(np.linalg.norm(problem.rest - middle, axis=1)))]
    F = problem.deformation_gradients(x)
    yield Cousin(
        name,
        method,
        tip_x=float(tip[0]),
        tip_y=float(tip[1]),
        along=float(np.linalg.norm(F[:, :, 0], axis=1).max()),
        least=float(stretches(problem, x)[:, 2].min()),
        own=worst,
        hyperbolic=float(problem.violations(x).max()),
        apart=float(np.linalg.norm(x - there, axis=1).max()),
        count=float(np.mean(counts)),
        ratio=float(np.mean(seconds) / np.mean(least)),
    )


BEAM_PART = Part(
    "cousin",
    2,
    beam_cells,
    beside,
    "The beam under its convex cousins",
    f"The anisotropic beam of Fig. 2 with limits of {100 * LIMIT:g}% on y and z, {LASTS:g} s from "
    f"rest in steps of {1e3 * STEP:g} ms, damped at {ALPHA:g} / s, on 200 tetrahedra. Limits on "
    "principal stretches by the linearised step in the norm of its metric, upper limits on "
    "stretch projected in that of the masses, as convex methods take no other; they have no lower "
    "limits. Each is played twice and timed the second time: thread times as ratios of means a "
    "step, of which those need none whose candidate is within the limits.",
    [
        *("limits", "method"),
        *numbers(("tip x", "m", ".2f"), ("tip y", "m", ".2f"), ("‖F e_x‖", "", ".2f")),
        *numbers(("least stretch", "", ".2f"), ("own violation", "", ".1g")),
        *numbers(("hyperbolic violation", "", ".2g"), ("apart", "m", ".2f")),
        *numbers(("iterations", "", ".0f"), ("ratio of times", "", ".2g")),
    ],
)
