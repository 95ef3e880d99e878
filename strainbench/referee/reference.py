"""Reference optima for the referee: solved by one solver of the suite, verified here.

Where that one fails others are asked, and where all do the reference says why: an answer is then
judged by its own positions alone.

A solver is given bounds that are tighter by a hair, or by more where that does not suffice, so that
its positions are feasible; bound and error are then computed from positions and multipliers alone.

A degenerate optimum has many multipliers, and the largest price a violation that the outcome allows
at more than the gap it allows. Where they are dear, other solvers are asked for cheaper ones too.

A problem with lower bounds is not convex. Its reference is a local optimum, an objective to
compare with and nothing more.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from strainbench.arrays import FloatArray
from strainbench.plugins import UnavailableError
from strainbench.problem.dual import Dual, dual_bound, relative
from strainbench.problem.problem import Problem
from strainbench.solver.registry import find_solver
from strainbench.solver.solver import Solution, Solver, run_solver

REFERENCE_SOLVER = "newton-ipm"
SLOW_SOLVER = "clarabel-tight"  # where the other one fails
LAST_SOLVERS = "clarabel", "clarabel-default"
"""Asked for less, and scaled less, these cope with limits far from the target; not scaled at all,
with masses over 20 decades, whose mean says nothing of most."""
LOCAL_SOLVERS = "sequential-cuts", "ipopt"
"""Of problems with lower bounds, the first that takes them: the one folds flat sheets, where the
other stays at a saddle, and at 20 cells does not come to an end."""
TOLERANCE = 1e-11  # asked of the reference solver
LAST_TOLERANCE, LOCAL_TOLERANCE = 1e-6, 1e-6
ATTEMPTS = 4  # each but the first with bounds tightened further, by three times the violation
ENOUGH = 1e-6  # relative gap of a reference that needs no second solver
MARGIN = 3e-13  # of the first attempt, above what the reference solver leaves of violation
ALLOWED = 1e-6  # violation of an optimal answer, by default of `certify`
DEAR = 1e-2  # relative gap from that violation in every constraint; of cloth scenes it is 1e-4
ACTIVE = 1e-6  # constraints this close to their bound count as active
Kept = dict[str, tuple[FloatArray, list[FloatArray], str | None]]
"""Positions, multipliers, and why they are no optimum, by the content of the problem."""


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
    failure : what the reference solvers said, or raised, where they found no optimum
    cheaper : lower bound and |Y_i| of other multipliers, which price violations less
    """

    positions: FloatArray
    multiplier_norms: FloatArray
    lower_bound: float
    error: float
    active_constraints: int
    infeasible: str | None = None
    failure: str | None = None
    cheaper: Dual | None = None

    @classmethod
    def local(cls, problem: Problem, positions: FloatArray) -> Reference:
        """Of a problem that is not convex: nothing is known of other points."""
        stretches = problem.stretches(positions)
        active = stretches > problem.bounds - ACTIVE
        if problem.kind.lower is not None:
            active |= stretches < problem.lower_bounds + ACTIVE
        nothing = np.full(problem.constraints, np.nan)
        pins, nan = problem.infeasible_pins(), float("nan")
        return cls(positions, nothing, nan, nan, int(np.sum(active)), pins)

    @classmethod
    def verified(
        cls, problem: Problem, positions: FloatArray, multipliers: FloatArray
    ) -> Reference:
        """Bounds that hold whatever the positions (n, 3) and multipliers (rows, 3) are."""
        if not problem.convex:
            return cls.local(problem, positions)
        lower_bound, norms = dual_bound(problem, multipliers)
        infeasible = problem.infeasible_pins()
        if infeasible is None and lower_bound > problem.largest_objective:
            infeasible = (
                "infeasible: the dual bound exceeds the objective of any point within limits"
            )
        feasible = bool(np.all(np.isfinite(positions))) and not np.any(
            problem.violations(positions)
        )
        if not feasible:
            nothing = np.full_like(problem.target, np.nan)
            return cls(nothing, norms, lower_bound, np.inf, 0, infeasible)
        gap = max(0.0, problem.objective(positions) - lower_bound)
        error = np.sqrt(2 * gap / problem.least_weight)
        active = int(np.sum(problem.stretches(positions) > problem.bounds - ACTIVE))
        return cls(positions, norms, lower_bound, float(error), active, infeasible)

    @property
    def duals(self) -> list[Dual]:
        """What is known from multipliers, the highest lower bound first."""
        best = self.lower_bound, self.multiplier_norms
        return [best] if self.cheaper is None else [best, self.cheaper]


class ReferenceSolver:
    """References for the frames of one mesh.

    Parameters
    ----------
    problem : any frame; its matrices are prepared once
    kept : positions and multipliers by content, read and added to; no file, which a cell's
        solver could read its answers from
    """

    def __init__(self, problem: Problem, kept: Kept | None = None) -> None:
        self._solvers = _reference_solvers(problem)
        self._states: dict[Solver, Any] = {}
        self._problem = problem
        self._kept = {} if kept is None else kept

    def __call__(self, problem: Problem) -> Reference:
        """The reference of a frame of this mesh; one that says so where the solvers failed."""
        with np.errstate(all="ignore"):  # what overflows is not finite, and judged as that
            if not np.any(problem.violations(problem.target)):
                return Reference.verified(problem, problem.target, np.zeros((problem.rows, 3)))
            key = content_key(problem)
            if key not in self._kept:
                self._kept[key] = self._solve(problem)
            positions, (best, cheaper), failure = self._kept[key]
            reference = replace(Reference.verified(problem, positions, best), failure=failure)
            if cheaper is best or not problem.convex:
                return reference
            return replace(reference, cheaper=dual_bound(problem, cheaper))

    def _solve(self, problem: Problem) -> tuple[FloatArray, list[FloatArray], str | None]:
        """Positions, multipliers, and what the solvers said where these are no optimum.

        The next solver is asked where those before left no answer with a gap below ENOUGH, or
        only multipliers that are DEAR. Of these the best are kept, and the best with that price.
        """
        positions = np.full_like(problem.target, np.nan)
        multipliers = [np.zeros((problem.rows, 3))] * 2
        if len(problem.free) == 0 or problem.infeasible_pins():
            return positions, multipliers, None
        said, enough = [], False
        for solver in self._solvers:
            try:
                for solution in self._attempts(solver, problem):
                    positions = _better_positions(problem, solution.positions, positions)
                    multipliers = [
                        _better_multipliers(problem, solution.multipliers, old, price)
                        for old, price in zip(multipliers, (0.0, ALLOWED), strict=True)
                    ]
                said.append(f"{solver.label}: {solution.status}")
            except Exception as error:  # whatever it is: answers can be judged without
                words = " ".join(str(error).split())
                said.append(f"{solver.label}: {type(error).__name__}: {words}")
            enough = _enough(problem, positions, multipliers[0])
            if enough and not _dear(problem, *multipliers):
                break
        return positions, multipliers, None if enough else "; ".join(said) or None

    def _attempts(self, solver: Solver, problem: Problem) -> Iterator[Solution]:
        """Solutions with bounds that are tightened until one is feasible."""
        if solver not in self._states:
            self._states[solver] = solver.prepare(self._problem)
        state = self._states[solver]
        if not problem.convex:
            yield run_solver(solver, problem, state, LOCAL_TOLERANCE)
            return
        margin, half = MARGIN, 0.5 * float(problem.bounds.min())
        tolerance = LAST_TOLERANCE if solver.label in LAST_SOLVERS else TOLERANCE
        for _ in range(ATTEMPTS):
            tighter = problem.tightened(min(margin, half))
            solution = run_solver(solver, tighter, state, tolerance)
            yield solution
            violation = float(problem.violations(solution.positions).max())
            if violation == 0 or not (margin or violation > 0):
                break
            # limits that can be met, but not tightened ones, leave it no answer
            margin = 0.0 if np.isnan(violation) else margin + 3 * violation


def _better_positions(problem: Problem, new: FloatArray, old: FloatArray) -> FloatArray:
    """Of two answers a feasible one, that with the lower objective; else the new one."""
    if not problem.convex or np.any(problem.violations(old) != 0):
        return new
    within = not np.any(problem.violations(new) != 0)
    return new if within and problem.objective(new) <= problem.objective(old) else old


def _better_multipliers(
    problem: Problem, new: FloatArray | None, old: FloatArray, price: float
) -> FloatArray:
    """The multipliers with the higher lower bound, less the price of violations so large."""
    if not problem.convex or new is None:
        return old
    duals = (dual_bound(problem, Y) for Y in (new, old))
    values = [bound - price * float(norms.sum()) for bound, norms in duals]
    return new if values[0] > values[1] else old


def _dear(problem: Problem, best: FloatArray, cheaper: FloatArray) -> bool:
    """Whether violations of ALLOWED cost more than DEAR, with the cheaper multipliers too."""
    if not problem.convex:
        return False
    (highest, _), (bound, norms) = (dual_bound(problem, Y) for Y in (best, cheaper))
    return relative(problem, highest - bound + ALLOWED * float(norms.sum()), highest) > DEAR


def _enough(problem: Problem, positions: FloatArray, multipliers: FloatArray) -> bool:
    """Whether a reference of these is an optimum, or shows that there is none."""
    if not problem.convex:
        return bool(np.all(np.isfinite(positions)))
    reference = Reference.verified(problem, positions, multipliers)
    if not np.isfinite(reference.error):
        return reference.infeasible is not None
    gap = problem.objective(positions) - reference.lower_bound
    return relative(problem, gap, reference.lower_bound) <= ENOUGH


def _reference_solvers(problem: Problem) -> list[Solver]:
    """The solvers of references that take the problem, in turn; those missing are left out."""
    names = (REFERENCE_SOLVER, SLOW_SOLVER, *LAST_SOLVERS) if problem.convex else LOCAL_SOLVERS
    solvers = []
    for name in names:
        with suppress(UnavailableError):
            solvers.append(find_solver(name))
    return [solver for solver in solvers if not solver.supports(problem)]


def reference_of(problem: Problem) -> Reference:
    """The reference of a single problem, nothing kept."""
    return ReferenceSolver(problem)(problem)


def content_key(problem: Problem) -> str:
    """A digest of everything that the optimum depends on, and of who found it."""
    digest = hashlib.sha256(f"{REFERENCE_SOLVER} {TOLERANCE} {problem.kind.formula}".encode())
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
    if problem.metric is not None:
        for array in (problem.metric.data, problem.metric.indices):
            digest.update(array.tobytes())
    for plane in problem.contact:
        digest.update(np.concatenate([plane.point, plane.normal]).tobytes())
    return digest.hexdigest()[:32]
