"""Reference optima for the referee: solved by one solver of the suite, verified here.

It is given bounds that are tighter by a hair, or by more where that does not suffice, so that its
positions are feasible; bound and error are then computed from positions and multipliers alone.

A problem with lower bounds is not convex. Its reference is a local optimum found from the target,
an objective to compare with and nothing more.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from typing import Any

import numpy as np

from strainbench.discovery import UnavailableError, find_solver
from strainbench.limits import FloatArray
from strainbench.problem import Problem
from strainbench.solver import Solver, run_solver

REFERENCE_SOLVER = "newton-ipm"
SLOW_SOLVER = "clarabel-tight"  # of exact limits in volumes
LOCAL_SOLVER = "ipopt"  # of problems with lower bounds
TOLERANCE = 1e-11  # asked of the reference solver
LOCAL_TOLERANCE = 1e-6
ATTEMPTS = 4  # each but the first with bounds tightened further, by three times the violation
MARGIN = 3e-13  # of the first attempt, above what the reference solver leaves of violation
ACTIVE = 1e-6  # constraints this close to their bound count as active
Kept = dict[str, tuple[FloatArray, FloatArray]]


@dataclass(frozen=True, eq=False)
class Reference:
    """A verified lower bound and, with it, a feasible point.

    Attributes
    ----------
    positions : (n, 3) [m], feasible, or NaN where none was found
    multiplier_norms : (constraints,) |Y_i|
    lower_bound : on the objective of any feasible point; NaN where the problem is not convex
    error : rigorous bound on ||positions - x*||, and on ||x_Y - x*|| [m]; infinite without one
    active_constraints : constraints within ACTIVE of their bound
    infeasible : why no positions can meet the limits, where that is certain
    """

    positions: FloatArray
    multiplier_norms: FloatArray
    lower_bound: float
    error: float
    active_constraints: int
    infeasible: str | None = None


def objective_floor(problem: Problem) -> float:
    """Half a squared correction of 1e-3 mean edges a vertex: the least scale of a relative gap."""
    return 0.5 * float(np.sum(problem.weights[problem.free])) * (1e-3 * problem.edge_length) ** 2


def local(problem: Problem, positions: FloatArray) -> Reference:
    """Of a problem that is not convex: nothing is known of other points."""
    stretches = problem.stretches(positions)
    active = stretches > problem.bounds - ACTIVE
    active |= stretches < problem.lower_bounds + ACTIVE
    nothing = np.full(problem.constraints, np.nan)
    pins, nan = problem.infeasible_pins(), float("nan")
    return Reference(positions, nothing, nan, nan, int(np.sum(active)), pins)


def verify(problem: Problem, positions: FloatArray, multipliers: FloatArray) -> Reference:
    """Bounds that hold whatever the positions (n, 3) and multipliers (rows, 3) are.

    Y is scaled by the factor that makes D largest: D = lin^2 / 2 q with
    lin = <Y, G target> - sum b_i |Y_i| and q = ||G^T Y||^2_{M^-1}, less its own rounding.
    """
    if not problem.convex:
        return local(problem, positions)
    Y = np.where(np.isfinite(multipliers), multipliers, 0.0)
    norms = problem.dual_norms(Y)
    products = np.sum((Y * (problem.G @ problem.target)).reshape(len(norms), -1), axis=1)
    terms = products - problem.bounds * norms
    back = (problem.G.T @ Y)[problem.free]
    q = float(np.sum(back**2 / problem.weights[problem.free, None]))
    rounding = 16 * np.finfo(float).eps * 2 * float(np.sum(problem.bounds * norms))
    linear = float(np.sum(terms)) - rounding
    scale = linear / q if linear > 0 and q > 0 else 0.0
    lower_bound = 0.5 * linear * scale
    infeasible = problem.infeasible_pins()
    if infeasible is None and lower_bound > problem.largest_objective:
        infeasible = "infeasible: the dual bound exceeds the objective of any point within limits"
    feasible = bool(np.all(np.isfinite(positions))) and not np.any(problem.violations(positions))
    if not feasible:
        nothing = np.full_like(problem.target, np.nan)
        return Reference(nothing, scale * norms, lower_bound, np.inf, 0, infeasible)
    gap = max(0.0, problem.objective(positions) - lower_bound)
    error = np.sqrt(2 * gap / problem.least_weight)
    active = int(np.sum(problem.stretches(positions) > problem.bounds - ACTIVE))
    return Reference(positions, scale * norms, lower_bound, float(error), active, infeasible)


class ReferenceSolver:
    """References for the frames of one mesh.

    Parameters
    ----------
    problem : any frame; its matrices are prepared once
    kept : positions and multipliers by content, read and added to; no file, which a cell's
        solver could read its answers from
    """

    def __init__(self, problem: Problem, kept: Kept | None = None) -> None:
        self._solver = _reference_solver(problem)
        self._state: Any = None
        self._prepared = False
        self._problem = problem
        self._kept = {} if kept is None else kept

    def __call__(self, problem: Problem) -> Reference:
        """The reference of a frame of this mesh."""
        if not np.any(problem.violations(problem.target)):
            return verify(problem, problem.target, np.zeros((problem.rows, 3)))
        key = content_key(problem)
        if key not in self._kept:
            self._kept[key] = self._solve(problem)
        return verify(problem, *self._kept[key])

    def _solve(self, problem: Problem) -> tuple[FloatArray, FloatArray]:
        if self._solver is None:
            nothing = np.full_like(problem.target, np.nan)
            return nothing, np.zeros((problem.rows, 3))
        if not self._prepared:
            self._state = self._solver.prepare(self._problem)
            self._prepared = True
        if not problem.convex:
            found = run_solver(self._solver, problem, self._state, LOCAL_TOLERANCE)
            return found.positions, np.zeros((problem.rows, 3))
        margin, best = MARGIN, -np.inf
        for _ in range(ATTEMPTS):
            solution = run_solver(self._solver, problem.tightened(margin), self._state, TOLERANCE)
            assert solution.multipliers is not None, f"{self._solver.label}: no multipliers"
            bound = verify(problem, solution.positions, solution.multipliers).lower_bound
            if bound > best:
                best, multipliers = bound, solution.multipliers
            violation = float(problem.violations(solution.positions).max())
            if violation == 0 or not (margin or violation > 0):
                break
            # limits that can be met, but not tightened ones, leave it no answer
            margin = 0.0 if np.isnan(violation) else margin + 3 * violation
        return solution.positions, multipliers


def _reference_solver(problem: Problem) -> Solver | None:
    """The solver of references; None where only a missing one could take lower bounds."""
    if problem.convex:
        fast = find_solver(REFERENCE_SOLVER)
        return find_solver(SLOW_SOLVER) if fast.supports(problem) else fast
    try:
        return find_solver(LOCAL_SOLVER)
    except UnavailableError:
        return None


def reference_of(problem: Problem) -> Reference:
    """The reference of a single problem, nothing kept."""
    return ReferenceSolver(problem)(problem)


def content_key(problem: Problem) -> str:
    """A digest of everything that the optimum depends on, and of who found it."""
    digest = hashlib.sha256(f"{REFERENCE_SOLVER} {TOLERANCE}".encode())
    for array in (
        problem.row_vertices,
        problem.row_coefficients,
        problem.bounds,
        problem.lower_bounds,
        problem.target,
        problem.pinned,
        problem.weights,
    ):
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()[:32]
