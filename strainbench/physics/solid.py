"""An elastic body of tetrahedra, and its step of backward Euler with linearised forces.

The step of Hernandez et al. 2013, section 4: with the forces f of the corotational tetrahedra
(`energies.corotational`), their stiffness K with rotations held, and Rayleigh damping alpha M +
beta K, the unconstrained velocities solve

    A v = M v_0 + h (f(x_0) + M g),  A = (1 + alpha h) M + (h^2 + beta h) K,

K at x_0, and A is the metric of the constrained step that follows. `minimise_step` takes the same
body with all of its nonlinearity, undamped.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import scipy

from strainbench import sparse as sp
from strainbench.arrays import FloatArray, IntArray
from strainbench.physics.body import GRAVITY, Body
from strainbench.physics.energies.contact import Contact
from strainbench.physics.energies.corotational import Corotational
from strainbench.physics.energies.energy import Energy
from strainbench.problem.elements import shape_gradients


@dataclass(frozen=True)
class SolidMaterial:
    """Constants of an elastic solid; `alpha` [1/s] and `beta` [s] are those of Rayleigh damping."""

    young: float  # [Pa]
    poisson: float = 0.3
    density: float = 1000.0  # [kg/m^3]
    alpha: float = 0.0
    beta: float = 0.0

    def __post_init__(self) -> None:
        for name, valid in (("young", "above 0"), ("density", "above 0")):
            if not 0 < getattr(self, name) < np.inf:
                raise ValueError(f"{name} is {getattr(self, name)}: a number {valid} is valid")
        if not -1 < self.poisson < 0.5:
            raise ValueError(f"poisson is {self.poisson}: a number above -1 and below 0.5 is valid")
        for name in ("alpha", "beta"):
            if not 0 <= getattr(self, name) < np.inf:
                raise ValueError(f"{name} is {getattr(self, name)}: a number from 0 on is valid")

    @property
    def lame(self) -> tuple[float, float]:
        """Lame constants (lam, mu) [Pa]."""
        shear = self.young / (2 * (1 + self.poisson))
        return 2 * shear * self.poisson / (1 - 2 * self.poisson), shear


@dataclass(frozen=True, eq=False)
class Solid(Body):
    """Corotational tetrahedra, contact and more.

    Parameters
    ----------
    rest : (n, 3) [m]
    elements : (e, 4)
    material : SolidMaterial
    pinned : (p,) vertices that are not unknowns of a step
    contact : what the vertices are kept off, or None
    gravity : (3,) [m/s^2]
    more : further energies
    """

    rest: FloatArray
    elements: IntArray
    material: SolidMaterial
    pinned: IntArray
    contact: Contact | None = None
    gravity: FloatArray = field(default_factory=lambda: GRAVITY)
    more: Collection[Energy] = ()

    @cached_property
    def elastic(self) -> Corotational:
        """The tetrahedra's energy."""
        shape = shape_gradients(self.rest, self.elements)
        return Corotational(self.elements, *shape, self.material.lame)

    @cached_property
    def mass(self) -> FloatArray:
        """(n,) [kg]: a quarter of each tetrahedron's mass at each of its vertices."""
        mass = np.zeros(len(self.rest))
        quarter = 0.25 * self.material.density * self.elastic.volumes
        np.add.at(mass, self.elements, quarter[:, None])
        return mass

    @cached_property
    def energies(self) -> tuple[Energy, ...]:
        """The tetrahedra's, contact if there is any, and what was given."""
        contact = (self.contact.penalty(self.mass),) if self.contact else ()
        return (self.elastic, *contact, *self.more)

    def metric(self, x: FloatArray, h: float) -> sp.csc_array:
        """(3n, 3n) A [kg] of a step of h [s] from positions x (n, 3)."""
        alpha, beta = self.material.alpha, self.material.beta
        M = sp.diags_array(np.repeat((1 + alpha * h) * self.mass, 3))
        return sp.csc_array(M + (h**2 + beta * h) * self.elastic.stiffness(x))


def linearised_step(
    body: Solid, x: FloatArray, v: FloatArray, h: float, pins: FloatArray | None = None
) -> FloatArray:
    """Positions (n, 3) after a step of h [s] from x with velocities v (n, 3), without limits.

    Parameters
    ----------
    pins : (p, 3) where the pinned vertices go, by default nowhere; A moves the others with them
    """
    moved, free = np.zeros_like(x), np.setdiff1d(np.arange(len(x)), body.pinned)
    if pins is not None:
        moved[body.pinned] = (pins - x[body.pinned]) / h
    momentum = body.mass[:, None] * (v + h * body.gravity) - h * body.gradient(x)[1]
    unknown = (3 * free[:, None] + np.arange(3)).ravel()
    A = body.metric(x, h)
    right = (momentum.ravel() - A @ moved.ravel())[unknown]
    factor = scipy.sparse.linalg.splu(sp.csc_array(A[unknown][:, unknown]), "MMD_AT_PLUS_A")
    solved = factor.solve(right)
    moved[free] = solved.reshape(-1, 3)
    return x + h * moved
