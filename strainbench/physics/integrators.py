"""Time stepping around the projection (Tang et al. 2022, sections 3.2 and 4).

A scheme is a function of the motion so far, the step size dt, a minimisation that takes a step of
implicit Euler or BDF-2, and a projection. Without limits the projection changes nothing, and SAP
is implicit Euler itself. h is the size of a sub-step: dt for projection schemes, dt/2 for
reflection schemes. x~ is where the cloth would go without forces (`minimise_step`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from strainbench.arrays import FloatArray

Minimise = Callable[[FloatArray, FloatArray, float, float], FloatArray]
"""(start, inertial, step, time) to the minimum of 1/2 ||x - inertial||_M^2 / step^2 + W(x) and
gravity, with the pins where they are at that time."""
Project = Callable[[FloatArray], FloatArray]
"""Candidate positions to limited ones."""
Scheme = Callable[["Motion", float, Minimise, Project], "Motion"]


@dataclass(frozen=True, eq=False)
class Motion:
    """Where the cloth is and how fast, now and a sub-step ago.

    Parameters
    ----------
    positions : (n, 3) [m]
    velocities : (n, 3) [m/s]
    time : [s]
    before : positions and velocities one sub-step earlier, or None at the start
    """

    positions: FloatArray
    velocities: FloatArray
    time: float
    before: tuple[FloatArray, FloatArray] | None = None


def implicit_euler(
    x: FloatArray, v: FloatArray, h: float, time: float, minimise: Minimise
) -> FloatArray:
    """Candidate at `time`, after h: x~ = x + h v."""
    return minimise(x, x + h * v, h, time)


def bdf2(
    x: FloatArray,
    v: FloatArray,
    before: tuple[FloatArray, FloatArray],
    h: float,
    time: float,
    minimise: Minimise,
) -> FloatArray:
    """Candidate at `time`, after h; x', v' are a sub-step back.

    x~ = (4 x - x')/3 + 8/9 h v - 2/9 h v', with step 2/3 h.
    """
    x0, v0 = before
    inertial = (4 * x - x0) / 3 + h * (8 * v - 2 * v0) / 9
    return minimise(x, inertial, 2 * h / 3, time)


def bdf2_velocity(x: FloatArray, x1: FloatArray, x0: FloatArray, h: float) -> FloatArray:
    """(3 x - 4 x1 + x0) / 2h, for x after x1 after x0."""
    return (3 * x - 4 * x1 + x0) / (2 * h)


def step_and_project(motion: Motion, h: float, minimise: Minimise, project: Project) -> Motion:
    """SAP (section 3.2): implicit Euler, then the projection."""
    x, v = motion.positions, motion.velocities
    time = motion.time + h
    limited = project(implicit_euler(x, v, h, time, minimise))
    return Motion(limited, (limited - x) / h, time, (x, v))


def step_and_reflect(
    motion: Motion, dt: float, minimise: Minimise, project: Project, printed: bool = True
) -> Motion:
    """SAR (Algorithm 1): project at the middle, reflect, step on, project.

    Both half steps integrate dt/2. Line 8 as printed takes v^1 from the reflected x^1/2, which
    leaves an odd-even velocity at rest; `printed=False` takes it from the projected one.
    """
    h = dt / 2
    x0, v0 = motion.positions, motion.velocities
    candidate = implicit_euler(x0, v0, h, motion.time + h, minimise)  # 2
    middle = project(candidate)  # 3
    velocity = (middle - x0) / h  # 4
    reflected = 2 * middle - candidate  # 5
    x1 = project(implicit_euler(reflected, velocity, h, motion.time + dt, minimise))  # 6, 7
    v1 = (x1 - (reflected if printed else middle)) / h  # 8
    return Motion(x1, v1, motion.time + dt, (middle, velocity))


def bdf2_and_project(motion: Motion, h: float, minimise: Minimise, project: Project) -> Motion:
    """BAP (English and Bridson 2008): BDF-2, then the projection; first step implicit Euler."""
    if motion.before is None:
        return step_and_project(motion, h, minimise, project)
    x, v = motion.positions, motion.velocities
    limited = project(bdf2(x, v, motion.before, h, motion.time + h, minimise))
    velocity = bdf2_velocity(limited, x, motion.before[0], h)
    return Motion(limited, velocity, motion.time + h, (x, v))


def bdf2_and_reflect(
    motion: Motion, dt: float, minimise: Minimise, project: Project, middle_bdf2: bool = False
) -> Motion:
    """BAR to the letter: SAR with BDF-2 in both half steps.

    The mid-step velocity is (x^1/2 - x^0)/h, or with `middle_bdf2` the BDF-2 formula, which the
    paper found to be unstable. First step SAR.
    """
    if motion.before is None:
        return step_and_reflect(motion, dt, minimise, project)
    h = dt / 2
    x0, v0, before = motion.positions, motion.velocities, motion.before
    candidate = bdf2(x0, v0, before, h, motion.time + h, minimise)
    middle = project(candidate)
    velocity = bdf2_velocity(middle, x0, before[0], h) if middle_bdf2 else (middle - x0) / h
    reflected = 2 * middle - candidate
    x1 = project(bdf2(reflected, velocity, (x0, v0), h, motion.time + dt, minimise))
    v1 = bdf2_velocity(x1, reflected, x0, h)
    return Motion(x1, v1, motion.time + dt, (middle, velocity))


def euler_bdf2_and_reflect(
    motion: Motion, dt: float, minimise: Minimise, project: Project
) -> Motion:
    """A BAR that is stable: implicit Euler to the middle, BDF-2 from there, plain velocities."""
    h = dt / 2
    x0, v0 = motion.positions, motion.velocities
    candidate = implicit_euler(x0, v0, h, motion.time + h, minimise)
    middle = project(candidate)
    velocity = (middle - x0) / h
    reflected = 2 * middle - candidate
    x1 = project(bdf2(reflected, velocity, (x0, v0), h, motion.time + dt, minimise))
    return Motion(x1, (x1 - middle) / h, motion.time + dt, (middle, velocity))


CONSTRAINED = "constrained"
INTEGRATORS: dict[str, Scheme] = {
    "sap": step_and_project,
    "sar": step_and_reflect,
    "sar-projected": partial(step_and_reflect, printed=False),
    "bap": bdf2_and_project,
    "bar": bdf2_and_reflect,
    "bar-bdf2": partial(bdf2_and_reflect, middle_bdf2=True),
    "bar-stable": euler_bdf2_and_reflect,
    CONSTRAINED: step_and_project,
}
"""Schemes by their names in Tang et al. 2022, Fig. 4, and our variants of them.

`CONSTRAINED` is a reference: its minimisation keeps within the limits itself
(`strainbench.physics.constrained`), and its projection, which is to leave its answers as they are,
only shows them."""
