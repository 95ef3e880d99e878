"""The inner minimum: steps 1 and 2 of `solvers.augmented_lagrangian`, and their compiled loops."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from strainbench import Problem
from strainbench.arrays import FloatArray
from strainbench.compiled import compiled
from strainbench.problem.leverage import inverse_weights
from strainbench.problem.rows import Rows, gather, spread

DECREASE, HALVINGS = 1e-4, 20
"""Armijo's condition with its customary factor (Nocedal and Wright 2006, Sec. 3.1)."""

CG_STEPS = 1000
"""To a Newton step, at most; the tuning needed 20 to 100."""


class Blocks(NamedTuple):
    """The rows of each constraint, c of them with m rows; the same for all frames.

    pulls : (c, m, k), g [1/m], 0 at a pin; scale : (c,) rho / mu;
    M : (n,), 0 at a pin; W : (n,), its inverse, 0 at a pin.
    """

    rows: Rows
    pulls: FloatArray
    scale: FloatArray
    M: FloatArray
    W: FloatArray

    @classmethod
    def of(cls, problem: Problem) -> Blocks:
        """Those of a problem."""
        rows, W = Rows.of(problem), inverse_weights(problem)
        M = np.where(W > 0, problem.weights, 0.0)
        area = problem.measures ** (2 / problem.rest.shape[-1])
        a_mass = area / np.mean(1 / problem.weights[problem.used])
        scale = np.repeat(a_mass, problem.constraints // len(area))
        pulls = np.where(W[rows.vertices][:, None] > 0, rows.coefficients, 0.0)
        return cls(rows, pulls, scale, M, W)


class Local(NamedTuple):
    """Z = V diag(s) U^T of each constraint: V (c, m, m), s (c, m), U^T (c, 3, 3).

    With one row V is left out, and U^T has one line, Z/|Z|.
    """

    V: FloatArray
    s: FloatArray
    Ut: FloatArray


class Hessian(NamedTuple):
    """What the generalised Hessian at one point is made of; b, rho (c,)."""

    mesh: Blocks
    b: FloatArray
    rho: FloatArray
    local: Local


class Minimum:
    """Steps 1 and 2 for given multipliers.

    x : (n, 3); value, gradient (n, 3) and Y (c, m, 3), which is Y+, there;
    residual : 1/2 |gradient|^2_{M^-1}; moved : sum_i |Y+ - Y|^2 / 2 rho_i.
    """

    def __init__(
        self, G: Blocks, problem: Problem, Y: FloatArray, penalty: float, x: FloatArray
    ) -> None:
        c, m = Y.shape[:2]
        self._t, self._start = problem.target, Y
        directions = np.zeros((c, 3 if m > 1 else 1, 3))
        local = Local(np.zeros((c, m, m)), np.zeros((c, m)), directions)
        self.hessian = Hessian(G, problem.bounds, penalty * G.scale, local)
        self._last: tuple[FloatArray, FloatArray] | None = None
        self.value = self._move(x)

    def _move(self, x: FloatArray) -> float:
        """The value at x, and everything else."""
        self.x, self.Y, self.gradient = x, np.empty_like(self._start), np.empty_like(x)
        start = self._t, self._start
        value, self.moved = evaluate(self.hessian, *start, x, self.Y, self.gradient)
        self.residual = 0.5 * float(self.hessian.mesh.W @ np.sum(self.gradient**2, axis=1))
        return value

    def newton_step(self, cg_steps: int = CG_STEPS) -> None:
        """One Newton step."""
        inverse = np.linalg.inv(diagonal(self.hessian))
        self._search(conjugate_gradients(self.hessian, inverse, self.gradient, cg_steps))  # 2

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
        product(self.hessian, p, Hp)
        self._search(p * float(-np.sum(self.gradient * p) / np.sum(p * Hp)))

    def _search(self, p: FloatArray) -> None:
        """To the first of x + p, x + p/2, x + p/4, ... that meets Armijo's condition."""
        slope, x, before = float(np.sum(self.gradient * p)), self.x, self.value
        for halvings in range(HALVINGS + 1):
            t = 0.5**halvings
            self.value = self._move(x + t * p)
            if self.value <= before * (1 + 1e-15) + DECREASE * t * slope:
                break


@compiled
def evaluate(
    K: Hessian,
    t: FloatArray,
    Y: FloatArray,
    x: FloatArray,
    Y_new: FloatArray,
    gradient: FloatArray,
) -> tuple[float, float]:
    """Value and sum_i |Y+ - Y|^2 / 2 rho_i at x; the last two and K.local are filled."""
    (G, pulls, _, M, _), b, rho, local = K
    for k in range(len(x)):
        for c in range(3):
            gradient[k, c] = M[k] * (x[k, c] - t[k, c])
    value, moved = 0.5 * np.sum(gradient * (x - t)), 0.0
    Z = np.empty((len(G.axes), 3))
    for i in range(len(b)):
        gather(G, i, x, Z)
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
            spread(G, pulls, i, Z, gradient)
    return value, moved


@compiled
def decompose(Z: FloatArray, i: int, axes: tuple[int, ...], local: Local) -> None:
    """Singular values and vectors of Z (m, 3)."""
    if len(axes) == 1:
        s = np.sqrt(Z[0, 0] ** 2 + Z[0, 1] ** 2 + Z[0, 2] ** 2)
        local.s[i, 0] = s
        for c in range(3):
            local.Ut[i, 0, c] = Z[0, c] / s if s > 0 else 0.0
    else:
        local.V[i], local.s[i], local.Ut[i] = np.linalg.svd(Z)


@compiled(error_model="numpy", contract=True)
def differentiate(
    i: int, axes: tuple[int, ...], b: float, local: Local, H: FloatArray, A: FloatArray
) -> None:
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
def diagonal(K: Hessian) -> FloatArray:
    """(n, 3, 3) diagonal blocks of the Hessian; the identity at a pin."""
    (G, pulls, _, M, _), b, rho, local = K
    blocks = np.zeros((len(M), 3, 3))
    for k in range(len(M)):
        for c in range(3):
            blocks[k, c, c] = M[k] if M[k] > 0 else 1.0
    H, A = np.empty((len(G.axes), 3)), np.empty((len(G.axes), 3))
    for i in range(len(b)):
        if local.s[i, 0] <= b[i]:
            continue
        for k in range(len(G.corners)):
            v = G.vertices[i, k]
            for c in range(3 if M[v] > 0 else 0):
                for a in range(len(G.axes)):
                    for d in range(3):
                        H[a, d] = pulls[i, a, k] if d == c else 0.0
                differentiate(i, G.axes, b[i], local, H, A)
                for a in range(len(G.axes)):
                    for d in range(3):
                        blocks[v, d, c] += rho[i] * pulls[i, a, k] * H[a, d]
    return blocks


@compiled(error_model="numpy", contract=True)
def product(K: Hessian, p: FloatArray, out: FloatArray) -> None:
    """Fill `out` with the Hessian times p (n, 3).

    1.26 of the same in C (`make kernels`; 1.51 with separate rounding and divisions that raise), as
    H goes through memory: its shape is that of a row or of an element. So has `evaluate` 1.28.
    """
    (G, pulls, _, M, _), b, rho, local = K
    for k in range(len(p)):
        for c in range(3):
            out[k, c] = M[k] * p[k, c]
    H, A = np.empty((len(G.axes), 3)), np.empty((len(G.axes), 3))
    for i in range(len(b)):
        if local.s[i, 0] > b[i]:
            gather(G, i, p, H)
            differentiate(i, G.axes, b[i], local, H, A)
            for a in range(len(G.axes)):
                for c in range(3):
                    H[a, c] *= rho[i]
            spread(G, pulls, i, H, out)


@compiled
def conjugate_gradients(
    K: Hessian, inverse: FloatArray, gradient: FloatArray, steps: int
) -> FloatArray:
    """(n, 3) Newton's step, to a tenth of the preconditioned gradient."""
    p, r, Hq = np.zeros_like(gradient), -gradient, np.empty_like(gradient)
    z = precondition(inverse, r)
    q, rz = z.copy(), np.sum(r * z)
    enough = 0.01 * rz
    for _ in range(steps):
        product(K, q, Hq)
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
def precondition(inverse: FloatArray, r: FloatArray) -> FloatArray:
    """(n, 3) each block's inverse times its part of r."""
    z = np.empty_like(r)
    for k in range(len(r)):
        for c in range(3):
            z[k, c] = (
                inverse[k, c, 0] * r[k, 0] + inverse[k, c, 1] * r[k, 1] + inverse[k, c, 2] * r[k, 2]
            )
    return z
