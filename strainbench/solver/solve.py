"""One problem, one solver, one call."""

from __future__ import annotations

from dataclasses import replace
from time import perf_counter

import numpy as np
from threadpoolctl import threadpool_limits

from strainbench.problem.problem import Problem
from strainbench.solver.registry import find_solver
from strainbench.solver.solver import Solution, Solver, Watch, check_threads, run_solver, warm_up


def solve(
    problem: Problem,
    solver: str | Solver,
    tolerance: float = 1e-6,
    time_limit: float | None = None,
    watch: Watch | None = None,
    threads: int = 1,
) -> Solution:
    """Project `problem` with a solver, given by name or as an object.

    Parameters
    ----------
    tolerance : the max violation and relative gap to aim for; what is reached, `certify` tells.
    time_limit : [s], passed on to the solver as its deadline; None is no limit.
    threads : of BLAS and OpenMP; more seldom pay, and cost much on a machine that is busy.
    watch : called off the clock with (seconds, iterations, positions, multipliers) of each iterate
        shown; it copies what it keeps.

    Raises
    ------
    ValueError
        For an unknown or unavailable solver, one that does not support the problem, a tolerance
        that is not positive, a negative time limit, or no whole number of threads.

    Examples
    --------
    Both ends of an edge that is 0.2 m too long move by half of that:

    >>> rest, target = [[0, 0], [1, 0], [0, 1]], [[0, 0, 0], [1.3, 0, 0], [0, 1, 0]]
    >>> problem = Problem(rest, [[0, 1, 2]], target, StretchLimits.isotropic(1.1, directions=2))
    >>> solve(problem, "newton-ipm").positions[:2, 0].round(4).tolist()
    [0.1, 1.2]
    """
    if not tolerance > 0:
        raise ValueError(f"tolerance is {tolerance}: a number above 0 is valid")
    if time_limit is not None and not time_limit > 0:
        raise ValueError(f"time_limit is {time_limit}: a number of seconds above 0 is valid")
    check_threads(threads)
    chosen = find_solver(solver) if isinstance(solver, str) else solver
    refusal = chosen.supports(problem)
    if refusal:
        raise ValueError(f"{chosen.label} cannot take this problem: {refusal}")
    if reason := problem.infeasible_pins():
        nothing = np.full_like(problem.target, np.nan)
        return Solution(nothing, reason, 0, seconds=0.0, setup_seconds=0.0)
    with threadpool_limits(threads):
        warm_up(chosen, problem, tolerance)
    with threadpool_limits(threads):  # of what was loaded meanwhile too
        start = perf_counter()
        state = chosen.prepare(problem)
        setup_seconds = perf_counter() - start
        solution = run_solver(chosen, problem, state, tolerance, time_limit, watch)
    return replace(solution, setup_seconds=setup_seconds)
