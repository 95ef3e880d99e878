"""Ipopt on limits on principal stretches as they are (Hernandez et al. 2013, Eqs. 7 to 22).

    minimise s/2 ||x - target||^2 in the problem's norm  such that  C_i(x) >= 0,  n.(x - p) >= 0,

with the values and derivatives of `strainbench.problem.principal_rows`, all rows of all elements,
and of the vertices on each plane that they are kept off. The Hessian is Ipopt's own L-BFGS: that of
the rows is not there, and the metric alone in its place does not converge. Lengths are in edges,
and s = 10 / (mean weight), as with `solvers.ipopt`. Ipopt scales rows by their gradients: those of
free axes that are interpolated between are a million times steeper. A triangle under
`linear` limits takes 8 iterations so, and 87 without.

Rows have kinks where singular values are equal, as they are at rest; there derivatives are those of
values a little apart. Where the optimum lies in one, such as two values at one isotropic limit,
Ipopt steps to and fro across it and ends at its limit of iterations, near the limits.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from solvers.ipopt import ANSWERS, STATUS
from strainbench import Clock, Problem, Solution, Solver
from strainbench import sparse as sp
from strainbench.arrays import FloatArray, IntArray
from strainbench.plugins import Library
from strainbench.problem.principal import PrincipalLimits
from strainbench.solver.claim import claimed
from strainbench.solver.solver import held_still

cyipopt = Library("cyipopt")


@dataclass(frozen=True)
class IpoptPrincipal(Solver):
    """Nonlinear programming on limits on principal stretches (Wachter and Biegler 2006).

    An interior-point line-search method, started at the positions to linearise at where the problem
    has them, at the target else. "solved" is a local optimum at best, and not from these limits'
    kinks, where singular values are equal.

    Parameters
    ----------
    max_iterations : of Ipopt.
    """

    name = "ipopt-principal"
    takes_principal = True
    takes_metric = True
    takes_contact = True

    max_iterations: int = 1000

    def supports(self, problem: Problem) -> str | None:
        """A reason, where limits are not on principal stretches."""
        if refusal := super().supports(problem):
            return refusal
        if not isinstance(problem.kind, PrincipalLimits):
            return "it limits principal stretches alone"
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
        """One run of Ipopt."""
        if len(problem.free) == 0:
            return held_still(problem, tolerance)
        nlp = Program(problem, monitor, deadline)
        rows = nlp.rows
        ipopt = cyipopt.Problem(
            n=3 * len(problem.free),
            m=rows,
            problem_obj=nlp,
            cl=np.zeros(rows),
            cu=np.full(rows, np.inf),
        )
        for option, value in self._options(tolerance, deadline).items():
            ipopt.add_option(option, value)
        at = problem.target if problem.linearise_at is None else problem.linearise_at
        x, info = ipopt.solve(at[problem.free].ravel() / nlp.unit)
        code = info["status"]
        if code not in ANSWERS:
            x = np.full_like(x, np.nan)
        status = STATUS.get(code, f"Ipopt status {code}")
        return claimed(problem, Solution(nlp.positions(x), status, nlp.iterations), tolerance)

    def _options(self, tolerance: float, deadline: Clock) -> dict[str, Any]:
        options: dict[str, Any] = {
            "print_level": 0,
            "sb": "yes",
            "hessian_approximation": "limited-memory",
            "mu_strategy": "adaptive",
            "bound_relax_factor": 0.0,
            "tol": 0.01 * tolerance,
            "max_iter": self.max_iterations,
        }
        if np.isfinite(deadline.remaining):
            options["max_wall_time"] = max(deadline.remaining, 1e-3)
        return options


class Program:
    """Values and derivatives as cyipopt calls them, at x (3 free vertices,) in `unit` metres.

    Attributes
    ----------
    rows : how many constraints there are: all of the limits, then those of each plane
    """

    def __init__(self, problem: Problem, monitor: Callable[..., None], deadline: Clock) -> None:
        assert isinstance(problem.kind, PrincipalLimits)
        self.problem, self.kind, self.unit = problem, problem.kind, problem.edge_length
        self.monitor, self.deadline, self.iterations = monitor, deadline, 0
        unknowns = (3 * problem.free[:, None] + np.arange(3)).ravel()
        A = sp.diags_array(np.repeat(problem.weights, 3)) if problem.metric is None else None
        A = sp.csr_array(problem.metric if A is None else A)[unknowns][:, unknowns]
        self.A = sp.csr_array(10 / float(A.diagonal().mean()) * A)
        self.target = problem.target[problem.free].ravel() / self.unit
        self.iterate = self.target
        self._places(problem)

    def _places(self, problem: Problem) -> None:
        """Where the derivatives' entries are: those of elements, then those of planes."""
        number = np.full(problem.vertices, -1)
        number[problem.free] = np.arange(len(problem.free))
        e, c = len(problem.elements), len(self.kind.bounds)
        column = 3 * number[problem.elements][:, None, :, None] + np.arange(3)
        row = np.arange(e * c).reshape(e, c, 1, 1)
        shape = (e, c, *column.shape[2:])
        self.moves = np.broadcast_to(column >= 0, shape)
        self.touching = np.intersect1d(problem.used, problem.free)
        rest = np.arange(len(self.touching) * len(problem.contact))
        along = 3 * number[self.touching][:, None] + np.arange(3)
        self.rows = e * c + len(rest)
        self.structure = (
            np.append(np.broadcast_to(row, shape)[self.moves], np.repeat(e * c + rest, 3)),
            np.append(
                np.broadcast_to(column, shape)[self.moves],
                np.tile(along.ravel(), len(problem.contact)),
            ),
        )
        normals = [np.tile(p.normal, len(self.touching)) for p in problem.contact]
        self.normals = np.concatenate([np.zeros(0), *normals])

    def positions(self, x: FloatArray) -> FloatArray:
        """(n, 3) [m] of all vertices."""
        positions: FloatArray = self.problem.target.copy()
        positions[self.problem.free] = self.unit * x.reshape(-1, 3)
        return positions

    def objective(self, x: FloatArray) -> float:
        """s/2 ||x - target||^2."""
        d = x - self.target
        return 0.5 * float(d @ (self.A @ d))

    def gradient(self, x: FloatArray) -> FloatArray:
        """s A (x - target)."""
        self.iterate = x  # Ipopt asks for gradients at accepted iterates alone
        gradient: FloatArray = self.A @ (x - self.target)
        return gradient

    def constraints(self, x: FloatArray) -> FloatArray:
        """C of all elements, and the gaps of all planes in edges."""
        positions = self.positions(x)
        room = self.kind.bounds + self.kind.values(self.problem.deformation_gradients(positions))
        gaps = [p.gaps(positions[self.touching]) / self.unit for p in self.problem.contact]
        return np.concatenate([room.ravel(), *gaps])

    def jacobianstructure(self) -> tuple[IntArray, IntArray]:
        """Row and column indices."""
        return self.structure

    def jacobian(self, x: FloatArray) -> FloatArray:
        """dC/dF times the shape functions' gradients, and the planes' normals."""
        problem = self.problem
        slopes = self.kind.linearised(problem.deformation_gradients(self.positions(x)))[1]
        by_corner = np.einsum("ecxd,ekd->eckx", slopes, self.unit * problem.gradients)
        return np.append(by_corner[self.moves], self.normals)

    def intermediate(self, algorithm: int, iteration: int, *progress: float) -> bool:
        """Whether to go on; called once an iteration."""
        self.iterations = iteration
        self.monitor(self.positions(self.iterate), iterations=iteration)
        return not self.deadline.passed
