"""The loops of exact limits over triangles: 2 x 2 matrices, in closed form.

Symmetric ones are stored as their entries 11, 22, 12.
"""

from __future__ import annotations

import numpy as np

from solvers.newton_ipm.matrix import Slots, spread_products
from solvers.newton_ipm.mesh import ROUNDING, Point, Sums, add_sums
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
from strainbench.arrays import FloatArray
from strainbench.compiled import compiled
from strainbench.problem.rows import Rows, gather, spread

ROOT_HALF = 0.5**0.5
IDENTITY = np.array([1.0, 1.0, 0.0])

__all__ = [
    "IDENTITY",
    "aim",
    "aim_again",
    "assemble",
    "centre",
    "change",
    "fill_rows",
    "inverse_times",
    "measure",
    "moved",
    "push",
    "stretch",
    "widened",
]


def inverse_times(s: FloatArray, mu: float) -> FloatArray:
    """mu S^-1 of each element."""
    determinant = s[:, 0] * s[:, 1] - s[:, 2] ** 2
    inverse: FloatArray = mu * s[:, [1, 0, 2]] * [1, 1, -1] / determinant[:, None]
    return inverse


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
