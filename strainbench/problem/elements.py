"""Elements: their corners, the gradients of their shape functions, their areas or volumes."""

from __future__ import annotations

import numpy as np

from strainbench import sparse as sp
from strainbench.arrays import FloatArray, IntArray, read_only


def rest_corners(rest: FloatArray, elements: IntArray) -> FloatArray:
    """(e, k, dim) material positions of each element's own corners [m], however `rest` is given."""
    return rest[elements] if rest.ndim == 2 else rest


def shape_gradients(rest: FloatArray, elements: IntArray) -> tuple[FloatArray, FloatArray]:
    """Gradients B of the linear shape functions, and the elements' areas or volumes.

    Returns
    -------
    gradients : (e, k, dim)
        F_e = sum_k x_k B_k [1/m] (Tang et al. 2022, appendix A).
    measures : (e,)
        Rest area [m^2] of a triangle, rest volume [m^3] of a tetrahedron.

    Raises
    ------
    ValueError
        Naming the first element without area or volume, to working precision.
    """
    corners = rest_corners(rest, elements)
    edges = np.swapaxes(corners[:, 1:] - corners[:, :1], 1, 2)
    dim = rest.shape[-1]
    determinant = np.linalg.det(edges)
    size = np.abs(edges).max(axis=(1, 2), initial=0) ** dim
    flat = np.flatnonzero(np.abs(determinant) <= 1e-14 * size)
    if len(flat):
        word = "area" if dim == 2 else "volume"
        raise ValueError(
            f"elements[{flat[0]}] (vertices {elements[flat[0]].tolist()}) has no rest {word}"
        )
    inverse = np.linalg.inv(edges)
    gradients = np.concatenate([-inverse.sum(axis=1, keepdims=True), inverse], axis=1)
    return read_only(gradients), read_only(np.abs(determinant) / (2 if dim == 2 else 6))


def sparse_rows(vertices: IntArray, coefficients: FloatArray, count: int) -> sp.csr_array:
    """(rows, count) the matrix with these `coefficients` (rows, k) at `vertices` (rows, k)."""
    rows, k = vertices.shape
    starts = np.arange(0, rows * k + 1, k)
    entries = coefficients.ravel(), vertices.ravel(), starts
    matrix = sp.csr_array(entries, shape=(rows, count), copy=True)
    matrix.sort_indices()
    matrix.data.setflags(write=False)
    return matrix
