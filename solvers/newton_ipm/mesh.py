"""What both kinds of limits share: a step, and what an element adds to sums over the mesh.

The functions are compiled into the loops that call them.

`corners` and `axes` are tuples of k and dim zeros: their lengths are known to the compiler, which
then unrolls the loops over an element's vertices and material axes.
"""

from __future__ import annotations

from dataclasses import dataclass

from strainbench.arrays import FloatArray
from strainbench.compiled import compiled


@dataclass(frozen=True)
class Change:
    """What a step changes: numbers (rows,) for sampled limits, matrices (e, 3) for exact ones.

    s, l : of slacks and multipliers
    square : dy dy^T / 2, by which slacks fall short of their linearisation
    length : the part of the step that reaches the boundary, at most 1
    """

    s: FloatArray
    l: FloatArray  # noqa: E741
    square: FloatArray
    length: float


@compiled
def gather(elements, gradients, corners, axes, e, x, F):  # type: ignore[no-untyped-def]
    """F (dim, 3) = sum_a B_a x_a^T of element e."""
    for c in range(len(axes)):
        f0 = f1 = f2 = 0.0
        for a in range(len(corners)):
            v, B = elements[e, a], gradients[e, a, c]
            f0 += B * x[v, 0]
            f1 += B * x[v, 1]
            f2 += B * x[v, 2]
        F[c, 0], F[c, 1], F[c, 2] = f0, f1, f2


@compiled
def spread(elements, gradients, corners, axes, e, P, out):  # type: ignore[no-untyped-def]
    """Add sum_c B_ac P_c, of P (dim, 3), to each vertex a of element e in `out` (n, 3)."""
    for a in range(len(corners)):
        v = elements[e, a]
        for c in range(len(axes)):
            B = gradients[e, a, c]
            for i in range(3):
                out[v, i] += B * P[c, i]


@compiled
def spread_blocks(elements, gradients, corners, axes, e, H, slots, stride, data):  # type: ignore[no-untyped-def]
    """Add sum_cf B_ac B_bf H_cf, of H (dim, dim, 3, 3), to the block of each vertex pair a, b.

    `slots`, `stride` and `data` are those of `strainbench.physics.pattern.Pattern`.
    """
    for b in range(len(corners)):
        width = stride[elements[e, b]]
        for a in range(len(corners)):
            first = slots[e, a, b]
            if first < 0:
                continue
            for j in range(3):
                k0 = k1 = k2 = 0.0
                for c in range(len(axes)):
                    for f in range(len(axes)):
                        weight = gradients[e, a, c] * gradients[e, b, f]
                        k0 += weight * H[c, f, 0, j]
                        k1 += weight * H[c, f, 1, j]
                        k2 += weight * H[c, f, 2, j]
                column = first + j * width
                data[column] += k0
                data[column + 1] += k1
                data[column + 2] += k2


@compiled
def spread_symmetric(elements, gradients, corners, axes, e, H, slots, stride, data):  # type: ignore[no-untyped-def]
    """The same for H_cf = H_fc = H_cf^T, whose entries 00, 01, 02, 11, 12, 22 are H (dim, dim, 6).

    Those with f <= c are read.
    """
    for b in range(len(corners)):
        width = stride[elements[e, b]]
        for a in range(len(corners)):
            first = slots[e, a, b]
            if first < 0:
                continue
            k0 = k1 = k2 = k3 = k4 = k5 = 0.0
            for c in range(len(axes)):
                for f in range(c + 1):
                    weight = gradients[e, a, c] * gradients[e, b, f]
                    if f < c:
                        weight += gradients[e, a, f] * gradients[e, b, c]
                    k0 += weight * H[c, f, 0]
                    k1 += weight * H[c, f, 1]
                    k2 += weight * H[c, f, 2]
                    k3 += weight * H[c, f, 3]
                    k4 += weight * H[c, f, 4]
                    k5 += weight * H[c, f, 5]
            data[first] += k0
            data[first + 1] += k1
            data[first + 2] += k2
            data[first + width] += k1
            data[first + width + 1] += k3
            data[first + width + 2] += k4
            data[first + 2 * width] += k2
            data[first + 2 * width + 1] += k4
            data[first + 2 * width + 2] += k5
