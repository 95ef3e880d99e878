"""Fast projection by Newton steps on the violated rows (Goldenthal et al. 2007, Sec. 4).

R. Goldenthal, D. Harmon, R. Fattal, M. Bercovier, E. Grinspun, "Efficient simulation of
inextensible cloth", ACM Trans. Graph. 26(3), Algorithm 1; for triangles E. English, R. Bridson,
"Animating developable surfaces using nonconforming elements", ACM Trans. Graph. 27(3), 2008.
With C_i = ||y_i|| - b_i, y = G x, J = dC/dx and W = M^-1 on the free vertices, from x = target:

1. stop once max C over all rows is below the tolerance;
2. linearise the violated rows, C_i > 0: row i of J is y_i/|y_i| times row i of G, without pins;
3. solve (J W J^T + eps D) dl = C with D = diag(J W J^T), and dx = -W J^T dl;
4. x += t dx with t = 1, 1/2, 1/4, ...: the first that lowers phi = 1/2 sum_{C_i > 0} C_i^2 / D_i.

The paper has eps = 0 and t = 1. But all limited directions of a triangle are functions of its
three strains, so that J W J^T is singular with four of them, and nearly so where neighbours lock.
Step 3 is solved through the same system's normal equations,

    (M + J^T (eps D)^-1 J) dx = -J^T (eps D)^-1 C,

which are positive definite at any rank and no larger than the free coordinates: the same dx, 3 to
8 times sooner. Full steps can raise C, as a row also lengthens, to second order, when its ends
move sideways; dx always descends phi, which is convex, so that halving it is safe.

No loop is compiled here: SciPy's are in C, and the factorisation takes most of the time.

Each step is the least move from where the last one ended, and none goes back towards the target:
the answer is feasible, not the closest.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy

from strainbench import Clock, Problem, Solution, Solver
from strainbench import sparse as sp
from strainbench.arrays import FloatArray, IntArray
from strainbench.problem.leverage import Leverage, free_numbers

EXPLODED = 1e3
"""Largest C, beside the target's own or 1, beyond which positions are given up."""

DECREASE, HALVINGS = 1e-4, 20
"""Armijo's condition with its customary factor (Nocedal and Wright 2006, Sec. 3.1)."""


@dataclass(frozen=True)
class FastProjection(Solver):
    """Fast projection by Newton steps on the violated rows (Goldenthal et al. 2007, Sec. 4).

    | status | when |
    |---|---|
    | solved | the largest violation of the returned positions is below the tolerance |
    | iteration limit | it is not, after `max_iterations` |
    | time limit | it is not, at the deadline |
    | diverged | it is not finite, or has exploded: the last finite positions |
    | singular matrix | the factorisation failed: the positions before it |

    Parameters
    ----------
    regularisation : eps. Tuned with `line_search` on the swing, simulated at 20 and 40 cells
        with limits of 1% and 10%: 1e-4 always converged, in 70 to 80 iterations at 40 cells;
        1e-3 ends closer to the optimum, but needs more than 200 in some steps; 1e-2 in most at 1%.
    line_search : step 4's, for robustness; False, the variant "full-step", is the paper's t = 1.
    max_iterations : Newton steps; four times what the tuning runs needed on average.
    """

    name = "fast-projection"
    variants = {"full-step": {"line_search": False}}

    regularisation: float = 1e-4
    line_search: bool = True
    max_iterations: int = 300

    def prepare(self, problem: Problem) -> Newton:
        """D, and where the entries of J go."""
        return Newton(problem)

    def solve(
        self,
        problem: Problem,
        state: Newton,
        *,
        tolerance: float,
        monitor: Callable[..., None],
        deadline: Clock,
    ) -> Solution:
        """Newton steps from the target; the monitor sees each."""
        x = problem.target.copy()
        y, C = constraints(problem, x)
        ceiling = EXPLODED * max(1.0, C.max())
        for iteration in range(self.max_iterations + 1):
            if C.max() < tolerance:  # 1
                return Solution(x, "solved", iteration)
            if iteration == self.max_iterations:
                break
            if deadline.passed:
                return Solution(x, "time limit", iteration)
            violated = np.flatnonzero((C > 0) & (state.D > 0))
            J = state.jacobian(violated, y[violated])  # 2
            try:
                dx = state.newton_step(J, C[violated], self.regularisation * state.D[violated])  # 3
            except RuntimeError:  # SuperLU: "Factor is exactly singular"
                return Solution(x, "singular matrix", iteration)
            slope = float((C[violated] / state.D[violated]) @ (J @ dx))
            last = x
            x, y, C = self._advance(problem, state, x, dx, C, slope)  # 4
            if not C.max() <= ceiling:
                finite = np.isfinite(C.max())
                return Solution(x if finite else last, "diverged", iteration + 1)
            monitor(x)
        return Solution(x, "iteration limit", self.max_iterations)

    def _advance(
        self,
        problem: Problem,
        state: Newton,
        x: FloatArray,
        dx: FloatArray,
        C: FloatArray,
        slope: float,
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """x + t dx, with its y and C; `slope` is dphi/dt at t = 0."""
        phi = state.merit(C)
        for halvings in range(HALVINGS + 1):
            t = 0.5**halvings
            moved = x.copy()
            moved[problem.free] += t * dx.reshape(-1, 3)
            y, C = constraints(problem, moved)
            if not self.line_search or state.merit(C) <= phi + DECREASE * t * slope:
                break
        return moved, y, C


def constraints(problem: Problem, x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """y = G x (rows, 3) and C = |y| - b (rows,) at `x` (n, 3); infinite where it overflows."""
    with np.errstate(over="ignore", invalid="ignore"):
        y = problem.G @ x
        return y, np.sqrt(np.sum(y**2, axis=1)) - problem.bounds


class Newton:
    """Steps 2 and 3, and phi; the same from frame to frame.

    D : (rows,) diagonal of J W J^T, sum_k w_k g_k^2 over the free vertices: |y_i/|y_i|| is 1; 0
    where no free vertex can change the row.
    """

    def __init__(self, problem: Problem) -> None:
        self._columns = free_numbers(problem)[problem.row_vertices]
        self._g = problem.row_coefficients
        self._mass = np.repeat(problem.weights[problem.free], 3)
        self.D = Leverage.of(problem).total

    def jacobian(self, rows: IntArray, y: FloatArray) -> sp.csr_array:
        """(r, 3 n) J of these rows over the free coordinates, from their y (r, 3)."""
        columns, g = self._columns[rows], self._g[rows]
        free = columns >= 0
        direction = y / np.linalg.norm(y, axis=1, keepdims=True)
        entries = (g[:, :, None] * direction[:, None, :])[free]
        places = 3 * columns[free][:, None] + np.arange(3)
        starts = np.concatenate([[0], np.cumsum(3 * free.sum(axis=1))])
        return sp.csr_array(
            (entries.ravel(), places.ravel(), starts), shape=(len(rows), len(self._mass))
        )

    def newton_step(self, J: sp.csr_array, C: FloatArray, eps_D: FloatArray) -> FloatArray:
        """(3 n,) dx of the normal equations."""
        A = sp.diags_array(self._mass) + J.T @ (sp.diags_array(1 / eps_D) @ J)
        factor = scipy.sparse.linalg.splu(
            sp.csc_matrix(A),
            permc_spec="MMD_AT_PLUS_A",
            diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        )
        step: FloatArray = factor.solve(-(J.T @ (C / eps_D)))
        return step

    def merit(self, C: FloatArray) -> float:
        """phi, over the rows that can move."""
        movable = self.D > 0
        with np.errstate(over="ignore"):
            return 0.5 * float(np.sum(np.maximum(C[movable], 0.0) ** 2 / self.D[movable]))
