"""Where each element's block goes in the sparse Hessian, found once.

Only the lower triangle is kept, in blocks: the upper entries of the diagonal blocks come along
and repeat the lower ones.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from strainbench import sparse as sp
from strainbench.arrays import FloatArray, IntArray
from strainbench.compiled import compiled


@dataclass(frozen=True, eq=False)
class Pattern:
    """Where the 3 x 3 block of each vertex pair i >= j lies in a CSC matrix on the free vertices.

    Block (i, j) starts at `slot` in its first column; its column c starts c stride[j] further.
    """

    size: int
    indptr: IntArray
    indices: IntArray
    slots: list[IntArray]  # of each family: (e, k, k) first entry of a block, or -1
    stride: IntArray  # (n,) entries in each column of vertex j
    diagonal: IntArray  # (free,) slot of each diagonal block
    free: IntArray
    families: list[IntArray]  # (e, k) each

    @classmethod
    def of(cls, families: list[IntArray], n: int, pinned: IntArray) -> Pattern:
        """The pattern in which the vertices of each element of each family interact."""
        free = np.setdiff1d(np.arange(n), pinned)
        size = len(free)
        number = np.full(n, -1)
        number[free] = np.arange(size)
        rows = np.concatenate([np.repeat(number[f], f.shape[1], axis=1).ravel() for f in families])
        columns = np.concatenate([np.tile(number[f], (1, f.shape[1])).ravel() for f in families])
        inside = (rows >= columns) & (columns >= 0)
        keys, block = np.unique(columns[inside] * size + rows[inside], return_inverse=True)
        column, row = np.divmod(keys, size)
        degree = np.bincount(column, minlength=size)
        before = np.cumsum(degree) - degree
        first = 6 * before[column] + 3 * np.arange(len(keys))  # slot of each block
        c, a = np.arange(3)[:, None, None], np.arange(3)[:, None]
        indices = np.empty(9 * len(keys), dtype=np.int64)
        indices[first + 3 * c * degree[column] + a] = 3 * row + a
        indptr = np.concatenate([[0], np.cumsum(np.repeat(3 * degree, 3))])
        slot, diagonal = np.full(len(rows), -1), np.full(size, -1)
        slot[inside] = first[block]
        diagonal[column[row == column]] = first[row == column]
        parts = np.split(slot, np.cumsum([f.size * f.shape[1] for f in families]))
        slots = [
            part.reshape(*f.shape, f.shape[1]) for part, f in zip(parts, families, strict=False)
        ]
        stride = np.zeros(n, dtype=np.int64)
        stride[free] = 3 * degree
        return cls(3 * size, indptr, indices, slots, stride, diagonal, free, families)

    def blocks(self, data: FloatArray) -> list[Blocks]:
        """Where each family's blocks are added to the values `data`."""
        families = zip(self.families, self.slots, strict=True)
        return [Blocks(elements, slots, self.stride, data) for elements, slots in families]

    def add_diagonal(self, data: FloatArray, values: FloatArray) -> None:
        """Add the (n,) `values` to the diagonal of each free vertex's block."""
        for c in range(3):
            data[self.diagonal + c * self.stride[self.free] + c] += values[self.free]

    def matrix(self, data: FloatArray | None = None) -> sp.csc_array:
        """The matrix with these values, or ones, in its lower triangle; the upper is not stored."""
        data = np.ones(len(self.indices)) if data is None else data
        return sp.csc_array((data, self.indices, self.indptr), shape=2 * (self.size,))


class Blocks(NamedTuple):
    """Where the Hessians of elements (e, k) are added: see `Pattern`; (nnz,) values `data`."""

    elements: IntArray
    slots: IntArray
    stride: IntArray
    data: FloatArray

    def add(self, values: FloatArray, modes: FloatArray) -> None:
        """Add sum_m values_m q_m q_m^T of each element: values (e, r), and modes q (e, r, 3k)."""
        _scatter_each(np.ascontiguousarray(values), np.ascontiguousarray(modes), self)


@compiled
def scatter(values: FloatArray, modes: FloatArray, blocks: Blocks, e: int) -> None:
    """Add sum_m values_m q_m q_m^T of element e: values (r,), and modes q (r, 3k)."""
    vertices, slots, data = blocks.elements[e], blocks.slots[e], blocks.data
    for j in range(len(vertices)):
        for i in range(len(vertices)):
            start = slots[i, j]
            if start < 0:
                continue
            for m in range(len(values)):
                for c in range(3):
                    column = start + c * blocks.stride[vertices[j]]
                    factor = values[m] * modes[m, 3 * j + c]
                    for a in range(3):
                        data[column + a] += factor * modes[m, 3 * i + a]


@compiled
def _scatter_each(values: FloatArray, modes: FloatArray, blocks: Blocks) -> None:
    for e in range(len(values)):
        scatter(values[e], modes[e], blocks, e)
