"""Gauss-Seidel projection of one constraint at a time (Thomaszewski et al. 2009, Sec. 4).

B. Thomaszewski, S. Pabst, W. Strasser, "Continuum-based strain limiting", Computer Graphics
Forum 28(2), with the stop rule of Tang et al. 2022, Table 1: largest violation below the
tolerance, at most 1e5 sweeps. What is limited here is the stretch of one direction at a time,
where the paper clamps the strain of one element at a time.

For each row i of G in turn, in mesh order, with y = sum_k g_k x_k and w_k = 1/m_k (0 at a pin):

1. skip the row if |y|^2 <= b^2;
2. x_k -= w_k g_k / (sum_j w_j g_j^2) (|y| - b) y/|y|, the exact projection onto this one
   constraint in the norm of M;
3. stop once the largest violation of all rows at the same positions is below the tolerance:
   looked at after a sweep that found no row above it, and at every look at the clock.

The answer is a feasible point near the target, not the closest one.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from strainbench import Clock, Problem, Solution, Solver
from strainbench.limits import FloatArray

ROWS_A_CHUNK = 3_000_000
"""Row visits between two looks at the clock: 20 ms at the 6 to 7 ns a visit measured."""

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

    def sweep(self, bounds: FloatArray, x: FloatArray, tolerance: float, sweeps: int) -> int:
        """Sweeps done on `x` (n, 3), in place: as many as asked, or until one is calm."""
        arrays = (self.vertices, self.coefficients, self.steps, self.corners)
        return int(sweep_rows(*arrays, bounds, x, float(tolerance), sweeps))

    def violation(self, bounds: FloatArray, x: FloatArray) -> float:
        """Largest max(0, |y_i| - b_i) at `x` (n, 3)."""
        return float(largest_violation(self.vertices, self.coefficients, self.corners, bounds, x))


@dataclass(frozen=True)
class GaussSeidel(Solver):
    """Gauss-Seidel projection of one constraint at a time (Thomaszewski et al. 2009, Sec. 4).

    | status | when |
    |---|---|
    | solved | the largest violation of the returned positions is below the tolerance |
    | iteration limit | it is not, after `max_sweeps` |
    | time limit | it is not, at the deadline |

    Parameters
    ----------
    max_sweeps : over all rows (Tang et al. 2022, Table 1: 1e5).
    """

    name = "gauss-seidel"

    max_sweeps: int = 100_000

    def prepare(self, problem: Problem) -> Rows:
        """Coefficients and step factors, and the compiled loops."""
        g = problem.row_coefficients
        corners = (0,) * g.shape[1]
        state = Rows(problem.row_vertices.astype(np.int32), g, step_factors(problem), corners)
        x = problem.target.copy()
        state.sweep(problem.bounds, x, 1.0, 0)
        state.violation(problem.bounds, x)
        return state

    def solve(
        self,
        problem: Problem,
        state: Rows,
        *,
        tolerance: float,
        monitor: Callable[..., None],
        deadline: Clock,
    ) -> Solution:
        """Sweeps from the target; the monitor sees sweeps 1, 2, 4, 8, ..."""
        b, x = problem.bounds, problem.target.copy()
        done, mark = 0, 1
        chunk = max(1, ROWS_A_CHUNK // problem.rows)
        while state.violation(b, x) >= tolerance:  # 3
            if done >= self.max_sweeps:
                return Solution(x, "iteration limit", done)
            if deadline.passed:
                return Solution(x, "time limit", done)
            sweeps = min(mark - done, chunk, self.max_sweeps - done)
            done += state.sweep(b, x, tolerance, sweeps)
            if done == mark:
                monitor(x, iterations=done)
                mark *= 2
        return Solution(x, "solved", done)


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


@njit(cache=True)
def sweep_rows(vertices, coefficients, steps, corners, bounds, x, tolerance, sweeps):  # type: ignore[no-untyped-def]
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
            if square <= bounds[i] * bounds[i]:  # 1
                continue
            length = np.sqrt(square)
            excess = length - bounds[i]
            worst = max(worst, excess)
            for j in range(len(corners)):  # 2
                v, s = vertices[i, j], steps[i, j] * (excess / length)
                x[v, 0] -= s * y0
                x[v, 1] -= s * y1
                x[v, 2] -= s * y2
        if worst < tolerance:
            return sweep + 1
    return sweeps


@njit(cache=True)
def largest_violation(vertices, coefficients, corners, bounds, x):  # type: ignore[no-untyped-def]
    """Largest max(0, |y_i| - b_i); nothing moves."""
    worst = 0.0
    for i in range(len(vertices)):
        y0 = y1 = y2 = 0.0
        for j in range(len(corners)):
            v, g = vertices[i, j], coefficients[i, j]
            y0 += g * x[v, 0]
            y1 += g * x[v, 1]
            y2 += g * x[v, 2]
        worst = max(worst, np.sqrt(y0 * y0 + y1 * y1 + y2 * y2) - bounds[i])
    return worst
