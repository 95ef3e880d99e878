"""Position-based dynamics with strain constraints (Muller et al. 2014; Macklin et al. 2016).

M. Muller, N. Chentanez, T.-Y. Kim, M. Macklin, "Strain based dynamics", SCA 2014: constraints on
the entries of the strain F^T F. The limited direction d as a material axis makes its entry

    C_i(x) = d^T F^T F d - b^2 = |y|^2 - b^2,  y = sum_k g_k x_k,  dC_i/dx_k = 2 g_k y.

M. Macklin, M. Muller, N. Chentanez, "XPBD: position-based simulation of compliant constrained
dynamics", MIG 2016, Eqs. 17 and 18: with w_k = 1/m_k (0 at a pin), from x = target and l = 0,
for each row i of G in turn, in mesh order:

1. skip the row if C_i <= 0: the limit is one-sided;
2. dl = (C_i - a_i l_i) / (4 |y|^2 sum_k w_k g_k^2 + a_i);
3. l_i += dl, x_k -= 2 w_k g_k y dl;
4. stop once the largest violation of all rows at the same positions is below the tolerance.

With no compliance, a_i = 0, this is Gauss-Seidel projection but for the constraint function: the
step is a Newton step on |y|^2 - b^2, which leaves the row violated by (|y| - b)^2 / 2|y|, and
needs no square root. Muller et al.'s other form, sqrt(d^T F^T F d) - b, solved in one step, gives
the solver `gauss-seidel` to the letter. The multipliers Y_i = 2 l_i y_i are a by-product: the path
bends, so that they do not explain where x ends, and the answer is not the closest one.

XPBD's other one-sided form clamps l_i >= 0 instead of step 1, so that a row may give back what it
took, though the directions y have moved since: measured on frame 30
of the swing at 1%, it ends twice as close at 10 cells, after five times as many sweeps, and no
closer at 20 cells, where it is still above 1e-6 after 1e5 sweeps.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from strainbench import Clock, Problem, Solution, Solver
from strainbench.arrays import FloatArray
from strainbench.compiled import compiled
from strainbench.problem.leverage import Leverage
from strainbench.problem.rows import Rows, add_row, row
from strainbench.solver.memory import Memory

Mesh = tuple[Rows, Leverage]

ROWS_A_CHUNK = 3_000_000
"""Row visits between two looks at the clock: 30 ms at the 10 ns a visit measured."""


@dataclass(frozen=True)
class Xpbd(Solver):
    """Position-based dynamics with strain constraints (Muller et al. 2014; Macklin et al. 2016).

    | status | when |
    |---|---|
    | solved | the largest violation of the returned positions is below the tolerance |
    | iteration limit | it is not, after `max_sweeps` |
    | time limit | it is not, at the deadline |

    Parameters
    ----------
    max_sweeps : over all rows, as many as `gauss-seidel` has; the variant "20" has the 20 that
        interactive use affords, which no test of the limits ends.
    compliance : a_i over 4 b_i^2 sum_k w_k g_k^2: a row alone is left with this part of its
        C_i, nearly; it never meets its limit. The variant "compliant" has 1e-3 and 100 sweeps.
    clamped : l_i >= 0 in place of step 1.
    warm : start from the frame before: its positions, moved as the target has moved, and l = 0.
        As in `gauss-seidel`, the errors of all frames add up: on frames 10 to 30 of the swing at
        20 cells, 1%, 7,844 sweeps in place of 12,877 (medians), the farthest vertex 21 mm from the
        optimum in place of 5.
    """

    name = "xpbd"
    variants = {
        "20": {"max_sweeps": 20},
        "compliant": {"compliance": 1e-3, "max_sweeps": 100},
    }

    max_sweeps: int = 100_000
    compliance: float = 0.0
    clamped: bool = False
    warm: bool = False

    def __post_init__(self) -> None:
        if not 0 <= self.compliance < float("inf"):
            raise ValueError(f"compliance is {self.compliance}: a number of at least 0 is valid")

    def prepare(self, problem: Problem) -> Memory[Mesh]:
        """Coefficients, and the compiled loops."""
        G = Rows.of(problem)
        levers, l = Leverage.of(problem), np.zeros(problem.rows)  # noqa: E741
        sweep(G, levers, problem.bounds, problem.target.copy(), l, 0.0, self.clamped, 1.0, 0)
        return Memory((G, levers), self.warm)

    def solve(
        self,
        problem: Problem,
        state: Memory[Mesh],
        *,
        tolerance: float,
        monitor: Callable[..., None],
        deadline: Clock,
    ) -> Solution:
        """Sweeps from the target, or the last answer; the monitor sees sweeps 1, 2, 4, 8, ..."""
        (x, _), l = state.start(problem), np.zeros(problem.rows)  # noqa: E741
        solution = self.relax(problem, state.mesh, x, l, tolerance, monitor, deadline)
        return state.keep(problem, solution)

    def relax(
        self,
        problem: Problem,
        mesh: Mesh,
        x: FloatArray,
        multipliers: FloatArray,
        tolerance: float,
        monitor: Callable[..., None],
        deadline: Clock,
    ) -> Solution:
        """Sweeps from any x (n, 3) and l (rows,), both changed in place."""
        b, l, done, mark = problem.bounds, multipliers, 0, 1  # noqa: E741
        chunk = max(1, ROWS_A_CHUNK // problem.rows)
        a, clamped, enough = self.compliance, self.clamped, float(tolerance)
        status = ""
        while not status:
            if problem.violations(x).max() < tolerance:  # 4
                status = "solved"
            elif done >= self.max_sweeps:
                status = "iteration limit"
            elif deadline.passed:
                status = "time limit"
            else:
                sweeps = min(mark - done, chunk, self.max_sweeps - done)
                done += sweep(*mesh, b, x, l, a, clamped, enough, sweeps)
            if done == mark:
                monitor(x.copy(), iterations=done)
                mark *= 2
        return Solution(x, status, done, 2 * l[:, None] * (problem.G @ x))


@compiled
def sweep(
    G: Rows,
    levers: Leverage,
    b: FloatArray,
    x: FloatArray,
    l: FloatArray,  # noqa: E741
    compliance: float,
    clamped: bool,
    tolerance: float,
    sweeps: int,
) -> int:
    """Steps 1 to 3 on x and l in place, so often, or until nothing is violated by `tolerance`."""
    for number in range(sweeps):
        worst = 0.0
        for i in range(len(b)):
            y0, y1, y2 = row(G, i, 0, x)
            square, limit, L = y0 * y0 + y1 * y1 + y2 * y2, b[i] * b[i], levers.total[i]
            if L == 0 or (square <= limit and not (clamped and l[i] > 0)):  # 1
                continue
            C = square - limit
            worst = max(worst, C / (2 * b[i]))
            a = 4 * limit * L * compliance
            dl = (C - a * l[i]) / (4 * square * L + a)  # 2
            if clamped:
                dl = max(dl, -l[i])
            l[i] += dl  # 3
            s = -2 * dl
            add_row(G, levers.moves, i, 0, (s * y0, s * y1, s * y2), x)
        if worst < tolerance:
            return number + 1
    return sweeps
