"""The projection within a convex restriction of its lower bounds, as Clarabel takes it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from solvers.sequential_cuts.cuts import Cuts
from strainbench import Clock, Problem
from strainbench import sparse as sp
from strainbench.arrays import FloatArray
from strainbench.plugins import Library
from strainbench.problem.conic import ConicForm

clarabel = Library("clarabel")

SCALING = 256.0
"""Of the objective, in units of 1/edge^2 over the mean mass; lengths are in edges. On the swing's
first ten frames at 6 cells, without lower bounds, 4, 16 and 64 leave gaps of 1e-5 to 1.5e-6."""
ACCURACY = 1e-2
"""Clarabel's gap tolerances over those that the asked for one amounts to."""
PRICE = 120.0
"""Of the slack, in units of the scaled objective, for each free vertex: it must exceed the sum of
the lower bounds' multipliers, which grows with the mesh. On stretch-square at 6, 10 and 20 cells
40 is too little unless it grows; 1200 saves a round or two, and ends up to 14% higher."""


@dataclass(frozen=True, eq=False)
class Answer:
    """What a round found: positions (n, 3), duals of the cones' entries; in so many programs."""

    positions: FloatArray
    duals: FloatArray
    status: str
    programs: int = 1


class Restricted(Protocol):
    """The projection within a restriction that touches at positions x (n, 3)."""

    def solve(
        self, problem: Problem, x: FloatArray, tolerance: float, deadline: Clock, dearer: float = 1
    ) -> Answer:
        """Of the restriction at x, slack being so many times dearer."""

    def residual(self, problem: Problem, x: FloatArray, duals: FloatArray) -> float:
        """Of the KKT conditions at x with these duals, relative to the move from the target."""

    def multipliers(self, x: FloatArray, duals: FloatArray) -> FloatArray | None:
        """(rows, 3) of rows of G, where the duals are of such."""


class Program:
    """Minimise the objective under the upper bounds and the cuts that touch at some x.

    Parameters
    ----------
    slack : whether the lower bounds may lack t >= 0, at a price.
    """

    def __init__(self, problem: Problem, cuts: Cuts, slack: bool) -> None:
        self.cuts, self.slack = cuts, slack
        self.form = form = ConicForm(problem, SCALING)
        self._upper = form.A.tocoo()
        u, q, top = form.P.shape[0], len(cuts.offsets), form.A.shape[0]
        place = np.full(problem.vertices, -1)
        place[problem.free] = np.arange(len(problem.free))
        columns = 3 * place[cuts.vertices][:, :, None] + np.arange(3)
        self._kept = np.broadcast_to(columns >= 0, columns.shape)
        rows = np.broadcast_to(top + np.arange(q)[:, None, None], columns.shape)
        lines = [self._upper.row, rows[self._kept]]
        places = [self._upper.col, columns[self._kept]]
        P, self.q, cones = form.P, np.zeros(u), [clarabel.SecondOrderConeT(form.order)] * form.count
        self.cones = [*cones, *cuts.cones]
        self._rest = np.zeros(0)
        if slack:
            lines.append(top + np.arange(q + 1))
            places.append(np.full(q + 1, u))
            self._rest = -np.append(cuts.slack, 1.0)
            P = sp.block_diag([P, sp.csc_array((1, 1))], format="csc")
            self.q = np.append(self.q, PRICE * len(problem.free))
            self.cones.append(clarabel.NonnegativeConeT(1))
        self.P = sp.csc_matrix(P)
        shape = top + q + slack, u + slack
        at = np.concatenate(lines), np.concatenate(places)
        self.A = sp.csc_matrix(sp.coo_array((np.arange(len(at[0])), at), shape=shape))
        self._order = self.A.data.copy()
        self._solver: Any = None

    def solve(
        self, problem: Problem, x: FloatArray, tolerance: float, deadline: Clock, dearer: float = 1
    ) -> Answer:
        """One interior-point run within the restriction at x, slack being so many times dearer."""
        self.touch(x)
        q = np.append(self.q[:-1], dearer * self.q[-1]) if self.slack else self.q
        b = self._constants(problem)
        gap = tolerance * least_gap(problem, self.form.scale)
        chosen = settings(gap, deadline, feasibility=100 * gap)
        if self._solver is None:
            self._solver = clarabel.DefaultSolver(self.P, q, self.A, b, self.cones, chosen)
        else:
            self._solver.update(q=q, A=self.A, b=b, settings=chosen)
        found = self._solver.solve()
        z = np.array(found.x)
        positions = self.form.positions(problem, z[:-1] if self.slack else z)
        status = str(found.status)
        if "Infeasible" in status:
            positions[:] = np.nan
        return Answer(positions, np.array(found.z), status)

    def residual(self, problem: Problem, x: FloatArray, duals: FloatArray) -> float:
        """Of the KKT conditions at x with these duals, relative to the move from the target.

        As the referee's, which has the best multipliers: forces in the norm of M^-1.
        """
        self.touch(x)
        root = np.sqrt(self.form.P.diagonal())
        move = (x - problem.target)[problem.free].ravel() / self.form.unit
        left = root * move + (self.A.T @ duals)[: len(move)] / root
        floor = np.sqrt(2 * self.form.scale * problem.objective_floor)
        return float(np.linalg.norm(left) / max(np.linalg.norm(root * move), floor))

    def multipliers(self, x: FloatArray, duals: FloatArray) -> FloatArray | None:
        """(rows, 3) Y of upper and lower bounds together, where the cuts are of rows of G."""
        top = self.form.A.shape[0]
        lower = self.cuts.multipliers(x, duals[top : top + len(self.cuts.offsets)])
        upper = self.form.multipliers(duals)
        return None if lower is None else upper + lower / self.form.scale

    def touch(self, x: FloatArray) -> None:
        """Renew the cuts."""
        self._C = self.cuts.coefficients(x)
        lower = -self.form.unit * self._C[self._kept]
        self.A.data = np.concatenate([self._upper.data, lower, self._rest])[self._order]

    def _constants(self, problem: Problem) -> FloatArray:
        at_target = np.einsum("qkc,qkc->q", self._C, problem.target[self.cuts.vertices])
        lower = at_target - self.cuts.offsets
        return np.concatenate([self.form.constants(problem), lower, np.zeros(int(self.slack))])


def least_gap(problem: Problem, scale: float) -> float:
    """Of a scaled objective, what a tolerance of 1 amounts to for Clarabel."""
    return ACCURACY * min(1.0, scale * problem.objective_floor)


def settings(gap: float, deadline: Clock, feasibility: float) -> Any:
    """Clarabel's, without what it would do to a scaled program."""
    s = clarabel.DefaultSettings()
    s.verbose, s.max_threads, s.equilibrate_enable = False, 1, False
    s.presolve_enable = s.chordal_decomposition_enable = False
    s.direct_solve_method = "faer"
    s.time_limit = max(deadline.remaining, 1e-3)
    s.tol_gap_abs = s.tol_gap_rel = gap
    s.tol_feas = feasibility
    return s
