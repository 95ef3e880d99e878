"""A step of implicit Euler within limits, minimised whole: a reference for step-and-project.

minimise phi(x) = 1/2 ||x - x~||_M^2 / h^2 + W(x)  subject to  q_i(x) = (b_i^2 - |y_i|^2) / 2 >= 0,

x~ = x^n + h v + h^2 g and y = G x, with the pins fixed. Li et al. (2021), Codimensional Incremental
Potential Contact, build limits into the step alike, by a barrier; here they hold to the tolerance.
The iteration is that of newton-ipm (Mehrotra 1992, Gondzio 1996) with W in the objective:

1. r_d = M (x - x~)/h^2 + grad W(x) + G^T (l y), anew at each iterate; r = q - s with slacks s
2. K = Hess W + M/h^2 + sum_i l_i (g_i g_i^T) (x) I_3 + (l_i/s_i) (g_i (x) y_i)(g_i (x) y_i)^T, on
   the cloth's own pattern; W's Hessian unclamped, clamped only where K has no Cholesky factor
3. from x^n, s = max(q, 3e-3 b^2), l = mu_0/s, mu_0 = 0.3 ||x^n - x~||_M^2 / (2 h^2) / rows: a
   predictor, a corrector, up to two of Gondzio's, 0.99 of the way to the boundary
4. stop when ||r_d|| <= tolerance g_0 ||m||_2, <s, l> <= tolerance m (g_0 h)^2 / 2 and no |r_i| is
   above tolerance / 100
5. halve the step while r_d grows beyond the tolerance; after two iterations with two halvings or
   more each, clamp always and use M/h^2 (1 + c), c = 1/4, then fourfold
6. unsolved: again from the projection of implicit Euler's candidate, which is found by the same
   iteration without W; then the step is given up

Where h is long there are several minima (at 1/5 s on the swing, tens of millimetres apart): the
report says which start was used. With W convex, energy never rises: E(x') + |v'|^2/2 + |v' - v|^2/2
<= E(x) + |v|^2/2, as x^n is within the limits; and a free sheet's momentum is kept, as the forces
of the limits are internal. Both hold for projections in the mass norm, neither for the unweighted.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from strainbench.arrays import FloatArray, IntArray
from strainbench.physics.body import Body
from strainbench.physics.constrained.iterate import Iteration as Iteration
from strainbench.physics.constrained.iterate import LimitSettings, Point, UnsolvedError
from strainbench.physics.energies.energy import Energy
from strainbench.physics.implicit_euler import NewtonReport, NewtonSettings, minimise_step
from strainbench.physics.linear import LinearSolver, NotPositiveDefiniteError
from strainbench.physics.pattern import Blocks
from strainbench.problem.kinds import Sampled
from strainbench.problem.problem import Problem

LAST, PROJECTED = "the last positions", "the projection of implicit Euler's candidate"


@dataclass(frozen=True)
class ConstrainedReport(NewtonReport):
    """How a constrained step ended; `residual` is that of the Lagrangian's gradient.

    factorisations : those of a projection to start from included
    start : that the answer was found from, in words
    multipliers : (rows,) l [J]; the limits' forces are -G^T (l y)
    complementarity : <s, l> / (m (g_0 h)^2 / 2)
    """

    start: str
    multipliers: FloatArray
    complementarity: float


def constrained_step(
    body: Body,
    problem: Problem,
    start: FloatArray,
    inertial: FloatArray,
    step: float,
    settings: LimitSettings | None = None,
    linear_solver: LinearSolver | None = None,
) -> tuple[FloatArray, ConstrainedReport]:
    """Minimise 1/2 ||x - inertial||_M^2 / step^2 + W(x) and gravity within sampled limits.

    Parameters
    ----------
    body : masses, energies, gravity; its first energy is that of the problem's elements
    problem : its mesh, limits and pins; its target and its norm play no part
    start : (n, 3) first iterate [m]; its pinned vertices stay where they are
    inertial : (n, 3) where the body would go without elasticity, gravity and limits [m]
    step : h [s]
    linear_solver : for the body's pattern; the body's own by default

    Returns
    -------
    positions : (n, 3) [m]; NaN where the step is unsolved
    report : ConstrainedReport

    Raises
    ------
    ValueError
        In one line: limits that are exact, of another kind or on compression too, pins that are
        not the body's or too far apart for the limits, a start of another shape.
    """
    if reason := unfit(body, problem, start):
        raise ValueError(reason)
    settings, linear = settings or LimitSettings(), linear_solver or body.linear_solver
    phi = Iteration(body, problem, inertial, step, settings, linear)
    reason, at = "", None
    for name in (LAST, PROJECTED):
        try:
            first = start if name == LAST else projected(phi, start, inertial)
            at = phi.run(first)
            break
        except (UnsolvedError, NotPositiveDefiniteError) as error:
            reason += f"{'; ' if reason else ''}from {name}: {error}"
            phi.damping, phi.rough = 0.0, 0
    return _answer(phi, at, name, reason if at is None else "", start)


def unfit(body: Body, problem: Problem, start: FloatArray) -> str:
    """Why a step within the limits of `problem` cannot be taken, or ""."""
    if not isinstance(problem.kind, Sampled):
        return "limits: the constrained step takes sampled directions alone"
    if problem.kind.lower is not None:
        return "limits.lower: the constrained step has no form for limits on compression"
    if not np.array_equal(np.sort(problem.pinned), np.sort(body.pinned)):
        return "pinned: the problem's pins are not the body's"
    if start.shape != problem.target.shape:
        return f"start: shape {start.shape}, but {problem.target.shape} is the target's"
    return problem.with_target(start).infeasible_pins() or ""


class _Nothing(Energy):
    """No energy on elements, whose vertices are in the matrix all the same."""

    name = "nothing"

    def __init__(self, elements: IntArray) -> None:
        self.elements = elements

    def add_gradient(self, x: FloatArray, out: FloatArray) -> float:  # noqa: ARG002
        """See the base class."""
        return 0.0

    def add_hessian(self, x: FloatArray, blocks: Blocks, clamp: bool) -> None:
        """See the base class."""


class Inert(Body):
    """The masses and pins of a body alone, without energies and gravity."""

    def __init__(self, body: Body, elements: IntArray) -> None:
        self.pinned, self.gravity = body.pinned, np.zeros(3)
        self._mass, self._energies = body.mass, (_Nothing(elements),)

    @property
    def mass(self) -> FloatArray:
        """See the base class."""
        return self._mass

    @property
    def energies(self) -> tuple[Energy, ...]:
        """See the base class."""
        return self._energies


def projected(phi: Iteration, start: FloatArray, inertial: FloatArray) -> FloatArray:
    """The projection (n, 3) of implicit Euler's candidate in the mass norm, from `start`."""
    candidate, newton = minimise_step(
        phi.body, start, inertial, phi.step, NewtonSettings(), phi.linear
    )
    inert, settings = Inert(phi.body, phi.problem.elements), replace(phi.settings, first_mu=1.0)
    linear = inert.linear_solver
    projection = Iteration(inert, phi.problem, candidate, phi.step, settings, linear)
    try:
        return projection.run(start).x
    finally:
        phi.factorisations += newton.factorisations + projection.factorisations


def _answer(
    phi: Iteration, at: Point | None, name: str, reason: str, start: FloatArray
) -> tuple[FloatArray, ConstrainedReport]:
    rows = phi.problem.rows
    nan = float("nan")
    return np.full_like(start, nan) if at is None else at.x, ConstrainedReport(
        converged=at is not None,
        iterations=phi.iterations,
        residual=phi.residual(at) if at else nan,
        reason=reason,
        factorisations=phi.factorisations,
        evaluations=phi.evaluations,
        start=name,
        multipliers=at.l if at else np.full(rows, nan),
        complementarity=float(at.s @ at.l) / phi.work if at else nan,
        **{f"{part}_seconds": seconds for part, seconds in phi.seconds.items()},
    )
