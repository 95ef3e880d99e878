"""A sheet of cloth: lumped masses, elastic energies and their sparse Hessian."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from numba import njit

from strainbench.limits import FloatArray
from strainbench.physics.bending import add_bending_gradient, angle_and_gradient, hinges
from strainbench.physics.membrane import add_membrane_gradient, membrane_hessian
from strainbench.problem import IntArray, shape_gradients


@dataclass(frozen=True)
class Material:
    """Constants of a cloth; the defaults are those of Tang et al. 2022, section 5."""

    thickness: float = 0.5e-3  # [m]
    density: float = 200.0  # [kg/m^3]
    young: float = 1800.0  # [Pa]
    poisson: float = 0.41
    bending: float = 1e-6  # hinge stiffness [J]; the paper gives none

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
    """

    rest: FloatArray
    elements: IntArray
    material: Material
    pinned: IntArray

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

    @cached_property
    def pattern(self) -> Pattern:
        """Sparsity of the Hessian on the free vertices, found once."""
        return Pattern.of([self.elements, self._hinges[0]], self.vertices, self.pinned)

    def hessian(self, x: FloatArray, diagonal: FloatArray) -> sp.csc_array:
        """Positive semidefinite Hessian on the free vertices plus a (n,) `diagonal` [N/m]."""
        lam, mu = self.material.lame
        pattern = self.pattern
        data = np.zeros(len(pattern.indices))
        pattern.add_diagonal(data, diagonal)
        weights = self.material.thickness * self._shape[1]
        triangles, quads = pattern.slots
        _assemble_membrane(
            x, self.elements, self._shape[0], weights, lam, mu, triangles, pattern.stride, data
        )
        _assemble_bending(x, *self._hinges, quads, pattern.stride, data)
        return sp.csc_array((data, pattern.indices, pattern.indptr), shape=2 * (pattern.size,))


@dataclass(frozen=True, eq=False)
class Pattern:
    """Where the 3 x 3 block of each vertex pair lies in a CSC matrix on the free vertices.

    Block (i, j) starts at `slot` in its first column; its column c starts c stride[j] further.
    """

    size: int
    indptr: IntArray
    indices: IntArray
    slots: list[IntArray]  # per family of elements: (e, k, k) first entry of a block, or -1
    stride: IntArray  # (n,) entries in each column of vertex j
    diagonal: IntArray  # (free,) slot of each diagonal block
    free: IntArray

    @classmethod
    def of(cls, families: list[IntArray], n: int, pinned: IntArray) -> Pattern:
        """The pattern in which the vertices of each element of each family interact."""
        free = np.setdiff1d(np.arange(n), pinned)
        number = np.full(n, -1)
        number[free] = np.arange(len(free))
        rows = np.concatenate([np.repeat(f, f.shape[1], axis=1).ravel() for f in families])
        columns = np.concatenate([np.tile(f, (1, f.shape[1])).ravel() for f in families])
        keep = (number[rows] >= 0) & (number[columns] >= 0)
        blocks = sp.csc_array(
            (np.ones(keep.sum()), (number[rows[keep]], number[columns[keep]])),
            shape=2 * (len(free),),
        )
        blocks.sum_duplicates()
        blocks.sort_indices()
        degree = np.diff(blocks.indptr)
        columns_of = np.repeat(np.arange(len(free)), degree)
        place = np.arange(blocks.nnz) - blocks.indptr[columns_of]
        first = 9 * blocks.indptr[columns_of] + 3 * place
        lookup = sp.csc_array((first + 1, blocks.indices, blocks.indptr), shape=blocks.shape)
        slots = []
        for family in families:
            k = family.shape[1]
            i = number[np.repeat(family, k, axis=1)].ravel()
            j = number[np.tile(family, (1, k))].ravel()
            inside = (i >= 0) & (j >= 0)
            slot = np.full(len(i), -1)
            slot[inside] = np.asarray(lookup[i[inside], j[inside]]).ravel() - 1
            slots.append(slot.reshape(-1, k, k))
        stride = np.zeros(n, dtype=np.int64)
        stride[free] = 3 * degree
        indptr = np.concatenate([[0], np.cumsum(np.repeat(3 * degree, 3))])
        column_indices = [
            (3 * blocks.indices[a:b, None] + np.arange(3)).ravel()
            for a, b in zip(blocks.indptr[:-1], blocks.indptr[1:], strict=True)
        ]
        indices = np.concatenate([np.tile(c, 3) for c in column_indices])
        diagonal = np.asarray(lookup.diagonal()).ravel() - 1
        return cls(3 * len(free), indptr, indices, slots, stride, diagonal, free)

    def add_diagonal(self, data: FloatArray, values: FloatArray) -> None:
        """Add the (n,) `values` to the diagonal of each free vertex's block."""
        for c in range(3):
            data[self.diagonal + c * self.stride[self.free] + c] += values[self.free]


@njit(cache=True)
def _scatter(
    block: FloatArray, vertices: IntArray, slot: IntArray, stride: IntArray, data: FloatArray
) -> None:
    """Add an element's (3k, 3k) block to the entries of the sparse matrix."""
    k = len(vertices)
    for i in range(k):
        for j in range(k):
            start = slot[i, j]
            if start < 0:
                continue
            for c in range(3):
                column = start + c * stride[vertices[j]]
                for a in range(3):
                    data[column + a] += block[3 * i + a, 3 * j + c]


@njit(cache=True)
def _assemble_membrane(
    x: FloatArray,
    triangles: IntArray,
    gradients: FloatArray,
    weights: FloatArray,
    lam: float,
    mu: float,
    slots: IntArray,
    stride: IntArray,
    data: FloatArray,
) -> None:
    block = np.zeros((9, 9))
    for e in range(len(triangles)):
        membrane_hessian(x, triangles[e], gradients[e], weights[e], lam, mu, True, block)
        _scatter(block, triangles[e], slots[e], stride, data)


@njit(cache=True)
def _assemble_bending(
    x: FloatArray,
    quads: IntArray,
    weights: FloatArray,
    slots: IntArray,
    stride: IntArray,
    data: FloatArray,
) -> None:
    grad = np.zeros((4, 3))
    block = np.zeros((12, 12))
    for h in range(len(quads)):
        angle_and_gradient(x, quads[h], grad)
        for i in range(12):
            for j in range(12):
                block[i, j] = 2 * weights[h] * grad[i // 3, i % 3] * grad[j // 3, j % 3]
        _scatter(block, quads[h], slots[h], stride, data)
