"""Interior-point second-order cone programming (Tang et al. 2022, Eq. 12; QOCO).

G. M. Chari and B. Acikmese, "QOCO: a quadratic objective conic optimizer with custom solver
generation", 2025: a primal-dual method with Mehrotra's predictor and corrector.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from strainbench import Clock, Problem, Solution, Solver
from strainbench import sparse as sp
from strainbench.plugins import Library
from strainbench.problem.conic import ConicForm
from strainbench.solver.claim import claimed
from strainbench.solver.solver import held_still

qoco = Library("qoco")


@dataclass(frozen=True)
class Qoco(Solver):
    """Interior-point second-order cone programming (Tang et al. 2022, Eq. 12; QOCO).

    What `clarabel` solves, see `strainbench.problem.conic`. Called without cvxpy it takes as long
    or less (0.6 to 1 of the time), and its last iterate is kept where it ends with a numerical
    error, which cvxpy takes for no answer: close to a gap of 1e-6 its linear systems get too
    ill-conditioned to go on. It has no warm start, looks at no clock and does not detect that
    limits cannot be met. It is set up anew for each projection, a twentieth of the time: with
    constants updated instead (version 0.3.2), runs that end as QOCO_SOLVED_INACCURATE take the same
    iterations to an answer that is wrong, by up to a quarter of an edge with the fast pins of
    `stress`.

    Its iterations depend on the order of vertices and on the frame of reference, which change
    nothing in the problem: `tests/solvers/test_qoco.py` has a sheet of 10 cells on which the most
    are more than 1.5 times the least, and newton-ipm's do not change.

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

    def prepare(self, problem: Problem) -> ConicForm | None:
        """The matrices of the cone program; None where all vertices are pinned."""
        return ConicForm(problem, self.scaling) if len(problem.free) else None

    def solve(
        self,
        problem: Problem,
        state: ConicForm | None,
        *,
        tolerance: float,
        monitor: Callable[..., None],
        deadline: Clock,
    ) -> Solution:
        """One interior-point run, aiming at a hundredth of `tolerance`; unscaled, at QOCO's own."""
        if state is None:
            return held_still(problem, tolerance)
        solver = set_up(state, problem)
        if self.scaling is not None:
            solver.update_settings(abstol=1e-2 * tolerance, reltol=1e-2 * tolerance)
        result = solver.solve()
        status = "solved" if result.status == "QOCO_SOLVED" else result.status
        positions = state.positions(problem, np.array(result.x))
        Y = state.multipliers(np.array(result.z))
        return claimed(problem, Solution(positions, status, result.iters, Y), tolerance)


def set_up(form: ConicForm, problem: Problem) -> Any:
    """QOCO with the cone program of a frame."""
    entries, unknowns = form.A.shape
    solver = qoco.QOCO()
    solver.setup(
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
    return solver
