"""Algebra of 2 x 2 matrices for compiled loops: symmetric ones are their entries 11, 22, 12."""

from __future__ import annotations

import numpy as np

from strainbench.arrays import FloatArray
from strainbench.compiled import compiled

Symmetric = tuple[float, float, float]


@compiled
def entries(A: FloatArray, e: int) -> Symmetric:
    """Matrix e of A (e, 3)."""
    return A[e, 0], A[e, 1], A[e, 2]


@compiled
def after(d: FloatArray, A: FloatArray, a: float, e: int) -> Symmetric:
    """diag(d) + a A of element e."""
    return d[e, 0] + a * A[e, 0], d[e, 1] + a * A[e, 1], a * A[e, 2]


@compiled
def dot(A: Symmetric, B: Symmetric) -> float:
    """<A, B>: an off-diagonal entry counts twice."""
    return A[0] * B[0] + A[1] * B[1] + 2 * A[2] * B[2]


@compiled
def gram(y: FloatArray) -> Symmetric:
    """Y Y^T of y (2, 3)."""
    a = b = c = 0.0
    for i in range(3):
        a += y[0, i] * y[0, i]
        b += y[1, i] * y[1, i]
        c += y[0, i] * y[1, i]
    return a, b, c


@compiled
def congruent(R: FloatArray, A: Symmetric) -> Symmetric:
    """R A R^T of R (2, 2)."""
    p, q, r, s = R[0, 0], R[0, 1], R[1, 0], R[1, 1]
    return (
        p * p * A[0] + 2 * p * q * A[2] + q * q * A[1],
        r * r * A[0] + 2 * r * s * A[2] + s * s * A[1],
        p * r * A[0] + (p * s + q * r) * A[2] + q * s * A[1],
    )


@compiled
def moved(B: FloatArray, a: float, R: FloatArray, A: FloatArray) -> FloatArray:
    """B + a R A R^T of each element, (e, 3)."""
    out = B.copy()
    for e in range(len(out)):
        more = congruent(R[e], entries(A, e))
        for i in range(3):
            out[e, i] += a * more[i]
    return out


@compiled
def nuclear_norm(y: FloatArray) -> float:
    """The sum of the singular values of y (2, 3), whose product is the length of y_1 x y_2."""
    p, q, _ = gram(y)
    u = y[0, 1] * y[1, 2] - y[0, 2] * y[1, 1]
    v = y[0, 2] * y[1, 0] - y[0, 0] * y[1, 2]
    w = y[0, 0] * y[1, 1] - y[0, 1] * y[1, 0]
    return float(np.sqrt(p + q + 2 * np.sqrt(u * u + v * v + w * w)))


@compiled
def product(A: Symmetric, B: Symmetric) -> Symmetric:
    """(A B + B A)/2."""
    cross = A[2] * B[2]
    mixed = ((A[0] + A[1]) * B[2] + A[2] * (B[0] + B[1])) / 2
    return A[0] * B[0] + cross, A[1] * B[1] + cross, mixed


@compiled
def eigenvalues(A: Symmetric) -> tuple[float, float]:
    """The smaller and the larger one."""
    mean, half = (A[0] + A[1]) / 2, (A[0] - A[1]) / 2
    apart = np.sqrt(half * half + A[2] * A[2])  # hypot takes many times as long
    return mean - apart, mean + apart


@compiled
def with_eigenvalues(A: Symmetric, at_low: float, at_high: float) -> Symmetric:
    """A with others: linear in A and I, the line through the new ones at the old ones."""
    low, high = eigenvalues(A)
    slope = (at_high - at_low) / (high - low) if high > low else 0.0
    shift = at_high - slope * high
    return slope * A[0] + shift, slope * A[1] + shift, slope * A[2]


@compiled(error_model="numpy")
def reach(d: FloatArray, change: Symmetric) -> float:
    """The largest a for which diag(d) + a change has no negative eigenvalue."""
    a, b = change[0] / d[0], change[1] / d[1]
    least, _ = eigenvalues((a, b, change[2] / np.sqrt(d[0] * d[1])))
    return -1 / least if least < 0 else np.inf


@compiled(error_model="numpy")
def scale(s: Symmetric, l: Symmetric, R: FloatArray, inverse: FloatArray, d: FloatArray) -> None:  # noqa: E741
    """Fill in R, its inverse and d with R^-1 S R^-T = R^T L R = diag(d), of one element.

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
