"""Where each element's block goes in the sparse Hessian, found once.

Only the lower triangle is kept, in blocks: the upper entries of the diagonal blocks come along
and repeat the lower ones.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

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

    @classmethod
    def of(cls, families: list[IntArray], n: int, pinned: IntArray) -> Pattern:
        """The pattern in which the vertices of each element of each family interact."""
        free = np.setdiff1d(np.arange(n), pinned)
        number = np.full(n, -1)
        number[free] = np.arange(len(free))
        rows = np.concatenate([np.repeat(f, f.shape[1], axis=1).ravel() for f in families])
        columns = np.concatenate([np.tile(f, (1, f.shape[1])).ravel() for f in families])
        keep = (number[rows] >= number[columns]) & (number[columns] >= 0)
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
            if len(family) == 0:  # such as no hinges
                slots.append(np.empty((0, k, k), dtype=np.int64))
                continue
            i = number[np.repeat(family, k, axis=1)].ravel()
            j = number[np.tile(family, (1, k))].ravel()
            inside = (i >= j) & (j >= 0)
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

    def matrix(self, data: FloatArray | None = None) -> sp.csc_array:
        """The matrix with these values, or ones, in its lower triangle; the upper is not stored."""
        data = np.ones(len(self.indices)) if data is None else data
        return sp.csc_array((data, self.indices, self.indptr), shape=2 * (self.size,))


@compiled
def scatter(
    values: FloatArray,
    modes: FloatArray,
    vertices: IntArray,
    slot: IntArray,
    stride: IntArray,
    data: FloatArray,
) -> None:
    """Add sum_m values_m q_m q_m^T of one element, q_m = modes[m], to the sparse matrix.

    Parameters
    ----------
    values : (r,)
    modes : (r, 3k), three columns for each of the (k,) vertices
    slot, stride, data : of the `Pattern`
    """
    for j in range(len(vertices)):
        for i in range(len(vertices)):
            start = slot[i, j]
            if start < 0:
                continue
            for m in range(len(values)):
                for c in range(3):
                    column = start + c * stride[vertices[j]]
                    factor = values[m] * modes[m, 3 * j + c]
                    for a in range(3):
                        data[column + a] += factor * modes[m, 3 * i + a]
