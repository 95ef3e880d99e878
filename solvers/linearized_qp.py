"""Sequential quadratic programming with linearised limits (Nocedal and Wright 2006, Sec. 18; OSQP).

J. Nocedal, S. J. Wright, "Numerical optimization", 2nd ed.; B. Stellato et al., "OSQP: an operator
splitting solver for quadratic programs", Mathematical Programming Computation 12, 2020. The limits
are those of fast projection (Goldenthal et al. 2007), C_i = |y_i| - b_i with y = G x, linearised
at the current x, but as inequalities:

1. a_i = y_i / |y_i|, H = G^T diag(l_i / |y_i| (I - a_i a_i^T)) G, the Hessian of sum l_i C_i;
2. x, l = positions and multipliers of
   minimise 1/2 ||x - target||_M^2 + 1/2 ||x - x_old||_H^2  such that  a_i . (G x)_i <= b_i,
   by OSQP, started at the last ones;
3. stop once the violation of x and its gap above the dual value of Y_i = l_i a_i are below the
   tolerance.

Since |y_i| >= a_i . y_i, each linearised set holds the feasible one: no step is infeasible but for
limits that cannot be met, and there is no line search. Without H the steps are those of the plain
linearisation. These do not converge: the curvature of the limits that H stands for is larger than
M, so that x leaps from side to side. With the cuts of all former steps kept they do, in 8 steps
at 10 cells where H needs 4; at 20 cells, where H needs 7, violation and gap were 1e-6 and 9e-6
after 15, with up to seven times the rows.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from strainbench import Clock, Problem, Solution, Solver
from strainbench import sparse as sp
from strainbench.arrays import FloatArray
from strainbench.plugins import Library
from strainbench.problem.dual import dual_bound
from strainbench.solver.memory import Memory
from strainbench.solver.solver import held_still

osqp = Library("osqp")

REFUSED = "refused by OSQP"
ITERATIONS = 1000
RHO = 100.0
FORCING = 0.1
"""Of OSQP, where tuned: its iterations a step, its first step size, and its tolerance relative to
the violation of the last step, between 1e-4 and a tenth of the tolerance asked for."""


@dataclass(frozen=True)
class LinearizedQP(Solver):
    """Sequential quadratic programming with linearised limits (Nocedal and Wright 2006; OSQP).

    | status | when |
    |---|---|
    | solved | the violation of x and its gap above the dual value of Y are below the tolerance |
    | primal infeasible | OSQP finds no point within the linearised limits |
    | refused by OSQP | the numbers are too large for it |
    | step limit | neither, after `max_steps` |
    | time limit | neither, at the deadline |

    Parameters
    ----------
    curvature : whether H is used; without, the method oscillates at violations of 1e-2 to 1e-1 on
        every frame of the swing that was tried. With it, gaps of 1e-6 take 5 to 19 steps at 10 to
        40 cells, 1% and 0.1%.
    settings : "default" is OSQP's own in metres; its tolerance of 1e-3 stops it before the limits
        hold to 1e-4. "tuned" takes lengths in edges and the objective in 4 / edge^2 over the mean
        mass, OSQP's Ruiz scaling off (at 0.1% it costs three times the iterations), no polishing
        (a factorisation of its own a step; the iterations get as far), its step size carried from
        step to step, and tolerances that follow the violation. Tuned on four frames of the swing
        at 10 and 20 cells, 1% and 0.1%: three times as fast as OSQP at 1e-7 with the rest default.
    warm : start from the frame before: its multipliers, and its positions moved as the target has
        moved. On frames 10 to 30 of the swing at 20 cells, 1%, 9 steps become 3 (medians).
    max_steps : quadratic programs, after which it gives up.
    """

    name = "linearized-qp"
    variants = {"default": {"settings": "default"}, "plain": {"curvature": False}}

    curvature: bool = True
    settings: str = "tuned"
    warm: bool = False
    max_steps: int = 50

    def __post_init__(self) -> None:
        if self.settings not in ("tuned", "default"):
            raise ValueError(f"settings is {self.settings!r}: valid are tuned, default")

    def prepare(self, problem: Problem) -> Memory[sp.csr_array]:
        """G on the free vertices, for the three coordinates."""
        G = sp.csr_array(sp.kron(problem.G[:, problem.free], sp.eye_array(3)))
        return Memory(G, self.warm)

    @np.errstate(all="ignore")  # what overflows is not finite, and refused
    def solve(
        self,
        problem: Problem,
        state: Memory[sp.csr_array],
        *,
        tolerance: float,
        monitor: Callable[..., None],
        deadline: Clock,
    ) -> Solution:
        """Steps from the target with no multipliers, or from the last answer."""
        if len(problem.free) == 0:
            return held_still(problem, tolerance)
        if not np.any(problem.violations(problem.target)):
            nothing = np.zeros((problem.rows, 3))
            return state.keep(problem, Solution(problem.target.copy(), "solved", 0, nothing))
        x, Y = state.start(problem)
        steps = Steps(self, problem, state.mesh, x, np.linalg.norm(Y, axis=1))
        return state.keep(problem, self._run(steps, tolerance, monitor, deadline))

    def _run(
        self, steps: Steps, tolerance: float, monitor: Callable[..., None], deadline: Clock
    ) -> Solution:
        for step in range(1, self.max_steps + 1):
            status = steps.take(tolerance, deadline)
            monitor(steps.x.copy(), steps.Y)
            if status == REFUSED:
                return Solution(steps.x, status, step, steps.Y)
            if "infeasible" in status:
                steps.x[steps.problem.free] = np.nan
                return Solution(steps.x, status, step)
            if steps.converged(tolerance):  # 3
                return Solution(steps.x, "solved", step, steps.Y)
            if deadline.passed:
                return Solution(steps.x, "time limit", step, steps.Y)
        return Solution(steps.x, "step limit", self.max_steps, steps.Y)


class Steps:
    """Steps 1 and 2 from any positions x (n, 3) and lengths of multipliers (rows,).

    OSQP's unknowns are the free vertices' displacements from the target in units of h, and its
    objective and multipliers are s times the problem's.
    """

    def __init__(
        self,
        method: LinearizedQP,
        problem: Problem,
        G: sp.csr_array,
        x: FloatArray,
        lengths: FloatArray,
    ) -> None:
        self.method, self.problem = method, problem
        self.h, self.s = 1.0, 1.0
        if method.settings == "tuned":
            self.h = problem.edge_length
            self.s = 4 / (self.h**2 * problem.mean_weight)
        self.G = self.h * G
        self.M = sp.diags_array(self.s * self.h**2 * np.repeat(problem.weights[problem.free], 3))
        self.stretched = problem.G @ problem.target
        self.x, self.l, self.rho = x.copy(), self.s * lengths, RHO
        self.Y = np.zeros((problem.rows, 3))

    def take(self, tolerance: float, deadline: Clock) -> str:
        """One step; OSQP's status."""
        problem = self.problem
        y = problem.G @ self.x
        length = np.maximum(np.linalg.norm(y, axis=1), 1e-9)
        a = y / length[:, None]
        along = sp.csr_array((a.ravel(), np.arange(a.size), np.arange(0, a.size + 1, 3)))
        room = problem.bounds - np.sum(a * self.stretched, axis=1)
        old = ((self.x - problem.target)[problem.free] / self.h).ravel()
        P, q = self.M, np.zeros(len(old))
        if self.method.curvature:
            H = self._curvature(a, self.l / length)
            P, q = P + H, -(H @ old)
        qp = osqp.OSQP()
        options = self._options(tolerance, deadline)
        below = np.full(len(room), -np.inf)
        upper = sp.csc_matrix(sp.triu(P))
        try:
            qp.setup(upper, q, sp.csc_matrix(along @ self.G), below, room, verbose=False, **options)
        except osqp.OSQPException:  # of what is not finite, or beyond the 1e30 that it takes for so
            return REFUSED
        qp.warm_start(x=old, y=self.l)
        result = qp.solve(raise_error=False)
        if "infeasible" not in result.info.status:
            self.rho = float(np.clip(result.info.rho_estimate, 1e-3, 1e5))
            self.l = np.maximum(result.y, 0.0)
            self.x[problem.free] = problem.target[problem.free] + self.h * result.x.reshape(-1, 3)
            self.Y = (self.l / self.s)[:, None] * a
        return str(result.info.status)

    def _curvature(self, a: FloatArray, ratio: FloatArray) -> sp.csr_array:
        """H, from a (rows, 3) and l_i / |y_i| (rows,)."""
        blocks = ratio[:, None, None] * (np.eye(3) - a[:, :, None] * a[:, None, :])
        index = np.arange(len(a) + 1)
        return self.G.T @ sp.bsr_array((blocks, index[:-1], index)) @ self.G

    def _options(self, tolerance: float, deadline: Clock) -> dict[str, Any]:
        options: dict[str, Any] = {"time_limit": min(max(deadline.remaining, 1e-3), 1e9)}
        if self.method.settings == "tuned":
            violation = float(self.problem.violations(self.x).max())
            eps = float(np.clip(FORCING * violation, 0.1 * tolerance, 1e-4))
            options |= {"eps_abs": eps, "eps_rel": eps, "max_iter": ITERATIONS}
            options |= {"scaling": 0, "rho": self.rho}
        return options

    def converged(self, tolerance: float) -> bool:
        """Whether the violation, and the gap relative to the dual value of Y, are below it."""
        problem, violations = self.problem, self.problem.violations(self.x)
        lower, _ = dual_bound(problem, self.Y)
        gap = problem.objective(self.x) + problem.dual_norms(self.Y) @ violations - lower
        limit = tolerance * max(lower, problem.objective_floor)
        return bool(violations.max() < tolerance and gap < limit)
