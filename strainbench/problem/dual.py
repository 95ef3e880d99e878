"""The projection's dual: bounds on the optimum from any multipliers (see `strainbench.referee`)."""

from __future__ import annotations

import numpy as np

from strainbench.arrays import FloatArray
from strainbench.problem.problem import Problem

Dual = tuple[float, FloatArray]
"""A lower bound D(Y), and |Y_i| of the multipliers that it comes from (constraints,)."""


def dual_bound(problem: Problem, multipliers: FloatArray) -> Dual:
    """The best D(Y) of any multiple Y of `multipliers` (rows, 3), and its |Y_i| (constraints,).

    D = lin^2 / 2 q with lin = <Y, G target> - sum b_i |Y_i| and q = ||G^T Y||^2_{M^-1}, less its
    own rounding. Where a number overflows, D is 0.
    """
    Y = np.where(np.isfinite(multipliers), multipliers, 0.0)
    Y /= np.max(np.abs(Y), initial=0.0) or 1.0  # or the squares of small ones would vanish
    norms = problem.dual_norms(Y)
    products = np.sum((Y * (problem.G @ problem.target)).reshape(len(norms), -1), axis=1)
    terms = products - problem.bounds * norms
    back = (problem.G.T @ Y)[problem.free]
    q = float(np.sum(back**2 / problem.weights[problem.free, None]))
    rounding = 16 * np.finfo(float).eps * 2 * float(np.sum(problem.bounds * norms))
    linear = float(np.sum(terms) - rounding)
    with np.errstate(all="ignore"):
        scale = float(np.divide(linear, q)) if linear > 0 else 0.0
    lower_bound = 0.5 * linear * scale
    if not np.isfinite(lower_bound):
        scale, lower_bound = 0.0, 0.0
    return lower_bound, scale * norms


def dual_gap(dual: Dual, objective: float, violations: FloatArray) -> float:
    """f(x) + sum |Y_i| v_i - D(Y), at least 0; infinite where it cannot be computed."""
    lower_bound, norms = dual
    priced = float(np.sum(norms * violations, where=norms > 0))
    gap = objective + priced - lower_bound
    return float("inf") if np.isnan(gap) else max(0.0, gap)


def relative(problem: Problem, gap: float, lower_bound: float) -> float:
    """A gap relative to the lower bound, or to the floor where that is larger."""
    scale = max(lower_bound, problem.objective_floor)
    if gap <= 0:
        return 0.0
    return gap / scale if 0 < scale < np.inf else float("inf")
