"""Constant-strain triangles with St Venant-Kirchhoff material in plane stress.

Energy of an element: w (lam/2 tr(E)^2 + mu E:E), E = (F^T F - I)/2, w = thickness x rest area,
lam = E nu / (1 - nu^2), mu = E / (2 (1 + nu)). Its gradient for vertex k is w F S B_k with
S = lam tr(E) I + 2 mu E.

The Hessian in F has six eigenpairs in closed form. With F = U diag(s) V^T, E_i = (s_i^2 - 1)/2
and S_i = lam tr(E) + 2 mu E_i they are: two in span{u1 v1^T, u2 v2^T} (the scalings, a 2 x 2
block), the in-plane twist and flip, and the out-of-plane n v1^T and n v2^T. Clamping each at 0
gives the nearest positive semidefinite matrix.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from strainbench.limits import FloatArray
from strainbench.problem import IntArray


@njit(cache=True)
def deformation_gradient(x: FloatArray, triangle: IntArray, B: FloatArray) -> FloatArray:
    """F (3, 2) of one triangle: sum_k x_k B_k."""
    F = np.zeros((3, 2))
    for k in range(3):
        for a in range(3):
            F[a, 0] += x[triangle[k], a] * B[k, 0]
            F[a, 1] += x[triangle[k], a] * B[k, 1]
    return F


@njit(cache=True)
def singular_frames(F: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Thin SVD of a 3 x 2 matrix: U (3, 3) with the normal as third column, s (2,), V (2, 2)."""
    c00 = F[0, 0] ** 2 + F[1, 0] ** 2 + F[2, 0] ** 2
    c11 = F[0, 1] ** 2 + F[1, 1] ** 2 + F[2, 1] ** 2
    c01 = F[0, 0] * F[0, 1] + F[1, 0] * F[1, 1] + F[2, 0] * F[2, 1]
    angle = 0.5 * np.arctan2(2 * c01, c00 - c11)
    V = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    U = np.zeros((3, 3))
    s = np.zeros(2)
    for i in range(2):
        for a in range(3):
            U[a, i] = F[a, 0] * V[0, i] + F[a, 1] * V[1, i]
        s[i] = np.sqrt(U[0, i] ** 2 + U[1, i] ** 2 + U[2, i] ** 2)
        length = s[i]
        if length < 1e-12:  # a collapsed direction: any unit vector across the first serves
            U[:, i] = 0.0
            axis = np.argmin(np.abs(U[:, 0])) if i == 1 else 0
            along = U[axis, 0] if i == 1 else 0.0
            for a in range(3):
                U[a, i] = (1.0 if a == axis else 0.0) - along * U[a, 0] * i
            length = np.sqrt(1.0 - along**2)
        for a in range(3):
            U[a, i] /= length
    U[:, 2] = np.cross(U[:, 0], U[:, 1])
    return U, s, V


@njit(cache=True)
def add_membrane_gradient(
    x: FloatArray,
    triangles: IntArray,
    gradients: FloatArray,
    weights: FloatArray,
    lam: float,
    mu: float,
    out: FloatArray,
) -> float:
    """Add the gradient (n, 3) [N] to `out`; return the energy [J]. `weights` are [m^3]."""
    energy = 0.0
    for e in range(len(triangles)):
        B = gradients[e]
        F = deformation_gradient(x, triangles[e], B)
        e00 = 0.5 * (F[0, 0] ** 2 + F[1, 0] ** 2 + F[2, 0] ** 2 - 1)
        e11 = 0.5 * (F[0, 1] ** 2 + F[1, 1] ** 2 + F[2, 1] ** 2 - 1)
        e01 = 0.5 * (F[0, 0] * F[0, 1] + F[1, 0] * F[1, 1] + F[2, 0] * F[2, 1])
        trace = e00 + e11
        energy += weights[e] * (0.5 * lam * trace**2 + mu * (e00**2 + e11**2 + 2 * e01**2))
        s00, s11, s01 = lam * trace + 2 * mu * e00, lam * trace + 2 * mu * e11, 2 * mu * e01
        for k in range(3):
            t0 = weights[e] * (s00 * B[k, 0] + s01 * B[k, 1])
            t1 = weights[e] * (s01 * B[k, 0] + s11 * B[k, 1])
            for a in range(3):
                out[triangles[e, k], a] += F[a, 0] * t0 + F[a, 1] * t1
    return energy


@njit(cache=True)
def eigenpairs(F: FloatArray, lam: float, mu: float) -> tuple[FloatArray, FloatArray]:
    """Eigenvalues (6,) [Pa] and eigenmatrices (6, 3, 2) of the energy density's Hessian in F."""
    U, s, V = singular_frames(F)
    E = 0.5 * (s**2 - 1)
    S = lam * (E[0] + E[1]) + 2 * mu * E
    values = np.zeros(6)
    Q = np.zeros((6, 3, 2))
    w00 = S[0] + s[0] ** 2 * (lam + 2 * mu)
    w11 = S[1] + s[1] ** 2 * (lam + 2 * mu)
    w01 = lam * s[0] * s[1]
    mean, half = 0.5 * (w00 + w11), 0.5 * (w00 - w11)
    radius = np.sqrt(half**2 + w01**2)
    angle = 0.5 * np.arctan2(w01, half)
    cosine, sine = np.cos(angle), np.sin(angle)
    values[0], values[1] = mean + radius, mean - radius
    trace = lam * (E[0] + E[1])
    values[2] = trace + mu * (s[0] ** 2 + s[0] * s[1] + s[1] ** 2 - 1)
    values[3] = trace + mu * (s[0] ** 2 - s[0] * s[1] + s[1] ** 2 - 1)
    values[4], values[5] = S[0], S[1]
    root = np.sqrt(0.5)
    for a in range(3):
        for b in range(2):
            d0, d1 = U[a, 0] * V[b, 0], U[a, 1] * V[b, 1]
            cross, back = U[a, 0] * V[b, 1], U[a, 1] * V[b, 0]
            Q[0, a, b] = cosine * d0 + sine * d1
            Q[1, a, b] = -sine * d0 + cosine * d1
            Q[2, a, b] = root * (cross + back)
            Q[3, a, b] = root * (cross - back)
            Q[4, a, b] = U[a, 2] * V[b, 0]
            Q[5, a, b] = U[a, 2] * V[b, 1]
    return values, Q


@njit(cache=True)
def membrane_hessian(
    x: FloatArray,
    triangle: IntArray,
    B: FloatArray,
    weight: float,
    lam: float,
    mu: float,
    clamp: bool,
    out: FloatArray,
) -> None:
    """Write one triangle's Hessian (9, 9) [N/m] to `out`, positive semidefinite if `clamp`."""
    values, Q = eigenpairs(deformation_gradient(x, triangle, B), lam, mu)
    out[:] = 0.0
    q = np.zeros(9)
    for m in range(6):
        if clamp and values[m] <= 0.0:
            continue
        for k in range(3):
            for a in range(3):
                q[3 * k + a] = Q[m, a, 0] * B[k, 0] + Q[m, a, 1] * B[k, 1]
        for i in range(9):
            scaled = weight * values[m] * q[i]
            for j in range(9):
                out[i, j] += scaled * q[j]
