"""Hinge bending (Grinspun et al. 2003, Discrete Shells, Eq. 3).

Each interior edge e = x1 - x0 with opposite vertices x2, x3 stores k 3 |e|^2/(A1 + A2) theta^2,
with the angle theta between its two triangles, flat at rest, and rest length and areas. The
Gauss-Newton Hessian 2 c grad(theta) grad(theta)^T is used: positive semidefinite as it stands.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from strainbench.arrays import FloatArray, IntArray
from strainbench.compiled import compiled
from strainbench.physics.energies.energy import Energy
from strainbench.physics.pattern import Blocks, scatter
from strainbench.problem.elements import rest_corners


@dataclass(frozen=True, eq=False)
class Bending(Energy):
    """All hinges of a sheet."""

    name = "bending"
    elements: IntArray  # (h, 4), as of `hinges`
    weights: FloatArray  # (h,) c [J]

    def add_gradient(self, x: FloatArray, out: FloatArray) -> float:
        """See the base class."""
        return float(add_bending_gradient(x, self.elements, self.weights, out))

    def add_hessian(self, x: FloatArray, blocks: Blocks, clamp: bool) -> None:  # noqa: ARG002
        """See the base class; Gauss and Newton's needs no clamping."""
        add_bending_hessian(x, self.weights, blocks)


def hinges(rest: FloatArray, elements: IntArray, areas: FloatArray) -> tuple[IntArray, FloatArray]:
    """Interior edges of a triangle mesh, and their weights.

    Returns
    -------
    hinges : (h, 4)
        Vertices x0, x1 of the edge, then x2, x3 across it; x0, x1, x2 turn as their triangle.
    weights : (h,)
        3 |e|^2 / (A1 + A2) at rest, without unit; of the mean length where a seam's sides differ.
    """
    corners = rest_corners(rest, elements)
    lengths = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
    seen: dict[tuple[int, int], tuple[int, int, int, int, int]] = {}
    quads, weights = [], []
    for t, triangle in enumerate(elements.tolist()):
        for c in range(3):
            a, b, across = triangle[c], triangle[(c + 1) % 3], triangle[(c + 2) % 3]
            key = (min(a, b), max(a, b))
            if key not in seen:
                seen[key] = (a, b, across, t, c)
                continue
            x0, x1, x2, other, corner = seen[key]
            quads.append((x0, x1, x2, across))
            length2 = (0.5 * float(lengths[t, c] + lengths[other, corner])) ** 2
            weights.append(3 * length2 / (areas[t] + areas[other]))
    return np.array(quads, dtype=np.int64).reshape(-1, 4), np.array(weights)


@compiled
def angle_and_gradient(x: FloatArray, hinge: IntArray, grad: FloatArray) -> float:
    """Hinge angle [rad]; its gradient (4, 3) [rad/m] is written to `grad`.

    With n1 = e x a and n2 = b x e: theta's gradient is -|e| n1/|n1|^2 at x2, -|e| n2/|n2|^2 at
    x3, and minus their shares t2 = a.e/|e|^2, t3 = b.e/|e|^2 at x1, the rest at x0.
    """
    i0, i1, i2, i3 = hinge[0], hinge[1], hinge[2], hinge[3]
    e0, e1, e2 = x[i1, 0] - x[i0, 0], x[i1, 1] - x[i0, 1], x[i1, 2] - x[i0, 2]
    a0, a1, a2 = x[i2, 0] - x[i0, 0], x[i2, 1] - x[i0, 1], x[i2, 2] - x[i0, 2]
    b0, b1, b2 = x[i3, 0] - x[i0, 0], x[i3, 1] - x[i0, 1], x[i3, 2] - x[i0, 2]
    n1 = (e1 * a2 - e2 * a1, e2 * a0 - e0 * a2, e0 * a1 - e1 * a0)  # e x a
    n2 = (b1 * e2 - b2 * e1, b2 * e0 - b0 * e2, b0 * e1 - b1 * e0)  # b x e
    length2 = e0 * e0 + e1 * e1 + e2 * e2
    m1 = n1[0] * n1[0] + n1[1] * n1[1] + n1[2] * n1[2]
    m2 = n2[0] * n2[0] + n2[1] * n2[1] + n2[2] * n2[2]
    if m1 <= 1e-24 * length2**2 or m2 <= 1e-24 * length2**2:  # a collapsed triangle has no angle
        grad[:] = 0.0
        return 0.0
    length = np.sqrt(length2)
    t2 = (a0 * e0 + a1 * e1 + a2 * e2) / length2
    t3 = (b0 * e0 + b1 * e1 + b2 * e2) / length2
    for c in range(3):
        g2, g3 = -length / m1 * n1[c], -length / m2 * n2[c]
        grad[2, c], grad[3, c] = g2, g3
        grad[1, c] = -t2 * g2 - t3 * g3
        grad[0, c] = -(1 - t2) * g2 - (1 - t3) * g3
    sine = -length * (n1[0] * b0 + n1[1] * b1 + n1[2] * b2)  # (n1 x n2).e/|e| = -|e| n1.b
    return float(np.arctan2(sine, n1[0] * n2[0] + n1[1] * n2[1] + n1[2] * n2[2]))


@compiled
def add_bending_gradient(
    x: FloatArray, quads: IntArray, weights: FloatArray, out: FloatArray
) -> float:
    """Add the gradient (n, 3) [N] to `out`; return the energy [J]. `weights` (h,) are [J]."""
    energy = 0.0
    grad = np.zeros((4, 3))
    for h in range(len(quads)):
        theta = angle_and_gradient(x, quads[h], grad)
        energy += weights[h] * theta**2
        for k in range(4):
            for c in range(3):
                out[quads[h, k], c] += 2 * weights[h] * theta * grad[k, c]
    return energy


@compiled
def add_bending_hessian(x: FloatArray, weights: FloatArray, blocks: Blocks) -> None:
    """Add every hinge's 2 c grad(theta) grad(theta)^T [N/m]."""
    grad = np.empty((4, 3))
    mode = grad.reshape(1, 12)
    value = np.empty(1)
    for h in range(len(weights)):
        angle_and_gradient(x, blocks.elements[h], grad)
        value[0] = 2 * weights[h]
        scatter(value, mode, blocks, h)
