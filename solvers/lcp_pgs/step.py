"""One constrained step, whose limits are linearised once, for whichever method solves it.

Hernandez et al. 2013, section 4. From positions x_0 (`Problem.linearise_at`) an unconstrained step
has proposed x*. With d = x - x_0 = h v, h times the velocities, the constrained step is

    minimise 1/2 ||d - (x* - x_0)||_A^2  such that  C(x_0) + J d >= 0,  J = dC/dx at x_0,

whose KKT conditions are the paper's linear complementarity problem: one step of sequential
quadratic programming for the projection in the norm of A, whose end is no point within the limits.
Contact with planes is further rows of C (`contact.py`); friction makes it no quadratic program.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from solvers.lcp_pgs.contact import Contacts, Friction
from strainbench import Clock, Problem, Solution, Solver, section
from strainbench import sparse as sp
from strainbench.arrays import FloatArray, IntArray
from strainbench.problem.contact import rubs
from strainbench.problem.principal import PrincipalLimits

SELECTIONS, ROWS = ("near", "violated"), ("exact", "biot")


class Linearised:
    """The step's quadratic program, on the coordinates of the free vertices.

    Attributes
    ----------
    start : (n, 3) x_0 with pins where they go
    proposed : (u,) x* - x_0
    A : (u, u) the metric
    C, slopes : (rows,) values at x_0, of contacts the last ones, and (limits, 3, dim) dC/dF
    limits : rows that are not of contacts
    """

    def __init__(self, problem: Problem, rows: str) -> None:
        self.problem = problem
        at = problem.target if problem.linearise_at is None else problem.linearise_at
        assert isinstance(problem.kind, PrincipalLimits)
        values, slopes = problem.kind.linearised(problem.deformation_gradients(at), rows)
        self.slopes = slopes.reshape(-1, *slopes.shape[2:])
        self.limits = len(self.slopes)
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
        self._each = self.limits // len(problem.elements)
        self.contacts = Contacts(problem, self._number)
        self.C = np.concatenate([values.ravel(), self.contacts.gaps(self.start)])

    def jacobian(self, chosen: IntArray) -> tuple[sp.csr_array, FloatArray]:
        """(k, u) J of these rows, in ascending order, and J times what the pins move.

        Contacts count from where the pins have gone.
        """
        of_limits, touching = np.split(chosen, [np.searchsorted(chosen, self.limits)])
        J, moved = self._of_limits(of_limits)
        if len(touching) == 0:
            return J, moved
        normals = self.contacts.rows(touching - self.limits)
        return sp.vstack([J, normals], format="csr"), np.append(moved, np.zeros(len(touching)))

    def _of_limits(self, chosen: IntArray) -> tuple[sp.csr_array, FloatArray]:
        problem, element = self.problem, chosen // self._each
        by_corner = np.einsum("rxc,rkc->rkx", self.slopes[chosen], problem.gradients[element])
        corners = problem.elements[element]
        moved = np.einsum("rkx,rkx->r", by_corner, self.pushed[corners])
        column = self._number[3 * corners[:, :, None] + np.arange(3)]
        place = np.nonzero(column >= 0)
        row, values = place[0], by_corner[place]
        shape = (len(chosen), len(self.proposed))
        return sp.csr_array((values, (row, column[place])), shape=shape), moved

    def room(self, x: FloatArray) -> FloatArray:
        """(rows,) C at positions x (n, 3)."""
        limits = -self.problem.kind.measure(self.problem.G @ x)
        return np.concatenate([limits, self.contacts.gaps(x)])

    def whichever_axis(self, rows: NDArray[np.bool_]) -> IntArray:
        """The marked rows and those of an element's other principal axes: see the limits."""
        limits, touching = np.split(rows, [self.limits])
        kind = self.problem.kind
        assert isinstance(kind, PrincipalLimits)
        return np.flatnonzero(np.append(kind.whichever_axis(limits), touching))

    def positions(self, d: FloatArray) -> FloatArray:
        """(n, 3) x_0 + d."""
        x: FloatArray = self.start.copy()
        x[self.problem.free] += d.reshape(-1, 3)
        return x


class Rows(NamedTuple):
    """The rows of a round: J d + c >= 0, and how they are solved.

    J : (k, u); c : (k,); l : (k,) multipliers to start from; friction, if there is any
    """

    step: Linearised
    J: sp.csr_array
    c: FloatArray
    l: FloatArray  # noqa: E741
    friction: Friction | None = None


class Answer(NamedTuple):
    """d (u,), the multipliers (k,), iterations, why it is no solution, or "", and friction's."""

    d: FloatArray
    l: FloatArray  # noqa: E741
    iterations: int
    fault: str
    rubbing: FloatArray | None = None


class Forces(NamedTuple):
    """The multipliers of all rows, and of friction (contacts, 2), as rounds find them."""

    step: Linearised
    normal: FloatArray
    rubbing: FloatArray

    @classmethod
    def none(cls, step: Linearised) -> Forces:
        """Before the first round."""
        return cls(step, np.zeros(len(step.C)), np.zeros((len(step.C) - step.limits, 2)))

    def take(self, chosen: IntArray, answer: Answer) -> None:
        """Keep those that a round has found."""
        self.normal[chosen] = answer.l
        if answer.rubbing is not None:
            touching = chosen[chosen >= self.step.limits] - self.step.limits
            self.rubbing[touching] = answer.rubbing.reshape(-1, 2)

    def told(self) -> dict[str, float]:
        """How many vertices touch, the sum of normal forces times h^2 [kg m], and the cone's error.

        The error is the largest |l_t| - mu l_n, over the largest l_n. None of it without planes.
        """
        contact = self.step.problem.contact
        if not contact:
            return {}
        l = self.normal[self.step.limits :]  # noqa: E741
        mu = np.repeat([p.friction for p in contact], self.step.problem.vertices)
        beyond = np.linalg.norm(self.rubbing, axis=1) - mu * l
        return {
            "contacts": float(np.sum(l > 0)),
            "push": float(l.sum()) / self.step.contacts.edge,
            "cone_error": max(0.0, float(beyond.max())) / max(float(l.max()), 1e-300),
        }


@dataclass(frozen=True)
class LinearComplementarity(Solver):
    """A solver of the linearised step; its fields are those of `LcpPgs`."""

    takes_principal = True
    takes_metric = True
    takes_contact = True

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
            details = {"rows": 0.0, "unconverged": 0.0, **Forces.none(step).told()}
            return Solution(x, "nothing near a limit", 0, details=details)
        with section("factorise"):
            inverse = scipy.sparse.linalg.splu(
                step.A, "MMD_AT_PLUS_A", options={"SymmetricMode": True}
            ).solve
        forces, iterations, faults = Forces.none(step), 0, 0
        for number in range(1, self.rounds + 1):
            answer = self.solved(self._rows(step, chosen, forces), inverse)
            forces.take(chosen, answer)
            iterations += answer.iterations
            faults += bool(answer.fault)
            x = step.positions(answer.d)
            monitor(x.copy(), None, iterations)
            more = np.setdiff1d(step.whichever_axis(step.room(x) < 0), chosen)
            if len(more) == 0 or number == self.rounds or deadline.passed:
                break
            chosen = np.union1d(chosen, more)
        details = {
            "rows": float(len(chosen)),
            "rounds": float(number),
            "unconverged": float(faults),
            **forces.told(),
        }
        return Solution(x, answer.fault or "linearised step solved", iterations, details=details)

    def _flagged(self, step: Linearised) -> IntArray:
        """The rows of the first round: those that x* violates, or comes near to, or x_0 does."""
        problem = step.problem
        assert isinstance(problem.kind, PrincipalLimits)
        near = 0.5 * problem.kind.tightest if self.select == "near" else 0.0
        flagged = step.whichever_axis(step.room(problem.target) < near)
        if self.select == "near":
            flagged = np.union1d(flagged, np.flatnonzero(np.less(step.C, near)))
        return flagged

    def _rows(self, step: Linearised, chosen: IntArray, forces: Forces) -> Rows:
        """C + J d >= 0, of limits violated at x_0 a share alone to be made good."""
        C = step.C[chosen]
        J, moved = step.jacobian(chosen)
        share = np.where((C < 0) & (chosen < step.limits), self.gamma, 1.0)
        rows = Rows(step, J, share * C + moved, forces.normal[chosen])
        touching = chosen[chosen >= step.limits] - step.limits
        if len(touching) == 0 or not rubs(step.problem.contact):
            return rows
        rubbing = forces.rubbing[touching].ravel()
        return rows._replace(friction=step.contacts.friction(touching, step.pushed, rubbing))
