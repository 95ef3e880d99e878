"""Implicit Euler as a minimisation, by Newton's method.

One step minimises phi(x) = 1/2 ||x - x~||_M^2 / h^2 + W(x) with x~ = x^n + h v^n + h^2 g, from x^n.

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
from time import perf_counter

import numpy as np

from strainbench.arrays import FloatArray
from strainbench.physics.cloth import Cloth
from strainbench.physics.linear import LinearSolver, NotPositiveDefiniteError

GRAVITY = np.array([0.0, -9.81, 0.0])
"""[m/s^2], y is up."""


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


class _Clock:
    """Adds up the time between readings under names."""

    def __init__(self) -> None:
        self.last = perf_counter()
        self.spent = {"assembly": 0.0, "factorisation": 0.0, "line_search": 0.0}

    def skip(self) -> None:
        self.last = perf_counter()

    def count(self, name: str) -> None:
        now = perf_counter()
        self.spent[name] += now - self.last
        self.last = now


class _Function:
    """phi, as a function of the free vertices."""

    def __init__(self, cloth: Cloth, inertial: FloatArray, step: float) -> None:
        self.cloth, self.inertial = cloth, inertial
        self.inertia = cloth.mass / step**2
        self.evaluations = 0

    def __call__(self, x: FloatArray) -> tuple[float, FloatArray]:
        """phi [J] and its gradient at the free vertices (f, 3) [N]."""
        self.evaluations += 1
        membrane, bending, gradient = self.cloth.energies(x)
        contact = self.cloth.add_contact_gradient(x, gradient)
        difference = x - self.inertial
        force = self.inertia[:, None] * difference
        kinetic = 0.5 * float(np.vdot(force, difference))
        return kinetic + membrane + bending + contact, (gradient + force)[self.cloth.pattern.free]


def minimise_step(
    cloth: Cloth,
    start: FloatArray,
    inertial: FloatArray,
    step: float,
    settings: NewtonSettings,
    linear_solver: LinearSolver | None = None,
) -> tuple[FloatArray, NewtonReport]:
    """Minimise 1/2 ||x - inertial||_M^2 / step^2 + W(x) over the free vertices.

    Parameters
    ----------
    start : (n, 3) first iterate [m]; its pinned vertices stay where they are
    inertial : (n, 3) where the cloth would go without elasticity [m]
    step : [s]
    linear_solver : for the cloth's pattern; the cloth's own by default

    Returns
    -------
    positions : (n, 3) [m], the last iterate, converged or not
    report : NewtonReport
    """
    linear = linear_solver or cloth.linear_solver
    free = cloth.pattern.free
    scale = float(np.linalg.norm(GRAVITY) * np.linalg.norm(cloth.mass[free]))
    phi = _Function(cloth, inertial, step)
    clock = _Clock()
    factorisations = 0
    x = start.copy()
    value, gradient = phi(x)
    clock.count("line_search")

    def report(iterations: int, reason: str = "") -> NewtonReport:
        residual = float(np.linalg.norm(gradient)) / scale
        spent = {f"{name}_seconds": seconds for name, seconds in clock.spent.items()}
        return NewtonReport(
            converged=not reason,
            iterations=iterations,
            residual=residual,
            reason=reason,
            factorisations=factorisations,
            evaluations=phi.evaluations,
            **spent,
        )

    for iteration in range(settings.max_iterations + 1):
        if np.linalg.norm(gradient) <= settings.tolerance * scale:  # 1
            return x, report(iteration)
        if not (np.isfinite(value) and np.all(np.isfinite(gradient))):
            return x, report(iteration, "the energy or its gradient is not finite")
        if iteration == settings.max_iterations:
            break
        clock.skip()
        for clamp in (False, True):  # 2
            values = cloth.hessian_values(x, phi.inertia, clamp)
            clock.count("assembly")
            factorisations += 1
            try:
                linear.factorise(values)
                break
            except NotPositiveDefiniteError as error:
                reason = str(error)
            finally:
                clock.count("factorisation")
        else:
            return x, report(iteration, reason)
        d = linear.solve(-gradient.ravel()).reshape(-1, 3)  # 3
        clock.count("factorisation")
        found = _line_search(phi, x, value, gradient, d, settings)  # 4
        clock.count("line_search")
        if found is None:
            return x, report(iteration, "the line search found no lower energy")
        x, value, gradient = found
    return x, report(iteration, f"{settings.max_iterations} iterations")


def _line_search(
    phi: _Function,
    x: FloatArray,
    value: float,
    gradient: FloatArray,
    d: FloatArray,
    settings: NewtonSettings,
) -> tuple[FloatArray, float, FloatArray] | None:
    """The first acceptable trial on x + a d, a = 1, 1/2, ...: positions, phi, gradient."""
    slope = float(np.vdot(gradient, d))
    if not slope < 0:
        return None
    free, delta = phi.cloth.pattern.free, settings.armijo
    a = 1.0
    for _ in range(settings.max_halvings):
        trial = x.copy()
        trial[free] += a * d
        trial_value, trial_gradient = phi(trial)
        fell = trial_value <= value + delta * a * slope
        same = trial_value <= value + settings.rounding * abs(value)
        if fell or (same and float(np.vdot(trial_gradient, d)) <= (2 * delta - 1) * slope):
            return trial, trial_value, trial_gradient
        a *= 0.5
    return None
