"""The fields of a problem, checked: read-only copies, or ValueError with index and value."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np
import scipy
from numpy.typing import ArrayLike

from strainbench import sparse as sp
from strainbench.arrays import FloatArray, IntArray, frozen_array, index_array
from strainbench.problem.contact import Plane, checked_contact


def checked_rest(rest: ArrayLike) -> FloatArray:
    """Material positions, by vertex or by corner."""
    array = frozen_array("rest", rest, 2, 3)
    if array.shape[-1] not in (2, 3):
        valid = "(n, 2), (n, 3), (e, 3, 2) and (e, 4, 3)"
        raise ValueError(f"rest: shape {array.shape}; valid are {valid}")
    return array


def checked_elements(elements: ArrayLike, rest: FloatArray, vertices: int) -> IntArray:
    """Triangles or tetrahedra, as many as `rest` has if that is by corner."""
    array = index_array("elements", elements, 2, vertices)
    dim = rest.shape[-1]
    if rest.ndim == 3 and rest.shape[:2] != array.shape:
        raise ValueError(
            f"rest: shape {rest.shape} for elements of shape {array.shape}; "
            f"one material position for each corner of each element is valid"
        )
    if len(array) == 0 or array.shape[1] != dim + 1:
        raise ValueError(
            f"elements: shape {array.shape}; rest has {dim} coordinates, "
            f"so (e, {dim + 1}) with at least one element is valid"
        )
    return array


def checked_target(target: ArrayLike, vertices: int, name: str = "target") -> FloatArray:
    """A position for each vertex."""
    array = frozen_array(name, target, 2)
    if array.shape != (vertices, 3):
        raise ValueError(
            f"{name}: shape {array.shape}, but rest has {vertices} vertices, "
            f"so ({vertices}, 3) is valid"
        )
    return array


def checked_pins(pinned: ArrayLike, vertices: int) -> IntArray:
    """Vertices, none of them twice."""
    pins = index_array("pinned", pinned, 1, vertices)
    values, counts = np.unique(pins, return_counts=True)
    for vertex in values[counts > 1][:1]:
        second = np.flatnonzero(pins == vertex)[1]
        raise ValueError(f"pinned[{second}] is {vertex}: this vertex is pinned already")
    return pins


def checked_mass(mass: ArrayLike, vertices: int) -> FloatArray:
    """A mass above 0 for each vertex."""
    array = frozen_array("mass", mass, 1)
    if len(array) != vertices:
        raise ValueError(f"mass: {len(array)} entries for {vertices} vertices")
    for vertex in np.flatnonzero(array <= 0)[:1]:
        raise ValueError(f"mass[{vertex}] is {array[vertex]}: a mass must be above 0")
    return array


def put_step(
    problem: Any, metric: Any, linearise_at: ArrayLike | None, contact: Sequence[Plane]
) -> None:
    """Keep what differs between the steps of a scene, checked, where it is given."""
    put, n = partial(object.__setattr__, problem), problem.vertices
    if metric is not None:
        put("metric", checked_metric(metric, n))
    if linearise_at is not None:
        put("linearise_at", checked_target(linearise_at, n, "linearise_at"))
    if len(contact):
        put("contact", checked_contact(contact))


SYMMETRIC = 1e-10
"""Entries of a metric and their mirror images are as near as that, of the largest entry."""


def checked_metric(metric: Any, vertices: int) -> sp.csc_array:
    """A symmetric positive definite matrix on the coordinates of all vertices, (n, 3) in C order.

    It is symmetric to the last digit afterwards.
    """
    try:
        A = sp.csc_array(metric, dtype=np.float64, copy=True)
    except (TypeError, ValueError) as error:
        raise ValueError(f"metric: not a matrix of real numbers ({error})") from None
    size = 3 * vertices
    if A.shape != (size, size):
        raise ValueError(f"metric: shape {A.shape} for {vertices} vertices; ({size}, {size})")
    A.sum_duplicates()
    frozen_array("metric.data", A.data, 1)
    _check_symmetric(A)
    A = sp.csc_array((A + A.T) / 2)
    _check_positive_definite(A)
    A.data.setflags(write=False)
    return A


def _check_symmetric(A: sp.csc_array) -> None:
    rows, columns, off = sp.find(sp.triu(A - A.T))
    for k in np.flatnonzero(np.abs(off) > SYMMETRIC * np.abs(A.data).max(initial=0.0))[:1]:
        i, j = rows[k], columns[k]
        raise ValueError(
            f"metric[{i}, {j}] is {A[i, j]:g}, but metric[{j}, {i}] is {A[j, i]:g}: "
            "a symmetric matrix is valid"
        )


def _check_positive_definite(A: sp.csc_array) -> None:
    """By the pivots of its factorisation, which SuperLU does not exchange in this mode."""
    diagonal = A.diagonal()
    for i in np.flatnonzero(diagonal <= 0)[:1]:
        raise ValueError(f"metric[{i}, {i}] is {diagonal[i]:g}: a positive definite one is valid")
    options = {"SymmetricMode": True}
    try:
        factor = scipy.sparse.linalg.splu(
            A, "MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options
        )
        pivots = factor.U.diagonal()[factor.perm_c]
    except RuntimeError:
        pivots = np.zeros(1)  # exactly singular
    for i in np.flatnonzero(~(pivots > 0))[:1]:
        raise ValueError(
            f"metric: pivot {i} of its factorisation is {pivots[i]:g}: "
            "a positive definite matrix is valid"
        )
