"""ADMM in projective-dynamics form (Overby et al. 2017, Sec. 4; Boyd et al. 2011, Sec. 3).

M. Overby, G. Brown, J. Li, R. Narain, "ADMM superset of projective dynamics", IEEE TVCG 23(10);
S. Boyd et al., "Distributed optimization and statistical learning via ADMM", Foundations and
Trends in Machine Learning 3(1); J. Zhang et al., "Accelerating ADMM for efficient simulation and
optimization", ACM TOG 38(6), 2019.

    minimise 1/2 ||x - target||_M^2 + sum_i indicator(|z_i| <= b_i)  such that  W^1/2 (G x - z) = 0

with one weight w_i a constraint. With v = z + u, where W u are the multipliers of G x = z:

1. z = P(v), each (v)_i moved into its ball, or its singular values clamped; u = v - z;
2. x = argmin 1/2 ||x - target||_M^2 + 1/2 ||G x - z + u||_W^2: one matrix M + G^T W G on the free
   vertices, factorised once for many iterations, and for the three coordinates at once;
3. stop if x itself and the multipliers W u say so: see `Admm`;
4. v <- v + alpha (G x - z), over-relaxed (Boyd et al. 2011, Sec. 3.4.3);
5. Anderson acceleration of v, if asked for (Zhang et al. 2019, Alg. 1);
6. now and then new weights, a new factor, and u scaled to keep W u (Boyd et al. 2011, Sec. 3.4.1).

The weights are w_i = rho_i / (g_i M^-1 g_i), so that rho_i has no unit.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from solvers.admm.anderson import Anderson
from solvers.admm.steps import Steps
from strainbench import Clock, Problem, Solution, Solver
from strainbench.arrays import FloatArray
from strainbench.solver.memory import Memory
from strainbench.solver.solver import held_still

LOOK = 10
"""Iterations between two tests for the end, each as dear as half an iteration."""

FIRST_RHO = 10.0
FIRST_CHANGE, NEXT_CHANGE = 5.0, 1.5
"""Weights may change at iterations 5, 8, 12, ...: ever more seldom, so that they settle."""

POWER, SPREAD, FACTOR = 0.25, (0.1, 10.0), 1.5
"""Of the weights; tuned like the others here on three frames of the swing at 10 and 20 cells, 1%
and 0.1%. The per-row optimum, power 1, settles late; equal rho take twice the iterations."""

REFACTORISE = 1.1
"""Smallest mean factor between old and new weights for which they are changed."""


@dataclass(frozen=True)
class Admm(Solver):
    """ADMM in projective-dynamics form (Overby et al. 2017, Sec. 4; Boyd et al. 2011, Sec. 3).

    | status | when |
    |---|---|
    | solved | the violation of x and its gap above the dual value of W u are below the tolerance |
    | iteration limit | they are not, after `max_iterations` |
    | time limit | they are not, at the deadline |

    Parameters
    ----------
    weights : "bound" minimises, row by row, the terms rho_i |z_i - z_i^0|^2 + |Y_i|^2 / rho_i of
        the bound on ADMM's error (Boyd et al. 2011, Eq. A.1), with the current z and multipliers
        in place of the optimal ones. "residuals" is the textbook's: all rho_i equal, doubled or
        halved where one residual exceeds the other ten times (Boyd et al. 2011, Eq. 3.13). "bound"
        needs 3 to 12 times fewer iterations on the swing, and up to 8 times more on irregular
        meshes with random masses (14 of the tests' random problems).
    relaxation : alpha.
    memory : former iterates in Anderson acceleration; 0 is none. With 6 it saves a tenth to a half
        of the iterations on the swing, each of which then takes two to three times as long.
    warm : start from the frame before: its multipliers, and its positions moved as the target has
        moved. On frames 10 to 30 of the swing at 20 cells, 1%, 855 iterations become 725
        (medians), and the worst frame's 3690 become 1220; to carry rho over too gains nothing.
    max_iterations : after which it gives up.

    It reaches gaps of 1e-6 in 300 to 5000 iterations on frames of the swing at 10 to 40 cells, 1%
    and 0.1%; the violation of x is often the last to fall.
    """

    name = "admm"
    takes_exact = True
    variants = {"textbook": {"weights": "residuals", "relaxation": 1.0}}

    weights: str = "bound"
    relaxation: float = 1.8
    memory: int = 0
    warm: bool = False
    max_iterations: int = 100_000

    def __post_init__(self) -> None:
        if self.weights not in ("bound", "residuals"):
            raise ValueError(f"weights is {self.weights!r}: valid are bound, residuals")
        if not 0 < self.relaxation < 2:
            raise ValueError(f"relaxation is {self.relaxation}: a number between 0 and 2 is valid")

    def prepare(self, problem: Problem) -> Memory[Steps]:
        """Sparsity, ordering, and the compiled loops."""
        return Memory(Steps(problem), self.warm)

    def solve(
        self,
        problem: Problem,
        state: Memory[Steps],
        *,
        tolerance: float,
        monitor: Callable[..., None],
        deadline: Clock,
    ) -> Solution:
        """Iterations from the target with no multipliers, or from the last answer."""
        if len(problem.free) == 0:
            return held_still(problem, tolerance)
        if not np.any(problem.violations(problem.target)):
            nothing = np.zeros((problem.rows, 3))
            return state.keep(problem, Solution(problem.target.copy(), "solved", 0, nothing))
        iteration = Iteration(self, problem, state.mesh, *state.start(problem))
        status, done = iteration.run(tolerance, monitor, deadline)
        return state.keep(problem, Solution(iteration.x, status, done, iteration.multipliers))


class Iteration:
    """ADMM from any positions (n, 3) and multipliers (rows, 3).

    Attributes
    ----------
    x : (n, 3) [m]; v, z : (rows, 3); w : (rows,)
    """

    def __init__(
        self, method: Admm, problem: Problem, steps: Steps, x: FloatArray, multipliers: FloatArray
    ) -> None:
        self.method, self.problem, self.steps = method, problem, steps
        self.stretched: FloatArray = problem.G @ problem.target
        self.x = x.copy()
        self.z: FloatArray = problem.G @ x
        self.v = self.z
        self.rho = np.full(problem.constraints, FIRST_RHO)
        self._weigh(self.rho, multipliers)

    @property
    def multipliers(self) -> FloatArray:
        """(rows, 3) Y = W u."""
        multipliers: FloatArray = self.w[:, None] * (self.v - self.z)
        return multipliers

    def run(
        self, tolerance: float, monitor: Callable[..., None], deadline: Clock
    ) -> tuple[str, int]:
        """The status, and the iterations done."""
        anderson = Anderson(self.method.memory)
        change = FIRST_CHANGE
        for iteration in range(1, self.method.max_iterations + 1):
            self.z = self._project(self.v)  # 1
            self._solve_for_positions()  # 2
            step = self.problem.G @ self.x - self.z
            if iteration % LOOK == 0:
                monitor(self.x, self.multipliers, iteration)
                if self._converged(tolerance):  # 3
                    return "solved", iteration
                if deadline.passed:
                    return "time limit", iteration
            if iteration >= change:
                change *= NEXT_CHANGE
                if self._reweigh(step):  # 6
                    anderson = Anderson(self.method.memory)
                    continue
            step *= self.method.relaxation
            self.v = anderson(self.v + step, step, self.w)  # 4, 5
        return "iteration limit", self.method.max_iterations

    def _project(self, v: FloatArray) -> FloatArray:
        """Each constraint's rows moved to the closest within its bound."""
        return self.steps.project(v, self.problem.bounds)

    def _solve_for_positions(self) -> None:
        """(M + G^T W G) (x - target) = G^T W (z - u - G target) on the free vertices."""
        pull = self.steps.pull(self.w, self.v, self.z, self.stretched)
        free = self.problem.free
        self.x[free] = self.problem.target[free] + self.steps.linear.solve(pull[free])

    def _converged(self, tolerance: float) -> bool:
        """Whether the violation and the gap relative to the dual value of Y are below it.

        By steps 1 and 2, <u_i, z_i> = b_i |u_i|, so that <Y, G target> - sum b_i |Y_i| =
        <Y, G target - z>; the best multiple of Y has the dual value of `reference.verify`.
        Half the tolerance, as the referee prices violations with multipliers of its own.
        """
        problem, y = self.problem, self.problem.G @ self.x
        violation = self._norms(y - self._project(y))
        if violation.max() > tolerance:
            return False
        Y = self.multipliers
        linear = float(np.sum(Y * (self.stretched - self.z)))
        back = (problem.G.T @ Y)[problem.free]
        quadratic = float(np.sum(back**2 / problem.weights[problem.free, None]))
        lower = 0.5 * linear**2 / quadratic if linear > 0 else 0.0
        priced = float(np.sum(self._norms(Y) * violation))
        gap = problem.objective(self.x) + priced - lower
        return gap <= 0.5 * tolerance * max(lower, problem.objective_floor)

    def _norms(self, rows: FloatArray) -> FloatArray:
        """(constraints,) of (rows, 3), over all entries."""
        norms: FloatArray = np.sqrt(np.sum(rows.reshape(len(self.rho), -1) ** 2, axis=1))
        return norms

    def _weigh(self, rho: FloatArray, multipliers: FloatArray) -> None:
        """New weights and factor for the same z and multipliers."""
        self.rho = rho
        self.w = np.repeat(rho / self.steps.compliance, self.steps.group)
        self.v = self.z + multipliers / self.w[:, None]
        self.steps.factorise(self.w)

    def _reweigh(self, step: FloatArray) -> bool:
        """Choose new weights; whether they differ enough to be taken."""
        if self.method.weights == "bound":
            rho = self._bound_rho()
        else:
            w = np.sqrt(self.w)[:, None]
            primal = np.linalg.norm(w * step)
            dual = np.linalg.norm(w * (self._project(self.v + step) - self.z))
            factor = 2.0 if primal > 10 * dual else 0.5 if dual > 10 * primal else 1.0
            rho = factor * self.rho
        change = np.exp(np.abs(np.log(rho / self.rho)).mean())
        if change < REFACTORISE:
            return False
        self._weigh(rho, self.multipliers)
        return True

    def _bound_rho(self) -> FloatArray:
        """The bound's best common rho, for rows that share it by the roots of their multipliers."""
        root = np.sqrt(self.steps.compliance)
        dual = self._norms(self.multipliers) * root
        moved = self._norms(self.z - self.stretched) / root
        if not dual.any():
            return self.rho
        share = ((dual / dual[dual > 0].mean()) ** POWER).clip(*SPREAD)
        common = np.linalg.norm(dual / np.sqrt(share)) / np.linalg.norm(moved * np.sqrt(share))
        rho: FloatArray = FACTOR * common * share
        return rho
