"""One projection on its way: steps 1 to 6 of `solvers.newton_ipm`."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from solvers.newton_ipm.drawn import Drawn
from solvers.newton_ipm.exact import ExactCones
from solvers.newton_ipm.matrix import Matrix
from solvers.newton_ipm.mesh import Change, put, residual, take
from solvers.newton_ipm.sampled import SampledCones
from strainbench import Problem, section
from strainbench.arrays import FloatArray
from strainbench.physics.linear import best_linear_solver
from strainbench.problem.kinds import Exact, Kind, Sampled

FLOOR = 3e-3  # least first slack, in b^2
FIRST_MU = 50.0  # times the guess of the optimum's objective
EXPONENT = 6  # of sigma
LEAST_SIGMA = 1e-4
AIM = 0.1  # part of the tolerance
CORRECTORS = 2
LONGER, GROWTH = 0.3, 0.1  # a corrector aims at this longer a step, and must bring this part of it
LOW, HIGH = 0.1, 5.0  # products aimed at by correctors, in sigma mu
BACK_OFF = 0.99
SNAPSHOT = 0.1  # relative gap
STRICTER = 10.0  # limits must hold so much better than the gap: they do, but for the last steps
DEARER = 100.0  # multipliers, than those at hand, where they have no bound
DRIFT = 0.5  # part of the snapshot's last change that a warm start expects again
LARGE = 1e3  # multipliers, of the objective: there may be others that are larger still
CONES: dict[type[Kind], type[SampledCones | ExactCones]] = {
    Sampled: SampledCones,
    Exact: ExactCones,
}
ROUNDING = 32 * np.finfo(float).eps  # of a sum of products, as the referee counts it


class Snapshot(NamedTuple):
    """A frame's centred iterate, its target, and how x - target changed since the frame before."""

    x: FloatArray
    s: FloatArray
    l: FloatArray  # noqa: E741
    target: FloatArray
    drift: FloatArray


class State:
    """What a mesh needs once, and the last frame's centred iterate."""

    def __init__(self, problem: Problem) -> None:
        self.matrix = Matrix(problem)
        self.linear = best_linear_solver(self.matrix.lower)
        self.cones = CONES[type(problem.kind)](problem, self.matrix.slots)
        self.drawn = Drawn(problem)
        self.snapshot: Snapshot | None = None
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

    def __init__(self, problem: Problem, state: State, keep: bool, tolerance: float) -> None:
        self.tolerance = tolerance
        self.problem, self.state, self.cones = problem, state, state.cones
        self.keep = keep
        self.target = problem.target
        self.free, self.floor = problem.free, problem.objective_floor
        self.infeasible = False
        self.x = problem.target
        self.cones.place(problem.bounds, self.x)
        self.y_target = self.cones.at.y.copy()

    def begin(self) -> bool:
        """Resume where a snapshot is kept and there is one, else start; which of them it was."""
        resumed = self.keep and self.state.snapshot is not None
        if resumed:
            self.resume()
        else:
            self.start()
        return resumed

    def start(self) -> None:
        """From the target or nearer, with products of a guess: violation over the mesh's size."""
        problem = self.problem
        self.cones.place(problem.bounds, self.target)
        self.x = self.state.drawn.start(self.target, float(self.cones.excess().max()))
        self.cones.place(problem.bounds, self.x)
        size = problem.edge_length * np.sqrt(len(problem.used))
        far = size * np.sqrt(np.mean(np.maximum(self.cones.excess(), 0.0) ** 2))
        guess = 0.5 * far**2 * float(np.sum(problem.weights[self.free]))
        guess += problem.objective(self.x)
        self.cones.start(FLOOR, FIRST_MU * guess / self.cones.degree)

    def resume(self) -> None:
        """From the snapshot, moved as the target has moved, and on as it moved from the target."""
        assert self.state.snapshot is not None
        x, s, l, target, drift = self.state.snapshot  # noqa: E741
        self.x = x + (self.target - target) + DRIFT * drift
        self.x[self.problem.held] = self.target[self.problem.held]
        self.cones.place(self.problem.bounds, self.x)
        self.cones.resume(s, l)

    def measure(self) -> float:
        """The larger of relative gap at x, the violations priced in, and STRICTER violations."""
        self.Y, pull, self.r_d = np.empty((self.problem.rows, 3)), *np.zeros((2, *self.x.shape))
        most, linear, price, beyond, worst = self.cones.measure(self.y_target, self.Y, pull)
        pull[self.problem.held] = 0.0
        objective, square = residual(self.problem.weights, self.x, self.target, pull, self.r_d)
        self.objective = objective
        linear -= most * (1 + ROUNDING)
        bound = 0.5 * linear**2 / square if linear > 0 < square else 0.0
        self.infeasible = bound > objective and bound > self.problem.largest_objective
        scale = max(bound, self.floor)
        self.priced = objective - bound + price
        self.gap, self.violation = max(0.0, self.priced) / scale, worst
        error = max(STRICTER * worst, self.gap)
        return error if most < LARGE * scale else max(error, DEARER * beyond / scale)

    def step(self) -> None:
        """Steps 3 to 6, and once the snapshot for the next frame where one is kept."""
        cones = self.cones
        with section("assemble"):
            values = self.state.matrix.mass()
            total = cones.assemble(values)
        with section("factorise"):
            self.state.linear.factorise(values)  # 3
        mean = total / cones.degree
        if self.keep and self.gap < SNAPSHOT and self.violation < SNAPSHOT:
            cones.aim(mean)
            self._snapshot(*self._direction())
        cones.aim(0.0)
        _, affine = self._direction()
        mu = self._next_mu(total, affine)
        cones.aim(mu, affine)  # 4
        dx, change = self._direction()
        for _ in range(CORRECTORS):  # 5
            longer = min(1.0, change.length + LONGER)
            cones.centre(change, longer, LOW * mu, HIGH * mu)
            dx_new, new = self._direction()
            if new.length < change.length + GROWTH * (longer - change.length):
                break
            dx, change = dx_new, new
        a = min(1.0, BACK_OFF * change.length)  # 6
        self.x = self.x + a * dx
        cones.put(*cones.moved(change, a))
        cones.place(self.problem.bounds, self.x)

    def _next_mu(self, total: float, affine: Change) -> float:
        """The mean product to aim at, where <s, l> is `total` and the predictor would go so far."""
        a, degree = affine.length, self.cones.degree
        ratio = 1 + (a * affine.first + a * a * affine.second) / total
        enough = AIM * self.tolerance * max(self.objective, self.floor)
        least = min(total, max(enough, LEAST_SIGMA * self.priced)) / degree
        return max(total / degree * max(ratio**EXPONENT, LEAST_SIGMA), least)

    def _direction(self) -> tuple[FloatArray, Change]:
        """One solve with the factor at hand: dx (n, 3), ds and dl."""
        with section("cones"):
            force, dx, b = self.r_d.copy(), np.zeros_like(self.r_d), np.empty(3 * len(self.free))
            self.cones.push(force)
            take(force, self.free, b)
        with section("back-substitute"):
            found = self.state.linear.solve(b)
        with section("cones"):
            put(found, self.free, dx)
            return dx, self.cones.change(dx)

    def _snapshot(self, dx: FloatArray, change: Change) -> None:
        a, last = 0.9 * change.length, self.state.snapshot
        x = self.x + a * dx
        drift = np.zeros_like(x) if last is None else (x - self.target) - (last.x - last.target)
        self.state.snapshot = Snapshot(x, *self.cones.moved(change, a), self.target, drift)
        self.keep = False
