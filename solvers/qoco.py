"""Interior-point second-order cone programming (Tang et al. 2022, Eq. 12; QOCO).

G. M. Chari and B. Acikmese, "QOCO: a quadratic objective conic optimizer with custom solver
generation", 2025: a primal-dual method with Mehrotra's predictor and corrector.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import qoco
import scipy.sparse as sp

from strainbench import Clock, Problem, Solution, Solver
from strainbench.conic import ConicForm


@dataclass(frozen=True)
class Qoco(Solver):
    """Interior-point second-order cone programming (Tang et al. 2022, Eq. 12; QOCO).

    What `clarabel` solves, see `strainbench.conic`. Called without cvxpy it takes as long or less
    (0.6 to 1 of the time), and its last iterate is kept where it ends with a numerical error, which
    cvxpy takes for no answer: close to a gap of 1e-6 its linear systems get too ill-conditioned to
    go on. It neither looks at a clock nor detects that limits cannot be met.

    Parameters
    ----------
    scaling : factor of the objective in units of 1/edge^2 over the mean mass, with lengths in
        edges; None leaves both as they are. On frames of the swing at 10 to 40 cells 16 leaves
        gaps of up to 2e-6, 32 at most 6e-7, and from 64 on it often ends in a numerical error.
        Its Ruiz equilibration ends all of them in one; its other settings change nothing.
    """

    name = "qoco"
    variants = {"default": {"scaling": None}}

    scaling: float | None = 32.0

    def prepare(self, problem: Problem) -> State | None:
        """The matrices and QOCO's symbolic factorisation; None where all vertices are pinned."""
        return State(problem, self.scaling) if len(problem.free) else None

    def solve(
        self,
        problem: Problem,
        state: State | None,
        *,
        tolerance: float,
        monitor: Callable[..., None],
        deadline: Clock,
    ) -> Solution:
        """One interior-point run, aiming at a hundredth of `tolerance`; unscaled, at QOCO's own."""
        if state is None:
            return Solution(problem.target.copy(), "solved", 0)
        form, solver = state.form, state.solver
        if self.scaling is not None:
            solver.update_settings(abstol=1e-2 * tolerance, reltol=1e-2 * tolerance)
        solver.update_vector_data(h=form.constants(problem))
        result = solver.solve()
        status = "solved" if result.status == "QOCO_SOLVED" else result.status
        positions = form.positions(problem, np.array(result.x))
        return Solution(positions, status, result.iters, form.multipliers(np.array(result.z)))


class State:
    """The cone program of a mesh, and QOCO set up for it."""

    def __init__(self, problem: Problem, scaling: float | None) -> None:
        self.form = form = ConicForm(problem, scaling)
        entries, unknowns = form.A.shape
        self.solver: Any = qoco.QOCO()
        self.solver.setup(
            unknowns,
            entries,
            0,
            sp.csc_matrix(form.P),
            np.zeros(unknowns),
            None,
            None,
            sp.csc_matrix(form.A),
            form.constants(problem),
            0,
            form.count,
            np.full(form.count, form.order),
        )
