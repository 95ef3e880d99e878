"""Gauss-Seidel sweeps over the limited directions (Thomaszewski et al. 2009, Sec. 4).

For each row i of G in turn, in mesh order, with y = sum_k g_k x_k and w_k = 1/m_k (0 at a pin):

1. skip the row if l^2 <= |y|^2 <= b^2;
2. x_k -= w_k g_k / (sum_j w_j g_j^2) (|y| - b) y/|y|, the exact projection onto this one
   constraint in the norm of M; below a lower bound l, with l for b.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from strainbench import Problem
from strainbench.arrays import FloatArray
from strainbench.compiled import compiled

NO_LEVERAGE = 1e-12
"""Coefficients smaller than this beside the row's largest are rounding, and move nothing."""


@dataclass(frozen=True)
class Rows:
    """The rows of G as contiguous arrays.

    vertices : (rows, k); coefficients : (rows, k), g [1/m];
    steps : (rows, k), w_k g_k / sum_j w_j g_j^2 [m], 0 where all vertices are pinned;
    corners : k zeros; its length is known to the compiler, which then unrolls the loops over k.
    """

    vertices: NDArray[np.int32]
    coefficients: FloatArray
    steps: FloatArray
    corners: tuple[int, ...]

    @classmethod
    def of(cls, problem: Problem) -> Rows:
        """The rows of a problem."""
        g = problem.row_coefficients
        corners = (0,) * g.shape[1]
        return cls(problem.row_vertices.astype(np.int32), g, step_factors(problem), corners)

    def sweep(self, problem: Problem, x: FloatArray, tolerance: float, sweeps: int) -> int:
        """Sweeps done on `x` (n, 3), in place: as many as asked, or until one is calm."""
        arrays = (self.vertices, self.coefficients, self.steps, self.corners)
        bounds = problem.bounds, problem.lower_bounds
        return int(sweep_rows(*arrays, *bounds, x, float(tolerance), sweeps))


def step_factors(problem: Problem) -> FloatArray:
    """(rows, k) w_k g_k / sum_j w_j g_j^2 [m], or 0 in rows that no free vertex can change."""
    w = np.zeros(problem.vertices)
    w[problem.free] = 1 / problem.weights[problem.free]
    g = problem.row_coefficients
    g = np.where(np.abs(g) > NO_LEVERAGE * np.abs(g).max(axis=1, keepdims=True), g, 0.0)
    wg = w[problem.row_vertices] * g
    total = np.sum(wg * g, axis=1, keepdims=True)
    steps = np.zeros_like(wg)
    np.divide(wg, total, out=steps, where=total > 0)
    return steps


@compiled
def sweep_rows(  # type: ignore[no-untyped-def]
    vertices, coefficients, steps, corners, bounds, lower, x, tolerance, sweeps
):
    """Take steps 1 and 2 on `x` in place, and return the number of sweeps done.

    It stops early after a sweep that found no row violated by `tolerance`.
    """
    for sweep in range(sweeps):
        worst = 0.0
        for i in range(len(vertices)):
            y0 = y1 = y2 = 0.0
            for j in range(len(corners)):
                v, g = vertices[i, j], coefficients[i, j]
                y0 += g * x[v, 0]
                y1 += g * x[v, 1]
                y2 += g * x[v, 2]
            square = y0 * y0 + y1 * y1 + y2 * y2
            bound = bounds[i]
            if square <= bound * bound:  # 1
                bound = lower[i]
                if square >= bound * bound:
                    continue
            length = np.sqrt(square)
            excess = length - bound
            worst = max(worst, abs(excess))
            if length == 0:  # no direction to stretch it in
                continue
            for j in range(len(corners)):  # 2
                v, s = vertices[i, j], steps[i, j] * (excess / length)
                x[v, 0] -= s * y0
                x[v, 1] -= s * y1
                x[v, 2] -= s * y2
        if worst < tolerance:
            return sweep + 1
    return sweeps
