"""Arrays that are checked, and then only read."""

from __future__ import annotations

from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]
"""Doubles."""
IntArray = NDArray[np.int64]
"""Indices, 64 bits wide."""
Scalar = TypeVar("Scalar", np.int64, np.float64)


def frozen_array(name: str, values: ArrayLike, *ndims: int) -> FloatArray:
    """A read-only float copy of `values`, or ValueError naming the field, index and value."""
    try:
        given = np.array(values)
        if not np.isrealobj(given) or given.dtype.kind in "USO":
            raise ValueError(f"entries of type {given.dtype}")
        array = given.astype(np.float64)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{name}: not an array of real numbers ({error})") from None
    if array.ndim not in ndims:
        valid = " or ".join(map(str, ndims))
        raise ValueError(f"{name}: expected {valid} dimensions, got shape {array.shape}")
    bad = np.argwhere(~np.isfinite(array))
    if len(bad):
        index = tuple(bad[0].tolist())
        raise ValueError(f"{name}{list(index)} is {array[index]}: every entry must be finite")
    array.setflags(write=False)
    return array


def index_array(name: str, values: ArrayLike, ndim: int, vertices: int) -> IntArray:
    """A read-only copy of vertex indices, or ValueError naming the field, index and value."""
    try:
        array = np.array(values)
    except ValueError as error:
        raise ValueError(f"{name}: not an array of vertex indices ({error})") from None
    if array.size == 0:
        array = array.astype(np.int64)
    if array.ndim != ndim:
        raise ValueError(f"{name}: expected {ndim} dimensions, got shape {array.shape}")
    if not np.issubdtype(array.dtype, np.integer):
        raise ValueError(f"{name}: vertex indices must be integers, got {array.dtype}")
    bad = np.argwhere((array < 0) | (array >= vertices))
    if len(bad):
        index = tuple(bad[0].tolist())
        raise ValueError(
            f"{name}{list(index)} is {array[index]}: valid vertex indices are 0 to {vertices - 1}"
        )
    array = array.astype(np.int64)
    array.setflags(write=False)
    return array


def read_only(array: NDArray[Scalar]) -> NDArray[Scalar]:
    """The array itself, which can no longer be written to."""
    array.setflags(write=False)
    return array
