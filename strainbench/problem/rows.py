"""The rows of G as compiled loops take them, y = G x and G^T y.

A block is one or several rows on the same vertices: those of a constraint, or an element's material
axes. The loops of solvers call the kernels here, which are compiled into them.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from strainbench.arrays import FloatArray, IntArray
from strainbench.compiled import compiled
from strainbench.problem.kinds import Exact
from strainbench.problem.problem import Problem


class Rows(NamedTuple):
    """G in c blocks of m rows, each on k vertices; the same for all frames.

    vertices : (c, k); coefficients : (c, m, k), g [1/m];
    corners, axes : k and m zeros; their lengths are known to the compiler, which unrolls loops.
    """

    vertices: NDArray[np.int32]
    coefficients: FloatArray
    corners: tuple[int, ...]
    axes: tuple[int, ...]

    @classmethod
    def of(cls, problem: Problem) -> Rows:
        """The rows of each constraint: one, or those of an element with exact limits."""
        c, k = problem.constraints, problem.elements.shape[1]
        coefficients = problem.row_coefficients.reshape(c, -1, k)
        return cls._with(problem.row_vertices[:: problem.rows // c], coefficients)

    @classmethod
    def of_axes(cls, problem: Problem) -> Rows:
        """Of each element those of its material axes: F^T, or (F D)^T with exact limits."""
        if isinstance(problem.kind, Exact):
            return cls.of(problem)
        return cls._with(problem.elements, problem.gradients.swapaxes(1, 2))

    @classmethod
    def _with(cls, vertices: IntArray, coefficients: FloatArray) -> Rows:
        _, m, k = coefficients.shape
        whole = np.ascontiguousarray(vertices, dtype=np.int32)
        return cls(whole, np.ascontiguousarray(coefficients), (0,) * k, (0,) * m)


@compiled
def row(G: Rows, i: int, a: int, x: FloatArray) -> tuple[float, float, float]:
    """y = sum_k g_k x_k of row a in block i, at x (n, 3)."""
    y0 = y1 = y2 = 0.0
    for k in range(len(G.corners)):
        v, g = G.vertices[i, k], G.coefficients[i, a, k]
        y0 += g * x[v, 0]
        y1 += g * x[v, 1]
        y2 += g * x[v, 2]
    return y0, y1, y2


@compiled
def add_row(
    G: Rows, factors: FloatArray, i: int, a: int, y: tuple[float, float, float], x: FloatArray
) -> None:
    """Add y, times each of row a's `factors` (c, m, k), to the vertices of block i in x (n, 3)."""
    for k in range(len(G.corners)):
        v, f = G.vertices[i, k], factors[i, a, k]
        x[v, 0] += f * y[0]
        x[v, 1] += f * y[1]
        x[v, 2] += f * y[2]


@compiled
def gather(G: Rows, i: int, x: FloatArray, y: FloatArray) -> None:
    """Fill y (m, 3) with G_i x."""
    for a in range(len(G.axes)):
        y[a, 0], y[a, 1], y[a, 2] = row(G, i, a, x)


@compiled
def spread(G: Rows, factors: FloatArray, i: int, y: FloatArray, x: FloatArray) -> None:
    """Add y (m, 3), times the `factors` (c, m, k), to the vertices of block i: G_i^T y with g."""
    for a in range(len(G.axes)):
        add_row(G, factors, i, a, (y[a, 0], y[a, 1], y[a, 2]), x)
