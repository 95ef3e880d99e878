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
        self._fixed = self._rows_of_planes()

    def solved(self, cuts: Rows, tolerance: float, deadline: Clock) -> Answer:
        """One interior-point run within these and what is fixed."""
        problem, P, (fixed, constants) = self._problem, self._P, self._fixed
        rows, of_cuts = self._rows_of(cuts)
        self._rows, b = sp.vstack([fixed, rows], format="csc"), np.append(constants, of_cuts)
        if self._loose:
            P = sp.block_diag([P, sp.csc_array((1, 1))], format="csc")
        gap = tolerance * least_gap(problem, self._scale)
        options = settings(gap, deadline, feasibility=gap)
        options.equilibrate_enable = True  # without, it ends of insufficient progress at times
        cones = [clarabel.NonnegativeConeT(len(b))] if len(b) else []
        P, rows = sp.csc_matrix(sp.triu(P)), sp.csc_matrix(self._rows)
        found = clarabel.DefaultSolver(P, self._q, rows, b, cones, options).solve()
        z, status = np.array(found.x), str(found.status)
        positions: FloatArray = problem.target.copy()
        positions[problem.free] += self._unit * z[: len(z) - self._loose].reshape(-1, 3)
        if "Infeasible" in status:
            positions[:] = np.nan
        self.slack = max(0.0, float(z[-1])) if self._loose else 0.0
        return Answer(positions, np.array(found.z), status)

    def _rows_of(self, cuts: Rows) -> tuple[sp.csr_array, FloatArray]:
        """Rows and constants of half-spaces."""
        q, target = len(cuts.offsets), self._problem.target
        columns = self._place[3 * cuts.vertices[:, :, None] + np.arange(3)]
        kept = np.nonzero(columns >= 0)
        values, row, column = -self._unit * cuts.coefficients[kept], kept[0], columns[kept]
        if self._loose:
            values, row = np.append(values, -1.0 * cuts.lower), np.append(row, np.arange(q))
            column = np.append(column, np.full(q, len(self._q) - 1))
        rows = sp.csr_array((values, (row, column)), shape=(q, len(self._q)))
        at_target = np.einsum("qkc,qkc->q", cuts.coefficients, target[cuts.vertices])
        return rows, at_target - cuts.offsets

    def residual(self, x: FloatArray, duals: FloatArray) -> float:
        """Of the KKT conditions at x with these duals, relative to the move from the target."""
        problem, P = self._problem, self._P
        move = (x - problem.target)[problem.free].ravel() / self._unit
        left = P @ move + (self._rows.T @ duals)[: len(move)]
        size = float(np.sqrt(move @ (P @ move)))
        floor = float(np.sqrt(2 * self._scale * problem.objective_floor))
        return float(np.sqrt(left @ scipy.sparse.linalg.spsolve(P, left))) / max(size, floor)

    def _rows_of_planes(self) -> tuple[sp.csr_array, FloatArray]:
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
