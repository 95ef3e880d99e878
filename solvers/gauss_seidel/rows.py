"""Gauss-Seidel sweeps over the limited directions (Thomaszewski et al. 2009, Sec. 4).

For each row i of G in turn, in mesh order, with y = sum_k g_k x_k and w_k = 1/m_k (0 at a pin):

1. skip the row if l^2 <= |y|^2 <= b^2;
2. x_k -= w_k g_k / (sum_j w_j g_j^2) (|y| - b) y/|y|, the exact projection onto this one
   constraint in the norm of M; below a lower bound l, with l for b.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from strainbench import Problem
from strainbench.arrays import FloatArray
from strainbench.compiled import compiled
from strainbench.problem.leverage import Leverage
from strainbench.problem.rows import Rows, add_row, row


@dataclass(frozen=True)
class Directions:
    """The rows of G, and (rows, 1, k) steps w_k g_k / sum_j w_j g_j^2 [m], 0 where none moves."""

    G: Rows
    steps: FloatArray

    @classmethod
    def of(cls, problem: Problem) -> Directions:
        """Those of a problem."""
        levers = Leverage.of(problem)
        return cls(Rows.of(problem), levers.moves * levers.steps[:, None, None])

    def sweep(self, problem: Problem, x: FloatArray, tolerance: float, sweeps: int) -> int:
        """Sweeps done on `x` (n, 3), in place: as many as asked, or until one is calm."""
        bounds = problem.bounds, problem.lower_bounds
        return sweep_rows(self.G, self.steps, *bounds, x, float(tolerance), sweeps)


@compiled
def sweep_rows(
    G: Rows,
    steps: FloatArray,
    bounds: FloatArray,
    lower: FloatArray,
    x: FloatArray,
    tolerance: float,
    sweeps: int,
) -> int:
    """Take steps 1 and 2 on `x` in place, and return the number of sweeps done.

    It stops early after a sweep that found no row violated by `tolerance`.
    """
    for sweep in range(sweeps):
        worst = 0.0
        for i in range(len(bounds)):
            y0, y1, y2 = row(G, i, 0, x)
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
            s = -excess / length  # 2
            add_row(G, steps, i, 0, (s * y0, s * y1, s * y2), x)
        if worst < tolerance:
            return sweep + 1
    return sweeps
