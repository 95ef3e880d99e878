"""A square sheet at rest, hung by two corners (Tang et al. 2022, Fig. 2)."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
import scipy

from strainbench.arrays import FloatArray, IntArray
from strainbench.physics.body import gravity_of
from strainbench.physics.cloth import Cloth, Material
from strainbench.physics.equilibrium import BarrierSettings, equilibrium
from strainbench.physics.statics import Equilibrium, StaticsSettings, constrained_minimum
from strainbench.problem.grid import square_grid
from strainbench.problem.limits import StretchLimits
from strainbench.problem.problem import Problem
from strainbench.scenario.scenario import Scenario, StepReport

SIDE = 0.5  # [m]
SAMPLES = {"isotropic": 4, "orthotropic": 8, "anisotropic": 18}
"""Sampled directions of each curve; Fig. 2 shows its samples, the text 4 to 18."""


@dataclass(frozen=True)
class Drape(Scenario):
    """A square sheet at rest, hung by two corners (Tang et al. 2022, Fig. 2).

    The minimum of membrane, bending and gravity energy within the limits. One is found without
    any projection (`strainbench.physics.equilibrium`), certified by its own optimality conditions
    to 1e-8 of the weight. From it, or from the folds, the steps go on with one projection each, in
    the norm of the masses (`strainbench.physics.statics`, which says why repeated step-and-project
    will not do): a true projection keeps the drape where it is, and what another one makes of it
    is in `equilibrium_residual` and `equilibrium_distance`. A step is an iteration, not a time.

    The sheet starts in vertical folds of its own length. Other folds lead to other minima, with
    energies that differ in the fourth digit: from the folds, the steps may find another one.

    The curves of limits over the angle a from the pinned edge are ours, as the paper prints them
    only as a plot; `limit` is the strain of the tightest direction, 1% in the figure:

    - isotropic: 1 + limit
    - orthotropic: 1 / sqrt((cos a / (1 + limit))^2 + (sin a / 1.30)^2)
    - anisotropic: 1 + limit + .25 sin^2(a - 30deg) + .10 sin^2 2(a - 10deg)

    Parameters
    ----------
    directions : sampled directions; if not given, 4, 8 or 18, as the curve needs.
    shape : "isotropic", "orthotropic" or "anisotropic".
    gather : how much closer the pins are than at rest; 0.2 is a fifth.
    folds : of the sheet at the start.
    start : of the steps: "drape", for which limits must be sampled, or "folds".
    diagonals : "alternating" or "uniform".
    """

    name = "drape"
    needs = frozenset({"gravity", "membrane", "bending"})

    directions: int | str = None  # type: ignore[assignment] # resolved below
    shape: str = "isotropic"
    gather: float = 0.2
    folds: int = 2
    start: str = "drape"
    diagonals: str = "alternating"

    def __post_init__(self) -> None:
        if self.shape not in SAMPLES:
            raise ValueError(f"shape is {self.shape!r}: valid are {', '.join(SAMPLES)}")
        if self.directions is None:
            object.__setattr__(self, "directions", SAMPLES[self.shape])
        super().__post_init__()
        if self.shape != "isotropic":
            self.sampled_angles()
        if not 0 <= self.gather <= 0.5:
            raise ValueError(f"gather is {self.gather}: a number from 0 to 0.5 is valid")
        if self.folds < 1:
            raise ValueError(f"folds is {self.folds}: a whole number above 0 is valid")
        if self.start not in ("drape", "folds"):
            raise ValueError(f"start is {self.start!r}: valid are drape, folds")
        if self.start == "drape" and self.directions == "exact":
            raise ValueError("start is 'drape': with exact directions only folds is valid")
        if self.diagonals not in ("alternating", "uniform"):
            raise ValueError(f"diagonals is {self.diagonals!r}: valid are alternating, uniform")

    def bound(self, angles: FloatArray) -> FloatArray:
        """The curve b(a) at material angles a [rad] from the pinned edge."""
        tight = 1 + self.limit
        if self.shape == "isotropic":
            return np.full_like(angles, tight)
        if self.shape == "orthotropic":
            curve: FloatArray = np.hypot(np.cos(angles) / tight, np.sin(angles) / 1.30) ** -1
            return curve
        first: FloatArray = 0.25 * np.sin(angles - np.deg2rad(30)) ** 2
        second: FloatArray = 0.10 * np.sin(2 * (angles - np.deg2rad(10))) ** 2
        return tight + first + second

    def curve(self) -> tuple[FloatArray, FloatArray]:
        """Angles (a,) [rad] in [-pi/2, pi/2) and the bounds there: the curve, for polar plots."""
        angles = np.linspace(-np.pi / 2, np.pi / 2, 180, endpoint=False)
        return angles, self.bound(angles)

    def limits(self) -> StretchLimits:
        """The curve at equally spaced angles in [-pi/2, pi/2)."""
        if self.shape == "isotropic":
            return super().limits()
        angles = self.sampled_angles()
        return StretchLimits.sampled(angles, self.bound(angles))

    def sheet(self) -> tuple[FloatArray, IntArray, FloatArray, IntArray]:
        """Rest positions (n, 2), triangles (e, 3), initial positions (n, 3), pins (p,)."""
        rest, elements = square_grid(self.resolution, SIDE, self.diagonals)
        x, z = pleat(rest[:, 0] / SIDE, self.gather, self.folds)
        positions = np.column_stack([SIDE * x, -rest[:, 1], SIDE * z])
        pinned = np.array([0, self.resolution * (self.resolution + 1)])
        return rest, elements, positions, pinned

    def cloth(self) -> Cloth:
        """The sheet's masses and energies."""
        rest, elements, _, pinned = self.sheet()
        material, gravity = Material().only(self.needs), gravity_of(self.needs)
        return Cloth(rest, elements, material, pinned, gravity=gravity)

    def problem(self) -> Problem:
        """The projection in the norm of the masses."""
        rest, elements, positions, pinned = self.sheet()
        return Problem(rest, elements, positions, self.limits(), pinned, self.cloth().mass)

    def certified(self) -> Equilibrium | None:
        """A drape, found without any projection; None with exact limits.

        Raises
        ------
        ArithmeticError
            If none was found to the tolerance.
        """
        if self.directions == "exact":
            return None
        found, reason = equilibrium(self.cloth(), self.problem(), BarrierSettings())
        if reason:
            raise ArithmeticError(f"no certified drape: {reason}")
        return found

    def equilibria(
        self, project: Callable[[FloatArray], FloatArray], drape: Equilibrium | None = None
    ) -> Iterator[Equilibrium]:
        """Ever better approximations of a drape, from `drape` or from the folds."""
        start = self.sheet()[2] if drape is None else drape.positions
        forces = None if drape is None else drape.limit_forces
        return constrained_minimum(self.cloth(), start, project, StaticsSettings(), forces)

    def play(self, project: Callable[[FloatArray], FloatArray]) -> Iterator[StepReport]:
        """Iterations at the drape, or towards one; see the base class."""
        drape = self.certified()
        for state in self.equilibria(project, drape if self.start == "drape" else None):
            apart = state.positions - drape.positions if drape else np.array([[np.nan]])
            yield StepReport(
                time=float("nan"),
                newton_iterations=1,
                kinetic_energy=0.0,
                gravity_energy=state.energies["gravity"],
                membrane_energy=state.energies["membrane"],
                bending_energy=state.energies["bending"],
                equilibrium_residual=state.residual,
                equilibrium_distance=float(np.linalg.norm(apart, axis=1).max()),
            )

    def warm_up(self) -> None:
        """With one fold in 3 cells, which is not flat (see `strainbench.physics.equilibrium`)."""
        next(replace(self, resolution=3, folds=1).play(lambda target: target))


def pleat(s: FloatArray, gather: float, folds: int) -> tuple[FloatArray, FloatArray]:
    """A curve of unit length in folds: its points (x, z) at arc lengths s (n,) in [0, 1].

    Its angle is A sin(2 pi folds s), so that its ends are J0(A) = 1 - gather apart, on z = 0,
    and x = 0 in the middle.
    """
    A = (
        0.0
        if gather == 0
        else float(scipy.optimize.brentq(lambda a: scipy.special.j0(a) - (1 - gather), 0, 2.4))
    )
    t = np.linspace(0, 1, 400 * folds + 1)
    angle = A * np.sin(2 * np.pi * folds * t)
    x = scipy.integrate.cumulative_simpson(np.cos(angle), x=t, initial=0)
    z = scipy.integrate.cumulative_simpson(np.sin(angle), x=t, initial=0)
    return np.interp(s, t, x - x[-1] / 2), np.interp(s, t, z)
