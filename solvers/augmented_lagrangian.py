"""Augmented Lagrangian with Newton-CG inside (Narain, Samii, O'Brien 2012).

R. Narain, A. Samii, J. O'Brien, "Adaptive anisotropic remeshing for cloth simulation", ACM Trans.
Graph. 31(6), and their program ARCSim: constraints sqrt(area) (s - b) <= 0 on stretches s, penalty
mu = 1e3 beside an objective divided by the harmonic mean of the masses. For each constraint, with
rho = mu area / mean(1/m) (for volumes volume^(2/3)), y = G_i x, and from x = target, Y = 0:

1. minimise 1/2 |x - t|_M^2 + sum_i rho_i/2 dist^2(y_i + Y_i/rho_i, B_i) by Newton's method, B_i
   the ball |y| <= b_i, or with exact limits all matrices with singular values up to b_i;
2. Newton's step by conjugate gradients on the generalised Hessian, preconditioned with its 3 x 3
   diagonal blocks, to a tenth of the gradient; then Armijo's rule, t = 1, 1/2, 1/4, ...;
3. end once 1/2 |gradient|^2_{M^-1} <= sum_i |Y+ - Y|^2 / 2 rho_i, which makes the method converge
   (R. T. Rockafellar, "Augmented Lagrangians and applications of the proximal point algorithm in
   convex programming", Math. Oper. Res. 1, 1976, criterion B'), or where the answer needs no more;
4. Y = Y+ = rho_i (Z - its projection on B_i), Z = y_i + Y_i/rho_i: Z with its singular values
   lowered by b_i, times rho_i; double mu where the violation has not halved;
5. stop once the largest violation and f(x) + sum_i |Y_i| v_i - D(Y), which is
   sum_i |Y_i| max(b_i, |y_i|) - <Y_i, y_i> + 1/2 |M (x - t) + G^T Y|^2_{M^-1}, are small.

ARCSim keeps one number a principal stretch, l = |Y_i| / sqrt(area), and the direction of y at
hand; the vector or matrix Y_i remembers the direction too, without which exact limits have no
limit point where the principal stretches are equal. Y is what certifies the answer.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from strainbench import Clock, Problem, Solution, Solver
from strainbench.arrays import FloatArray
from strainbench.compiled import compiled
from strainbench.solver.memory import Memory

DECREASE, HALVINGS = 1e-4, 20
"""Armijo's condition with its customary factor (Nocedal and Wright 2006, Sec. 3.1)."""

CG_STEPS = 1000
"""To a Newton step, at most; the tuning needed 20 to 100."""

ENOUGH = 0.05
"""Part of the gap allowed that an inexact minimum may use up."""


class Blocks(NamedTuple):
    """G by constraint, c of them with m rows each; the same for all frames.

    vertices : (c, k); coefficients : (c, m, k), g [1/m]; scale : (c,) rho / mu;
    M : (n,), 0 at a pin; W : (n,), its inverse, 0 at a pin;
    corners, axes : k and m zeros; their lengths are known to the compiler, which unrolls loops.
    """

    vertices: Any
    coefficients: Any
    scale: Any
    M: Any
    W: Any
    corners: tuple[int, ...]
    axes: tuple[int, ...]


class Local(NamedTuple):
    """Z = V diag(s) U^T of each constraint: V (c, m, m), s (c, m), U^T (c, 3, 3).

    With one row V is left out, and U^T has one line, Z/|Z|.
    """

    V: Any
    s: Any
    Ut: Any


@dataclass(frozen=True)
class AugmentedLagrangian(Solver):
    """Augmented Lagrangian with Newton-CG inside (Narain, Samii, O'Brien 2012).

    | status | when |
    |---|---|
    | solved | the largest violation and the relative duality gap are below the tolerance |
    | iteration limit | they are not, after `max_updates` of the multipliers |
    | time limit | they are not, at the deadline |

    The variant "arcsim" has ARCSim's fixed penalty, nonlinear conjugate gradients inside, and
    fixed counts: 10 of their steps to an update, 100 in all, wherever these end.

    Parameters
    ----------
    penalty, max_penalty : mu at first and at most. Tuned on frame 30 of the swing at 10 and 20
        cells, 1% and 0.1%, and 40 at 1%: from 1e3, as ARCSim, up to 2e4 takes 0.3 to 1.5 times
        the time of a fixed mu from 1e3 to 1e4; with 100, some did not end in 10 s. L-BFGS took 2 to
        3 times as long as Newton-CG.
    warm : start from the frame before: its multipliers, and its positions moved as the target has
        moved. On frames 10 to 30 of the swing at 20 cells, 1%, 180 steps become 89 (medians); to
        carry mu over too takes up to 1.5 times as many.
    inner : "newton" for step 2, or "cg" for nonlinear conjugate gradients, with beta =
        max(0, min(Hestenes-Stiefel, Dai-Yuan)) and the step length of one Newton step along p.
    inner_steps : to an update, at most.
    max_updates : of the multipliers; ten times what the tuning needed.
    """

    name = "augmented-lagrangian"
    variants = {"arcsim": {"max_penalty": 1e3, "inner": "cg", "inner_steps": 10, "max_updates": 10}}
    takes_exact = True

    warm: bool = False
    penalty: float = 1e3
    max_penalty: float = 2e4
    inner: str = "newton"
    inner_steps: int = 200
    max_updates: int = 1000

    def __post_init__(self) -> None:
        if self.inner not in ("newton", "cg"):
            raise ValueError(f"inner is {self.inner!r}: valid are newton, cg")

    def prepare(self, problem: Problem) -> Memory[Blocks]:
        """Coefficients, and the compiled loops."""
        G = blocks(problem)
        shape = (problem.constraints, len(G.axes), 3)
        inner = Minimum(G, problem, np.zeros(shape), self.penalty, problem.target)
        inner.newton_step(0)
        return Memory(G, self.warm)

    def solve(
        self,
        problem: Problem,
        state: Memory[Blocks],
        *,
        tolerance: float,
        monitor: Callable[..., None],
        deadline: Clock,
    ) -> Solution:
        """Updates from the target and Y = 0, or from the last answer.

        The monitor sees inner steps 1, 2, 4, 8, ...
        """
        x, Y = state.start(problem)
        return state.keep(
            problem, self.update(problem, state.mesh, x, Y, tolerance, monitor, deadline)
        )

    def update(
        self,
        problem: Problem,
        G: Blocks,
        x: FloatArray,
        multipliers: FloatArray,
        tolerance: float,
        monitor: Callable[..., None],
        deadline: Clock,
    ) -> Solution:
        """Updates from any x (n, 3) and multipliers (rows, 3)."""
        Y = multipliers.reshape(problem.constraints, -1, 3)
        penalty, last, steps = self.penalty, np.inf, 0
        floor = problem.objective_floor
        for updates in range(self.max_updates + 1):
            violation, gap = judge(problem, G, x, Y.reshape(-1, 3))  # 5
            allowed = tolerance * max(problem.objective(x) - gap, floor)
            status = "iteration limit" if updates == self.max_updates else ""
            status = "time limit" if deadline.passed else status
            status = "solved" if violation < tolerance and gap < allowed else status
            if status:
                break
            if violation > 0.5 * last:
                penalty = min(2 * penalty, self.max_penalty) if updates > 1 else penalty
            last = violation
            minimum = Minimum(G, problem, Y, penalty, x)
            step = minimum.newton_step if self.inner == "newton" else minimum.cg_step
            for number in range(self.inner_steps):
                close = minimum.residual <= max(minimum.moved, ENOUGH * allowed)
                if (number and close) or minimum.residual == 0 or deadline.passed:  # 3
                    break
                step()
                steps += 1
                if steps & (steps - 1) == 0:
                    monitor(minimum.x.copy(), minimum.Y.reshape(-1, 3).copy(), steps)
            x, Y = minimum.x, minimum.Y  # 4
        return Solution(x, status, steps, Y.reshape(-1, 3), {"updates": updates})


class Minimum:
    """Steps 1 and 2 for given multipliers.

    x : (n, 3); value, gradient (n, 3) and Y (c, m, 3), which is Y+, there;
    residual : 1/2 |gradient|^2_{M^-1}; moved : sum_i |Y+ - Y|^2 / 2 rho_i.
    """

    def __init__(
        self, G: Blocks, problem: Problem, Y: FloatArray, penalty: float, x: FloatArray
    ) -> None:
        c, m = Y.shape[:2]
        self._G, self._t, self._b = G, problem.target, problem.bounds
        self._start, self._rho = Y, penalty * G.scale
        directions = np.zeros((c, 3 if m > 1 else 1, 3))
        self._local = Local(np.zeros((c, m, m)), np.zeros((c, m)), directions)
        self._last: tuple[FloatArray, FloatArray] | None = None
        self.value = self._move(x)

    def _move(self, x: FloatArray) -> float:
        """The value at x, and everything else."""
        self.x, self.Y, self.gradient = x, np.empty_like(self._start), np.empty_like(x)
        value, self.moved = evaluate(
            *(self._G, self._t, self._b, self._rho, self._start),
            *(x, self._local, self.Y, self.gradient),
        )
        self.residual = 0.5 * float(self._G.W @ np.sum(self.gradient**2, axis=1))
        return float(value)

    @property
    def hessian(self) -> tuple[Any, ...]:
        """What the compiled loops need for it."""
        return self._G, self._b, self._rho, self._local

    def newton_step(self, cg_steps: int = CG_STEPS) -> None:
        """One Newton step."""
        inverse = np.linalg.inv(diagonal(*self.hessian))
        self._search(conjugate_gradients(*self.hessian, inverse, self.gradient, cg_steps))  # 2

    def cg_step(self) -> None:
        """One step of nonlinear conjugate gradients."""
        p, Hp = -self.gradient, np.empty_like(self.gradient)
        if self._last is not None:
            before, direction = self._last
            change = self.gradient - before
            curvature = float(np.sum(direction * change))
            beta = np.sum(self.gradient * (change, self.gradient), axis=(1, 2)).min()
            p += max(0.0, float(beta)) / curvature * direction if curvature > 0 else 0.0
            p = p if np.sum(p * self.gradient) < 0 else -self.gradient
        self._last = (self.gradient, p)
        product(*self.hessian, p, Hp)
        self._search(p * float(-np.sum(self.gradient * p) / np.sum(p * Hp)))

    def _search(self, p: FloatArray) -> None:
        """To the first of x + p, x + p/2, x + p/4, ... that meets Armijo's condition."""
        slope, x, before = float(np.sum(self.gradient * p)), self.x, self.value
        for halvings in range(HALVINGS + 1):
            t = 0.5**halvings
            self.value = self._move(x + t * p)
            if self.value <= before * (1 + 1e-15) + DECREASE * t * slope:
                break


def blocks(problem: Problem) -> Blocks:
    """What the loops need of the mesh."""
    c, k = problem.constraints, problem.elements.shape[1]
    m = problem.rows // c
    M, W = np.zeros((2, problem.vertices))
    M[problem.free] = problem.weights[problem.free]
    W[problem.free] = 1 / problem.weights[problem.free]
    area = problem.measures ** (2 / problem.rest.shape[-1])
    scale = np.repeat(area / np.mean(1 / problem.weights[problem.used]), c // len(area))
    vertices = problem.row_vertices.reshape(c, m, k)[:, 0].astype(np.int32)
    g = problem.row_coefficients.reshape(c, m, k).copy()
    return Blocks(vertices, g, scale, M, W, (0,) * k, (0,) * m)


def judge(problem: Problem, G: Blocks, x: FloatArray, Y: FloatArray) -> tuple[float, float]:
    """Largest violation and gap of x (n, 3) with multipliers Y (rows, 3)."""
    stretches = problem.stretches(x)
    force = problem.weights[:, None] * (x - problem.target) + problem.G.T @ Y
    priced = problem.dual_norms(Y) @ np.maximum(problem.bounds, stretches)
    slack = float(priced - np.sum(Y * (problem.G @ x)))
    gap = slack + 0.5 * float(G.W @ np.sum(force**2, axis=1))
    return float(np.max(stretches - problem.bounds)), gap


@compiled
def evaluate(G, t, b, rho, Y, x, local, Y_new, gradient):  # type: ignore[no-untyped-def]
    """Value and sum_i |Y+ - Y|^2 / 2 rho_i at x; the last three are filled."""
    for k in range(len(x)):
        for c in range(3):
            gradient[k, c] = G.M[k] * (x[k, c] - t[k, c])
    value, moved = 0.5 * np.sum(gradient * (x - t)), 0.0
    Z = np.empty((len(G.axes), 3))
    for i in range(len(b)):
        apply(G, i, x, Z)
        for a in range(len(G.axes)):
            for c in range(3):
                Z[a, c] += Y[i, a, c] / rho[i]
                Y_new[i, a, c] = 0.0
        decompose(Z, i, G.axes, local)
        for a in range(len(G.axes)):
            beyond = rho[i] * max(0.0, local.s[i, a] - b[i])
            value += 0.5 * beyond**2 / rho[i]
            for d in range(len(G.axes)):
                along = beyond * (local.V[i, d, a] if len(G.axes) > 1 else 1.0)
                for c in range(3):
                    Y_new[i, d, c] += along * local.Ut[i, a, c]
        for a in range(len(G.axes)):
            for c in range(3):
                Z[a, c] = Y_new[i, a, c]
                moved += 0.5 * (Z[a, c] - Y[i, a, c]) ** 2 / rho[i]
        if local.s[i, 0] > b[i]:
            spread(G, i, Z, gradient)
    return value, moved


@compiled
def apply(G, i, x, y):  # type: ignore[no-untyped-def]
    """Fill y (m, 3) with G_i x."""
    for a in range(len(G.axes)):
        y0 = y1 = y2 = 0.0
        for k in range(len(G.corners)):
            v, g = G.vertices[i, k], G.coefficients[i, a, k]
            y0 += g * x[v, 0]
            y1 += g * x[v, 1]
            y2 += g * x[v, 2]
        y[a, 0], y[a, 1], y[a, 2] = y0, y1, y2


@compiled
def spread(G, i, y, x):  # type: ignore[no-untyped-def]
    """Add G_i^T y to the free vertices of x (n, 3)."""
    for k in range(len(G.corners)):
        v = G.vertices[i, k]
        if G.M[v] > 0:
            for a in range(len(G.axes)):
                g = G.coefficients[i, a, k]
                x[v, 0] += g * y[a, 0]
                x[v, 1] += g * y[a, 1]
                x[v, 2] += g * y[a, 2]


@compiled
def decompose(Z, i, axes, local):  # type: ignore[no-untyped-def]
    """Singular values and vectors of Z (m, 3)."""
    if len(axes) == 1:
        s = np.sqrt(Z[0, 0] ** 2 + Z[0, 1] ** 2 + Z[0, 2] ** 2)
        local.s[i, 0] = s
        for c in range(3):
            local.Ut[i, 0, c] = Z[0, c] / s if s > 0 else 0.0
    else:
        local.V[i], local.s[i], local.Ut[i] = np.linalg.svd(Z)


@compiled
def differentiate(i, axes, b, local, H, A):  # type: ignore[no-untyped-def]
    """Replace H (m, 3) by the derivative of Z - projection of Z along H, Z beyond; A is scratch.

    In singular vectors, with f(s) = max(0, s - b), its symmetric part is multiplied by the
    divided differences of f, its antisymmetric part by (f_a + f_c) / (s_a + s_c).
    """
    m = len(axes)
    if m == 1:
        f = 1 - b / local.s[i, 0]
        u0, u1, u2 = local.Ut[i, 0, 0], local.Ut[i, 0, 1], local.Ut[i, 0, 2]
        along = (1 - f) * (u0 * H[0, 0] + u1 * H[0, 1] + u2 * H[0, 2])
        H[0, 0] = f * H[0, 0] + along * u0
        H[0, 1] = f * H[0, 1] + along * u1
        H[0, 2] = f * H[0, 2] + along * u2
        return
    V, s, Ut = local.V[i], local.s[i], local.Ut[i]
    A[:] = V.T @ H @ Ut.T
    for a in range(m):
        f = max(0.0, s[a] - b)
        for c in range(a, 3):
            if c >= m:
                A[a, c] *= f / s[a] if f > 0 else 0.0
                continue
            f_c, apart = max(0.0, s[c] - b), s[a] - s[c]
            close = apart <= 1e-12 * s[0]
            even = (1.0 if f > 0 else 0.0) if close else (f - f_c) / apart
            odd = (f + f_c) / (s[a] + s[c]) if f > 0 else 0.0
            plus, minus = even * (A[a, c] + A[c, a]) / 2, odd * (A[a, c] - A[c, a]) / 2
            A[a, c], A[c, a] = plus + minus, plus - minus
    H[:] = V @ A @ Ut


@compiled
def diagonal(G, b, rho, local):  # type: ignore[no-untyped-def]
    """(n, 3, 3) diagonal blocks of the Hessian; the identity at a pin."""
    blocks = np.zeros((len(G.M), 3, 3))
    for k in range(len(G.M)):
        for c in range(3):
            blocks[k, c, c] = G.M[k] if G.M[k] > 0 else 1.0
    H, A = np.empty((len(G.axes), 3)), np.empty((len(G.axes), 3))
    for i in range(len(b)):
        if local.s[i, 0] <= b[i]:
            continue
        for k in range(len(G.corners)):
            v = G.vertices[i, k]
            for c in range(3 if G.M[v] > 0 else 0):
                for a in range(len(G.axes)):
                    for d in range(3):
                        H[a, d] = G.coefficients[i, a, k] if d == c else 0.0
                differentiate(i, G.axes, b[i], local, H, A)
                for a in range(len(G.axes)):
                    for d in range(3):
                        blocks[v, d, c] += rho[i] * G.coefficients[i, a, k] * H[a, d]
    return blocks


@compiled
def product(G, b, rho, local, p, out):  # type: ignore[no-untyped-def]
    """Fill `out` with the Hessian times p (n, 3)."""
    for k in range(len(p)):
        for c in range(3):
            out[k, c] = G.M[k] * p[k, c]
    H, A = np.empty((len(G.axes), 3)), np.empty((len(G.axes), 3))
    for i in range(len(b)):
        if local.s[i, 0] > b[i]:
            apply(G, i, p, H)
            differentiate(i, G.axes, b[i], local, H, A)
            for a in range(len(G.axes)):
                for c in range(3):
                    H[a, c] *= rho[i]
            spread(G, i, H, out)


@compiled
def conjugate_gradients(G, b, rho, local, inverse, gradient, steps):  # type: ignore[no-untyped-def]
    """(n, 3) Newton's step, to a tenth of the preconditioned gradient."""
    p, r, Hq = np.zeros_like(gradient), -gradient, np.empty_like(gradient)
    z = precondition(inverse, r)
    q, rz = z.copy(), np.sum(r * z)
    enough = 0.01 * rz
    for _ in range(steps):
        product(G, b, rho, local, q, Hq)
        alpha = rz / np.sum(q * Hq)
        p += alpha * q
        r -= alpha * Hq
        z = precondition(inverse, r)
        last, rz = rz, np.sum(r * z)
        if rz <= enough:
            break
        q = z + rz / last * q
    return p


@compiled
def precondition(inverse, r):  # type: ignore[no-untyped-def]
    """(n, 3) each block's inverse times its part of r."""
    z = np.empty_like(r)
    for k in range(len(r)):
        for c in range(3):
            z[k, c] = (
                inverse[k, c, 0] * r[k, 0] + inverse[k, c, 1] * r[k, 1] + inverse[k, c, 2] * r[k, 2]
            )
    return z
