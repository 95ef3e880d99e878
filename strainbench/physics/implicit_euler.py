"""Implicit Euler as a minimisation, by Newton's method.

One step minimises phi(x) = 1/2 ||x - x~||_M^2 / h^2 + W(x) with x~ = x^n + h v^n + h^2 g, from x^n.
Gravity g is added here, and only here.

1. gradient g; stop when ||g_free|| <= tolerance g_0 ||m||_2, with g_0 = 9.81 m/s^2
2. Hessian H + M / h^2, factorised (numerically alone: `linear.py`); where that is not positive
   definite, again with each membrane element's clamped (Longva et al. 2023, Pitfalls of projection,
   project on demand). Clamping always takes 1.2 to 4 times the iterations on the swing, up to 84
3. Newton direction d, with slope g.d < 0
4. Armijo: halve the step a until phi falls by delta a |slope|. Near the minimum that fall drowns
   in the rounding of phi; where phi is the same but for rounding, the slope at the trial decides:
   slope(a) <= (2 delta - 1) slope, which is Armijo's condition for a quadratic phi (Hager and
   Zhang 2005, A new conjugate gradient method, Eq. 4.1)
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from strainbench.arrays import FloatArray
from strainbench.physics.body import Body
from strainbench.physics.linear import LinearSolver, NotPositiveDefiniteError
from strainbench.physics.stopwatch import Timed


@dataclass(frozen=True)
class NewtonSettings:
    """The stopping rule; the tolerance was found to give 3 to 10 iterations on the swing."""

    tolerance: float = 1e-6
    max_iterations: int = 100
    armijo: float = 1e-4
    max_halvings: int = 30
    rounding: float = 1e-12  # of phi, relative; tuned on the swing, 10 to 60 cells


@dataclass(frozen=True)
class NewtonReport:
    """How a step's minimisation ended, and where its time went [s]."""

    converged: bool
    iterations: int
    residual: float  # ||g_free|| / (g_0 ||m||_2), without unit
    reason: str  # why it did not converge, or ""
    assembly_seconds: float  # of Hessians
    factorisation_seconds: float  # and the solves with the factors
    line_search_seconds: float  # energies and gradients, the first iterate's too
    factorisations: int
    evaluations: int  # of energy and gradient


class _NotConvergedError(ArithmeticError):
    """Why the iteration ends here."""


class _Iterate(NamedTuple):
    """Positions x (n, 3), phi there [J], and its gradient at the free vertices (f, 3) [N]."""

    x: FloatArray
    value: float
    gradient: FloatArray


class _Minimisation(Timed):
    """phi, as a function of the free vertices, and what it has cost so far."""

    def __init__(
        self, body: Body, inertial: FloatArray, step: float, linear: LinearSolver | None
    ) -> None:
        self.body, self.linear = body, linear or body.linear_solver
        self.inertial = inertial + step**2 * body.gravity
        self.inertia = body.mass / step**2
        self.evaluations = self.factorisations = 0
        super().__init__()

    def at(self, x: FloatArray) -> _Iterate:
        """The iterate with these positions."""
        self.evaluations += 1
        values, gradient = self.body.gradient(x)
        difference = x - self.inertial
        force = self.inertia[:, None] * difference
        kinetic = 0.5 * float(np.vdot(force, difference))
        free = self.body.pattern.free
        return _Iterate(x, sum(values.values(), kinetic), (gradient + force)[free])

    def after(self, at: _Iterate, settings: NewtonSettings) -> _Iterate:
        """The next iterate."""
        if not (np.isfinite(at.value) and np.all(np.isfinite(at.gradient))):
            raise _NotConvergedError("the energy or its gradient is not finite")
        try:
            self.factorise(at, clamp=False)
        except NotPositiveDefiniteError:
            self.factorise(at, clamp=True)
        with self.timed("factorisation"):
            d = self.linear.solve(-at.gradient.ravel()).reshape(-1, 3)  # 3
        with self.timed("line_search"):
            return self.line_search(at, d, settings)

    def factorise(self, at: _Iterate, clamp: bool) -> None:
        """The Hessian at an iterate."""  # 2
        with self.timed("assembly"):
            values = self.body.hessian_values(at.x, self.inertia, clamp)
        self.factorisations += 1
        with self.timed("factorisation"):
            self.linear.factorise(values)

    def line_search(self, at: _Iterate, d: FloatArray, settings: NewtonSettings) -> _Iterate:
        """The first acceptable iterate on x + a d, a = 1, 1/2, ..."""  # 4
        slope, free, delta = np.vdot(at.gradient, d), self.body.pattern.free, settings.armijo
        for halvings in range(settings.max_halvings if slope < 0 else 0):
            a = 0.5**halvings
            x = at.x.copy()
            x[free] += a * d
            trial = self.at(x)
            fell = trial.value <= at.value + delta * a * slope
            same = trial.value <= at.value + settings.rounding * abs(at.value)
            if fell or (same and np.vdot(trial.gradient, d) <= (2 * delta - 1) * slope):
                return trial
        raise _NotConvergedError("the line search found no lower energy")


def minimise_step(
    body: Body,
    start: FloatArray,
    inertial: FloatArray,
    step: float,
    settings: NewtonSettings,
    linear_solver: LinearSolver | None = None,
) -> tuple[FloatArray, NewtonReport]:
    """Minimise 1/2 ||x - inertial||_M^2 / step^2 + W(x) + gravity over the free vertices.

    Parameters
    ----------
    start : (n, 3) first iterate [m]; its pinned vertices stay where they are
    inertial : (n, 3) where the body would go without elasticity and gravity [m]
    step : [s]
    linear_solver : for the body's pattern; the body's own by default

    Returns
    -------
    positions : (n, 3) [m], the last iterate, converged or not
    report : NewtonReport
    """
    phi = _Minimisation(body, inertial, step, linear_solver)
    with phi.timed("line_search"):
        at = phi.at(start.copy())
    iterations, reason = 0, ""
    while not (reason or np.linalg.norm(at.gradient) <= settings.tolerance * body.force_scale):  # 1
        try:
            if iterations == settings.max_iterations:
                raise _NotConvergedError(f"{iterations} iterations")
            at = phi.after(at, settings)
            iterations += 1
        except (NotPositiveDefiniteError, _NotConvergedError) as error:
            reason = str(error)
    return at.x, NewtonReport(
        converged=not reason,
        iterations=iterations,
        residual=float(np.linalg.norm(at.gradient)) / body.force_scale,
        reason=reason,
        factorisations=phi.factorisations,
        evaluations=phi.evaluations,
        **{f"{part}_seconds": seconds for part, seconds in phi.seconds.items()},
    )
