"""Static equilibrium within limits, by a barrier method on the energy itself.

minimise E(x) = W(x) + gravity  subject to  q_i(x) = (b_i^2 - |y_i|^2) / 2 >= 0,

y = G x, with the pins fixed: a primal-dual barrier method (Nocedal and Wright 2006, section 19.6)
without slacks, as the start is within the limits and the limits are convex. With multipliers l_i,
from l_i = mu / q_i:

1. stop when mu is the last one, ||(grad E + G^T (l y))_free|| <= tolerance g_0 ||m||_2 and no
   l_i q_i is above 2 mu
2. once the residual is as small as mu, both relative to the weight, mu falls to a fifth
3. K = H + sum_i [l_i (g_i g_i^T) (x) I3 + (l_i / q_i) (g_i (x) y_i)(g_i (x) y_i)^T], g_i a row of
   G, H the Hessian of E plus c M (Levenberg and Marquardt); where K is not positive definite, with
   more mass, then with H clamped
4. K dx = -(grad E + G^T (mu y / q)): descent of phi = E - mu sum_i log q_i
5. the longest step on which no q_i loses more than 9/10, halved until phi falls (Armijo; near
   the minimum, where that drowns in rounding, until the slope is no steeper than it was); c grows
   fourfold where it was halved, as bending's Hessian is but Gauss and Newton's, else it falls
6. l_i moves by a Newton step of its own, and stays within a factor 1e4 of mu / q_i

One minimum of several: E is not convex, and which fold goes where depends on the start. A flat
start is a saddle, and may not be left: the drape fails where its cells are too few for its folds,
such as 2 for 2 or 3 for 3; at 3 to 6, 10, 15, 30 and 60 for 2 it does not. The method needs no
projection, so it tells how far a drape found by projections is from a true one.
"""

# ruff: noqa: E741 - l are multipliers
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from strainbench.arrays import FloatArray
from strainbench.compiled import compiled
from strainbench.physics.body import GRAVITY
from strainbench.physics.cloth import Cloth
from strainbench.physics.linear import NotPositiveDefiniteError
from strainbench.physics.pattern import Blocks, scatter
from strainbench.physics.statics import Equilibrium
from strainbench.problem.kinds import Sampled
from strainbench.problem.problem import Problem


@dataclass(frozen=True)
class BarrierSettings:
    """The stopping rule; the rest tuned on the drape's three curves at 10 to 60 cells."""

    tolerance: float = 1e-8  # of the residual, and of the last mu
    max_iterations: int = 1000  # 42 to 60 are taken at 10 cells, 114 to 394 at 60
    fall: float = 0.2  # of mu, each time
    nearest: float = 0.9  # of q that a step may take; 0.995 jams at the limits from far away
    apart: float = 1e4  # factor between l_i and mu / q_i
    armijo: float = 1e-4
    max_halvings: int = 30
    rounding: float = 1e-11  # of phi, relative
    damping: float = 1.0  # [1/s^2], the least c above 0
    dampings: tuple[tuple[bool, float], ...] = (
        (False, 4.0),
        (False, 30.0),
        (True, 1.0),
        (True, 1e3),
        (True, 1e6),
    )  # whether to clamp, and what c is multiplied by


@compiled
def add_limits_hessian(
    coefficients: FloatArray, y: FloatArray, l: FloatArray, w: FloatArray, blocks: Blocks
) -> None:
    """Add sum_i l_i (g_i g_i^T) (x) I3 + w_i (g_i (x) y_i)(g_i (x) y_i)^T to a sparse matrix.

    Parameters
    ----------
    coefficients : (rows, 3) entries of G, as many rows an element as there are directions
    y : (rows, 3)
    l, w : (rows,)
    blocks : of the triangles
    """
    values, modes = np.empty(4), np.zeros((4, 9))
    directions = len(coefficients) // len(blocks.elements)
    for i in range(len(coefficients)):
        values[:3], values[3] = l[i], w[i]
        for k in range(3):
            for c in range(3):
                modes[c, 3 * k + c] = coefficients[i, k]
                modes[3, 3 * k + c] = coefficients[i, k] * y[i, c]
        scatter(values, modes, blocks, i // directions)


class _Point:
    """Positions x (n, 3), and what phi and its derivatives need there."""

    def __init__(self, cloth: Cloth, problem: Problem, x: FloatArray) -> None:
        self.cloth, self.problem, self.x = cloth, problem, x
        self.y = problem.G @ x
        self.q = 0.5 * (problem.bounds**2 - np.sum(self.y**2, axis=1))
        self.energies, self.gradient = cloth.potential(x)

    def moved(self, dx: FloatArray) -> _Point:
        """The point at x + dx."""
        return _Point(self.cloth, self.problem, self.x + dx)

    def phi(self, mu: float) -> float:
        """The barrier function [J]; infinite beyond the limits."""
        if self.q.min() <= 0:
            return float("inf")
        return sum(self.energies.values()) - mu * float(np.log(self.q).sum())

    def with_forces(self, l: FloatArray) -> FloatArray:
        """grad E + G^T (l y) at the free vertices (f, 3) [N]; grad phi where l = mu / q."""
        forces = self.problem.G.T @ (l[:, None] * self.y)
        gradient: FloatArray = (self.gradient + forces)[self.cloth.pattern.free]
        return gradient

    def equilibrium(self, l: FloatArray, residual: float) -> Equilibrium:
        """What is known of an equilibrium here."""
        forces = self.problem.G.T @ (l[:, None] * self.y)
        forces[self.cloth.pinned] = 0.0
        return Equilibrium(self.x, forces, residual, self.energies)


def equilibrium(
    cloth: Cloth, problem: Problem, settings: BarrierSettings
) -> tuple[Equilibrium, str]:
    """A minimum of the potential within the limits of `problem`, from its target.

    Returns
    -------
    equilibrium : the last iterate
    reason : why it is not as good as was asked for, or ""

    Raises
    ------
    ValueError
        If the target is not strictly within its limits, or these are not sampled.
    """
    at = _Point(cloth, problem, problem.target)
    if not isinstance(problem.kind, Sampled) or at.q.min() <= 0:
        raise ValueError("target: positions strictly within sampled limits are valid")
    fall = np.linalg.norm(GRAVITY) * cloth.mass.sum() * np.ptp(problem.target, axis=0).max()
    count, share, reason = len(at.q), 1.0, f"{settings.max_iterations} iterations"
    mu, c = share * fall / count, 0.0
    l = mu / at.q
    for _ in range(settings.max_iterations):
        residual = float(np.linalg.norm(at.with_forces(l))) / cloth.force_scale  # 1
        centred = bool(np.all(np.abs(l * at.q - mu) < mu))
        if share <= settings.tolerance and residual <= settings.tolerance and centred:
            reason = ""
            break
        if centred and residual < max(share, settings.tolerance):  # 2
            share = max(settings.fall * share, settings.tolerance)
            mu = share * fall / count
        dx = _direction(at, l, mu, c, settings)  # 3, 4
        dy = problem.G @ dx
        found, halvings = _line_search(at, dx, dy, mu, settings)  # 5
        if found is None:
            reason = "the line search found no lower energy"
            break
        c = max(4 * c, settings.damping) if halvings else c / 4
        c = c if c >= settings.damping else 0.0
        l = _multipliers(at, l, dy, mu, settings)  # 6
        at, near = found, mu / found.q
        l = np.clip(l, near / settings.apart, near * settings.apart)
    return at.equilibrium(l, residual), f"{reason}, residual {residual:.1e}" if reason else ""


def _direction(
    at: _Point, l: FloatArray, mu: float, c: float, settings: BarrierSettings
) -> FloatArray:
    """The Newton step dx (n, 3) [m], 0 at the pins."""
    cloth, pattern, linear = at.cloth, at.cloth.pattern, at.cloth.linear_solver
    least = max(c, settings.damping)
    for clamp, mass in ((False, c), *((clamp, f * least) for clamp, f in settings.dampings)):
        data = cloth.hessian_values(at.x, mass * cloth.mass, clamp)
        triangles = pattern.blocks(data)[0]
        add_limits_hessian(at.problem.row_coefficients, at.y, l, l / at.q, triangles)
        try:
            linear.factorise(data)
            break
        except NotPositiveDefiniteError as error:
            failure = error
    else:
        raise failure
    dx = np.zeros_like(at.x)
    dx[pattern.free] = linear.solve(-at.with_forces(mu / at.q).ravel()).reshape(-1, 3)
    return dx


def _multipliers(
    at: _Point, l: FloatArray, dy: FloatArray, mu: float, settings: BarrierSettings
) -> FloatArray:
    """The multipliers after their own Newton step, on which none loses more than 9/10."""
    dl = mu / at.q - l + l / at.q * np.sum(at.y * dy, axis=1)
    falling = dl < 0
    longest = float(np.min(-l[falling] / dl[falling], initial=np.inf))
    moved: FloatArray = l + min(1.0, settings.nearest * longest) * dl
    return moved


def _line_search(
    at: _Point, dx: FloatArray, dy: FloatArray, mu: float, settings: BarrierSettings
) -> tuple[_Point | None, int]:
    """The first acceptable point on x + a dx, or None; how often a was halved."""
    d, phi = dx[at.cloth.pattern.free], at.phi(mu)
    slope = float(np.vdot(at.with_forces(mu / at.q), d))
    a = min(1.0, longest_step(at.y, dy, settings.nearest * at.q))
    for halvings in range(settings.max_halvings):
        trial = at.moved(a * dx)
        reached = trial.phi(mu)
        if reached <= phi + settings.armijo * a * slope:
            return trial, halvings
        if reached <= phi + settings.rounding * abs(phi):
            steepness = float(np.vdot(trial.with_forces(mu / trial.q), d))
            if abs(steepness) <= abs(slope):
                return trial, halvings
        a *= 0.5
    return None, settings.max_halvings


def longest_step(y: FloatArray, dy: FloatArray, room: FloatArray) -> float:
    """The largest a at which no |y_i + a dy_i|^2 / 2 exceeds |y_i|^2 / 2 + room_i."""
    A, B = np.sum(dy**2, axis=1), np.sum(y * dy, axis=1)
    root = np.sqrt(B**2 + 2 * A * room)
    steps = np.divide(2 * room, B + root, out=np.full(len(A), np.inf), where=B + root > 0)
    return float(steps.min())
