"""Time stepping around the projection (Tang et al. 2022, sections 3.2 and 4).

A scheme is a function of the state, the step size, an implicit Euler solve and a projection;
an unconstrained run is the same scheme with a projection that changes nothing.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from strainbench.limits import FloatArray
from strainbench.physics.implicit_euler import GRAVITY

Minimise = Callable[[FloatArray, FloatArray, float], FloatArray]
"""(start, inertial, step) to the positions that implicit Euler's minimisation finds."""
Project = Callable[[FloatArray], FloatArray]
"""Candidate positions to limited ones."""


@dataclass(frozen=True, eq=False)
class Motion:
    """Positions (n, 3) [m] and velocities (n, 3) [m/s] at a time [s]."""

    positions: FloatArray
    velocities: FloatArray
    time: float


def step_and_project(motion: Motion, h: float, minimise: Minimise, project: Project) -> Motion:
    """Implicit Euler, then the projection; the velocity is that of the projected positions."""
    x = motion.positions
    inertial = x + h * motion.velocities + h**2 * GRAVITY
    limited = project(minimise(x, inertial, h))
    return Motion(limited, (limited - x) / h, motion.time + h)


INTEGRATORS = {"sap": step_and_project}
"""Schemes by their name in Tang et al. 2022, Fig. 4."""
