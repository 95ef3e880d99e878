"""Cone programming through cvxpy (Tang et al. 2022, Eq. 12; Diamond and Boyd 2016)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from time import perf_counter

from solvers.cvxpy.backends import (
    BACKENDS,
    SEMIDEFINITE,
    accuracy_options,
    missing,
    time_options,
)
from solvers.cvxpy.model import Model, cp
from strainbench import Clock, Problem, Solution, Solver
from strainbench.solver.claim import claimed
from strainbench.solver.solver import held_still


@dataclass(frozen=True)
class Cvxpy(Solver):
    """Cone programming through cvxpy (Tang et al. 2022, Eq. 12; Diamond and Boyd 2016).

    What `clarabel` solves, written in a modelling language: minimise ||z||^2 such that
    ||(G target + G W z)_i|| <= b_i, where W z are the free vertices' displacements and
    W = (s M / 2)^(-1/2), s = 16 / edge^2 over the mean mass. With s = 1, Clarabel misses a gap
    of 1e-4 in early frames of the swing. Exact limits have a semidefinite cone an element, with
    the backends that take them. The target is a cvxpy parameter: the model is compiled once a
    mesh, and a solve puts the numbers in and calls the backend.

    A solution's details tell the two apart: `backend_seconds`, in cvxpy's call of the backend,
    and `canonicalisation_seconds`, all the rest of the solve: 1 to 6 ms at 10 and 20 cells. So
    ECOS and SCS gain nothing from being called directly; `qoco` does.

    Parameters
    ----------
    backend : "CLARABEL", "ECOS", "SCS", "QOCO" or "MOSEK", where installed. SCS, a first-order
        method, needs 1e3 to 2e4 iterations for a gap of 1e-6 at 10 cells, whatever its scale,
        relaxation or acceleration, and reaches its limit of 1e5 on some problems. QOCO's iterate
        is lost where it ends with a numerical error.
    settings : "tuned" as above, or "default": s M = 1 kg and metres as they are, and the
        backend's own tolerances.
    """

    name = "cvxpy"
    takes_exact = True
    variants = {
        "default": {"settings": "default"},
        **{b.lower(): {"backend": b} for b in BACKENDS[1:]},
        **{f"{b.lower()}-default": {"backend": b, "settings": "default"} for b in BACKENDS[1:]},
    }

    backend: str = "CLARABEL"
    settings: str = "tuned"

    def __post_init__(self) -> None:
        if self.backend not in BACKENDS:
            raise ValueError(f"backend is {self.backend!r}: valid are {', '.join(BACKENDS)}")
        if self.settings not in ("tuned", "default"):
            raise ValueError(f"settings is {self.settings!r}: valid are tuned, default")

    def missing(self) -> str | None:
        """A backend that is not installed, or MOSEK's licence."""
        return missing(self.backend)

    def supports(self, problem: Problem) -> str | None:
        """A reason, where the backend is missing or has no semidefinite cones."""
        if problem.kind.cone == "semidefinite" and self.backend not in SEMIDEFINITE:
            return f"{self.backend} has no semidefinite cones, which exact limits need"
        return super().supports(problem) or self.missing()

    def prepare(self, problem: Problem) -> Model | None:
        """The compiled model; None where all vertices are pinned."""
        return Model(problem, self.backend, self.settings == "tuned") if len(problem.free) else None

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
            return held_still(problem, tolerance)
        options = time_options(self.backend, deadline)
        if self.settings == "tuned":
            options |= accuracy_options(self.backend, tolerance)
        status, seconds = state.run(problem, options)
        positions[problem.free] += state.displacement()
        found = Solution(
            positions,
            "solved" if status == cp.OPTIMAL else status,
            state.iterations(),
            state.multipliers(),
            {
                "backend_seconds": seconds,
                "canonicalisation_seconds": perf_counter() - start - seconds,
            },
        )
        return claimed(problem, found, tolerance)
