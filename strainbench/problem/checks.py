"""The fields of a problem, checked: read-only copies, or ValueError with index and value."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from strainbench.arrays import FloatArray, IntArray, frozen_array, index_array


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


def checked_target(target: ArrayLike, vertices: int) -> FloatArray:
    """A position for each vertex."""
    array = frozen_array("target", target, 2)
    if array.shape != (vertices, 3):
        raise ValueError(
            f"target: shape {array.shape}, but rest has {vertices} vertices, "
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
