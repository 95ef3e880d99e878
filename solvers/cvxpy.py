"""Cone programming through cvxpy (Tang et al. 2022, Eq. 12; Diamond and Boyd 2016)."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from time import perf_counter
from typing import Any

import cvxpy as cp
import numpy as np
import scipy.sparse as sp

from strainbench import Clock, Problem, Solution, Solver
from strainbench.limits import FloatArray

BACKENDS = ("CLARABEL", "ECOS", "SCS", "QOCO", "MOSEK")
SCALING = 16.0  # of the objective in units of 1/edge^2 over the mean mass, as `clarabel` has it


@dataclass(frozen=True)
class Cvxpy(Solver):
    """Cone programming through cvxpy (Tang et al. 2022, Eq. 12; Diamond and Boyd 2016).

    What `clarabel` solves, written in a modelling language: minimise ||z||^2 such that
    ||(G target + G W z)_i|| <= b_i, where W z are the free vertices' displacements and
    W = (s M / 2)^(-1/2), s = 16 / edge^2 over the mean mass. With s = 1, Clarabel misses a gap
    of 1e-4 in early frames of the swing. G target and b are cvxpy parameters: the model is
    compiled once a mesh, and a solve puts the numbers in and calls the backend.

    A solution's details tell the two apart: `backend_seconds`, in cvxpy's call of the backend,
    and `canonicalisation_seconds`, all the rest of the solve.

    Parameters
    ----------
    backend : "CLARABEL", "ECOS", "SCS", "QOCO" or "MOSEK", where installed. SCS, a first-order
        method, reaches its iteration limit on some problems, and takes 12 s at 20 cells and 1%.
    """

    name = "cvxpy"

    backend: str = "CLARABEL"

    def __post_init__(self) -> None:
        if self.backend not in BACKENDS:
            raise ValueError(f"backend is {self.backend!r}: valid are {', '.join(BACKENDS)}")

    def supports(self, problem: Problem) -> str | None:
        """A reason, where the backend is not installed."""
        installed = [name for name in BACKENDS if name in cp.installed_solvers()]
        if self.backend in installed:
            return super().supports(problem)
        return f"cvxpy's backend {self.backend} is not installed; installed: {', '.join(installed)}"

    def prepare(self, problem: Problem) -> Model | None:
        """The compiled model; None where all vertices are pinned."""
        return Model(problem, self.backend) if len(problem.free) else None

    def solve(
        self,
        problem: Problem,
        state: Model | None,
        *,
        tolerance: float,
        monitor: Callable[..., None],
        deadline: Clock,
    ) -> Solution:
        """One call of the compiled model."""
        start = perf_counter()
        positions = problem.target.copy()
        if state is None:
            return Solution(positions, "solved", 0)
        status, seconds = state.run(problem, backend_options(self.backend, tolerance, deadline))
        positions[problem.free] += state.displacement()
        return Solution(
            positions,
            "solved" if status == cp.OPTIMAL else status,
            state.iterations(),
            state.multipliers(),
            {
                "backend_seconds": seconds,
                "canonicalisation_seconds": perf_counter() - start - seconds,
            },
        )


def backend_options(backend: str, tolerance: float, deadline: Clock) -> dict[str, Any]:
    """Each backend's names for a hundredth of `tolerance`, the time limit and a single thread.

    SCS needs no less: at a tenth it leaves violations of up to four times `tolerance`. ECOS and
    QOCO take no time limit; they and SCS are single-threaded.
    """
    eps = 0.01 * tolerance
    seconds = min(max(deadline.remaining, 1e-3), 1e9)
    options: dict[str, dict[str, Any]] = {
        "CLARABEL": {
            "tol_feas": eps,
            "tol_gap_abs": eps,
            "tol_gap_rel": eps,
            "equilibrate_enable": False,
            "presolve_enable": False,  # it forbids new data
            "accept_unknown": True,  # the iterate where it stalls or time is up
            "max_threads": 1,
            "time_limit": seconds,
        },
        "ECOS": {"feastol": eps, "abstol": eps, "reltol": eps},
        "SCS": {"eps_abs": eps, "eps_rel": eps, "time_limit_secs": seconds},
        "QOCO": {"abstol": eps, "reltol": eps},
        "MOSEK": {
            "eps": eps,
            "accept_unknown": True,
            "mosek_params": {
                "MSK_IPAR_NUM_THREADS": 1,
                "MSK_DPAR_OPTIMIZER_MAX_TIME": seconds,
            },
        },
    }
    return options[backend]


class Model:
    """The cvxpy problem of a mesh, its parameters, and how to read its solution."""

    def __init__(self, problem: Problem, backend: str) -> None:
        weights = problem.weights[problem.free]
        self.backend = backend
        self.scale = SCALING / (problem.edge_length**2 * float(weights.mean()))
        self.root = np.sqrt(0.5 * self.scale * weights)[:, None]
        self.z = cp.Variable((len(weights), 3))
        self.stretched = cp.Parameter((problem.rows, 3))
        self.bounds = cp.Parameter(problem.rows, nonneg=True)
        G = problem.G[:, problem.free] @ sp.diags_array(1 / self.root[:, 0])
        self.cones = cp.SOC(self.bounds, self.stretched + G @ self.z, axis=1)
        self.problem = cp.Problem(cp.Minimize(cp.sum_squares(self.z)), [self.cones])
        self.put(problem)
        self.problem.get_problem_data(backend)

    def put(self, problem: Problem) -> None:
        """New numbers for the parameters."""
        self.stretched.value = problem.G @ problem.target
        self.bounds.value = problem.bounds

    def run(self, problem: Problem, options: dict[str, Any]) -> tuple[str, float]:
        """The status, and the seconds in the backend.

        These are the steps of `cvxpy.Problem.solve`, taken one by one for the clock. Where the
        backend fails, cvxpy raises, and its variables would still hold the last frame's values.
        cvxpy's `warm_start` hands SCS the last frame's answer, so that solves would depend on
        their order, and makes QOCO 0.3 violate limits by a tenth.
        """
        self.put(problem)
        reuse = self.backend == "CLARABEL"  # its symbolic factorisation, nothing else
        data, chain, inverse = self.problem.get_problem_data(self.backend, solver_opts=options)
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
        """(rows, 3) the vector part of each cone's dual, in the problem's own units."""
        if self.z.value is None:
            return None
        return -np.asarray(self.cones.dual_value[1]).reshape(-1, 3) / self.scale

    def iterations(self) -> int:
        """Of the backend, where it tells."""
        return int(getattr(self.problem.solver_stats, "num_iters", None) or 0)
