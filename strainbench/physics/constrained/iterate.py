"""The interior-point iteration on a step within limits: steps 1 to 5 of the package's docstring."""

# ruff: noqa: E741 - l are multipliers
from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from strainbench.arrays import FloatArray
from strainbench.physics.body import GRAVITY, Body
from strainbench.physics.equilibrium import add_limits_hessian
from strainbench.physics.linear import LinearSolver, NotPositiveDefiniteError
from strainbench.physics.stopwatch import Timed
from strainbench.problem.problem import Problem


@dataclass(frozen=True)
class LimitSettings:
    """The stopping rule, and the constants of the iteration, which are newton-ipm's."""

    tolerance: float = 1e-6
    max_iterations: int = 100
    first_mu: float = 0.3  # 0.1 to 1, of the inertia's energy at the start, over all rows
    floor: float = 3e-3  # least first slack, in b^2
    exponent: int = 6  # of sigma
    least_sigma: float = 1e-4
    aim: float = 0.1  # part of the tolerance
    correctors: int = 2
    longer: float = 0.3  # how much longer a step a corrector aims at,
    growth: float = 0.1  # and which part of it it must bring
    low: float = 0.1  # products aimed at by correctors, in mu
    high: float = 5.0
    back_off: float = 0.99
    max_halvings: int = 12
    many_halvings: int = 2  # this often in each of two iterations: the Hessian is clamped
    damping: float = 0.25  # c, the first time


class UnsolvedError(ArithmeticError):
    """Why the iteration ends here."""


class Point(NamedTuple):
    """Where the iteration is.

    x : (n, 3) [m]; slacks s, multipliers l [J], q and r = q - s : (rows,); y : (rows, 3)
    r_d : (f, 3) [N], the gradient of the Lagrangian at the free vertices
    """

    x: FloatArray
    s: FloatArray
    l: FloatArray
    y: FloatArray
    q: FloatArray
    r: FloatArray
    r_d: FloatArray


class Change(NamedTuple):
    """A direction: of positions, slacks and multipliers; `length` [0, 1] keeps these positive."""

    x: FloatArray
    s: FloatArray
    l: FloatArray
    square: FloatArray  # |dy|^2 / 2, by which slacks fall short of their linearisation
    length: float


class Iteration(Timed):
    """phi within limits, as a function of the free vertices, and what it has cost so far.

    Attributes
    ----------
    work : m (g_0 h)^2 / 2 of the free vertices [J], the scale of complementarity
    iterations, factorisations, evaluations, seconds : so far
    """

    def __init__(
        self,
        body: Body,
        problem: Problem,
        inertial: FloatArray,
        step: float,
        settings: LimitSettings,
        linear: LinearSolver,
    ) -> None:
        self.body, self.problem, self.settings, self.linear = body, problem, settings, linear
        self.step = step
        self.inertial = inertial + step**2 * body.gravity
        self.inertia = body.mass / step**2
        self.free = body.pattern.free
        speed = float(np.linalg.norm(GRAVITY)) * step
        self.work = 0.5 * float(body.mass[self.free].sum()) * speed**2
        self.damping, self.rough = 0.0, 0  # c, and iterations in a row with many halvings
        self.iterations = self.factorisations = self.evaluations = 0
        super().__init__()

    def run(self, x: FloatArray) -> Point:
        """From x (n, 3) to a point that is solved.

        Raises
        ------
        UnsolvedError, NotPositiveDefiniteError
            Why there is none.
        """
        at, count = self.begin(x), 0
        while not self.solved(at):
            if count == self.settings.max_iterations:
                raise UnsolvedError(f"{count} iterations")
            if not np.all(np.isfinite(at.r_d)):
                raise UnsolvedError("the energy's gradient is not finite")
            at = self.after(at)
            count += 1
            self.iterations += 1
        return at

    def begin(self, x: FloatArray) -> Point:
        """The first point: slacks as they are, or the floor; products of equal size."""
        b2, y = self.problem.bounds**2, self.problem.G @ x
        s = np.maximum(0.5 * (b2 - np.sum(y**2, axis=1)), self.settings.floor * b2)
        moved = (x - self.inertial)[self.free]
        energy = 0.5 * float(np.sum(self.inertia[self.free, None] * moved**2))
        mu = max(self.settings.first_mu * energy, self._least) / len(s)
        return self.at(x, s, mu / s)

    @property
    def _least(self) -> float:
        """The sum of products that is aimed at in the end [J]."""
        return self.settings.aim * self.settings.tolerance * self.work

    def at(self, x: FloatArray, s: FloatArray, l: FloatArray) -> Point:
        """The point with these."""
        self.evaluations += 1
        y = self.problem.G @ x
        q = 0.5 * (self.problem.bounds**2 - np.sum(y**2, axis=1))
        _, gradient = self.body.gradient(x)
        force = gradient + self.inertia[:, None] * (x - self.inertial)
        return Point(x, s, l, y, q, q - s, (force + self.pull(l, y))[self.free])

    def pull(self, l: FloatArray, y: FloatArray) -> FloatArray:
        """G^T (l y), (n, 3) [N]."""
        forces: FloatArray = self.problem.G.T @ (l[:, None] * y)
        return forces

    def residual(self, at: Point) -> float:
        """||r_d|| / (g_0 ||m||_2)."""
        return float(np.linalg.norm(at.r_d)) / self.body.force_scale

    def solved(self, at: Point) -> bool:
        """Whether stationarity, complementarity and slacks are within the tolerance."""
        tolerance = self.settings.tolerance
        return bool(
            self.residual(at) <= tolerance
            and float(at.s @ at.l) <= tolerance * self.work
            and np.max(np.abs(at.r), initial=0.0) <= 0.01 * tolerance
        )

    def after(self, at: Point) -> Point:
        """The next point."""
        self.factorise(at)
        with self.timed("factorisation"):
            change = self.direction(at)
        with self.timed("line_search"):
            return self.advance(at, change)

    def factorise(self, at: Point) -> None:
        """K at a point; with W's Hessian clamped where there is no factor, or steps were halved."""
        for clamp in (False, True) if self.damping == 0 else (True,):
            with self.timed("assembly"):
                inertia = (1 + self.damping) * self.inertia
                values = self.body.hessian_values(at.x, inertia, clamp)
                triangles = self.body.pattern.blocks(values)[0]
                G = self.problem.row_coefficients
                add_limits_hessian(G, at.y, at.l, at.l / at.s, triangles)
            self.factorisations += 1
            try:
                with self.timed("factorisation"):
                    return self.linear.factorise(values)
            except NotPositiveDefiniteError:
                if clamp:
                    raise
        return None

    def direction(self, at: Point) -> Change:
        """Mehrotra's predictor and corrector, then Gondzio's correctors.

        With products where they are to end a predictor to 0 would mislead: Newton's step alone.
        """
        settings, products = self.settings, at.s * at.l
        total = float(products.sum())
        if total < 2 * self._least:
            return self.towards(at, self._least / len(products) - products)
        affine = self.towards(at, -products)
        a = affine.length
        ratio = float((at.s + a * affine.s) @ (at.l + a * affine.l)) / total
        sigma = max(ratio**settings.exponent, settings.least_sigma)
        mu = max(sigma * total, min(total, self._least)) / len(products)
        at = at._replace(r=at.r - affine.square)
        c = mu - products - affine.s * affine.l
        change = self.towards(at, c)
        for _ in range(settings.correctors):
            a = min(1.0, change.length + settings.longer)
            after = (at.s + a * change.s) * (at.l + a * change.l)
            inside = np.clip(after, settings.low * mu, settings.high * mu)
            c = c + np.maximum(inside - after, -settings.high * mu)
            new = self.towards(at, c)
            if new.length < change.length + settings.growth * (a - change.length):
                break
            change = new
        return change

    def towards(self, at: Point, c: FloatArray) -> Change:
        """The Newton step that changes the products s l by c."""
        h = (c - at.l * at.r) / at.s
        force = at.r_d + self.pull(h, at.y)[self.free]
        dx = np.zeros_like(at.x)
        dx[self.free] = self.linear.solve(-force.ravel()).reshape(-1, 3)
        dy = self.problem.G @ dx
        along = np.sum(at.y * dy, axis=1)
        ds, dl = at.r - along, h + at.l / at.s * along
        shrinks = float(np.min([np.min(ds / at.s), np.min(dl / at.l)]))
        length = min(1.0, -1 / shrinks) if shrinks < 0 else 1.0
        return Change(dx, ds, dl, 0.5 * np.sum(dy**2, axis=1), length)

    def advance(self, at: Point, change: Change) -> Point:
        """Along a direction; and whether to damp from now on."""
        settings = self.settings
        found, halvings = self.line_search(at, change)
        self.rough = self.rough + 1 if halvings >= settings.many_halvings else 0
        if self.rough == 2:
            self.damping, self.rough = max(4 * self.damping, settings.damping), 0
        return found

    def line_search(self, at: Point, change: Change) -> tuple[Point, int]:
        """The first point of ever half the way whose gradient is no larger; how often halved."""
        longest = min(1.0, self.settings.back_off * change.length)
        enough = max(self.residual(at), self.settings.tolerance)
        for halvings in range(self.settings.max_halvings + 1):
            a = 0.5**halvings * longest
            trial = self.at(at.x + a * change.x, at.s + a * change.s, at.l + a * change.l)
            if self.residual(trial) <= enough:
                return trial, halvings
        raise UnsolvedError("no step along the direction makes the residual smaller")
