"""K's lower triangle, assembled into the very array that is factorised.

A vertex has three columns, each an entry shorter than the one before. Where its first column has
`width` entries and a block starts at entry `first` of it, row 0 of the second and third columns
is, or above the diagonal would be, at first + width - 1 and first + 2 width - 3.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from solvers.newton_ipm.symmetric import Symmetric
from strainbench import Problem
from strainbench import sparse as sp
from strainbench.arrays import FloatArray, IntArray
from strainbench.compiled import compiled
from strainbench.physics.pattern import Pattern
from strainbench.problem.rows import Rows


class Slots(NamedTuple):
    """(e, k, k) where each vertex pair's block starts, or -1; (n,) entries in a first column."""

    first: IntArray
    width: IntArray


class Matrix:
    """Its pattern and its values, which are written over.

    Attributes
    ----------
    lower : (3 free, 3 free), sorted, its lower triangle alone
    slots : where the elements' blocks go
    """

    def __init__(self, problem: Problem) -> None:
        pattern = Pattern.of([problem.elements], problem.vertices, problem.held)
        columns = np.repeat(np.arange(pattern.size), np.diff(pattern.indptr))
        below = pattern.indices >= columns
        place = np.cumsum(below) - 1
        starts = np.concatenate([[0], np.cumsum(np.bincount(columns[below]))])
        values, shape = np.ones(int(below.sum())), 2 * (pattern.size,)
        self.lower = sp.csc_array((values, pattern.indices[below], starts), shape=shape)
        first = pattern.slots[0]
        self.slots = Slots(np.where(first < 0, -1, place[first]), pattern.stride)
        self._diagonal, self._mass = starts[:-1], np.repeat(problem.weights[problem.free], 3)

    def mass(self) -> FloatArray:
        """The values of M alone, to be added to."""
        values: FloatArray = self.lower.data
        values[:] = 0.0
        values[self._diagonal] = self._mass
        return values


@compiled
def spread_products(
    G: Rows,
    at: Slots,
    e: int,
    A: FloatArray,
    l: Symmetric,  # noqa: E741
    values: FloatArray,
) -> None:
    """Add A_a A_b^T + (B_a^T L B_b) I, of A (k, 3, 3), to the block of each vertex pair a, b."""
    for b in range(len(G.corners)):
        width = at.width[G.vertices[e, b]]
        c, d = G.coefficients[e, 0, b], G.coefficients[e, 1, b]
        l0, l1 = l[0] * c + l[2] * d, l[2] * c + l[1] * d
        for a in range(len(G.corners)):
            first = at.first[e, a, b]
            if first < 0:
                continue
            for j in range(3):
                column = first + j * width - j * (j + 1) // 2
                for i in range(0 if a != b else j, 3):
                    k = A[a, i, 0] * A[b, j, 0] + A[a, i, 1] * A[b, j, 1]
                    values[column + i] += k + A[a, i, 2] * A[b, j, 2]
                values[column + j] += G.coefficients[e, 0, a] * l0 + G.coefficients[e, 1, a] * l1


@compiled
def spread_symmetric(G: Rows, at: Slots, e: int, H: FloatArray, values: FloatArray) -> None:
    """Add sum_cf B_ca B_fb H_cf to the block of each vertex pair a, b.

    H_cf = H_fc = H_cf^T, whose entries 00, 01, 02, 11, 12, 22 are H (dim, dim, 6), where f <= c.
    """
    for b in range(len(G.corners)):
        width = at.width[G.vertices[e, b]]
        for a in range(len(G.corners)):
            first = at.first[e, a, b]
            if first < 0:
                continue
            k0 = k1 = k2 = k3 = k4 = k5 = 0.0
            for c in range(len(G.axes)):
                for f in range(c + 1):
                    weight = G.coefficients[e, c, a] * G.coefficients[e, f, b]
                    if f < c:
                        weight += G.coefficients[e, f, a] * G.coefficients[e, c, b]
                    k0 += weight * H[c, f, 0]
                    k1 += weight * H[c, f, 1]
                    k2 += weight * H[c, f, 2]
                    k3 += weight * H[c, f, 3]
                    k4 += weight * H[c, f, 4]
                    k5 += weight * H[c, f, 5]
            second, third = first + width - 1, first + 2 * width - 3
            values[first] += k0
            values[first + 1] += k1
            values[first + 2] += k2
            values[second + 1] += k3
            values[second + 2] += k4
            values[third + 2] += k5
            if a != b:
                values[second] += k1
                values[third] += k2
                values[third + 1] += k4
