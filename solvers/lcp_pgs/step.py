"""One constrained step, whose limits are linearised once, for whichever method solves it.

Hernandez et al. 2013, section 4. From positions x_0 (`Problem.linearise_at`) an unconstrained step
has proposed x*. With d = x - x_0 = h v, h times the velocities, the constrained step is

    minimise 1/2 ||d - (x* - x_0)||_A^2  such that  C(x_0) + J d >= 0,  J = dC/dx at x_0,

whose KKT conditions are the paper's linear complementarity problem: one step of sequential
quadratic programming for the projection in the norm of A, whose end is no point within the limits.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy

from strainbench import Clock, Problem, Solution, Solver, section
from strainbench import sparse as sp
from strainbench.arrays import FloatArray, IntArray
from strainbench.problem.principal import PrincipalLimits

SELECTIONS, ROWS = ("near", "violated"), ("exact", "biot")


class Linearised:
    """The step's quadratic program, on the coordinates of the free vertices.

    Attributes
    ----------
    start : (n, 3) x_0 with pins where they go
    proposed : (u,) x* - x_0
    A : (u, u) the metric
    C, slopes : (rows,) values at x_0, and (rows, 3, dim) dC/dF
    """

    def __init__(self, problem: Problem, rows: str) -> None:
        self.problem = problem
        at = problem.target if problem.linearise_at is None else problem.linearise_at
        assert isinstance(problem.kind, PrincipalLimits)
        values, slopes = problem.kind.linearised(problem.deformation_gradients(at), rows)
        self.C, self.slopes = values.ravel(), slopes.reshape(-1, *slopes.shape[2:])
        self.start = at.copy()
        self.start[problem.held] = problem.target[problem.held]
        self.pushed = self.start - at  # by the pins alone
        self.proposed = (problem.target - self.start)[problem.free].ravel()
        unknowns = (3 * problem.free[:, None] + np.arange(3)).ravel()
        if problem.metric is None:
            self.A = sp.diags_array(np.repeat(problem.weights[problem.free], 3), format="csc")
        else:
            self.A = sp.csc_array(problem.metric[unknowns][:, unknowns])
        self._number = np.full(3 * problem.vertices, -1)
        self._number[unknowns] = np.arange(len(unknowns))
        self._each = len(self.C) // len(problem.elements)

    def jacobian(self, chosen: IntArray) -> tuple[sp.csr_array, FloatArray]:
        """(k, u) J of these rows, and J times what the pins move."""
        problem, element = self.problem, chosen // self._each
        by_corner = np.einsum("rxc,rkc->rkx", self.slopes[chosen], problem.gradients[element])
        corners = problem.elements[element]
        moved = np.einsum("rkx,rkx->r", by_corner, self.pushed[corners])
        column = self._number[3 * corners[:, :, None] + np.arange(3)].reshape(len(chosen), -1)
        row, entry = np.nonzero(column >= 0)
        values = by_corner.reshape(len(chosen), -1)[row, entry]
        shape = (len(chosen), len(self.proposed))
        return sp.csr_array((values, (row, column[row, entry])), shape=shape), moved

    def room(self, x: FloatArray) -> FloatArray:
        """(rows,) C at positions x (n, 3)."""
        return -self.problem.kind.measure(self.problem.G @ x)

    def positions(self, d: FloatArray) -> FloatArray:
        """(n, 3) x_0 + d."""
        x: FloatArray = self.start.copy()
        x[self.problem.free] += d.reshape(-1, 3)
        return x


class Rows(NamedTuple):
    """The rows of a round: J d + c >= 0, and how they are solved.

    J : (k, u); c : (k,); l : (k,) multipliers to start from
    """

    step: Linearised
    J: sp.csr_array
    c: FloatArray
    l: FloatArray  # noqa: E741


class Answer(NamedTuple):
    """d (u,), the multipliers (k,), iterations, and why it is no solution, or ""."""

    d: FloatArray
    l: FloatArray  # noqa: E741
    iterations: int
    fault: str


@dataclass(frozen=True)
class LinearComplementarity(Solver):
    """A solver of the linearised step; its fields are those of `LcpPgs`."""

    takes_principal = True
    takes_metric = True

    select: str = "near"
    gamma: float = 0.2
    rounds: int = 3
    rows: str = "exact"

    def __post_init__(self) -> None:
        for name, valid in (("select", SELECTIONS), ("rows", ROWS)):
            if getattr(self, name) not in valid:
                raise ValueError(f"{name} is {getattr(self, name)!r}: valid are {', '.join(valid)}")
        if not 0 < self.gamma <= 1:
            raise ValueError(f"gamma is {self.gamma}: a number above 0, up to 1, is valid")
        if self.rounds < 1:
            raise ValueError(f"rounds is {self.rounds}: a whole number above 0 is valid")

    @abstractmethod
    def solved(self, rows: Rows, inverse: Callable[[FloatArray], FloatArray]) -> Answer:
        """The quadratic program of these rows; `inverse` is A^-1."""

    def supports(self, problem: Problem) -> str | None:
        """A reason, where limits are not on principal stretches, or have no Biot rows."""
        if refusal := super().supports(problem):
            return refusal
        if not isinstance(problem.kind, PrincipalLimits):
            return "it limits principal stretches alone"
        if self.rows == "biot" and problem.kind.name != "hyperbolic":
            return "Biot rows are those of hyperbolic limits"
        return None

    def solve(
        self,
        problem: Problem,
        state: None,
        *,
        tolerance: float,
        monitor: Callable[..., None],
        deadline: Clock,
    ) -> Solution:
        """Rounds of one step, each with the rows that the last one violates beside its own."""
        with section("linearise"):
            step = Linearised(problem, self.rows)
        x, chosen = step.positions(step.proposed), self._flagged(step)
        if len(chosen) == 0 or len(problem.free) == 0:
            return Solution(x, "nothing near a limit", 0, details={"rows": 0.0})
        with section("factorise"):
            inverse = scipy.sparse.linalg.splu(
                step.A, "MMD_AT_PLUS_A", options={"SymmetricMode": True}
            ).solve
        multipliers, iterations, faults = np.zeros(len(step.C)), 0, 0
        for number in range(1, self.rounds + 1):
            answer = self.solved(self._rows(step, chosen, multipliers[chosen]), inverse)
            multipliers[chosen], iterations = answer.l, iterations + answer.iterations
            faults += bool(answer.fault)
            x = step.positions(answer.d)
            monitor(x.copy(), None, iterations)
            beyond = problem.kind.whichever_axis(step.room(x) < 0)  # type: ignore[attr-defined]
            more = np.setdiff1d(np.flatnonzero(beyond), chosen)
            if len(more) == 0 or number == self.rounds or deadline.passed:
                break
            chosen = np.union1d(chosen, more)
        details = {
            "rows": float(len(chosen)),
            "rounds": float(number),
            "unconverged": float(faults),
        }
        return Solution(x, answer.fault or "linearised step solved", iterations, details=details)

    def _flagged(self, step: Linearised) -> IntArray:
        """The rows of the first round: those that x* violates, or comes near to, or x_0 does."""
        problem = step.problem
        assert isinstance(problem.kind, PrincipalLimits)
        near = 0.5 * problem.kind.tightest if self.select == "near" else 0.0
        flagged = problem.kind.whichever_axis(step.room(problem.target) < near)
        if self.select == "near":
            flagged |= np.less(step.C, near)
        return np.flatnonzero(flagged)

    def _rows(self, step: Linearised, chosen: IntArray, multipliers: FloatArray) -> Rows:
        """C + J d >= 0, of what is violated at x_0 a share alone to be made good."""
        C = step.C[chosen]
        J, moved = step.jacobian(chosen)
        return Rows(step, J, np.where(C < 0, self.gamma * C, C) + moved, multipliers)
