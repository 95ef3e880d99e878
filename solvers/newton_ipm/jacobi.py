"""Algebra of 3 x 3 matrices for compiled loops, by Jacobi's rotations (Demmel and Veselic 1992).

They find small singular values as accurately as large ones, and axes where values are equal.
"""

from __future__ import annotations

import numpy as np

from strainbench.arrays import FloatArray
from strainbench.compiled import compiled

SWEEPS = 15
"""At most; quadratic convergence takes 4 to 6."""
EPS = 2.3e-16


@compiled
def rotation(p: float, q: float, off: float) -> tuple[float, float]:
    """cos and sin that make (p, off; off, q) diagonal."""
    zeta = 0.5 * (q - p) / off
    tangent = 1 / (abs(zeta) + np.sqrt(1 + zeta * zeta))
    if zeta < 0:
        tangent = -tangent
    cos = 1 / np.sqrt(1 + tangent * tangent)
    return cos, tangent * cos


@compiled
def turn(A: FloatArray, p: int, q: int, cos: float, sin: float) -> None:
    """Rotate columns p and q."""
    for i in range(3):
        first, second = A[i, p], A[i, q]
        A[i, p], A[i, q] = cos * first - sin * second, sin * first + cos * second


@compiled
def orthogonalise(M: FloatArray, C: FloatArray) -> None:
    """Rotate the columns of M until they are orthogonal, and those of C with them."""
    for _ in range(SWEEPS):
        calm = True
        for p in range(2):
            for q in range(p + 1, 3):
                a = b = c = 0.0
                for i in range(3):
                    a += M[i, p] * M[i, p]
                    b += M[i, q] * M[i, q]
                    c += M[i, p] * M[i, q]
                if abs(c) > EPS * np.sqrt(a * b):
                    calm = False
                    cos, sin = rotation(a, b, c)
                    turn(M, p, q, cos, sin)
                    turn(C, p, q, cos, sin)
        if calm:
            return


@compiled
def singular_values(y: FloatArray, M: FloatArray, V: FloatArray) -> tuple[float, float]:
    """The largest one of y (3, 3), and their sum; M and V are written over."""
    M[:] = y
    orthogonalise(M, V)
    largest = total = 0.0
    for j in range(3):
        length = np.sqrt(M[0, j] ** 2 + M[1, j] ** 2 + M[2, j] ** 2)
        total += length
        largest = length if length > largest or length != length else largest
    return largest, total


@compiled
def diagonalise(A: FloatArray, V: FloatArray) -> None:
    """Make the symmetric A diagonal; the columns of V are its axes."""
    for i in range(3):
        for j in range(3):
            V[i, j] = 1.0 if i == j else 0.0
    for _ in range(SWEEPS):
        calm = True
        for p in range(2):
            for q in range(p + 1, 3):
                if abs(A[p, q]) > EPS * (abs(A[p, p]) + abs(A[q, q])):
                    calm = False
                    cos, sin = rotation(A[p, p], A[q, q], A[p, q])
                    turn(A, p, q, cos, sin)
                    turn(A.T, p, q, cos, sin)
                    A[p, q] = A[q, p] = 0.0
                    turn(V, p, q, cos, sin)
        if calm:
            return


@compiled
def congruent(R: FloatArray, A: FloatArray, out: FloatArray) -> None:
    """R A R^T of a symmetric A, which `out` is not."""
    for i in range(3):
        t0 = R[i, 0] * A[0, 0] + R[i, 1] * A[1, 0] + R[i, 2] * A[2, 0]
        t1 = R[i, 0] * A[0, 1] + R[i, 1] * A[1, 1] + R[i, 2] * A[2, 1]
        t2 = R[i, 0] * A[0, 2] + R[i, 1] * A[1, 2] + R[i, 2] * A[2, 2]
        for j in range(i + 1):
            out[i, j] = out[j, i] = t0 * R[j, 0] + t1 * R[j, 1] + t2 * R[j, 2]


@compiled
def product(A: FloatArray, B: FloatArray, out: FloatArray) -> None:
    """(A B + B A)/2 of symmetric A and B."""
    for i in range(3):
        for j in range(i + 1):
            total = 0.0
            for k in range(3):
                total += A[i, k] * B[k, j] + B[i, k] * A[k, j]
            out[i, j] = out[j, i] = 0.5 * total


@compiled
def dot(A: FloatArray, B: FloatArray) -> float:
    """<A, B>."""
    total = 0.0
    for i in range(3):
        for j in range(3):
            total += A[i, j] * B[i, j]
    return total


@compiled(error_model="numpy")
def reach(d: FloatArray, change: FloatArray, A: FloatArray, V: FloatArray) -> float:
    """The largest a for which diag(d) + a change has no negative eigenvalue."""
    for i in range(3):
        for j in range(3):
            A[i, j] = change[i, j] / np.sqrt(d[i] * d[j])
    diagonalise(A, V)
    least = min(A[0, 0], A[1, 1], A[2, 2])
    return -1 / least if least < 0 else np.inf


@compiled(error_model="numpy")
def cholesky(A: FloatArray, C: FloatArray) -> None:
    """The lower C with C C^T = A; NaN where A is not positive definite."""
    C[:] = 0.0
    C[0, 0] = np.sqrt(A[0, 0])
    C[1, 0], C[2, 0] = A[1, 0] / C[0, 0], A[2, 0] / C[0, 0]
    C[1, 1] = np.sqrt(A[1, 1] - C[1, 0] * C[1, 0])
    C[2, 1] = (A[2, 1] - C[2, 0] * C[1, 0]) / C[1, 1]
    C[2, 2] = np.sqrt(A[2, 2] - C[2, 0] * C[2, 0] - C[2, 1] * C[2, 1])


@compiled(error_model="numpy")
def scale(
    s: FloatArray,
    l: FloatArray,  # noqa: E741
    R: FloatArray,
    inverse: FloatArray,
    d: FloatArray,
    work: FloatArray,
) -> None:
    """Fill in R, its inverse and d with R^-1 S R^-T = R^T L R = diag(d), of one element.

    With S = C C^T, L = E E^T and E^T C = U diag(d) V^T, R is C V diag(d)^-1/2, its inverse
    diag(d)^-1/2 U^T E^T. `work` (3, 3, 3) is written over.
    """
    C, E, M = work[0], work[1], work[2]
    cholesky(s, C)
    cholesky(l, E)
    for i in range(3):
        for j in range(3):
            M[i, j] = E[0, i] * C[0, j] + E[1, i] * C[1, j] + E[2, i] * C[2, j]
    orthogonalise(M, C)
    for j in range(3):
        d[j] = np.sqrt(M[0, j] ** 2 + M[1, j] ** 2 + M[2, j] ** 2)
        root = np.sqrt(d[j])
        for i in range(3):
            R[i, j] = C[i, j] / root
            u = E[i, 0] * M[0, j] + E[i, 1] * M[1, j] + E[i, 2] * M[2, j]
            inverse[j, i] = u / (d[j] * root)
