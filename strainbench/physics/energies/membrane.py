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

from dataclasses import dataclass

import numpy as np

from strainbench.arrays import FloatArray, IntArray
from strainbench.compiled import compiled
from strainbench.physics.energies.energy import Energy
from strainbench.physics.pattern import Blocks, scatter


@dataclass(frozen=True, eq=False)
class Membrane(Energy):
    """All triangles of a sheet."""

    name = "membrane"
    elements: IntArray  # (e, 3)
    gradients: FloatArray  # (e, 3, 2) of the shape functions: B [1/m]
    weights: FloatArray  # (e,) w [m^3]
    lame: tuple[float, float]  # lam, mu [Pa]

    def add_gradient(self, x: FloatArray, out: FloatArray) -> float:
        """See the base class."""
        shape = self.elements, self.gradients, self.weights
        return float(add_membrane_gradient(x, *shape, *self.lame, out))

    def add_hessian(self, x: FloatArray, blocks: Blocks, clamp: bool) -> None:
        """See the base class."""
        add_membrane_hessian(x, self.gradients, self.weights, *self.lame, clamp, blocks)


@compiled
def deformation_gradient(x: FloatArray, triangle: IntArray, B: FloatArray, F: FloatArray) -> None:
    """Write F (3, 2) of one triangle: sum_k x_k B_k."""
    F[:] = 0.0
    for k in range(3):
        for a in range(3):
            F[a, 0] += x[triangle[k], a] * B[k, 0]
            F[a, 1] += x[triangle[k], a] * B[k, 1]


@compiled
def singular_frames(F: FloatArray, U: FloatArray, s: FloatArray, V: FloatArray) -> None:
    """Thin SVD of a 3 x 2 matrix: U (3, 3) with the normal as third column, s (2,), V (2, 2)."""
    c00 = F[0, 0] ** 2 + F[1, 0] ** 2 + F[2, 0] ** 2
    c11 = F[0, 1] ** 2 + F[1, 1] ** 2 + F[2, 1] ** 2
    c01 = F[0, 0] * F[0, 1] + F[1, 0] * F[1, 1] + F[2, 0] * F[2, 1]
    angle = 0.5 * np.arctan2(2 * c01, c00 - c11)
    V[0, 0], V[0, 1] = np.cos(angle), -np.sin(angle)
    V[1, 0], V[1, 1] = -V[0, 1], V[0, 0]
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
    for a in range(3):  # u1 x u2
        b, c = (a + 1) % 3, (a + 2) % 3
        U[a, 2] = U[b, 0] * U[c, 1] - U[c, 0] * U[b, 1]


@compiled
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
    F = np.empty((3, 2))
    for e in range(len(triangles)):
        B = gradients[e]
        deformation_gradient(x, triangles[e], B, F)
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


@compiled
def eigenpairs(
    U: FloatArray,
    s: FloatArray,
    V: FloatArray,
    lam: float,
    mu: float,
    values: FloatArray,
    Q: FloatArray,
) -> None:
    """Write eigenvalues (6,) [Pa], eigenmatrices (6, 3, 2) of the energy density's Hessian in F.

    `U`, `s`, `V` are those of `singular_frames`.
    """
    E0, E1 = 0.5 * (s[0] ** 2 - 1), 0.5 * (s[1] ** 2 - 1)
    trace = lam * (E0 + E1)
    S0, S1 = trace + 2 * mu * E0, trace + 2 * mu * E1
    w00 = S0 + s[0] ** 2 * (lam + 2 * mu)
    w11 = S1 + s[1] ** 2 * (lam + 2 * mu)
    w01 = lam * s[0] * s[1]
    mean, half = 0.5 * (w00 + w11), 0.5 * (w00 - w11)
    radius = np.sqrt(half**2 + w01**2)
    angle = 0.5 * np.arctan2(w01, half)
    cosine, sine = np.cos(angle), np.sin(angle)
    values[0], values[1] = mean + radius, mean - radius
    values[2] = trace + mu * (s[0] ** 2 + s[0] * s[1] + s[1] ** 2 - 1)
    values[3] = trace + mu * (s[0] ** 2 - s[0] * s[1] + s[1] ** 2 - 1)
    values[4], values[5] = S0, S1
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


@compiled
def add_membrane_hessian(
    x: FloatArray,
    gradients: FloatArray,
    weights: FloatArray,
    lam: float,
    mu: float,
    clamp: bool,
    blocks: Blocks,
) -> None:
    """Add every triangle's Hessian [N/m], positive semidefinite if `clamp`.

    In x it is sum_m w value_m q_m q_m^T, with q_m = Q_m B_k at vertex k.
    """
    F, U, s, V = np.empty((3, 2)), np.empty((3, 3)), np.empty(2), np.empty((2, 2))
    values, Q, modes = np.empty(6), np.empty((6, 3, 2)), np.empty((6, 9))
    for e in range(len(weights)):
        B = gradients[e]
        deformation_gradient(x, blocks.elements[e], B, F)
        singular_frames(F, U, s, V)
        eigenpairs(U, s, V, lam, mu, values, Q)
        for m in range(6):
            values[m] *= weights[e]
            if clamp and values[m] <= 0.0:
                values[m] = 0.0
            for k in range(3):
                for a in range(3):
                    modes[m, 3 * k + a] = Q[m, a, 0] * B[k, 0] + Q[m, a, 1] * B[k, 1]
        scatter(values, modes, blocks, e)
