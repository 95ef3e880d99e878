"""Sampled limits: q_i = (b_i^2 - |y_i|^2)/2 >= 0, one slack and one multiplier a constraint."""

from __future__ import annotations

import numpy as np

from solvers.newton_ipm.mesh import Change, gather, spread, spread_symmetric
from strainbench import Problem
from strainbench.arrays import FloatArray
from strainbench.compiled import compiled
from strainbench.physics.pattern import Pattern

ROUNDING = 1e-14
"""Residuals below it count as 0: divided by small slacks, rounding would floor the gap."""


class SampledCones:
    """All constraints at one point: rows y = G x, slacks s, multipliers l, residuals r = q - s.

    A Newton step changes s by r - y.dy and l by h + (l/s)(y.dy) with h = (c - l r)/s, where c is
    what the products s l are to change by.

    Attributes
    ----------
    y : (rows, 3)
    q, s, l : (rows,)
    degree : number of products s l
    """

    b: FloatArray
    y: FloatArray
    q: FloatArray
    s: FloatArray
    l: FloatArray  # noqa: E741

    def __init__(self, problem: Problem, pattern: Pattern) -> None:
        k, dim = problem.gradients.shape[1:]
        self._mesh = (problem.elements, problem.gradients, (0,) * k, (0,) * dim)
        self._d = np.ascontiguousarray(problem.limits.directions)
        self._slots, self._stride, self._n = pattern.slots[0], pattern.stride, problem.vertices
        self.degree = problem.rows

    def rows(self, x: FloatArray) -> FloatArray:
        """(rows, 3) G x."""
        y = np.empty((self.degree, 3))
        fill_rows(*self._mesh, self._d, x, y)
        return y

    def back(self, multipliers: FloatArray) -> FloatArray:
        """(n, 3) G^T Y."""
        out = np.zeros((self._n, 3))
        add_back(*self._mesh, self._d, multipliers, out)
        return out

    def place(self, b: FloatArray, x: FloatArray) -> None:
        """Go to the positions x; slacks and multipliers stay."""
        self.b, self.y = b, self.rows(x)
        self.q = 0.5 * (b**2 - np.einsum("ri,ri->r", self.y, self.y))

    def start(self, floor: float, mu: float) -> None:
        """Slacks of at least `floor` b^2, products mu."""
        self.s = np.maximum(self.q, floor * self.b**2)
        self.l = mu / self.s

    def resume(self, s: FloatArray, l: FloatArray) -> None:  # noqa: E741
        """Slacks of another problem, widened to those at x, and its multipliers."""
        self.s, self.l = np.maximum(self.q, s), l

    def residuals(self) -> FloatArray:
        """r (rows,)."""
        r: FloatArray = self.q - self.s
        r[np.abs(r) < ROUNDING] = 0.0
        return r

    def excess(self) -> FloatArray:
        """(rows,) |y| - b."""
        excess: FloatArray = np.sqrt(self.b**2 - 2 * self.q) - self.b
        return excess

    def multipliers(self) -> tuple[FloatArray, FloatArray]:
        """Y = l y (rows, 3) and |Y| (rows,)."""
        Y: FloatArray = self.l[:, None] * self.y
        return Y, self.l * np.sqrt(self.b**2 - 2 * self.q)

    def assemble(self, data: FloatArray) -> None:
        """Add sum l g g^T (x) I + (l/s) (g (x) y)(g (x) y)^T to the matrix's values."""
        self._z = self.l / self.s
        add_hessian(*self._mesh, self._d, self.l, self._z, self.y, self._slots, self._stride, data)

    def push(self, c: FloatArray, r: FloatArray) -> FloatArray:
        """(n, 3) G^T (h y), for products that are to change by c."""
        self._r, self._h, out = r, np.empty(self.degree), np.zeros((self._n, 3))
        add_push(*self._mesh, self._d, c, r, self.s, self.l, self.y, self._h, out)
        return out

    def change(self, dx: FloatArray) -> Change:
        """The rest of the step, after `push` and the linear solve."""
        ds, dl, square = np.empty((3, self.degree))
        point = (self.y, self.s, self.l, self._z, self._r, self._h)
        length = fill_change(*self._mesh, self._d, dx, *point, ds, dl, square)
        return Change(ds, dl, square, float(length))

    def products(self, change: Change | None = None, a: float = 0.0) -> float:
        """<s, l>, after the part a of a step if one is given."""
        if change is None:
            return float(self.s @ self.l)
        return float((self.s + a * change.s) @ (self.l + a * change.l))

    def predictor(self) -> FloatArray:
        """c that would take all products to 0."""
        c: FloatArray = -self.s * self.l
        return c

    def corrector(self, mu: float, affine: Change | None = None) -> FloatArray:
        """c that takes all products to mu, the second-order error of a predictor included."""
        c: FloatArray = mu - self.s * self.l
        return c if affine is None else c - affine.s * affine.l

    def centrality(
        self, c: FloatArray, change: Change, a: float, low: float, high: float
    ) -> FloatArray:
        """c with what moves the products after the part a of a step into [low, high]."""
        after = (self.s + a * change.s) * (self.l + a * change.l)
        more: FloatArray = c + np.maximum(np.clip(after, low, high) - after, -high)
        return more

    def moved(self, change: Change, a: float) -> tuple[FloatArray, FloatArray]:
        """Slacks and multipliers after the part a of a step."""
        return self.s + a * change.s, self.l + a * change.l


@compiled
def fill_rows(elements, gradients, corners, axes, d, x, y):  # type: ignore[no-untyped-def]
    """y = G x."""
    m = len(d)
    F = np.empty((len(axes), 3))
    for e in range(len(elements)):
        gather(elements, gradients, corners, axes, e, x, F)
        for j in range(m):
            for i in range(3):
                y[e * m + j, i] = 0.0
                for c in range(len(axes)):
                    y[e * m + j, i] += d[j, c] * F[c, i]


@compiled
def add_back(elements, gradients, corners, axes, d, Y, out):  # type: ignore[no-untyped-def]
    """Add G^T Y to `out` (n, 3)."""
    m = len(d)
    P = np.empty((len(axes), 3))
    for e in range(len(elements)):
        P[:] = 0.0
        for j in range(m):
            for c in range(len(axes)):
                for i in range(3):
                    P[c, i] += d[j, c] * Y[e * m + j, i]
        spread(elements, gradients, corners, axes, e, P, out)


@compiled(error_model="numpy")
def add_push(elements, gradients, corners, axes, d, c, r, s, l, y, h, out):  # type: ignore[no-untyped-def] # noqa: E741
    """h = (c - l r)/s, and G^T (h y) added to `out` (n, 3)."""
    m = len(d)
    P = np.empty((len(axes), 3))
    for e in range(len(elements)):
        P[:] = 0.0
        for j in range(m):
            k = e * m + j
            h[k] = (c[k] - l[k] * r[k]) / s[k]
            for a in range(len(axes)):
                weight = d[j, a] * h[k]
                for i in range(3):
                    P[a, i] += weight * y[k, i]
        spread(elements, gradients, corners, axes, e, P, out)


@compiled
def add_hessian(elements, gradients, corners, axes, d, l, z, y, slots, stride, data):  # type: ignore[no-untyped-def] # noqa: E741
    """Add sum_i l_i g g^T (x) I + z_i (g (x) y)(g (x) y)^T, by element and material axes."""
    m = len(d)
    H = np.empty((len(axes), len(axes), 6))
    for e in range(len(elements)):
        H[:] = 0.0
        for j in range(m):
            r = e * m + j
            y0, y1, y2 = y[r, 0], y[r, 1], y[r, 2]
            z0, z1, z2 = z[r] * y0, z[r] * y1, z[r] * y2
            h0, h3, h5 = l[r] + z0 * y0, l[r] + z1 * y1, l[r] + z2 * y2
            h1, h2, h4 = z0 * y1, z0 * y2, z1 * y2
            for c in range(len(axes)):
                for f in range(c + 1):
                    weight = d[j, c] * d[j, f]
                    H[c, f, 0] += weight * h0
                    H[c, f, 1] += weight * h1
                    H[c, f, 2] += weight * h2
                    H[c, f, 3] += weight * h3
                    H[c, f, 4] += weight * h4
                    H[c, f, 5] += weight * h5
        spread_symmetric(elements, gradients, corners, axes, e, H, slots, stride, data)


@compiled(error_model="numpy")
def fill_change(elements, gradients, corners, axes, d, dx, y, s, l, z, r, h, ds, dl, square):  # type: ignore[no-untyped-def] # noqa: E741
    """ds = r - y.dy, dl = h + z y.dy, square = |dy|^2/2; the step's length is returned."""
    m = len(d)
    F = np.empty((len(axes), 3))
    length = 1.0
    for e in range(len(elements)):
        gather(elements, gradients, corners, axes, e, dx, F)
        for j in range(m):
            k = e * m + j
            along = across = 0.0
            for i in range(3):
                dy = 0.0
                for c in range(len(axes)):
                    dy += d[j, c] * F[c, i]
                along += y[k, i] * dy
                across += dy * dy
            square[k] = 0.5 * across
            ds[k] = r[k] - along
            dl[k] = h[k] + z[k] * along
            if s[k] < -length * ds[k]:
                length = -s[k] / ds[k]
            if l[k] < -length * dl[k]:
                length = -l[k] / dl[k]
    return length
