"""An elastic body: lumped masses, a list of energies, pins, and the gravity that acts on it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Collection
from functools import cached_property

import numpy as np

from strainbench.arrays import FloatArray, IntArray
from strainbench.physics.energies.energy import Energy
from strainbench.physics.linear import LinearSolver, best_linear_solver
from strainbench.physics.pattern import Pattern

GRAVITY = np.array([0.0, -9.81, 0.0])
"""[m/s^2], y is up."""


def gravity_of(parts: Collection[str]) -> FloatArray:
    """(3,) [m/s^2]: `GRAVITY` if "gravity" is among `parts`, else none."""
    return GRAVITY if "gravity" in parts else np.zeros(3)


class Body(ABC):
    """What time steps and equilibria ask of a cloth, or of any other body.

    Attributes
    ----------
    pinned : (p,) vertices that are not unknowns of a step
    gravity : (3,) [m/s^2]
    """

    pinned: IntArray
    gravity: FloatArray

    @property
    @abstractmethod
    def mass(self) -> FloatArray:
        """(n,) [kg], lumped at the vertices."""

    @property
    @abstractmethod
    def energies(self) -> tuple[Energy, ...]:
        """Their sum is the elastic energy W."""

    def gradient(self, x: FloatArray) -> tuple[dict[str, float], FloatArray]:
        """Each energy's value by its name [J], and the gradient (n, 3) of W [N]."""
        values: dict[str, float] = {}
        out = np.zeros_like(x)
        for energy in self.energies:
            values[energy.name] = values.get(energy.name, 0.0) + energy.add_gradient(x, out)
        return values, out

    def potential(self, x: FloatArray) -> tuple[dict[str, float], FloatArray]:
        """The same with "gravity", whose heights count from y = 0."""
        values, gradient = self.gradient(x)
        weight = self.mass[:, None] * self.gravity
        return {**values, "gravity": -float(np.sum(weight * x))}, gradient - weight

    @cached_property
    def force_scale(self) -> float:
        """g_0 ||m||_2 of the free vertices [N], g_0 = 9.81 m/s^2: residuals are relative to it."""
        return float(np.linalg.norm(GRAVITY) * np.linalg.norm(self.mass[self.pattern.free]))

    @cached_property
    def pattern(self) -> Pattern:
        """Sparsity of the Hessian on the free vertices, found once."""
        return Pattern.of([e.elements for e in self.energies], len(self.mass), self.pinned)

    @cached_property
    def linear_solver(self) -> LinearSolver:
        """For systems in the Hessian; analysed once."""
        return best_linear_solver(self.pattern.matrix())

    def hessian_values(self, x: FloatArray, diagonal: FloatArray, clamp: bool = True) -> FloatArray:
        """Hessian, clamped or not, plus a (n,) `diagonal` [N/m], as values of the pattern."""
        pattern = self.pattern
        data = np.zeros(len(pattern.indices))
        pattern.add_diagonal(data, diagonal)
        for energy, blocks in zip(self.energies, pattern.blocks(data), strict=True):
            energy.add_hessian(x, blocks, clamp)
        return data
