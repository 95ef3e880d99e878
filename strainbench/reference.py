"""Reference optima for the referee: solved by one solver of the suite, verified here.

The solver's positions are moved by the last bit of violation that it leaves, or if that fails
solved for again with tighter bounds, until they are feasible; bound and error are then computed
from positions and multipliers alone.

A problem with lower bounds is not convex. Its reference is a local optimum found from the target,
an objective to compare with and nothing more.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from strainbench.discovery import UnavailableError, find_solver
from strainbench.limits import FloatArray
from strainbench.problem import Problem
from strainbench.solver import Solver, run_solver

REFERENCE_SOLVER = "clarabel-tight"
LOCAL_SOLVER = "ipopt"  # of problems with lower bounds
TOLERANCE = 1e-6  # asked of the reference solver, which stalls below
ATTEMPTS = 4  # each but the first with bounds tightened further, by this and twice the violation
MARGIN = 1e-8
ACTIVE = 1e-6  # constraints this close to their bound count as active
REPAIRABLE = 1e-5  # violations up to this are repaired
REGULAR = 1e-8  # of the repair's matrix, relative to its mean diagonal
REPAIRS = 50  # Newton steps at most, each a pair of triangular solves


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
    cache : a folder in which references are kept by content, or None
    """

    def __init__(self, problem: Problem, cache: Path | None = None) -> None:
        self._solver = _reference_solver(problem)
        self._state: Any = None
        self._prepared = False
        self._problem = problem
        self._cache = cache

    def __call__(self, problem: Problem) -> Reference:
        """The reference of a frame of this mesh."""
        if not np.any(problem.violations(problem.target)):
            return verify(problem, problem.target, np.zeros((problem.rows, 3)))
        file = self._cache and self._cache / f"{content_key(problem)}.npz"
        if file and file.exists():
            with np.load(file) as data:
                return verify(problem, data["positions"], data["multipliers"])
        positions, multipliers = self._solve(problem)
        if file:
            file.parent.mkdir(parents=True, exist_ok=True)
            part = file.with_suffix(".part.npz")
            np.savez(part, positions=positions, multipliers=multipliers)
            part.replace(file)
        return verify(problem, positions, multipliers)

    def _solve(self, problem: Problem) -> tuple[FloatArray, FloatArray]:
        if self._solver is None:
            nothing = np.full_like(problem.target, np.nan)
            return nothing, np.zeros((problem.rows, 3))
        if not self._prepared:
            self._state = self._solver.prepare(self._problem)
            self._prepared = True
        if not problem.convex:
            found = run_solver(self._solver, problem, self._state, TOLERANCE)
            return found.positions, np.zeros((problem.rows, 3))
        margin, best = 0.0, -np.inf
        for _ in range(ATTEMPTS):
            tight = problem.tightened(margin)
            solution = run_solver(self._solver, tight, self._state, TOLERANCE)
            assert solution.multipliers is not None, f"{REFERENCE_SOLVER} returns no multipliers"
            bound = verify(problem, solution.positions, solution.multipliers).lower_bound
            if bound > best:
                best, multipliers = bound, solution.multipliers
            violation = float(problem.violations(solution.positions).max())
            positions = repaired(problem, solution.positions)
            if not problem.violations(positions).max() > 0:  # NaN where limits cannot be met
                break
            margin += MARGIN + 2 * violation
        return positions, multipliers


def _reference_solver(problem: Problem) -> Solver | None:
    """The solver of references; None where only a missing one could take lower bounds."""
    if problem.convex:
        return find_solver(REFERENCE_SOLVER)
    try:
        return find_solver(LOCAL_SOLVER)
    except UnavailableError:
        return None


def repaired(problem: Problem, positions: FloatArray) -> FloatArray:
    """Nearly feasible positions (n, 3) moved by about their violation, to feasible ones.

    Newton steps on the rows at their bound, with a matrix factorised once: the least move that
    takes each violated row just inside and leaves the others where they are, up to REGULAR.
    Where that fails, the positions come back still violated.
    """
    stretches = problem.stretches(positions)
    violation = float(np.max(stretches - problem.bounds))
    if not 0 < violation < REPAIRABLE:
        return positions
    active = np.flatnonzero(stretches > problem.bounds - ACTIVE)
    along = (problem.G @ positions)[active] / stretches[active, None]
    J = sp.hstack(
        [sp.diags_array(a) @ problem.G[active][:, problem.free] for a in along.T], format="csr"
    )
    weights = np.tile(problem.weights[problem.free], 3)
    stiffness = weights.mean() * len(active) / (REGULAR * float(np.sum(J.data**2)))
    factor = splu(
        sp.csc_matrix(sp.diags_array(weights) + stiffness * (J.T @ J)),
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )
    x = positions.copy()
    for _ in range(REPAIRS):
        excess = (problem.stretches(x) - problem.bounds)[active]
        if excess.max() > REPAIRABLE:  # the steps diverge
            return positions
        wanted = np.where(excess > 0, 1.5 * excess + 1e-14, 0.0)
        if not np.any(wanted):
            break
        x[problem.free] -= stiffness * factor.solve(J.T @ wanted).reshape(3, -1).T
    return x


def reference_of(problem: Problem) -> Reference:
    """The reference of a single problem, nothing kept."""
    return ReferenceSolver(problem)(problem)


def content_key(problem: Problem) -> str:
    """A digest of everything that the optimum depends on."""
    digest = hashlib.sha256()
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
