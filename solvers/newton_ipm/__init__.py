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
3. Factorise K. Predictor: c = -s l.
4. Corrector: c = sigma mu - s l - ds dl and r less |dy|^2/2, of the predictor's step, where
   sigma = (products after the predictor / products)^6.
5. Gondzio's correctors: what moves the products of a longer step into [0.1, 5] sigma mu, kept
   while the step grows.
6. One step length for all, 0.99 of the way to the boundary.
7. Where neither comes nearer, the limits may have no interior, such as those with a bound of 1 and
   pins at rest: multipliers then have no bound. Limits wider by a part of the tolerance have one,
   and an answer to these within the rest of it is one to the limits: Y prices what it violates.
8. Or there are no positions within the limits: `solvers.newton_ipm.infeasible`.

A warm start carries the centred iterate of the frame before, not its last one: when the gap falls
below SNAPSHOT, one solve with the factor at hand and c = mu - s l gives the point to keep. The
next frame starts there, moved as the target has moved, with slacks widened to those it has. Where
a frame takes no fewer iterations than the last cold one, the next is cold again: from a frame that
was hardly stretched the swing's starts at 6 cells are off centre, and so are those after them, with
20 iterations a frame in place of 7.

Exact limits have symmetric matrices for q, s and l: `solvers.newton_ipm.exact`.

What was tuned, on frames of the swing at 20 and 60 cells, limits of 0.1% to 10%, counting
factorisations to a gap of 1e-6 at 60 cells, 1%: sigma's exponent 3 takes 12.8, 6 takes 11.6 to
12, 8 no fewer; correctors 0, 1, 2, 3: 15.8, 13.2, 11.8, 11.0, the last with a fifth more solves;
a first slack of 1e-2, 3e-3, 1e-3: 12.8, 13.0, 13.4; a first mu from 3 to 300 times that of the
optimum's objective makes less than one iteration of difference, one below it many.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from solvers.newton_ipm.exact import ExactCones
from solvers.newton_ipm.infeasible import infeasible_multipliers
from solvers.newton_ipm.mesh import Change
from solvers.newton_ipm.sampled import SampledCones
from strainbench import Clock, Problem, Solution, Solver
from strainbench.limits import FloatArray
from strainbench.physics.linear import NotPositiveDefiniteError, best_linear_solver
from strainbench.physics.pattern import Pattern
from strainbench.reference import objective_floor

FLOOR = 3e-3  # least first slack, in b^2
FIRST_MU = 50.0  # times the guess of the optimum's objective
EXPONENT = 6  # of sigma
LEAST_SIGMA = 1e-4
CORRECTORS = 2
LONGER, GROWTH = 0.3, 0.1  # a corrector aims at this longer a step, and must bring this part of it
LOW, HIGH = 0.1, 5.0  # products aimed at by correctors, in sigma mu
BACK_OFF = 0.99
SNAPSHOT = 0.1  # relative gap
PATIENCE = 25  # iterations after which a warm start is given up
STRICTER = 100.0  # limits must hold so much better than the gap: they do, but for the last steps
ROUNDING = 32 * np.finfo(float).eps  # of a sum of products, as the referee counts it
WIDER = 0.02  # of the tolerance; tuned on pins with nothing to spare: 1e-3 stalls, 0.5 adds a gap
FAR = 1e-7  # errors below are rounding's: no other way out is tried
STALL, JAM = 12, 30  # iterations without progress, below an error of 1e-3 and above
ROUGH, ROUGH_ITERATIONS = 0.1, 40  # of projections onto wider limits


@dataclass(frozen=True)
class NewtonIPM(Solver):
    """Interior point on the quadratic constraints themselves (ours; Mehrotra 1992, Gondzio 1996).

    | status | when |
    |---|---|
    | solved | violation and relative gap are below the tolerance |
    | infeasible | the dual bound exceeds the objective of any point within the limits, or the \
pins alone are too far apart |
    | stalled | rounding: neither got better in 12 iterations (30 far from the optimum), or K has \
no factor any more; the best iterate is returned |
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

    def supports(self, problem: Problem) -> str | None:
        """A reason, where limits are exact and elements are not triangles."""
        if problem.limits.spectral and problem.elements.shape[1] != 3:
            return "its exact limits are those of triangles"
        return super().supports(problem)

    def prepare(self, problem: Problem) -> State | None:
        """Sparsity, ordering and symbolic factorisation; None where there is nothing to move."""
        return State(problem) if len(problem.free) else None

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
        wider = problem.tightened(-WIDER * tolerance)  # 7
        rest = (1 - WIDER) * tolerance
        other, _ = self._attempt(wider, state, False, rest, monitor, deadline)
        if other.status == "solved":
            return replace(other, iterations=found.iterations + other.iterations)
        violation = float(problem.violations(found.positions).max())
        rough = partial(roughly, state=state, deadline=deadline)
        shown = infeasible_multipliers(problem, violation, tolerance, rough)  # 8
        return found if shown is None else Solution(nowhere, "infeasible", found.iterations, shown)

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
        iterate = Iterate(problem, state, keep=warm)
        warm = resumed = warm and state.snapshot is not None
        if warm:
            iterate.resume()
        else:
            iterate.start()
        best, best_at, kept = np.inf, 0, None
        status = "iteration limit"
        for k in range(self.max_iterations + 1):
            error = iterate.measure()
            if k:
                monitor(iterate.x, iterate.Y)
            if error < best:
                best, best_at, kept = error, k, (iterate.x, iterate.Y)
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


def roughly(
    problem: Problem, width: float, state: State, deadline: Clock
) -> Iterator[tuple[float, FloatArray]]:
    """The errors and multipliers of a projection's iterates.

    An error of 1 is a gap of ROUGH, or a violation by the part ROUGH of `width`.
    """
    iterate = Iterate(problem, state, keep=False)
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


class State:
    """What a mesh needs once, and the last frame's centred iterate."""

    def __init__(self, problem: Problem) -> None:
        self.pattern = Pattern.of([problem.elements], problem.vertices, problem.pinned)
        self.linear = best_linear_solver(self.pattern.matrix())
        kind = ExactCones if problem.limits.spectral else SampledCones
        self.cones: SampledCones | ExactCones = kind(problem, self.pattern)
        self.snapshot: tuple[FloatArray, FloatArray, FloatArray, FloatArray] | None = None
        self.cold_iterations = 0
        _ = problem.largest_objective  # its shortest paths are kept with the problem

    def compare(self, iterations: int, resumed: bool) -> None:
        """Drop the snapshot of a frame whose own warm start was no better than a cold one."""
        if not resumed:
            self.cold_iterations = iterations
        elif iterations >= self.cold_iterations:
            self.snapshot = None


class Iterate:
    """Positions, slacks and multipliers of one projection.

    Attributes
    ----------
    x : (n, 3) [m]
    Y : (rows, 3) multipliers
    infeasible : whether the dual bound shows that no positions meet the limits
    """

    def __init__(self, problem: Problem, state: State, keep: bool) -> None:
        self.problem, self.state, self.cones = problem, state, state.cones
        self.keep = keep
        self.target, self.weights = problem.target, problem.weights[:, None]
        self.free, self.floor = problem.free, objective_floor(problem)
        self.infeasible = False
        self.x = problem.target
        self.cones.place(problem.bounds, self.x)
        self.y_target, self.violations = self.cones.y, np.maximum(self.cones.excess(), 0.0)

    def start(self) -> None:
        """From the target, with products of a guess: the violation over the size of the mesh."""
        problem = self.problem
        size = problem.edge_length * np.sqrt(problem.vertices)
        far = size * np.sqrt(np.mean(self.violations**2))
        guess = 0.5 * far**2 * float(np.sum(problem.weights[self.free]))
        self.x = self.target
        self.cones.place(problem.bounds, self.x)
        self.cones.start(FLOOR, FIRST_MU * guess / self.cones.degree)

    def resume(self) -> None:
        """From the snapshot, moved as the target has moved."""
        assert self.state.snapshot is not None
        x, s, l, target = self.state.snapshot  # noqa: E741
        self.x = x + (self.target - target)
        self.cones.place(self.problem.bounds, self.x)
        self.cones.resume(s, l)

    def measure(self) -> float:
        """The larger of violation and relative gap at x, the violations priced in."""
        cones, free = self.cones, self.free
        self.Y, norms = cones.multipliers()
        pull = cones.back(self.Y)
        self.r_d = self.weights * (self.x - self.target) + pull
        excess = cones.excess()
        objective = self.problem.objective(self.x)
        most = float(cones.b @ norms)
        linear = float(np.sum(self.Y * self.y_target)) - most * (1 + ROUNDING)
        square = float(np.sum(pull[free] ** 2 / self.weights[free]))
        bound = 0.5 * linear**2 / square if linear > 0 < square else 0.0
        self.infeasible = bound > objective and bound > self.problem.largest_objective
        priced = objective - bound + float(norms @ np.maximum(excess, 0.0))
        self.gap = max(0.0, priced) / max(bound, self.floor)
        self.violation = float(np.max(excess))
        return max(STRICTER * self.violation, self.gap)

    def step(self) -> None:
        """Steps 3 to 6, and once the snapshot for the next frame where one is kept."""
        cones, pattern = self.cones, self.state.pattern
        data = np.zeros(len(pattern.indices))
        pattern.add_diagonal(data, self.problem.weights)
        cones.assemble(data)
        self.state.linear.factorise(data)  # 3
        total, r = cones.products(), cones.residuals()
        mu = total / cones.degree
        if self.keep and self.gap < SNAPSHOT and self.violation < SNAPSHOT:
            self._snapshot(*self._direction(cones.corrector(mu), r))
        _, affine = self._direction(cones.predictor(), r)
        ratio = cones.products(affine, affine.length) / total
        mu *= max(ratio**EXPONENT, LEAST_SIGMA)
        r = r - affine.square
        c = cones.corrector(mu, affine)  # 4
        dx, change = self._direction(c, r)
        for _ in range(CORRECTORS):  # 5
            longer = min(1.0, change.length + LONGER)
            c = cones.centrality(c, change, longer, LOW * mu, HIGH * mu)
            dx_new, new = self._direction(c, r)
            if new.length < change.length + GROWTH * (longer - change.length):
                break
            dx, change = dx_new, new
        a = min(1.0, BACK_OFF * change.length)  # 6
        self.x = self.x + a * dx
        cones.s, cones.l = cones.moved(change, a)
        cones.place(self.problem.bounds, self.x)

    def _direction(self, c: FloatArray, r: FloatArray) -> tuple[FloatArray, Change]:
        """One solve with the factor at hand: dx (n, 3), ds and dl."""
        force = self.r_d + self.cones.push(c, r)
        dx = np.zeros_like(force)
        dx[self.free] = self.state.linear.solve(-force[self.free].ravel()).reshape(-1, 3)
        return dx, self.cones.change(dx)

    def _snapshot(self, dx: FloatArray, change: Change) -> None:
        a = 0.9 * change.length
        self.state.snapshot = (self.x + a * dx, *self.cones.moved(change, a), self.target)
        self.keep = False
