"""Implicit Euler as a minimisation, by Newton's method.

One step minimises 1/2 ||x - x~||_M^2 / h^2 + W(x) with x~ = x^n + h v^n + h^2 g, from x^n.

1. gradient g; stop when ||g_free|| <= tolerance g_0 ||m||_2, with g_0 = 9.81 m/s^2
2. positive semidefinite Hessian H + M / h^2, factorised (SuperLU, symmetric mode)
3. Newton direction d
4. Armijo: halve the step until the energy falls by 1e-4 of the slope
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse.linalg import splu

from strainbench.limits import FloatArray
from strainbench.physics.cloth import Cloth

GRAVITY = np.array([0.0, -9.81, 0.0])
"""[m/s^2], y is up."""


@dataclass(frozen=True)
class NewtonSettings:
    """The stopping rule; the tolerance was found to give 4 to 13 iterations on the swing."""

    tolerance: float = 1e-6
    max_iterations: int = 100
    armijo: float = 1e-4
    max_halvings: int = 30


@dataclass(frozen=True)
class NewtonReport:
    """How a step's minimisation ended."""

    converged: bool
    iterations: int
    residual: float  # ||g_free|| / (g_0 ||m||_2), without unit


def minimise_step(
    cloth: Cloth,
    start: FloatArray,
    inertial: FloatArray,
    step: float,
    settings: NewtonSettings,
) -> tuple[FloatArray, NewtonReport]:
    """Minimise 1/2 ||x - inertial||_M^2 / step^2 + W(x) over the free vertices.

    Parameters
    ----------
    start : (n, 3) first iterate [m]; its pinned vertices stay where they are
    inertial : (n, 3) where the cloth would go without elasticity [m]
    step : [s]

    Returns
    -------
    positions : (n, 3) [m], the last iterate, converged or not
    report : NewtonReport
    """
    x = start.copy()
    free = cloth.pattern.free
    inertia = cloth.mass / step**2
    scale = float(np.linalg.norm(GRAVITY) * np.linalg.norm(cloth.mass[free]))

    def energy(x: FloatArray) -> tuple[float, FloatArray]:
        membrane, bending, gradient = cloth.energies(x)
        contact = cloth.add_contact_gradient(x, gradient)
        difference = x - inertial
        kinetic = 0.5 * float(np.sum(inertia[:, None] * difference**2))
        return kinetic + membrane + bending + contact, gradient + inertia[:, None] * difference

    value, gradient = energy(x)
    residual = float(np.linalg.norm(gradient[free])) / scale
    for iteration in range(settings.max_iterations):
        if residual <= settings.tolerance:  # 1
            return x, NewtonReport(True, iteration, residual)
        H = cloth.hessian(x, inertia)  # 2
        factor = splu(
            H, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
        )
        d = factor.solve(-gradient[free].ravel()).reshape(-1, 3)  # 3
        slope = float(np.sum(gradient[free] * d))
        length = 1.0
        for _ in range(settings.max_halvings):  # 4
            trial = x.copy()
            trial[free] += length * d
            trial_value, trial_gradient = energy(trial)
            if trial_value <= value + settings.armijo * length * slope:
                break
            length *= 0.5
        else:
            return x, NewtonReport(False, iteration, residual)
        x, value, gradient = trial, trial_value, trial_gradient
        residual = float(np.linalg.norm(gradient[free])) / scale
    return x, NewtonReport(residual <= settings.tolerance, settings.max_iterations, residual)
