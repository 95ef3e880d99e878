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

from typing import NamedTuple

import numpy as np

from solvers.newton_ipm.matrix import Slots, spread_products
from solvers.newton_ipm.mesh import ROUNDING, Change, Sums, add_sums
from solvers.newton_ipm.symmetric import (
    after,
    congruent,
    dot,
    eigenvalues,
    entries,
    gram,
    moved,
    nuclear_norm,
    product,
    reach,
    scale,
    with_eigenvalues,
)
from strainbench import Problem
from strainbench.arrays import FloatArray
from strainbench.compiled import compiled
from strainbench.problem.rows import Rows, gather, spread

ROOT_HALF = 0.5**0.5


class Point(NamedTuple):
    """Where all constraints are: y (e, 2, 3), s, l, r~ (e, 3), and the scaling R, R^-1, d."""

    y: FloatArray
    s: FloatArray
    l: FloatArray  # noqa: E741
    r: FloatArray
    R: FloatArray
    inverse: FloatArray
    d: FloatArray


class ExactCones:
    """All constraints at one point, as in `SampledCones`.

    Attributes
    ----------
    at : the point
    degree : 2e, the number of products
    """

    def __init__(self, problem: Problem, slots: Slots) -> None:
        e = len(problem.elements)
        self._G, self._slots, self.degree = Rows.of_axes(problem), slots, problem.rows
        scaling = (*np.empty((2, e, 2, 2)), np.empty((e, 2)))
        self.b, self.at = problem.bounds, Point(np.empty((e, 2, 3)), *np.empty((3, e, 3)), *scaling)
        self._c, self._h = np.empty((2, e, 3))

    def place(self, b: FloatArray, x: FloatArray) -> None:
        """Go to the positions x; slacks and multipliers stay."""
        self.b = b
        fill_rows(self._G, x, self.at.y)

    def start(self, floor: float, mu: float) -> None:
        """Slacks with eigenvalues of at least `floor` b^2, products mu."""
        s = widened(self.at.y, self.b, np.outer(floor * self.b**2, [1.0, 1.0, 0.0]))
        determinant = s[:, 0] * s[:, 1] - s[:, 2] ** 2
        self.put(s, mu * s[:, [1, 0, 2]] * [1, 1, -1] / determinant[:, None])

    def resume(self, s: FloatArray, l: FloatArray) -> None:  # noqa: E741
        """Slacks of another problem, widened to those at x, and its multipliers."""
        self.put(widened(self.at.y, self.b, s), l)

    def put(self, s: FloatArray, l: FloatArray) -> None:  # noqa: E741
        """These slacks and multipliers, which are not written to."""
        self.at = self.at._replace(s=s, l=l)

    def excess(self) -> FloatArray:
        """(e,) the largest singular value of Y, less b."""
        largest = np.empty(len(self.b))
        stretch(self.at.y, largest)
        return largest - self.b

    def measure(self, y_target: FloatArray, Y: FloatArray, pull: FloatArray) -> Sums:
        """L Y (2e, 3) is filled, and G^T L Y added to `pull` (n, 3)."""
        return measure(self._G, self.at, self.b, y_target, Y.reshape(self.at.y.shape), pull)

    def assemble(self, values: FloatArray) -> float:
        """Add the constraints' part of K to the matrix's values; <S, L>."""
        return assemble(self._G, self._slots, self.at, self.b, values)

    def aim(self, mu: float, affine: Change | None = None) -> None:
        """To take all products to mu, the second-order error of a predictor included."""
        if affine is None:
            aim(self.at.d, mu, self._c)
        else:
            aim_again(self.at, mu, affine.s, affine.l, affine.square, self._c)

    def centre(self, change: Change, a: float, low: float, high: float) -> None:
        """To move, besides, the products after the part a of a step into [low, high]."""
        centre(self.at.d, change.s, change.l, a, low, high, self._c)

    def push(self, force: FloatArray) -> None:
        """Add G^T (H Y) to `force` (n, 3), for the scaled products aimed at."""
        push(self._G, self.at, self._c, self._h, force)

    def change(self, dx: FloatArray) -> Change:
        """The rest of the step, after `push` and the linear solve."""
        ds, dl, square = np.empty((3, *self._c.shape))
        sums = change(self._G, self.at, self._h, dx, ds, dl, square)
        return Change(ds, dl, square, *sums)

    def moved(self, change: Change, a: float) -> tuple[FloatArray, FloatArray]:
        """Slacks and multipliers after the part a of a step."""
        at, back = self.at, self.at.inverse.swapaxes(1, 2)
        return moved(at.s, a, at.R, change.s), moved(at.l, a, back, change.l)


@compiled
def fill_rows(G: Rows, x: FloatArray, y: FloatArray) -> None:
    """y = G x."""
    for e in range(len(G.vertices)):
        gather(G, e, x, y[e])


@compiled
def slack(y: FloatArray, b: float) -> tuple[float, float, float]:
    """Q = (b^2 I - Y Y^T)/2."""
    p, q, r = gram(y)
    return 0.5 * (b * b - p), 0.5 * (b * b - q), -0.5 * r


@compiled
def beyond(q: float, s: float) -> float:
    """q - s, or 0 where that is rounding."""
    return 0.0 if abs(q - s) < ROUNDING else q - s


@compiled
def widened(y: FloatArray, b: FloatArray, s: FloatArray) -> FloatArray:
    """S + (Q - S)_+, above both S and Q: the larger one where they are numbers."""
    out = s.copy()
    for e in range(len(b)):
        q = slack(y[e], b[e])
        more = (q[0] - s[e, 0], q[1] - s[e, 1], q[2] - s[e, 2])
        low, high = eigenvalues(more)
        more = with_eigenvalues(more, max(low, 0.0), max(high, 0.0))
        for i in range(3):
            out[e, i] += more[i]
    return out


@compiled
def stretch(y: FloatArray, largest: FloatArray) -> None:
    """The largest singular values of y (e, 2, 3)."""
    for e in range(len(y)):
        largest[e] = np.sqrt(eigenvalues(gram(y[e]))[1])


@compiled
def measure(
    G: Rows, at: Point, b: FloatArray, y_target: FloatArray, Y: FloatArray, pull: FloatArray
) -> Sums:
    """L Y, G^T L Y added to `pull` (n, 3), and the sums over all constraints."""
    sums = Sums(0.0, 0.0, 0.0, 0.0, -np.inf)
    for e in range(len(b)):
        l, y, linear = entries(at.l, e), at.y[e], 0.0  # noqa: E741
        for i in range(3):
            Y[e, 0, i] = l[0] * y[0, i] + l[2] * y[1, i]
            Y[e, 1, i] = l[2] * y[0, i] + l[1] * y[1, i]
            linear += Y[e, 0, i] * y_target[e, 0, i] + Y[e, 1, i] * y_target[e, 1, i]
        norm = nuclear_norm(Y[e])
        excess = np.sqrt(eigenvalues(gram(y))[1]) - b[e]
        sums = add_sums(sums, b[e], norm, excess, linear)
        spread(G, G.coefficients, e, Y[e], pull)
    return sums


@compiled(error_model="numpy")
def assemble(G: Rows, slots: Slots, at: Point, b: FloatArray, values: FloatArray) -> float:
    """Scale each element and add its blocks; residuals are filled in, and <S, L> is returned."""
    A, total = np.empty((len(G.corners), 3, 3)), 0.0
    for e in range(len(b)):
        s, l, V, y = entries(at.s, e), entries(at.l, e), at.inverse[e], at.y[e]  # noqa: E741
        scale(s, l, at.R[e], V, at.d[e])
        total += dot(s, l)
        q = slack(y, b[e])
        r = congruent(V, (beyond(q[0], s[0]), beyond(q[1], s[1]), beyond(q[2], s[2])))
        for i in range(3):
            at.r[e, i] = r[i]
            p0 = V[0, 0] * y[0, i] + V[0, 1] * y[1, i]
            p1 = V[1, 0] * y[0, i] + V[1, 1] * y[1, i]
            for k in range(len(G.corners)):
                c, d = G.coefficients[e, 0, k], G.coefficients[e, 1, k]
                u0, u1 = V[0, 0] * c + V[0, 1] * d, V[1, 0] * c + V[1, 1] * d
                A[k, i, 0], A[k, i, 1] = p0 * u0, p1 * u1
                A[k, i, 2] = (p0 * u1 + p1 * u0) * ROOT_HALF
        spread_products(G, slots, e, A, l, values)
    return total


@compiled
def aim(d: FloatArray, mu: float, c: FloatArray) -> None:
    """C = mu I - diag(d)^2."""
    for e in range(len(c)):
        c[e, 0], c[e, 1], c[e, 2] = mu - d[e, 0] ** 2, mu - d[e, 1] ** 2, 0.0


@compiled
def aim_again(
    at: Point, mu: float, ds: FloatArray, dl: FloatArray, square: FloatArray, c: FloatArray
) -> None:
    """The same less the product of the predictor's changes, and r~ less R^-1 dY dY^T R^-T/2."""
    aim(at.d, mu, c)
    for e in range(len(c)):
        error = product(entries(ds, e), entries(dl, e))
        short = congruent(at.inverse[e], entries(square, e))
        for i in range(3):
            c[e, i] -= error[i]
            at.r[e, i] -= short[i]


@compiled
def centre(
    d: FloatArray, ds: FloatArray, dl: FloatArray, a: float, low: float, high: float, c: FloatArray
) -> None:
    """Add to c what moves the products after the part a of a step into [low, high]."""
    for e in range(len(c)):
        products = product(after(d, ds, a, e), after(d, dl, a, e))
        p, q = eigenvalues(products)
        to_p = p + max(min(max(p, low), high) - p, -high)
        to_q = q + max(min(max(q, low), high) - q, -high)
        wanted = with_eigenvalues(products, to_p, to_q)
        for i in range(3):
            c[e, i] += wanted[i] - products[i]


@compiled(error_model="numpy")
def push(G: Rows, at: Point, c: FloatArray, h: FloatArray, force: FloatArray) -> None:
    """h = c/((d_p + d_q)/2) - r~, and G^T (R^-T h R^-1 Y) added to `force` (n, 3)."""
    P = np.empty((2, 3))
    for e in range(len(h)):
        d, V, y, r = at.d[e], at.inverse[e], at.y[e], at.r[e]
        h[e, 0] = c[e, 0] / d[0] - r[0]
        h[e, 1] = c[e, 1] / d[1] - r[1]
        h[e, 2] = 2 * c[e, 2] / (d[0] + d[1]) - r[2]
        H = congruent(V.T, entries(h, e))
        for i in range(3):
            P[0, i] = H[0] * y[0, i] + H[2] * y[1, i]
            P[1, i] = H[2] * y[0, i] + H[1] * y[1, i]
        spread(G, G.coefficients, e, P, force)


@compiled(error_model="numpy")
def change(
    G: Rows,
    at: Point,
    h: FloatArray,
    dx: FloatArray,
    ds: FloatArray,
    dl: FloatArray,
    square: FloatArray,
) -> tuple[float, float, float]:
    """dS~ = r~ - t, dL~ = h + t, square = dY dY^T/2; and the last three of `Change`."""
    F, length, first, second = np.empty((2, 3)), 1.0, 0.0, 0.0
    for e in range(len(h)):
        gather(G, e, dx, F)
        y, d, V = at.y[e], at.d[e], at.inverse[e]
        a0 = a1 = a2 = 0.0
        for i in range(3):
            a0 += F[0, i] * y[0, i]
            a1 += F[1, i] * y[1, i]
            a2 += 0.5 * (F[0, i] * y[1, i] + F[1, i] * y[0, i])
        t, r, across = congruent(V, (a0, a1, a2)), at.r[e], gram(F)
        for i in range(3):
            square[e, i] = 0.5 * across[i]
            ds[e, i] = r[i] - t[i]
            dl[e, i] = h[e, i] + t[i]
        u, v = entries(ds, e), entries(dl, e)
        first += d[0] * (u[0] + v[0]) + d[1] * (u[1] + v[1])
        second += dot(u, v)
        length = min(length, reach(d, u), reach(d, v))
    return length, first, second
