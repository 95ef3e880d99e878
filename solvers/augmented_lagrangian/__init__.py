"""Augmented Lagrangian with Newton-CG inside (Narain, Samii, O'Brien 2012).

R. Narain, A. Samii, J. O'Brien, "Adaptive anisotropic remeshing for cloth simulation", ACM Trans.
Graph. 31(6), and their program ARCSim: constraints sqrt(area) (s - b) <= 0 on stretches s, penalty
mu = 1e3 beside an objective divided by the harmonic mean of the masses. For each constraint, with
rho = mu area / mean(1/m) (for volumes volume^(2/3)), y = G_i x, and from x = target, Y = 0:

1. minimise 1/2 |x - t|_M^2 + sum_i rho_i/2 dist^2(y_i + Y_i/rho_i, B_i) by Newton's method, B_i
   the ball |y| <= b_i, or with exact limits all matrices with singular values up to b_i;
2. Newton's step by conjugate gradients on the generalised Hessian, preconditioned with its 3 x 3
   diagonal blocks, to a tenth of the gradient; then Armijo's rule, t = 1, 1/2, 1/4, ...;
3. end once 1/2 |gradient|^2_{M^-1} <= sum_i |Y+ - Y|^2 / 2 rho_i, which makes the method converge
   (R. T. Rockafellar, "Augmented Lagrangians and applications of the proximal point algorithm in
   convex programming", Math. Oper. Res. 1, 1976, criterion B'), or where the answer needs no more;
4. Y = Y+ = rho_i (Z - its projection on B_i), Z = y_i + Y_i/rho_i: Z with its singular values
   lowered by b_i, times rho_i; double mu where the violation has not halved;
5. stop once the largest violation and f(x) + sum_i |Y_i| v_i - D(Y), which is
   sum_i |Y_i| max(b_i, |y_i|) - <Y_i, y_i> + 1/2 |M (x - t) + G^T Y|^2_{M^-1}, are small.

ARCSim keeps one number a principal stretch, l = |Y_i| / sqrt(area), and the direction of y at
hand; the vector or matrix Y_i remembers the direction too, without which exact limits have no
limit point where the principal stretches are equal. Y is what certifies the answer.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from solvers.augmented_lagrangian.minimum import Blocks, Minimum
from strainbench import Clock, Problem, Solution, Solver
from strainbench.arrays import FloatArray
from strainbench.solver.memory import Memory

ENOUGH = 0.05
"""Part of the gap allowed that an inexact minimum may use up."""


@dataclass(frozen=True)
class AugmentedLagrangian(Solver):
    """Augmented Lagrangian with Newton-CG inside (Narain, Samii, O'Brien 2012).

    | status | when |
    |---|---|
    | solved | the largest violation and the relative duality gap are below the tolerance |
    | iteration limit | they are not, after `max_updates` of the multipliers |
    | time limit | they are not, at the deadline |

    The variant "arcsim" has ARCSim's fixed penalty, nonlinear conjugate gradients inside, and
    fixed counts: 10 of their steps to an update, 100 in all, wherever these end.

    Parameters
    ----------
    penalty, max_penalty : mu at first and at most. Tuned on frame 30 of the swing at 10 and 20
        cells, 1% and 0.1%, and 40 at 1%: from 1e3, as ARCSim, up to 2e4 takes 0.3 to 1.5 times
        the time of a fixed mu from 1e3 to 1e4; with 100, some did not end in 10 s. L-BFGS took 2 to
        3 times as long as Newton-CG.
    warm : start from the frame before: its multipliers, and its positions moved as the target has
        moved. On frames 10 to 30 of the swing at 20 cells, 1%, 180 steps become 89 (medians); to
        carry mu over too takes up to 1.5 times as many.
    inner : "newton" for step 2, or "cg" for nonlinear conjugate gradients, with beta =
        max(0, min(Hestenes-Stiefel, Dai-Yuan)) and the step length of one Newton step along p.
    inner_steps : to an update, at most.
    max_updates : of the multipliers; ten times what the tuning needed.
    """

    name = "augmented-lagrangian"
    variants = {"arcsim": {"max_penalty": 1e3, "inner": "cg", "inner_steps": 10, "max_updates": 10}}
    takes_exact = True

    warm: bool = False
    penalty: float = 1e3
    max_penalty: float = 2e4
    inner: str = "newton"
    inner_steps: int = 200
    max_updates: int = 1000

    def __post_init__(self) -> None:
        if self.inner not in ("newton", "cg"):
            raise ValueError(f"inner is {self.inner!r}: valid are newton, cg")

    def prepare(self, problem: Problem) -> Memory[Blocks]:
        """Coefficients, and the compiled loops."""
        G = Blocks.of(problem)
        shape = (problem.constraints, len(G.rows.axes), 3)
        inner = Minimum(G, problem, np.zeros(shape), self.penalty, problem.target)
        inner.newton_step(0)
        return Memory(G, self.warm)

    def solve(
        self,
        problem: Problem,
        state: Memory[Blocks],
        *,
        tolerance: float,
        monitor: Callable[..., None],
        deadline: Clock,
    ) -> Solution:
        """Updates from the target and Y = 0, or from the last answer.

        The monitor sees inner steps 1, 2, 4, 8, ...
        """
        x, Y = state.start(problem)
        return state.keep(
            problem, self.update(problem, state.mesh, x, Y, tolerance, monitor, deadline)
        )

    def update(
        self,
        problem: Problem,
        G: Blocks,
        x: FloatArray,
        multipliers: FloatArray,
        tolerance: float,
        monitor: Callable[..., None],
        deadline: Clock,
    ) -> Solution:
        """Updates from any x (n, 3) and multipliers (rows, 3)."""
        Y = multipliers.reshape(problem.constraints, -1, 3)
        penalty, last, steps = self.penalty, np.inf, 0
        floor = problem.objective_floor
        for updates in range(self.max_updates + 1):
            violation, gap = judge(problem, G, x, Y.reshape(-1, 3))  # 5
            allowed = tolerance * max(problem.objective(x) - gap, floor)
            status = "iteration limit" if updates == self.max_updates else ""
            status = "time limit" if deadline.passed else status
            status = "solved" if violation < tolerance and gap < allowed else status
            if status:
                break
            if violation > 0.5 * last:
                penalty = min(2 * penalty, self.max_penalty) if updates > 1 else penalty
            last = violation
            minimum = Minimum(G, problem, Y, penalty, x)
            step = minimum.newton_step if self.inner == "newton" else minimum.cg_step
            for number in range(self.inner_steps):
                close = minimum.residual <= max(minimum.moved, ENOUGH * allowed)
                if (number and close) or minimum.residual == 0 or deadline.passed:  # 3
                    break
                step()
                steps += 1
                if steps & (steps - 1) == 0:
                    monitor(minimum.x.copy(), minimum.Y.reshape(-1, 3).copy(), steps)
            x, Y = minimum.x, minimum.Y  # 4
        return Solution(x, status, steps, Y.reshape(-1, 3), {"updates": updates})


def judge(problem: Problem, G: Blocks, x: FloatArray, Y: FloatArray) -> tuple[float, float]:
    """Largest violation and gap of x (n, 3) with multipliers Y (rows, 3)."""
    stretches = problem.stretches(x)
    force = problem.weights[:, None] * (x - problem.target) + problem.G.T @ Y
    priced = problem.dual_norms(Y) @ np.maximum(problem.bounds, stretches)
    slack = float(priced - np.sum(Y * (problem.G @ x)))
    gap = slack + 0.5 * float(G.W @ np.sum(force**2, axis=1))
    return float(np.max(stretches - problem.bounds)), gap
