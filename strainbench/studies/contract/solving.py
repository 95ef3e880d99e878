"""How the contract's checks ask a solver, and the problems that they ask."""

from __future__ import annotations

import numpy as np

from strainbench.arrays import FloatArray
from strainbench.problem.draws import random_problem
from strainbench.problem.limits import StretchLimits
from strainbench.problem.problem import Problem
from strainbench.scenario.stage import StageError, plain_solution
from strainbench.solver.solve import solve
from strainbench.solver.solver import Solution, Solver, Watch
from strainbench.studies.contract.promises import Promise


class BrokenError(AssertionError):
    """A clause of the contract that a solver does not keep, in words."""


class NotApplicableError(Exception):
    """A clause that says nothing of this solver, and why."""


def demand(kept: bool | np.bool_, words: str) -> None:
    """BrokenError in these words unless it is kept."""
    if not kept:
        raise BrokenError(words)


def applies(applicable: bool, why: str) -> None:
    """NotApplicableError with the reason unless the clause applies."""
    if not applicable:
        raise NotApplicableError(why)


def answer(
    solver: Solver, problem: Problem, promise: Promise, watch: Watch | None = None
) -> Solution:
    """Its solution, which must have the form that the suite can take."""
    if refusal := solver.supports(problem):
        raise NotApplicableError(f"it refuses the problem: {refusal}")
    solution = solve(problem, solver, time_limit=promise.time_limit, watch=watch)
    return well_formed(problem, solution)


def well_formed(problem: Problem, solution: Solution) -> Solution:
    """The same, if its parts are what a Solution's are."""
    try:
        plain = plain_solution(solution)
    except StageError as error:
        raise BrokenError(error.reason) from None
    x = plain.positions
    demand(
        x.shape == problem.target.shape and x.dtype == np.float64,
        f"positions of shape {x.shape}, type {x.dtype}: {problem.target.shape}, float64 is valid",
    )
    return plain


def stretched_triangle(limit: float = 1.1, mass: FloatArray | None = None) -> Problem:
    """One limited direction, no pins: the projection is known in closed form."""
    rest = np.array([[0.0, 0.0], [1.0, 0.0], [0.2, 0.8]])
    target = np.column_stack([1.5 * rest, [0.0, 0.3, -0.1]])
    limits = StretchLimits.sampled([0.3], [limit])
    return Problem(rest, np.array([[0, 1, 2]]), target, limits, mass=mass)


def closest(problem: Problem) -> FloatArray:
    """Closed form: one constraint, x = t - M^-1 g (|y| - b) / (g' M^-1 g) y / |y|."""
    g = problem.row_coefficients[0]
    y = g @ problem.target
    length = np.linalg.norm(y)
    step = g / problem.weights
    moved: FloatArray = np.outer(step, y / length) * (length - problem.bounds[0]) / (g @ step)
    return problem.target - moved


def drawn(seed: int, directions: int = 4, limit: float = 0.05) -> Problem:
    """An irregular mesh beyond its limits, which can be met."""
    return random_problem(np.random.default_rng(seed), directions=directions, limit=limit)


def apart(one: FloatArray, other: FloatArray) -> float:
    """The largest difference of a coordinate; infinite where it is not finite."""
    largest = float(np.abs(one - other).max())
    return largest if np.isfinite(largest) else float("inf")
