"""Hinge bending (Grinspun et al. 2003, Discrete Shells, Eq. 3).

Each interior edge e = x1 - x0 with opposite vertices x2, x3 stores k 3 |e|^2/(A1 + A2) theta^2,
with the angle theta between its two triangles, flat at rest, and rest length and areas. The
Gauss-Newton Hessian 2 c grad(theta) grad(theta)^T is used: positive semidefinite as it stands.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from strainbench.limits import FloatArray
from strainbench.problem import IntArray, rest_corners


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


@njit(cache=True)
def angle_and_gradient(x: FloatArray, hinge: IntArray, grad: FloatArray) -> float:
    """Hinge angle [rad]; its gradient (4, 3) [rad/m] is written to `grad`."""
    x0 = x[hinge[0]]
    e, a, b = x[hinge[1]] - x0, x[hinge[2]] - x0, x[hinge[3]] - x0
    n1, n2 = np.cross(e, a), np.cross(b, e)
    length2, m1, m2 = e @ e, n1 @ n1, n2 @ n2
    length = np.sqrt(length2)
    if m1 <= 1e-24 * length2**2 or m2 <= 1e-24 * length2**2:  # a collapsed triangle has no angle
        grad[:] = 0.0
        return 0.0
    t2, t3 = (a @ e) / length2, (b @ e) / length2
    for c in range(3):
        g2, g3 = -length * n1[c] / m1, -length * n2[c] / m2
        grad[2, c], grad[3, c] = g2, g3
        grad[1, c] = -t2 * g2 - t3 * g3
        grad[0, c] = -(1 - t2) * g2 - (1 - t3) * g3
    return float(np.arctan2(np.cross(n1, n2) @ e / length, n1 @ n2))


@njit(cache=True)
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
