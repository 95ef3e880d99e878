"""A sheet of cloth: lumped masses, elastic energies and their sparse Hessian."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy.sparse as sp

from strainbench.arrays import FloatArray, IntArray
from strainbench.physics.energies.bending import add_bending_gradient, add_bending_hessian, hinges
from strainbench.physics.energies.contact import Contact, add_blocks
from strainbench.physics.energies.membrane import add_membrane_gradient, add_membrane_hessian
from strainbench.physics.linear import LinearSolver, best_linear_solver, symmetric
from strainbench.physics.pattern import Pattern
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
class Cloth:
    """Membrane and hinge energies on a triangle mesh.

    Parameters
    ----------
    rest : (n, 2), or (e, 3, 2) for the corners of each triangle [m]
    elements : (e, 3); with rest by corner, their largest index is the last vertex
    material : Material
    pinned : (p,) vertices that are not unknowns of a step
    contact : what the vertices are kept off, or None
    """

    rest: FloatArray
    elements: IntArray
    material: Material
    pinned: IntArray
    contact: Contact | None = None

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
    def _hinges(self) -> tuple[IntArray, FloatArray]:
        if self.material.bending == 0:
            return np.empty((0, 4), dtype=np.int64), np.empty(0)
        quads, weights = hinges(self.rest, self.elements, self._shape[1])
        return quads, self.material.bending * weights

    def energies(self, x: FloatArray) -> tuple[float, float, FloatArray]:
        """Membrane and bending energy [J], and the gradient (n, 3) of their sum [N]."""
        gradient = np.zeros_like(x)
        lam, mu = self.material.lame
        weights = self.material.thickness * self._shape[1]
        membrane = add_membrane_gradient(
            x, self.elements, self._shape[0], weights, lam, mu, gradient
        )
        bending = add_bending_gradient(x, *self._hinges, gradient)
        return membrane, bending, gradient

    def add_contact_gradient(self, x: FloatArray, out: FloatArray) -> float:
        """Add the gradient (n, 3) [N] of contact to `out`; return its energy [J]."""
        if self.contact is None:
            return 0.0
        return self.contact.add_gradient(x, self.contact.stiffnesses(self.mass), out)

    @cached_property
    def pattern(self) -> Pattern:
        """Sparsity of the Hessian on the free vertices, found once."""
        return Pattern.of([self.elements, self._hinges[0]], self.vertices, self.pinned)

    @cached_property
    def linear_solver(self) -> LinearSolver:
        """For systems in the Hessian; analysed once."""
        return best_linear_solver(self.pattern.matrix())

    def hessian_values(self, x: FloatArray, diagonal: FloatArray, clamp: bool = True) -> FloatArray:
        """Hessian plus a (n,) `diagonal` [N/m], as values of the pattern.

        Positive semidefinite if `clamp`; that of bending always is.
        """
        lam, mu = self.material.lame
        pattern = self.pattern
        data = np.zeros(len(pattern.indices))
        pattern.add_diagonal(data, diagonal)
        weights = self.material.thickness * self._shape[1]
        triangles, quads = pattern.slots
        gradients, stride = self._shape[0], pattern.stride
        add_membrane_hessian(
            x, self.elements, gradients, weights, lam, mu, clamp, triangles, stride, data
        )
        add_bending_hessian(x, *self._hinges, quads, stride, data)
        if self.contact is not None:
            blocks = self.contact.hessian_blocks(x, self.contact.stiffnesses(self.mass))
            add_blocks(blocks, pattern.free, pattern.diagonal, stride, data)
        return data

    def hessian(self, x: FloatArray, diagonal: FloatArray) -> sp.csc_array:
        """The clamped one, as a whole symmetric matrix on the free vertices."""
        return symmetric(self.pattern.matrix(self.hessian_values(x, diagonal)))
