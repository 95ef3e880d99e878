"""What a solver's "solved" is worth, by its own multipliers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from strainbench.problem.dual import dual_bound, dual_gap, relative
from strainbench.problem.problem import Problem
from strainbench.solver.solver import Solution


@np.errstate(all="ignore")  # what overflows is not within the tolerance
def claimed(problem: Problem, solution: Solution, tolerance: float) -> Solution:
    """A solver's answer, whose "solved" is kept where the answer itself bears it out.

    Violation and relative gap are computed as the referee does, but with the answer's own
    multipliers; without any, or where lower bounds leave no bound, the violation counts alone.
    """
    if solution.status != "solved":
        return solution
    x, Y = solution.positions, solution.multipliers
    violations = problem.violations(x)
    worst, gap = float(np.max(violations)), 0.0
    if problem.convex and Y is not None:
        dual = dual_bound(problem, Y)
        gap = relative(problem, dual_gap(dual, problem.objective(x), violations), dual[0])
    if not worst <= tolerance:
        return replace(solution, status=f"inaccurate: violation {worst:.1e}")
    if not gap <= tolerance:
        return replace(solution, status=f"inaccurate: gap {gap:.1e}")
    return solution
