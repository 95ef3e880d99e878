"""A sheet of cloth: its lumped masses and its energies."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from strainbench.arrays import FloatArray, IntArray
from strainbench.physics.body import GRAVITY, Body
from strainbench.physics.energies.bending import Bending, hinges
from strainbench.physics.energies.contact import Contact
from strainbench.physics.energies.energy import Energy
from strainbench.physics.energies.membrane import Membrane
from strainbench.problem.elements import shape_gradients


@dataclass(frozen=True)
class Material:
    """Constants of a cloth; the defaults are those of Tang et al. 2022, section 5."""

    thickness: float = 0.5e-3  # [m]
    density: float = 200.0  # [kg/m^3]
    young: float = 1800.0  # [Pa]
    poisson: float = 0.41
    bending: float = 1e-6  # hinge stiffness [J]; the paper gives none. 0 builds no hinges

    def only(self, parts: Collection[str]) -> Material:
        """The same without the energies, "membrane" and "bending", that are not among `parts`."""
        young = self.young if "membrane" in parts else 0.0
        return replace(self, young=young, bending=self.bending if "bending" in parts else 0.0)

    @property
    def lame(self) -> tuple[float, float]:
        """Plane-stress Lame constants (lam, mu) [Pa]."""
        lam = self.young * self.poisson / (1 - self.poisson**2)
        return lam, self.young / (2 * (1 + self.poisson))


@dataclass(frozen=True, eq=False)
class Cloth(Body):
    """Membrane, hinges, contact and more on a triangle mesh.

    Parameters
    ----------
    rest : (n, 2), or (e, 3, 2) for the corners of each triangle [m]
    elements : (e, 3); with rest by corner, their largest index is the last vertex
    material : Material
    pinned : (p,) vertices that are not unknowns of a step
    contact : what the vertices are kept off, or None
    gravity : (3,) [m/s^2]
    more : further energies
    """

    rest: FloatArray
    elements: IntArray
    material: Material
    pinned: IntArray
    contact: Contact | None = None
    gravity: FloatArray = field(default_factory=lambda: GRAVITY)
    more: tuple[Energy, ...] = ()

    @cached_property
    def _shape(self) -> tuple[FloatArray, FloatArray]:
        return shape_gradients(self.rest, self.elements)

    @property
    def vertices(self) -> int:
        """Number of vertices n."""
        return len(self.rest) if self.rest.ndim == 2 else int(self.elements.max()) + 1

    @cached_property
    def mass(self) -> FloatArray:
        """(n,) [kg]: a third of each triangle's mass at each of its vertices."""
        element_mass = self.material.density * self.material.thickness * self._shape[1]
        mass = np.zeros(self.vertices)
        np.add.at(mass, self.elements, element_mass[:, None] / 3)
        return mass

    @cached_property
    def energies(self) -> tuple[Energy, ...]:
        """Membrane, bending, contact if there is any, and what was given."""
        material, (gradients, areas) = self.material, self._shape
        weights = material.thickness * areas
        membrane = Membrane(self.elements, gradients, weights, material.lame)
        hinged = self.elements if material.bending else self.elements[:0]
        quads, shares = hinges(self.rest, hinged, areas)
        bending = Bending(quads, material.bending * shares)
        contact = (self.contact.penalty(self.mass),) if self.contact else ()
        return (membrane, bending, *contact, *self.more)
