"""The projection within half-spaces and planes, a quadratic program, as Clarabel takes it."""

from __future__ import annotations

import numpy as np
import scipy

from solvers.sequential_cuts.halfspaces import Rows
from solvers.sequential_cuts.program import SCALING, Answer, least_gap, settings
from strainbench import Clock, Problem
from strainbench import sparse as sp
from strainbench.arrays import FloatArray
from strainbench.plugins import Library

clarabel = Library("clarabel")


class Quadratic:
    """Minimise the objective, in the norm of masses or of a metric.

    Unknowns are u = (x - target) / edge of the free vertices, and the slack t.

    Parameters
    ----------
    price : of t >= 0, which lower limits may lack, in units of the scaled objective; or None

    Attributes
    ----------
    slack : t of the last answer
    """

    def __init__(self, problem: Problem, price: float | None = None) -> None:
        self._problem, self._unit, self.slack = problem, problem.edge_length, 0.0
        unknowns = (3 * problem.free[:, None] + np.arange(3)).ravel()
        A = problem.metric
        if A is None:
            A = sp.diags_array(np.repeat(problem.weights, 3))
        A = sp.csc_array(sp.csr_array(A)[unknowns][:, unknowns])
        mean = float(A.diagonal().mean())
        self._scale, self._P = SCALING / (self._unit**2 * mean), SCALING / mean * A
        self._place = np.full(3 * problem.vertices, -1)
        self._place[unknowns] = np.arange(len(unknowns))
        self._q, self._loose = np.zeros(len(unknowns)), price is not None
        if price is not None:
            self._q = np.append(self._q, price)
        self._rows, self._constants = self._fixed()

    def add(self, cuts: Rows) -> None:
        """Further half-spaces."""
        q, target = len(cuts.offsets), self._problem.target
        columns = self._place[3 * cuts.vertices[:, :, None] + np.arange(3)]
        kept = np.nonzero(columns >= 0)
        values, row, column = -self._unit * cuts.coefficients[kept], kept[0], columns[kept]
        if self._loose:
            values, row = np.append(values, -1.0 * cuts.lower), np.append(row, np.arange(q))
            column = np.append(column, np.full(q, len(self._q) - 1))
        rows = sp.csr_array((values, (row, column)), shape=(q, len(self._q)))
        at_target = np.einsum("qkc,qkc->q", cuts.coefficients, target[cuts.vertices])
        self._rows = sp.vstack([self._rows, rows], format="csr")
        self._constants = np.append(self._constants, at_target - cuts.offsets)

    def solved(self, tolerance: float, deadline: Clock) -> Answer:
        """One interior-point run."""
        problem, P, count = self._problem, self._P, len(self._constants)
        if self._loose:
            P = sp.block_diag([P, sp.csc_array((1, 1))], format="csc")
        gap = tolerance * least_gap(problem, self._scale)
        options = settings(gap, deadline, feasibility=gap)
        options.equilibrate_enable = True  # without, it ends of insufficient progress at times
        found = clarabel.DefaultSolver(
            sp.csc_matrix(sp.triu(P)),
            self._q,
            sp.csc_matrix(self._rows),
            self._constants,
            [clarabel.NonnegativeConeT(count)] if count else [],
            options,
        ).solve()
        z, status = np.array(found.x), str(found.status)
        positions: FloatArray = problem.target.copy()
        positions[problem.free] += self._unit * z[: P.shape[0] - self._loose].reshape(-1, 3)
        if "Infeasible" in status:
            positions[:] = np.nan
        self.slack = max(0.0, float(z[-1])) if self._loose else 0.0
        return Answer(positions, np.array(found.z), status)

    def residual(self, x: FloatArray, duals: FloatArray) -> float:
        """Of the KKT conditions at x with these duals, relative to the move from the target."""
        problem, P = self._problem, self._P
        move = (x - problem.target)[problem.free].ravel() / self._unit
        left = P @ move + (self._rows.T @ duals)[: len(move)]
        size = float(np.sqrt(move @ (P @ move)))
        floor = float(np.sqrt(2 * self._scale * problem.objective_floor))
        return float(np.sqrt(left @ scipy.sparse.linalg.spsolve(P, left))) / max(size, floor)

    def _fixed(self) -> tuple[sp.csr_array, FloatArray]:
        """Rows and constants of vertices on each plane, in edges, and of t."""
        problem, width = self._problem, len(self._q)
        touching = np.intersect1d(problem.used, problem.free)
        column = self._place[3 * touching[:, None] + np.arange(3)].ravel()
        row = np.repeat(np.arange(len(touching)), 3)
        rows, constants = [sp.csr_array((0, width))], [np.zeros(0)]
        for plane in problem.contact:
            values = np.tile(-plane.normal, len(touching))
            rows.append(sp.csr_array((values, (row, column)), shape=(len(touching), width)))
            constants.append(plane.gaps(problem.target[touching]) / self._unit)
        if self._loose:
            rows.append(sp.csr_array(([-1.0], ([0], [width - 1])), shape=(1, width)))
            constants.append(np.zeros(1))
        return sp.vstack(rows, format="csr"), np.concatenate(constants)
