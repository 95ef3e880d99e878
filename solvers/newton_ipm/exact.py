"""Exact limits: Q_e = (b_e^2 I - Y_e Y_e^T)/2 >= 0 with 2 x 2 slacks and multipliers.

Y_e (2, 3) holds the columns of F_e D. The steps are those of sampled limits in coordinates where
slack and multiplier are one diagonal matrix (Nesterov and Todd 1997): R^-1 S R^-T = R^T L R =
diag(d), where R R^T is the geometric mean of S and L^-1.

With t = R^-1 sym(dY Y^T) R^-T the scaled changes, those that a `Change` holds, are dS~ = r~ - t
and dL~ = h + t, where h = c/((d_p + d_q)/2) - r~ entry by entry, and c is what the products
diag(d)^2 are to change by. The block of vertices k, l in K is (B_k^T L B_l) I_3 + <A_ki, A_lj>
with A_ki = sym((R^-1 Y_i)(R^-1 B_k)^T). Symmetric matrices are stored as their entries 11, 22, 12.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from solvers.newton_ipm.mesh import Change, gather, spread, spread_blocks
from solvers.newton_ipm.sampled import ROUNDING
from strainbench import Problem
from strainbench.arrays import FloatArray
from strainbench.compiled import compiled
from strainbench.physics.pattern import Pattern

ROOT_HALF = 0.5**0.5
OFF = np.array([1.0, 1.0, 2.0])  # an off-diagonal entry counts twice in an inner product


class ExactCones:
    """All constraints at one point, as in `SampledCones`.

    Attributes
    ----------
    b : (e,)
    y : (2e, 3)
    q, s, l : (e, 3)
    degree : 2e, the number of products
    """

    b: FloatArray
    y: FloatArray
    q: FloatArray
    s: FloatArray
    l: FloatArray  # noqa: E741

    def __init__(self, problem: Problem, pattern: Pattern) -> None:
        e, k = problem.elements.shape
        gradients = problem.row_coefficients.reshape(e, 2, k).swapaxes(1, 2)  # D included
        self._mesh = (problem.elements, np.ascontiguousarray(gradients), (0,) * k, (0, 0))
        self._slots, self._stride, self._n = pattern.slots[0], pattern.stride, problem.vertices
        self.degree = problem.rows
        self._R, self._inverse, self._d = np.empty((e, 2, 2)), np.empty((e, 2, 2)), np.empty((e, 2))

    def rows(self, x: FloatArray) -> FloatArray:
        """(2e, 3) G x."""
        y = np.empty((self.degree, 3))
        fill_rows(*self._mesh, x, y)
        return y

    def back(self, multipliers: FloatArray) -> FloatArray:
        """(n, 3) G^T Y."""
        out = np.zeros((self._n, 3))
        add_back(*self._mesh, multipliers, out)
        return out

    def place(self, b: FloatArray, x: FloatArray) -> None:
        """Go to the positions x; slacks and multipliers stay."""
        self.b, self.y = b, self.rows(x)
        first, second = self.y[::2], self.y[1::2]
        gram = [np.einsum("ei,ei->e", *pair) for pair in ((first,) * 2, (second,) * 2)]
        gram.append(np.einsum("ei,ei->e", first, second))
        self.q = 0.5 * (np.outer(b**2, [1.0, 1.0, 0.0]) - np.stack(gram, axis=1))

    def start(self, floor: float, mu: float) -> None:
        """Slacks with eigenvalues of at least `floor` b^2, products mu."""
        self.s = widened(np.outer(floor * self.b**2, [1.0, 1.0, 0.0]), self.q)
        determinant = self.s[:, 0] * self.s[:, 1] - self.s[:, 2] ** 2
        self.l = mu * self.s[:, [1, 0, 2]] * [1, 1, -1] / determinant[:, None]

    def resume(self, s: FloatArray, l: FloatArray) -> None:  # noqa: E741
        """Slacks of another problem, widened to those at x, and its multipliers."""
        self.s, self.l = widened(s, self.q), l

    def residuals(self) -> FloatArray:
        """r (e, 3)."""
        r: FloatArray = self.q - self.s
        r[np.abs(r) < ROUNDING] = 0.0
        return r

    def excess(self) -> FloatArray:
        """(e,) the largest singular value of Y, less b."""
        squared = self.b**2 - 2 * eigenvalues(self.q)[0]
        excess: FloatArray = np.sqrt(np.maximum(squared, 0.0)) - self.b
        return excess

    def multipliers(self) -> tuple[FloatArray, FloatArray]:
        """L Y (2e, 3), and the nuclear norms (e,)."""
        a, d, c = (self.l[:, i, None] for i in range(3))
        first, second = self.y[::2], self.y[1::2]
        Y = np.empty_like(self.y)
        Y[::2], Y[1::2] = a * first + c * second, c * first + d * second
        area = np.linalg.norm(np.cross(Y[::2], Y[1::2]), axis=1)  # the product of the two
        norms: FloatArray = np.sqrt(np.sum(Y.reshape(-1, 6) ** 2, axis=1) + 2 * area)
        return Y, norms

    def assemble(self, data: FloatArray) -> None:
        """Add the constraints' part of K to the matrix's values, scaling found on the way."""
        scale = (self._R, self._inverse, self._d)
        add_hessian(*self._mesh, self.s, self.l, self.y, *scale, self._slots, self._stride, data)

    def push(self, c: FloatArray, r: FloatArray) -> FloatArray:
        """(n, 3) G^T (H Y), for scaled products that are to change by c."""
        self._r, self._h, Y = np.empty_like(r), np.empty_like(r), np.empty_like(self.y)
        fill_push(self._inverse, self._d, c, r, self.y, self._r, self._h, Y)
        return self.back(Y)

    def change(self, dx: FloatArray) -> Change:
        """The rest of the step, after `push` and the linear solve."""
        ds, dl, square = np.empty((3, *self.q.shape))
        point = (self.y, self._inverse, self._d, self._r, self._h)
        length = fill_change(*self._mesh, dx, *point, ds, dl, square)
        return Change(ds, dl, square, float(length))

    def products(self, change: Change | None = None, a: float = 0.0) -> float:
        """<S, L>, after the part a of a step if one is given."""
        if change is None:
            return float(np.sum(self.s * self.l @ OFF))
        s, l = self._after(change, a)  # noqa: E741
        return float(np.sum(s * l @ OFF))

    def _after(self, change: Change, a: float) -> tuple[FloatArray, FloatArray]:
        """Scaled slacks and multipliers after the part a of a step."""
        s, l = a * change.s, a * change.l  # noqa: E741
        s[:, :2] += self._d
        l[:, :2] += self._d
        return s, l

    def predictor(self) -> FloatArray:
        """c that would take all products to 0."""
        c = np.zeros_like(self.q)
        c[:, :2] = -(self._d**2)
        return c

    def corrector(self, mu: float, affine: Change | None = None) -> FloatArray:
        """c that takes all products to mu, the second-order error of a predictor included."""
        c = self.predictor()
        c[:, :2] += mu
        return c if affine is None else c - symmetric_product(affine.s, affine.l)

    def centrality(
        self, c: FloatArray, change: Change, a: float, low: float, high: float
    ) -> FloatArray:
        """c with what moves the products after the part a of a step into [low, high]."""
        after = symmetric_product(*self._after(change, a))
        wanted = mapped(after, lambda p: p + np.maximum(np.clip(p, low, high) - p, -high))
        return c + wanted - after

    def moved(self, change: Change, a: float) -> tuple[FloatArray, FloatArray]:
        """Slacks and multipliers after the part a of a step."""
        back = self._inverse.swapaxes(1, 2)
        s = self.s + a * congruent(self._R, change.s)
        l = self.l + a * congruent(back, change.l)  # noqa: E741
        return s, l


def eigenvalues(A: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Smallest and largest (e,) of symmetric matrices (e, 3)."""
    mean, apart = (A[:, 0] + A[:, 1]) / 2, np.hypot((A[:, 0] - A[:, 1]) / 2, A[:, 2])
    return mean - apart, mean + apart


def mapped(A: FloatArray, function: Callable[[FloatArray], FloatArray]) -> FloatArray:
    """Symmetric matrices (e, 3) with a function's values for eigenvalues.

    It is linear in A and I: the line through the values at both eigenvalues.
    """
    low, high = eigenvalues(A)
    at_low, at_high = function(low), function(high)
    slope = (at_high - at_low) / np.where(high > low, high - low, 1.0)
    out: FloatArray = slope[:, None] * A
    out[:, :2] += (at_high - slope * high)[:, None]
    return out


def widened(A: FloatArray, B: FloatArray) -> FloatArray:
    """A + (B - A)_+, above both A and B: the larger one where they are numbers."""
    return A + mapped(B - A, lambda d: np.maximum(d, 0.0))


def congruent(R: FloatArray, A: FloatArray) -> FloatArray:
    """(e, 3) R A R^T of R (e, 2, 2) and symmetric A (e, 3)."""
    out = np.empty_like(A)
    fill_congruent(np.ascontiguousarray(R), A, out)
    return out


def symmetric_product(A: FloatArray, B: FloatArray) -> FloatArray:
    """(e, 3) (A B + B A)/2."""
    cross = A[:, 2] * B[:, 2]
    mixed = ((A[:, 0] + A[:, 1]) * B[:, 2] + A[:, 2] * (B[:, 0] + B[:, 1])) / 2
    return np.stack([A[:, 0] * B[:, 0] + cross, A[:, 1] * B[:, 1] + cross, mixed], axis=1)


@compiled
def fill_congruent(R, A, out):  # type: ignore[no-untyped-def]
    """R A R^T for each element."""
    for e in range(len(A)):
        a, d, b = A[e, 0], A[e, 1], A[e, 2]
        p, q, r, s = R[e, 0, 0], R[e, 0, 1], R[e, 1, 0], R[e, 1, 1]
        out[e, 0] = p * p * a + 2 * p * q * b + q * q * d
        out[e, 1] = r * r * a + 2 * r * s * b + s * s * d
        out[e, 2] = p * r * a + (p * s + q * r) * b + q * s * d


@compiled(error_model="numpy")
def fill_push(inverse, d, c, r, y, scaled, h, Y):  # type: ignore[no-untyped-def]
    """scaled = R^-1 r R^-T, h = c/((d_p + d_q)/2) - scaled, and Y = R^-T h R^-1 y."""
    fill_congruent(inverse, r, scaled)
    for e in range(len(h)):
        h0 = c[e, 0] / d[e, 0] - scaled[e, 0]
        h1 = c[e, 1] / d[e, 1] - scaled[e, 1]
        h2 = 2 * c[e, 2] / (d[e, 0] + d[e, 1]) - scaled[e, 2]
        h[e, 0], h[e, 1], h[e, 2] = h0, h1, h2
        p, q, s, t = inverse[e, 0, 0], inverse[e, 0, 1], inverse[e, 1, 0], inverse[e, 1, 1]
        H0 = p * p * h0 + 2 * p * s * h2 + s * s * h1
        H1 = q * q * h0 + 2 * q * t * h2 + t * t * h1
        H2 = p * q * h0 + (p * t + q * s) * h2 + s * t * h1
        for i in range(3):
            Y[2 * e, i] = H0 * y[2 * e, i] + H2 * y[2 * e + 1, i]
            Y[2 * e + 1, i] = H2 * y[2 * e, i] + H1 * y[2 * e + 1, i]


@compiled
def fill_rows(elements, gradients, corners, axes, x, y):  # type: ignore[no-untyped-def]
    """y = G x."""
    for e in range(len(elements)):
        gather(elements, gradients, corners, axes, e, x, y[2 * e : 2 * e + 2])


@compiled
def add_back(elements, gradients, corners, axes, Y, out):  # type: ignore[no-untyped-def]
    """Add G^T Y to `out` (n, 3)."""
    for e in range(len(elements)):
        spread(elements, gradients, corners, axes, e, Y[2 * e : 2 * e + 2], out)


@compiled
def add_hessian(elements, gradients, corners, axes, s, l, y, R, inverse, d, slots, stride, data):  # type: ignore[no-untyped-def] # noqa: E741
    """Scale each element (R, its inverse and d are filled in), then add its blocks."""
    H = np.empty((2, 2, 3, 3))
    A = np.empty((2, 3, 3))
    for e in range(len(elements)):
        scale(s[e], l[e], R[e], inverse[e], d[e])
        V = inverse[e]
        for c in range(2):
            for i in range(3):
                p0 = V[0, 0] * y[2 * e, i] + V[0, 1] * y[2 * e + 1, i]
                p1 = V[1, 0] * y[2 * e, i] + V[1, 1] * y[2 * e + 1, i]
                A[c, i, 0] = p0 * V[0, c]
                A[c, i, 1] = p1 * V[1, c]
                A[c, i, 2] = (p0 * V[1, c] + p1 * V[0, c]) * ROOT_HALF
        for c in range(2):
            for f in range(c + 1):
                for i in range(3):
                    for j in range(3):
                        h = A[c, i, 0] * A[f, j, 0] + A[c, i, 1] * A[f, j, 1]
                        H[c, f, i, j] = h + A[c, i, 2] * A[f, j, 2]
                    H[c, f, i, i] += l[e, c] if c == f else l[e, 2]
        H[0, 1] = H[1, 0].T
        spread_blocks(elements, gradients, corners, axes, e, H, slots, stride, data)


@compiled(error_model="numpy")
def scale(s, l, R, inverse, d):  # type: ignore[no-untyped-def] # noqa: E741
    """R with R^-1 S R^-T = R^T L R = diag(d), of one element.

    W = R R^T is proportional to S/alpha + adj(L)/beta with alpha^2 = det S and beta^2 = det L,
    whose determinant is to be alpha/beta. With W = C C^T, R is C times C^T L C's eigenvectors.
    """
    alpha, beta = np.sqrt(s[0] * s[1] - s[2] ** 2), np.sqrt(l[0] * l[1] - l[2] ** 2)
    a, b, c = s[0] / alpha + l[1] / beta, s[1] / alpha + l[0] / beta, s[2] / alpha - l[2] / beta
    factor = np.sqrt(alpha / beta / (a * b - c * c))
    a, b, c = factor * a, factor * b, factor * c
    c00 = np.sqrt(a)
    c10 = c / c00
    c11 = np.sqrt(alpha / beta) / c00
    p = c00 * c00 * l[0] + 2 * c00 * c10 * l[2] + c10 * c10 * l[1]
    q = c11 * c11 * l[1]
    r = c11 * (c00 * l[2] + c10 * l[1])
    apart = 0.5 * (p - q)  # the rotation by half the angle of (apart, r)
    half = abs(apart) + np.hypot(apart, r)
    cos = half / np.hypot(half, r) if half > 0 else 1.0
    sin = r / np.hypot(half, r) if half > 0 else 0.0
    if apart < 0:
        cos, sin = sin, cos
    R[0, 0], R[0, 1] = c00 * cos, -c00 * sin
    R[1, 0], R[1, 1] = c10 * cos + c11 * sin, -c10 * sin + c11 * cos
    determinant = c00 * c11
    inverse[0, 0], inverse[0, 1] = R[1, 1] / determinant, -R[0, 1] / determinant
    inverse[1, 0], inverse[1, 1] = -R[1, 0] / determinant, R[0, 0] / determinant
    d[0] = p * cos * cos + 2 * r * cos * sin + q * sin * sin
    d[1] = p * sin * sin - 2 * r * cos * sin + q * cos * cos


@compiled(error_model="numpy")
def fill_change(elements, gradients, corners, axes, dx, y, inverse, d, r, h, ds, dl, square):  # type: ignore[no-untyped-def]
    """dS~ = r~ - t, dL~ = h + t, square = dY dY^T/2; the step's length is returned."""
    F = np.empty((2, 3))
    length = 1.0
    for e in range(len(elements)):
        gather(elements, gradients, corners, axes, e, dx, F)
        a00 = a11 = a01 = s00 = s11 = s01 = 0.0
        for i in range(3):
            u, v = y[2 * e, i], y[2 * e + 1, i]
            a00 += F[0, i] * u
            a11 += F[1, i] * v
            a01 += 0.5 * (F[0, i] * v + F[1, i] * u)
            s00 += F[0, i] * F[0, i]
            s11 += F[1, i] * F[1, i]
            s01 += F[0, i] * F[1, i]
        square[e, 0], square[e, 1], square[e, 2] = 0.5 * s00, 0.5 * s11, 0.5 * s01
        V = inverse[e]
        t0 = V[0, 0] * V[0, 0] * a00 + 2 * V[0, 0] * V[0, 1] * a01 + V[0, 1] * V[0, 1] * a11
        t1 = V[1, 0] * V[1, 0] * a00 + 2 * V[1, 0] * V[1, 1] * a01 + V[1, 1] * V[1, 1] * a11
        t2 = V[0, 0] * V[1, 0] * a00 + (V[0, 0] * V[1, 1] + V[0, 1] * V[1, 0]) * a01
        t2 += V[0, 1] * V[1, 1] * a11
        ds[e, 0], ds[e, 1], ds[e, 2] = r[e, 0] - t0, r[e, 1] - t1, r[e, 2] - t2
        dl[e, 0], dl[e, 1], dl[e, 2] = h[e, 0] + t0, h[e, 1] + t1, h[e, 2] + t2
        length = min(length, reach(d[e], ds[e]), reach(d[e], dl[e]))
    return length


@compiled(error_model="numpy")
def reach(d, change):  # type: ignore[no-untyped-def]
    """The largest a for which diag(d) + a change has no negative eigenvalue."""
    a, b = change[0] / d[0], change[1] / d[1]
    c = change[2] / np.sqrt(d[0] * d[1])
    least = (a + b) / 2 - np.hypot((a - b) / 2, c)
    return -1 / least if least < 0 else np.inf
