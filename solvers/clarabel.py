"""Interior-point second-order cone programming (Tang et al. 2022, Eq. 12; Clarabel)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from strainbench import Clock, Problem, Solution, Solver, section
from strainbench import sparse as sp
from strainbench.arrays import FloatArray
from strainbench.plugins import Library
from strainbench.problem.conic import ConicForm
from strainbench.problem.kinds import Sampled
from strainbench.solver.claim import claimed

clarabel = Library("clarabel")

CONES = {"second-order": "SecondOrderConeT", "semidefinite": "PSDTriangleConeT"}


@dataclass(frozen=True)
class Clarabel(Solver):
    """Interior-point second-order cone programming (Tang et al. 2022, Eq. 12; Clarabel).

    The unknowns are the displacements u = x - target of the free vertices.

    form="quadratic": minimise s/2 u'Mu subject to (b_i, (G target)_i + (G u)_i) in Q^4, the
        quadratic objective given as such. Equal to Eq. 12 but for the cone of the objective.
        Exact limits have a semidefinite cone an element: see `strainbench.problem.conic`.
    form="paper": Eq. 12 literally, with t_0, t_i, y_i and rotated cones. Clarabel has no
        rotated cone: (u, v, y) in Q_r iff (u + v, u - v, sqrt(2) y) in Q.

    Parameters
    ----------
    form : "quadratic" or "paper"
    scaling : factor s of the objective in units of 1/edge^2 over the mean mass, with lengths in
        edges; None leaves both as they are.
    accuracy : Clarabel's gap tolerances over those that suffice, which are `tolerance` times the
        referee's least scale of a gap: they are relative only to objectives above 1. Tuned on
        frames of the swing at 20 and 60 cells, 1% and 0.1%: scaling 4 is the fastest whose
        certified gaps stay below the tolerance, by a quarter against 16. Larger ones give better
        multipliers (`tight`): at 10 cells 4 stalls at gaps of up to 4e-6, 64 at 2e-7.
    equilibrate : Clarabel's own scaling; with the objective scaled it does harm.

    Also tried, by `strainbench duel swing --set resolution=20 --frame 12` with plug-ins that change
    one setting each, on a busy machine: steps of 0.995 to the boundary (20 iterations for 18) and
    two refinements for ten are no faster. MKL Pardiso, which newton-ipm has, takes 3.3 times as
    long as faer, with 22 iterations for 18; minimum degree as its ordering (iparm[1] = 0) makes
    that 1.6 times faster, with 15 iterations, no matching (iparm[12] = 0) does not. The wheel looks
    for libmkl_rt.so in MKL_PARDISO_PATH, and PyPI's mkl has libmkl_rt.so.3 alone: links to it and
    to its neighbours, in a folder of their own, make it run.
    """

    name = "clarabel"
    takes_exact = True
    variants = {
        "default": {"scaling": None, "equilibrate": True},
        "tight": {"scaling": 64.0, "accuracy": 1e-2},
        "paper": {"form": "paper", "scaling": None, "equilibrate": True},
    }

    form: str = "quadratic"
    scaling: float | None = 4.0
    accuracy: float = 1.0
    equilibrate: bool = False

    def __post_init__(self) -> None:
        if self.form not in ("quadratic", "paper"):
            raise ValueError(f"form is {self.form!r}: valid are quadratic, paper")

    def supports(self, problem: Problem) -> str | None:
        """Eq. 12 has no form for exact limits."""
        refusal = super().supports(problem)
        if self.form == "paper" and not refusal and not isinstance(problem.kind, Sampled):
            return "Eq. 12 has no form for exact limits, only for sampled directions"
        return refusal

    def prepare(self, problem: Problem) -> QuadraticForm | PaperForm:
        """The matrices and Clarabel's symbolic factorisation."""
        if self.form == "paper":
            return PaperForm(problem, self._settings())
        return QuadraticForm(problem, self._settings(), self.scaling)

    def _settings(self) -> Any:
        settings = clarabel.DefaultSettings()
        settings.verbose = False
        settings.max_threads = 1
        settings.equilibrate_enable = self.equilibrate
        settings.presolve_enable = False  # these two forbid new right-hand sides
        settings.chordal_decomposition_enable = False
        if self.scaling is not None:  # tuned: 5 to 10% faster than QDLDL at 10 to 60 cells
            settings.direct_solve_method = "faer"
        return settings

    def solve(
        self,
        problem: Problem,
        state: QuadraticForm | PaperForm,
        *,
        tolerance: float,
        monitor: Callable[..., None],
        deadline: Clock,
    ) -> Solution:
        """One interior-point run.

        Scaled, the limits hold far better than asked for, so that feasibility may be 100 times as
        loose as the gaps. The unscaled variants have Clarabel's defaults, 1e-8 for all, at the
        usual `tolerance` of 1e-6.
        """
        settings = self._settings()
        settings.time_limit = max(deadline.remaining, 1e-3)
        settings.tol_gap_abs = self.accuracy * tolerance * state.least_gap(problem)
        settings.tol_feas = (1 if self.scaling is None else 100) * settings.tol_gap_abs
        settings.tol_gap_rel = settings.tol_gap_abs
        with section("update"):
            q, rhs = state.vectors(problem)
            state.solver.update(q=q, b=rhs, settings=settings)
        with section("Clarabel"):
            result = state.solver.solve()
        status = str(result.status)
        positions = state.positions(problem, np.array(result.x))
        if "Infeasible" in status:
            positions[:] = np.nan
        found = Solution(
            positions,
            "solved" if status == "Solved" else status,
            result.iterations,
            state.multipliers(np.array(result.z)),
        )
        with section("claim"):
            return claimed(problem, found, tolerance)


UNSCALED = 1e-2
"""Gap tolerances over `tolerance` out of the box: Clarabel's own 1e-8 at the usual 1e-6."""


class QuadraticForm:
    """Displacements as unknowns, the objective as a quadratic, one cone a constraint."""

    def __init__(self, problem: Problem, settings: Any, scaling: float | None) -> None:
        self.form, self.scaling = ConicForm(problem, scaling), scaling
        q, rhs = self.vectors(problem)
        self.solver = clarabel.DefaultSolver(
            sp.csc_matrix(self.form.P),
            q,
            sp.csc_matrix(self.form.A),
            rhs,
            [getattr(clarabel, CONES[self.form.cone])(self.form.order)] * self.form.count,
            settings,
        )

    def least_gap(self, problem: Problem) -> float:
        """The least scale of a gap, in the solver's units."""
        if self.scaling is None:
            return UNSCALED
        return min(1.0, self.form.scale * problem.objective_floor)

    def vectors(self, problem: Problem) -> tuple[FloatArray, FloatArray]:
        """No linear objective, and the cones' constants."""
        return np.zeros(len(problem.free) * 3), self.form.constants(problem)

    def positions(self, problem: Problem, z: FloatArray) -> FloatArray:
        """Target plus displacement."""
        return self.form.positions(problem, z)

    def multipliers(self, duals: FloatArray) -> FloatArray:
        """See `ConicForm`."""
        return self.form.multipliers(duals)


class PaperForm:
    """Eq. 12: unknowns (x, t_0, t_1..t_m, y_1..y_m), a linear objective, rotated cones."""

    def __init__(self, problem: Problem, settings: Any) -> None:
        n, m = len(problem.free), problem.rows
        self.n, self.m = 3 * n, m
        identity = sp.eye_array
        weights = np.sqrt(2 * np.repeat(problem.weights[problem.free], 3))
        equations = sp.block_array(
            [  # t_i = b_i^2 and A_i x - y_i = -(pinned part)
                [sp.csc_array((m, 3 * n + 1)), identity(m), None],
                [
                    sp.hstack([sp.kron(problem.G[:, problem.free], identity(3)), _zeros(3 * m, 1)]),
                    None,
                    -identity(3 * m),
                ],
            ]
        )
        objective = sp.block_array(  # (1 + t_0, 1 - t_0, sqrt(2) x)
            [
                [_zeros(2, 3 * n), sp.csc_array([[1.0], [-1.0]]), _zeros(2, 4 * m)],
                [sp.diags_array(weights), None, None],
            ]
        )
        limits = sp.hstack(  # (1/2 + t_i, 1/2 - t_i, sqrt(2) y_i)
            [
                _zeros(5 * m, 3 * n + 1),
                sp.kron(identity(m), np.array([[1.0], [-1.0], [0.0], [0.0], [0.0]])),
                sp.kron(identity(m), np.sqrt(2) * identity(5, 3, k=-2)),
            ]
        )
        q, rhs = self.vectors(problem)
        self.solver = clarabel.DefaultSolver(
            sp.csc_matrix((len(q), len(q))),
            q,
            sp.csc_matrix(sp.vstack([equations, -objective, -limits])),
            rhs,
            [clarabel.ZeroConeT(4 * m), clarabel.SecondOrderConeT(3 * n + 2)]
            + [clarabel.SecondOrderConeT(5)] * m,
            settings,
        )

    def least_gap(self, problem: Problem) -> float:
        """See `QuadraticForm`."""
        return UNSCALED

    def vectors(self, problem: Problem) -> tuple[FloatArray, FloatArray]:
        """Objective t_0 - target'Mx, and the constants of equations and cones."""
        weighted = problem.weights[:, None] * problem.target
        q = np.concatenate([-weighted[problem.free].ravel(), [1.0], np.zeros(4 * self.m)])
        fixed = problem.G[:, problem.pinned] @ problem.target[problem.pinned]
        objective = np.concatenate([[1.0, 1.0], np.zeros(self.n)])
        limits = np.tile([0.5, 0.5, 0.0, 0.0, 0.0], self.m)
        return q, np.concatenate([problem.bounds**2, -fixed.ravel(), objective, limits])

    def positions(self, problem: Problem, z: FloatArray) -> FloatArray:
        """The first unknowns, and the pins."""
        positions = problem.target.copy()
        positions[problem.free] = z[: self.n].reshape(-1, 3)
        return positions

    def multipliers(self, duals: FloatArray) -> FloatArray:
        """The duals of y_i = A_i x."""
        return duals[self.m : 4 * self.m].reshape(-1, 3)


def _zeros(rows: int, columns: int) -> Any:
    return sp.csc_array((rows, columns))
