"""The projection in cvxpy's language."""

from __future__ import annotations

import warnings
from time import perf_counter
from typing import Any

import numpy as np

from strainbench import Problem
from strainbench import sparse as sp
from strainbench.arrays import FloatArray
from strainbench.plugins import Library

cp = Library("cvxpy")

SCALING = 16.0  # of the objective in units of 1/edge^2 over the mean mass, as `clarabel` has it


class Model:
    """The cvxpy problem of a mesh, its parameter, and how to read its solution.

    cvxpy keeps a number for each pair of a parameter and a variable: with the target 2 GB at 60
    cells of the swing, with G target and the bounds in its place more than 18.
    """

    def __init__(self, problem: Problem, backend: str, scaled: bool) -> None:
        weights = problem.weights[problem.free]
        self.backend = backend
        self.scale = 1.0
        if scaled:
            self.scale = SCALING / (problem.edge_length**2 * float(weights.mean()))
        self.root = np.sqrt(0.5 * self.scale * weights)[:, None]
        self.z = cp.Variable((len(weights), 3))
        self.target = cp.Parameter((problem.vertices, 3))
        G = problem.G[:, problem.free] @ sp.diags_array(1 / self.root[:, 0])
        y = problem.G @ self.target + G @ self.z
        self.exact = problem.kind.cone == "semidefinite"
        self.compiler = "SCIPY" if self.exact else None  # the default has no stacks of matrices
        if self.exact:
            self.cones = cp.PSD(matrices(problem, y))
        else:
            self.cones = cp.SOC(problem.bounds, y, axis=1)
        self.problem = cp.Problem(cp.Minimize(cp.sum_squares(self.z)), [self.cones])
        self.target.value = problem.target
        self.problem.get_problem_data(backend, canon_backend=self.compiler)

    def run(self, problem: Problem, options: dict[str, Any]) -> tuple[str, float]:
        """The status, and the seconds in the backend.

        These are the steps of `cvxpy.Problem.solve`, taken one by one for the clock. Where the
        backend fails, cvxpy raises, and its variables would still hold the last frame's values.
        cvxpy's `warm_start` hands SCS the last frame's answer, so that solves would depend on
        their order, and makes QOCO 0.3 violate limits by a tenth.
        """
        self.target.value = problem.target
        reuse = self.backend == "CLARABEL"  # its symbolic factorisation, nothing else
        data, chain, inverse = self.problem.get_problem_data(
            self.backend, canon_backend=self.compiler, solver_opts=options
        )
        start = perf_counter()
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", message="Solution may be inaccurate")
            try:
                answer = chain.solve_via_data(self.problem, data, reuse, False, options)
                seconds = perf_counter() - start
                self.problem.unpack_results(answer, chain, inverse)
            except cp.SolverError:
                self.z.value, self.problem._solver_stats = None, None
                return "solver error", perf_counter() - start
        return str(self.problem.status), seconds

    def displacement(self) -> FloatArray:
        """(free vertices, 3) [m], or NaN where there is no answer."""
        if self.z.value is None:
            return np.full(self.z.shape, np.nan)
        displacement: FloatArray = self.z.value / self.root
        return displacement

    def multipliers(self) -> FloatArray | None:
        """(rows, 3) the part of each cone's dual that belongs to G x, in its own units."""
        if self.z.value is None:
            return None
        if self.exact:
            Z = np.asarray(self.cones.dual_value)
            return -2 * Z[:, 3:, :3].reshape(-1, 3) / self.scale
        return -np.asarray(self.cones.dual_value[1]).reshape(-1, 3) / self.scale

    def iterations(self) -> int:
        """Of the backend, where it tells."""
        return int(getattr(self.problem.solver_stats, "num_iters", None) or 0)


def matrices(problem: Problem, y: Any) -> Any:
    """(elements, k, k) [[b I, Y], [Y^T, b I]], Y (3 x dim) an element's rows of y as columns."""
    e, dim = problem.constraints, problem.rows // problem.constraints
    k = 3 + dim
    first = k * k * np.arange(e)[:, None, None]
    column, row = np.meshgrid(np.arange(3), 3 + np.arange(dim))
    upper, lower = first + k * column + row, first + k * row + column
    diagonal = first[:, 0] + (k + 1) * np.arange(k)

    def scatter(places: Any, sources: Any, count: int) -> Any:
        ones = np.ones(len(places))
        return sp.csr_array((ones, (places, sources)), shape=(e * k * k, count))

    places = np.concatenate([upper.ravel(), lower.ravel()])
    of_y = scatter(places, np.tile(np.arange(3 * e * dim), 2), 3 * e * dim)
    of_b = scatter(diagonal.ravel(), np.repeat(np.arange(e), k), e)
    return cp.reshape(of_y @ cp.vec(y, order="C") + of_b @ problem.bounds, (e, k, k), order="C")
