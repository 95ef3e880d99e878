"""The loops of exact limits over tetrahedra: 3 x 3 matrices, stored whole."""

from __future__ import annotations

import numpy as np

from solvers.newton_ipm.jacobi import (
    congruent,
    diagonalise,
    dot,
    product,
    reach,
    scale,
    singular_values,
)
from solvers.newton_ipm.matrix import Slots
from solvers.newton_ipm.mesh import ROUNDING, Point, Sums, add_sums
from strainbench.arrays import FloatArray
from strainbench.compiled import compiled
from strainbench.problem.rows import Rows, gather, spread

ROOT_HALF = 0.5**0.5
IDENTITY = np.eye(3)


def inverse_times(s: FloatArray, mu: float) -> FloatArray:
    """mu S^-1 of each element."""
    inverse: FloatArray = mu * np.asarray(np.linalg.inv(s), dtype=np.float64)
    return inverse


@compiled
def fill_rows(G: Rows, x: FloatArray, y: FloatArray) -> None:
    """y = G x."""
    for e in range(len(G.vertices)):
        gather(G, e, x, y[e])


@compiled
def slack(y: FloatArray, b: float, s: FloatArray, out: FloatArray) -> None:
    """Q - S with Q = (b^2 I - Y Y^T)/2, entries that are rounding being 0."""
    for i in range(3):
        for j in range(i + 1):
            q = -0.5 * (y[i, 0] * y[j, 0] + y[i, 1] * y[j, 1] + y[i, 2] * y[j, 2])
            q += 0.5 * b * b if i == j else 0.0
            beyond = q - s[i, j]
            out[i, j] = out[j, i] = 0.0 if abs(beyond) < ROUNDING else beyond


@compiled
def add_turned(V: FloatArray, values: FloatArray, out: FloatArray) -> None:
    """Add V diag(values) V^T to `out`."""
    for i in range(3):
        for j in range(3):
            for k in range(3):
                out[i, j] += V[i, k] * values[k] * V[j, k]


@compiled
def widened(y: FloatArray, b: FloatArray, s: FloatArray) -> FloatArray:
    """S + (Q - S)_+, above both S and Q: the larger one where they are numbers."""
    out, A, V, values = s.copy(), np.empty((3, 3)), np.empty((3, 3)), np.empty(3)
    for e in range(len(b)):
        slack(y[e], b[e], s[e], A)
        diagonalise(A, V)
        for i in range(3):
            values[i] = max(A[i, i], 0.0)
        add_turned(V, values, out[e])
    return out


@compiled
def stretch(y: FloatArray, largest: FloatArray) -> None:
    """The largest singular values of y (e, 3, 3)."""
    M, V = np.zeros((3, 3)), np.zeros((3, 3))
    for e in range(len(y)):
        largest[e], _ = singular_values(y[e], M, V)


@compiled
def measure(
    G: Rows, at: Point, b: FloatArray, y_target: FloatArray, Y: FloatArray, pull: FloatArray
) -> Sums:
    """L Y, G^T L Y added to `pull` (n, 3), and the sums over all constraints."""
    sums, M, V = Sums(0.0, 0.0, 0.0, 0.0, -np.inf), np.zeros((3, 3)), np.zeros((3, 3))
    for e in range(len(b)):
        l, y, linear = at.l[e], at.y[e], 0.0  # noqa: E741
        for a in range(3):
            for i in range(3):
                Y[e, a, i] = l[a, 0] * y[0, i] + l[a, 1] * y[1, i] + l[a, 2] * y[2, i]
                linear += Y[e, a, i] * y_target[e, a, i]
        _, norm = singular_values(Y[e], M, V)
        largest, _ = singular_values(y, M, V)
        sums = add_sums(sums, b[e], norm, largest - b[e], linear)
        spread(G, G.coefficients, e, Y[e], pull)
    return sums


@compiled
def times(V: FloatArray, A: FloatArray, out: FloatArray) -> None:
    """V A of A (3, k)."""
    for i in range(3):
        for k in range(A.shape[1]):
            out[i, k] = V[i, 0] * A[0, k] + V[i, 1] * A[1, k] + V[i, 2] * A[2, k]


@compiled(error_model="numpy")
def assemble(G: Rows, slots: Slots, at: Point, b: FloatArray, values: FloatArray) -> float:
    """Scale each element and add its blocks; residuals are filled in, and <S, L> is returned."""
    corners, total = len(G.corners), 0.0
    A, u, p, work = (
        np.empty((corners, 3, 6)),
        np.empty((3, corners)),
        np.empty((3, 3)),
        np.empty((3, 3, 3)),
    )
    for e in range(len(b)):
        s, l, V = at.s[e], at.l[e], at.inverse[e]  # noqa: E741
        scale(s, l, at.R[e], V, at.d[e], work)
        total += dot(s, l)
        slack(at.y[e], b[e], s, p)
        congruent(V, p, at.r[e])
        times(V, at.y[e], p)
        times(V, G.coefficients[e], u)
        for k in range(corners):
            for i in range(3):
                A[k, i, 0], A[k, i, 1] = p[0, i] * u[0, k], p[1, i] * u[1, k]
                A[k, i, 2] = p[2, i] * u[2, k]
                A[k, i, 3] = (p[0, i] * u[1, k] + p[1, i] * u[0, k]) * ROOT_HALF
                A[k, i, 4] = (p[0, i] * u[2, k] + p[2, i] * u[0, k]) * ROOT_HALF
                A[k, i, 5] = (p[1, i] * u[2, k] + p[2, i] * u[1, k]) * ROOT_HALF
        spread_products(G, slots, e, A, l, values)
    return total


@compiled
def spread_products(
    G: Rows,
    at: Slots,
    e: int,
    A: FloatArray,
    l: FloatArray,  # noqa: E741
    values: FloatArray,
) -> None:
    """Add A_a A_b^T + (B_a^T L B_b) I, of A (k, 3, 6), to the block of each vertex pair a, b."""
    B = G.coefficients[e]
    for b in range(len(G.corners)):
        width = at.width[G.vertices[e, b]]
        l0 = l[0, 0] * B[0, b] + l[0, 1] * B[1, b] + l[0, 2] * B[2, b]
        l1 = l[1, 0] * B[0, b] + l[1, 1] * B[1, b] + l[1, 2] * B[2, b]
        l2 = l[2, 0] * B[0, b] + l[2, 1] * B[1, b] + l[2, 2] * B[2, b]
        for a in range(len(G.corners)):
            first = at.first[e, a, b]
            if first < 0:
                continue
            for j in range(3):
                column = first + j * width - j * (j + 1) // 2
                for i in range(0 if a != b else j, 3):
                    k = 0.0
                    for m in range(6):
                        k += A[a, i, m] * A[b, j, m]
                    values[column + i] += k
                values[column + j] += B[0, a] * l0 + B[1, a] * l1 + B[2, a] * l2


@compiled
def aim(d: FloatArray, mu: float, c: FloatArray) -> None:
    """C = mu I - diag(d)^2."""
    c[:] = 0.0
    for e in range(len(c)):
        for i in range(3):
            c[e, i, i] = mu - d[e, i] ** 2


@compiled
def aim_again(
    at: Point, mu: float, ds: FloatArray, dl: FloatArray, square: FloatArray, c: FloatArray
) -> None:
    """The same less the product of the predictor's changes, and r~ less R^-1 dY dY^T R^-T/2."""
    aim(at.d, mu, c)
    error, short = np.empty((3, 3)), np.empty((3, 3))
    for e in range(len(c)):
        product(ds[e], dl[e], error)
        congruent(at.inverse[e], square[e], short)
        for i in range(3):
            for j in range(3):
                c[e, i, j] -= error[i, j]
                at.r[e, i, j] -= short[i, j]


@compiled
def centre(
    d: FloatArray, ds: FloatArray, dl: FloatArray, a: float, low: float, high: float, c: FloatArray
) -> None:
    """Add to c what moves the products after the part a of a step into [low, high]."""
    S, L, products = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    V, more = np.empty((3, 3)), np.empty(3)
    for e in range(len(c)):
        for i in range(3):
            for j in range(3):
                own = d[e, i] if i == j else 0.0
                S[i, j], L[i, j] = own + a * ds[e, i, j], own + a * dl[e, i, j]
        product(S, L, products)
        diagonalise(products, V)
        for i in range(3):
            p = products[i, i]
            more[i] = max(min(max(p, low), high) - p, -high)
        add_turned(V, more, c[e])


@compiled(error_model="numpy")
def push(G: Rows, at: Point, c: FloatArray, h: FloatArray, force: FloatArray) -> None:
    """h = c/((d_p + d_q)/2) - r~, and G^T (R^-T h R^-1 Y) added to `force` (n, 3)."""
    H, P = np.empty((3, 3)), np.empty((3, 3))
    for e in range(len(h)):
        d = at.d[e]
        for i in range(3):
            for j in range(3):
                h[e, i, j] = 2 * c[e, i, j] / (d[i] + d[j]) - at.r[e, i, j]
        congruent(at.inverse[e].T, h[e], H)
        times(H, at.y[e], P)
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
    F, t = np.empty((3, 3)), np.empty((3, 3))
    A, V = np.empty((3, 3)), np.empty((3, 3))
    length, first, second = 1.0, 0.0, 0.0
    for e in range(len(h)):
        gather(G, e, dx, F)
        y, d = at.y[e], at.d[e]
        for i in range(3):
            for j in range(3):
                across = both = 0.0
                for k in range(3):
                    both += F[i, k] * F[j, k]
                    across += F[i, k] * y[j, k] + F[j, k] * y[i, k]
                square[e, i, j], A[i, j] = 0.5 * both, 0.5 * across
        congruent(at.inverse[e], A, t)
        for i in range(3):
            for j in range(3):
                ds[e, i, j] = at.r[e, i, j] - t[i, j]
                dl[e, i, j] = h[e, i, j] + t[i, j]
            first += d[i] * (ds[e, i, i] + dl[e, i, i])
        second += dot(ds[e], dl[e])
        length = min(length, reach(d, ds[e], A, V), reach(d, dl[e], A, V))
    return length, first, second


@compiled
def moved(B: FloatArray, a: float, R: FloatArray, A: FloatArray) -> FloatArray:
    """B + a R A R^T of each element, (e, 3, 3)."""
    out, more = B.copy(), np.empty((3, 3))
    for e in range(len(out)):
        congruent(R[e], A[e], more)
        for i in range(3):
            for j in range(3):
                out[e, i, j] += a * more[i, j]
    return out
