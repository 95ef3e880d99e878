"""A primal-dual interior point on the projection as it is (ours; Mehrotra 1992, Gondzio 1996).

    minimise 1/2 ||x - target||_M^2  such that  q_i(x) = (b_i^2 - |y_i|^2)/2 >= 0,  y = G x,

with one slack s_i > 0 and one multiplier l_i > 0 a constraint, where a second-order-cone method
needs four of each. With r = q - s, r_d = M (x - target) + G^T (l y) and mu the mean of the
products s l, a Newton step that is to change the products by c solves

    K dx = -r_d - G^T (h y),  h = (c - l r)/s,  ds = r - y.dy,  dl = h + (l/s)(y.dy),
    K = M + sum_i l_i (g_i g_i^T) (x) I_3 + (l_i/s_i) (g_i (x) y_i)(g_i (x) y_i)^T:

3 x 3 blocks on the graph of the mesh, whose pattern never changes.

1. Return a target that is feasible. Where there is nothing to move, or the pins are too far apart,
   no positions meet the limits.
2. Stop when violation and relative gap, both computed at x, are below the tolerance; or when the
   dual bound exceeds the objective of any point within the limits: there is none.
3. From the candidate, or far beyond the limits from a point nearer to them:
   `solvers.newton_ipm.drawn`. Factorise K. Predictor: c = -s l.
4. Corrector: c = sigma mu - s l - ds dl and r less |dy|^2/2, of the predictor's step, where
   sigma = (products after the predictor / products)^6, but no smaller than what the tolerance
   asks for, nor than 1e-4 of the whole error. With masses over many decades the products would
   run ahead of the residuals of light vertices, which count for nothing in the objective, until
   slacks are lost in rounding.
5. Gondzio's correctors: what moves the products of a longer step into [0.1, 5] sigma mu, kept
   while the step grows.
6. One step length for all, 0.99 of the way to the boundary.
7. Where neither comes nearer, the limits may have no interior, such as those with a bound of 1 and
   pins at rest: multipliers then have no bound. Limits wider by 2e-8 to 1e-13 have one. The answer
   to these of the least error is returned; it counts as solved where its violations are small for
   multipliers a hundred times its own, which the referee's may be.
8. Or there are no positions within the limits: `solvers.newton_ipm.infeasible`.

A warm start carries the centred iterate of the frame before, not its last one: when the gap falls
below SNAPSHOT, one solve with the factor at hand and c = mu - s l gives the point to keep. The
next frame starts there, moved as the target has moved and by half of what x - target last changed
by from frame to frame, with slacks widened to those it has. Where a frame takes no fewer iterations
than the last cold one, the next is cold again: from a frame that was hardly stretched the swing's
starts at 6 cells are off centre, and so are those after them, with 20 iterations a frame in place
of 7.

Exact limits have symmetric matrices for q, s and l: `solvers.newton_ipm.exact`.

What was tuned, on frames of the swing at 20 and 60 cells, limits of 0.1% to 10%, counting
factorisations to a gap of 1e-6 at 60 cells, 1%: sigma's exponent 3 takes 12.8, 6 takes 11.6 to
12, 8 no fewer; correctors 0, 1, 2, 3: 15.8, 13.2, 11.8, 11.0, the time being the same from 1 to 4,
as each costs a solve; a first slack of 1e-2, 3e-3, 1e-3: 12.8, 13.0, 13.4; a first mu from 3 to 300
times that of the optimum's objective makes less than one iteration of difference, one below it
many. Warm, with slacks kept instead of widened it takes 11 to 17, and from the last positions
unmoved 10 to 25, where it takes 7. Limits 10 times stricter than the gap, not 100, spare 4 to 8% of
the iterations; half of the last change 2 to 6% of the warm ones.

Where the time goes, in units of one factorisation and solve, as it is printed by `strainbench
profile swing --set resolution=60 --frame 20 --solver newton-ipm`: an iteration takes 1.83, of
them 0.94 for the matrix's factor, 0.09 for its assembly, 0.70 for three to four solves with what
goes before and after each, 0.05 for the measurement. Each step is one compiled loop over the
elements (measure, assemble, aim, push, change), which does its algebra and its sums on the way.
Blocks are summed by material axes before they go to vertex pairs, and stored as their six
entries.

What brought nothing: first multipliers weighted by violation, first slacks in proportion to it, a
start from the positions of up to 300 Gauss-Seidel sweeps (there, feasible ones matter less than a
first mu of the right size), slacks reset to q where that is positive, 0.999 in place of 0.99. The
second-order term of the latest corrector in place of the predictor's, with 3 correctors stopped at
a length of 0.95 and an exponent of 4: 1.05 to 1.16 times the factorisations and solves at 20, 40
and 60 cells and in the drape; these 3 correctors alone: 0.98 to 1.03.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from solvers.newton_ipm.infeasible import infeasible_multipliers
from solvers.newton_ipm.iterate import DEARER, Iterate, State
from solvers.newton_ipm.mesh import ROUNDING
from strainbench import Clock, Problem, Solution, Solver, section
from strainbench.arrays import FloatArray
from strainbench.physics.linear import NotPositiveDefiniteError
from strainbench.problem.dual import dual_bound

PATIENCE = 25  # iterations after which a warm start is given up
WIDTHS = 2e-8, 1e-10, 1e-12, 1e-13  # of wider limits; below, slacks are rounding
FAR = 1e-7  # errors below are rounding's: no other way out is tried
STALL, JAM = 12, 30  # iterations without progress, below an error of 1e-3 and above
NEARER = 0.999  # of the violation: without an interior the gap may grow for longer
ROUGH, ROUGH_ITERATIONS = 0.1, 40  # of projections onto wider limits


@dataclass(frozen=True)
class NewtonIPM(Solver):
    """Interior point on the quadratic constraints themselves (ours; Mehrotra 1992, Gondzio 1996).

    | status | when |
    |---|---|
    | solved | violation and relative gap are below the tolerance, as the referee measures them |
    | infeasible | the dual bound exceeds the objective of any point within the limits, or the \
pins alone are too far apart |
    | stalled | rounding: neither got better in 12 iterations (30 far from the optimum), or K has \
no factor any more; the best iterate is returned |
    | stalled: limits without an interior | wider limits are solved, these not to the tolerance: \
multipliers have no bound, and the referee's may price a violation higher than the answer's own |
    | iteration limit, time limit | neither of these before |

    Parameters
    ----------
    warm : start from the frame before.
    max_iterations : of factorisations.
    """

    name = "newton-ipm"
    takes_exact = True

    warm: bool = False
    max_iterations: int = 200

    def prepare(self, problem: Problem) -> State | None:
        """Sparsity, ordering and symbolic factorisation; None where there is nothing to move."""
        return State(problem) if len(problem.free) else None

    @np.errstate(all="ignore")  # what overflows is not finite, and no step forward
    def solve(
        self,
        problem: Problem,
        state: State | None,
        *,
        tolerance: float,
        monitor: Callable[..., None],
        deadline: Clock,
    ) -> Solution:
        """See the module's docstring for the steps."""
        nowhere = np.full_like(problem.target, np.nan)
        if not np.any(problem.violations(problem.target)):  # 1
            if state is not None:
                state.snapshot = None
            return Solution(problem.target.copy(), "solved", 0, np.zeros((problem.rows, 3)))
        if state is None or problem.infeasible_pins():
            return Solution(nowhere, "infeasible", 0, np.zeros((problem.rows, 3)))
        found, error = self._attempt(problem, state, self.warm, tolerance, monitor, deadline)
        if found.status != "stalled" or error < FAR:
            return found
        wider = self._wider(problem, state, tolerance, monitor, deadline)  # 7
        best = min([found, *wider], key=lambda solution: worth(problem, solution))
        if wider:
            status = "stalled"
            if any(other.status == "solved" for other in wider):
                status = "stalled: limits without an interior"
            if worth(problem, best) <= tolerance:
                status = "solved"
            iterations = found.iterations + sum(other.iterations for other in wider)
            return replace(best, status=status, iterations=iterations)
        violation = float(problem.violations(found.positions).max())
        if violation == 0:
            return found
        rough = partial(roughly, state=state, deadline=deadline)
        shown = infeasible_multipliers(problem, violation, tolerance, rough)  # 8
        return found if shown is None else Solution(nowhere, "infeasible", found.iterations, shown)

    def _wider(
        self,
        problem: Problem,
        state: State,
        tolerance: float,
        monitor: Callable[..., None],
        deadline: Clock,
    ) -> list[Solution]:
        """Answers to limits that are wider by a hair, then by less; none if that does not help."""
        answers: list[Solution] = []
        for width in WIDTHS:
            wider = problem.tightened(-width)
            other, error = self._attempt(wider, state, False, tolerance, monitor, deadline)
            if not error < ROUGH:
                break
            answers.append(other)
            if other.status not in ("solved", "stalled") or worth(problem, other) <= tolerance:
                break
        return answers

    def _attempt(
        self,
        problem: Problem,
        state: State,
        warm: bool,
        tolerance: float,
        monitor: Callable[..., None],
        deadline: Clock,
    ) -> tuple[Solution, float]:
        """Steps 2 to 6; and the least error, which is the solution's."""
        iterate = Iterate(problem, state, warm, tolerance)
        warm = resumed = iterate.begin()
        best, best_at, kept, least = np.inf, 0, None, np.inf
        status = "iteration limit"
        for k in range(self.max_iterations + 1):
            with section("measure"):
                error = iterate.measure()
            if k:
                monitor(iterate.x, iterate.Y)
            if error < best:
                best, best_at, kept = error, k, (iterate.x, iterate.Y)
            if max(0.0, iterate.violation) < NEARER * least:
                least, best_at = iterate.violation, k
            if error <= tolerance:  # 2
                state.compare(k, resumed)
                return Solution(iterate.x, "solved", k, iterate.Y), error
            if iterate.infeasible:
                nowhere = np.full_like(iterate.x, np.nan)
                return Solution(nowhere, "infeasible", k, iterate.Y), error
            if deadline.passed:
                status = "time limit"
                break
            if warm and k == PATIENCE:
                warm = False
                iterate.start()
                continue
            if k - best_at >= (STALL if best < 1e-3 else JAM):
                status = "stalled"
                break
            try:
                iterate.step()
            except NotPositiveDefiniteError:  # K is, but for rounding
                status = "stalled"
                break
        x, Y = (iterate.x, iterate.Y) if kept is None else kept
        return Solution(x, status, k, Y), float(best)


def worth(problem: Problem, solution: Solution) -> float:
    """The error as the referee has it, with violations DEARER, as in `Iterate.measure`.

    Being below the optimum does not set off violations here: other multipliers price them higher.
    """
    assert solution.multipliers is not None
    x, violations = solution.positions, problem.violations(solution.positions)
    lower_bound, norms = dual_bound(problem, solution.multipliers)
    price = DEARER * float(norms @ np.maximum(violations - 2 * ROUNDING, 0.0))
    scale = max(lower_bound, problem.objective_floor)
    gap = (abs(problem.objective(x) - lower_bound) + price) / scale
    return max(DEARER * float(violations.max()), gap)


def roughly(
    problem: Problem, width: float, state: State, deadline: Clock
) -> Iterator[tuple[float, FloatArray]]:
    """The errors and multipliers of a projection's iterates.

    An error of 1 is a gap of ROUGH, or a violation by the part ROUGH of `width`.
    """
    iterate = Iterate(problem, state, False, ROUGH)
    iterate.start()
    for _ in range(ROUGH_ITERATIONS):
        iterate.measure()
        error = max(iterate.gap, iterate.violation / width) / ROUGH
        yield error, iterate.Y
        if error < 1 or deadline.passed:
            return
        try:
            iterate.step()
        except NotPositiveDefiniteError:
            return
