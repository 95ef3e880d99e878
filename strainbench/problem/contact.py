"""Planes that vertices are kept off: linear rows beside the limits of a `Problem`.

Where a plane is at the end of a step, n . (x - p) >= 0 holds for each vertex x of an element. A
plane that moves, or a body that slides on it, is held back by Coulomb friction: of the multipliers
of a contact, the tangential ones are at most `friction` times the normal one, and against the slip,
the vertex's move in the step less the plane's. With friction the answer of a step is no projection.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from strainbench.arrays import FloatArray, frozen_array, read_only


@dataclass(frozen=True, eq=False)
class Plane:
    """A half-space that vertices are kept out of.

    Parameters
    ----------
    point : (3,) on the plane, where that is at the end of the step [m]
    normal : (3,) towards the vertices; of any length, kept as a unit vector
    moves : (3,) how far the plane goes in the step [m]
    friction : Coulomb's coefficient, from 0 on

    Raises
    ------
    ValueError
        Naming the field, and the value.

    Examples
    --------
    >>> Plane((0, 1, 0), (0, 2, 0)).gaps(np.array([[5.0, 1.25, 0.0]]))
    array([0.25])
    """

    point: FloatArray
    normal: FloatArray
    moves: FloatArray = (0.0, 0.0, 0.0)  # type: ignore[assignment]
    friction: float = 0.0

    def __post_init__(self) -> None:
        for name in ("point", "normal", "moves"):
            array = frozen_array(f"contact.{name}", getattr(self, name), 1)
            if array.shape != (3,):
                raise ValueError(f"contact.{name}: shape {array.shape}; (3,) is valid")
            object.__setattr__(self, name, array)
        length = float(np.linalg.norm(self.normal))
        if length == 0:
            raise ValueError("contact.normal is [0, 0, 0]: a vector with a direction is valid")
        if not 0 <= self.friction < np.inf:
            raise ValueError(f"contact.friction is {self.friction}: a number from 0 on is valid")
        object.__setattr__(self, "normal", read_only(self.normal / length))

    def gaps(self, x: FloatArray) -> FloatArray:
        """(n,) signed distances of points x (n, 3) [m], negative inside."""
        gaps: FloatArray = (x - self.point) @ self.normal
        return gaps

    @property
    def tangents(self) -> FloatArray:
        """(2, 3) unit vectors in the plane, at right angles."""
        first = np.cross(self.normal, np.eye(3)[np.argmin(np.abs(self.normal))])
        first /= np.linalg.norm(first)
        return np.stack([first, np.cross(self.normal, first)])


def checked_contact(planes: Sequence[Plane]) -> tuple[Plane, ...]:
    """All of them planes, or ValueError naming the index."""
    for i, plane in enumerate(planes):
        if not isinstance(plane, Plane):
            raise ValueError(f"contact[{i}] is {plane!r}: a Plane is valid")
    return tuple(planes)


def depths(planes: Sequence[Plane], x: FloatArray) -> FloatArray:
    """(planes n,) how deep points x (n, 3) lie within each plane [m]; 0 outside."""
    deep = [np.maximum(0.0, -plane.gaps(x)) for plane in planes]
    return np.concatenate(deep) if deep else np.zeros(0)


def rubs(planes: Sequence[Plane]) -> bool:
    """Whether any has friction."""
    return any(plane.friction > 0 for plane in planes)
