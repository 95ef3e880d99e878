"""Sampled limits: q_i = (b_i^2 - |y_i|^2)/2 >= 0, one slack and one multiplier a constraint."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from solvers.newton_ipm.matrix import Slots, spread_symmetric
from solvers.newton_ipm.mesh import ROUNDING, Change, Sums, add_sums
from strainbench import Problem
from strainbench.arrays import FloatArray
from strainbench.compiled import compiled
from strainbench.problem.rows import Rows, gather, spread


class Mesh(NamedTuple):
    """F^T by element, and the limited directions d (m, dim): y = F d."""

    G: Rows
    d: FloatArray


class Point(NamedTuple):
    """Where all constraints are: rows y (rows, 3), slacks s, multipliers l, residuals r = q - s."""

    y: FloatArray
    s: FloatArray
    l: FloatArray  # noqa: E741
    r: FloatArray


class SampledCones:
    """All constraints at one point.

    A Newton step changes s by r - y.dy and l by h + (l/s)(y.dy) with h = (c - l r)/s, where c is
    what the products s l are to change by.

    Attributes
    ----------
    at : the point
    degree : number of products s l
    """

    def __init__(self, problem: Problem, slots: Slots) -> None:
        rows = self.degree = problem.rows
        directions = np.ascontiguousarray(problem.limits.directions)
        self._mesh, self._slots = Mesh(Rows.of_axes(problem), directions), slots
        self.b, self.at = problem.bounds, Point(np.empty((rows, 3)), *np.empty((3, rows)))
        self._c, self._h = np.empty((2, rows))

    def place(self, b: FloatArray, x: FloatArray) -> None:
        """Go to the positions x; slacks and multipliers stay."""
        self.b = b
        fill_rows(self._mesh, x, self.at.y)

    def _q(self) -> FloatArray:
        q: FloatArray = 0.5 * (self.b**2 - np.einsum("ri,ri->r", self.at.y, self.at.y))
        return q

    def start(self, floor: float, mu: float) -> None:
        """Slacks of at least `floor` b^2, products mu."""
        s = np.maximum(self._q(), floor * self.b**2)
        self.put(s, mu / s)

    def resume(self, s: FloatArray, l: FloatArray) -> None:  # noqa: E741
        """Slacks of another problem, widened to those at x, and its multipliers."""
        self.put(np.maximum(self._q(), s), l)

    def put(self, s: FloatArray, l: FloatArray) -> None:  # noqa: E741
        """These slacks and multipliers, which are not written to."""
        self.at = self.at._replace(s=s, l=l)

    def excess(self) -> FloatArray:
        """(rows,) |y| - b."""
        excess: FloatArray = np.sqrt(np.einsum("ri,ri->r", self.at.y, self.at.y)) - self.b
        return excess

    def measure(self, y_target: FloatArray, Y: FloatArray, pull: FloatArray) -> Sums:
        """Y = l y (rows, 3) is filled, and G^T Y added to `pull` (n, 3)."""
        return measure(self._mesh, self.at, self.b, y_target, Y, pull)

    def assemble(self, values: FloatArray) -> float:
        """Add sum l g g^T (x) I + (l/s) (g (x) y)(g (x) y)^T to the matrix's values; <s, l>."""
        return assemble(self._mesh, self._slots, self.at, self.b, values)

    def aim(self, mu: float, affine: Change | None = None) -> None:
        """To take all products to mu, the second-order error of a predictor included."""
        if affine is None:
            aim(self.at, mu, self._c)
        else:
            aim_again(self.at, mu, affine.s, affine.l, affine.square, self._c)

    def centre(self, change: Change, a: float, low: float, high: float) -> None:
        """To move, besides, the products after the part a of a step into [low, high]."""
        centre(self.at, change.s, change.l, a, low, high, self._c)

    def push(self, force: FloatArray) -> None:
        """Add G^T (h y) to `force` (n, 3), for the products aimed at."""
        push(self._mesh, self.at, self._c, self._h, force)

    def change(self, dx: FloatArray) -> Change:
        """The rest of the step, after `push` and the linear solve."""
        ds, dl, square = np.empty((3, self.degree))
        sums = change(self._mesh, self.at, self._h, dx, ds, dl, square)
        return Change(ds, dl, square, *sums)

    def moved(self, change: Change, a: float) -> tuple[FloatArray, FloatArray]:
        """Slacks and multipliers after the part a of a step."""
        return self.at.s + a * change.s, self.at.l + a * change.l


@compiled
def fill_rows(mesh: Mesh, x: FloatArray, y: FloatArray) -> None:
    """y = G x."""
    G, d = mesh
    m = len(d)
    F = np.empty((len(G.axes), 3))
    for e in range(len(G.vertices)):
        gather(G, e, x, F)
        for j in range(m):
            for i in range(3):
                y[e * m + j, i] = 0.0
                for c in range(len(G.axes)):
                    y[e * m + j, i] += d[j, c] * F[c, i]


@compiled
def measure(
    mesh: Mesh, at: Point, b: FloatArray, y_target: FloatArray, Y: FloatArray, pull: FloatArray
) -> Sums:
    """Y = l y, G^T Y added to `pull` (n, 3), and the sums over all constraints."""
    G, d = mesh
    m = len(d)
    P = np.empty((len(G.axes), 3))
    sums = Sums(0.0, 0.0, 0.0, 0.0, -np.inf)
    for e in range(len(G.vertices)):
        P[:] = 0.0
        for j in range(m):
            k = e * m + j
            square = linear = 0.0
            for i in range(3):
                Y[k, i] = at.l[k] * at.y[k, i]
                square += at.y[k, i] * at.y[k, i]
                linear += Y[k, i] * y_target[k, i]
                for c in range(len(G.axes)):
                    P[c, i] += d[j, c] * Y[k, i]
            length = np.sqrt(square)
            sums = add_sums(sums, b[k], at.l[k] * length, length - b[k], linear)
        spread(G, G.coefficients, e, P, pull)
    return sums


@compiled(error_model="numpy")
def assemble(mesh: Mesh, slots: Slots, at: Point, b: FloatArray, values: FloatArray) -> float:
    """Add sum_i l g g^T (x) I + (l/s) (g (x) y)(g (x) y)^T, by element and material axes.

    The residuals are filled in on the way, and <s, l> is returned.
    """
    G, d = mesh
    m = len(d)
    H = np.empty((len(G.axes), len(G.axes), 6))
    total = 0.0
    for e in range(len(G.vertices)):
        H[:] = 0.0
        for j in range(m):
            k = e * m + j
            l, s = at.l[k], at.s[k]  # noqa: E741
            y0, y1, y2 = at.y[k, 0], at.y[k, 1], at.y[k, 2]
            r = 0.5 * (b[k] * b[k] - (y0 * y0 + y1 * y1 + y2 * y2)) - s
            at.r[k] = 0.0 if abs(r) < ROUNDING else r
            total += s * l
            z = l / s
            z0, z1, z2 = z * y0, z * y1, z * y2
            h0, h3, h5 = l + z0 * y0, l + z1 * y1, l + z2 * y2
            h1, h2, h4 = z0 * y1, z0 * y2, z1 * y2
            for c in range(len(G.axes)):
                for f in range(c + 1):
                    weight = d[j, c] * d[j, f]
                    H[c, f, 0] += weight * h0
                    H[c, f, 1] += weight * h1
                    H[c, f, 2] += weight * h2
                    H[c, f, 3] += weight * h3
                    H[c, f, 4] += weight * h4
                    H[c, f, 5] += weight * h5
        spread_symmetric(G, slots, e, H, values)
    return total


@compiled
def aim(at: Point, mu: float, c: FloatArray) -> None:
    """c = mu - s l."""
    for k in range(len(c)):
        c[k] = mu - at.s[k] * at.l[k]


@compiled
def aim_again(
    at: Point, mu: float, ds: FloatArray, dl: FloatArray, square: FloatArray, c: FloatArray
) -> None:
    """c = mu - s l - ds dl of the predictor's step, and r less |dy|^2/2."""
    for k in range(len(c)):
        c[k] = mu - at.s[k] * at.l[k] - ds[k] * dl[k]
        at.r[k] -= square[k]


@compiled
def centre(
    at: Point, ds: FloatArray, dl: FloatArray, a: float, low: float, high: float, c: FloatArray
) -> None:
    """Add to c what moves the products after the part a of a step into [low, high]."""
    for k in range(len(c)):
        after = (at.s[k] + a * ds[k]) * (at.l[k] + a * dl[k])
        c[k] += max(min(max(after, low), high) - after, -high)


@compiled(error_model="numpy")
def push(mesh: Mesh, at: Point, c: FloatArray, h: FloatArray, force: FloatArray) -> None:
    """h = (c - l r)/s, and G^T (h y) added to `force` (n, 3)."""
    G, d = mesh
    m = len(d)
    P = np.empty((len(G.axes), 3))
    for e in range(len(G.vertices)):
        P[:] = 0.0
        for j in range(m):
            k = e * m + j
            h[k] = (c[k] - at.l[k] * at.r[k]) / at.s[k]
            for a in range(len(G.axes)):
                weight = d[j, a] * h[k]
                for i in range(3):
                    P[a, i] += weight * at.y[k, i]
        spread(G, G.coefficients, e, P, force)


@compiled(error_model="numpy")
def change(
    mesh: Mesh,
    at: Point,
    h: FloatArray,
    dx: FloatArray,
    ds: FloatArray,
    dl: FloatArray,
    square: FloatArray,
) -> tuple[float, float, float]:
    """ds = r - y.dy, dl = h + (l/s) y.dy, square = |dy|^2/2; and the last three of `Change`."""
    G, d = mesh
    m = len(d)
    F = np.empty((len(G.axes), 3))
    length, first, second = 1.0, 0.0, 0.0
    for e in range(len(G.vertices)):
        gather(G, e, dx, F)
        for j in range(m):
            k = e * m + j
            along = across = 0.0
            for i in range(3):
                dy = 0.0
                for c in range(len(G.axes)):
                    dy += d[j, c] * F[c, i]
                along += at.y[k, i] * dy
                across += dy * dy
            s, l = at.s[k], at.l[k]  # noqa: E741
            square[k] = 0.5 * across
            ds[k] = u = at.r[k] - along
            dl[k] = v = h[k] + l / s * along
            first += s * v + l * u
            second += u * v
            if s < -length * u:
                length = -s / u
            if l < -length * v:
                length = -l / v
    return length, first, second
