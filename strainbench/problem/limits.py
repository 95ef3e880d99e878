"""Upper bounds on stretch in material directions (Tang et al. 2022, section 3.1).

A limit is a curve b(alpha) over material angles; a method sees samples of it, one
constraint ||F d_i|| <= b_i for each sampled direction d_i = (cos alpha_i, sin alpha_i).
An exact limit bounds all directions at once, by the largest singular value of F.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from strainbench.arrays import FloatArray, frozen_array
from strainbench.problem.curve import SAME_DIRECTION, read_curve


@dataclass(frozen=True, eq=False)
class StretchLimits:
    """Bounds on the stretch ||F d|| of an element in given material directions.

    Parameters
    ----------
    directions : (m, dim)
        Unit vectors in material space; d and -d are one direction.
    bounds : (m,) or (e, m)
        Largest stretch allowed in each direction, for all elements or for each.
        1 is the rest length: 1.01 is a limit of 1% strain.
    spectral : bool
        Whether the limit is exact, see `exact`: one constraint an element, ||F D||_2 <= 1 with
        D = diag(1 / bounds). The directions are then the material axes.
    lower : (m,) or (e, m), optional
        Least stretch allowed in each direction, above 0 and at most the bound: a limit on
        compression. Such limits are not convex, and only some methods take them.

    Raises
    ------
    ValueError
        Naming the field, the index and the value: a bound that is not positive and finite,
        a lower one above it, a direction that is not a unit vector, one that is given twice
        with different bounds, or shapes that do not match.

    Examples
    --------
    >>> StretchLimits.isotropic(1.01, directions=4).bounds.tolist()
    [1.01, 1.01, 1.01, 1.01]
    """

    directions: FloatArray
    bounds: FloatArray
    spectral: bool = False
    lower: FloatArray | None = None

    def __post_init__(self) -> None:
        directions = frozen_array("limits.directions", self.directions, 2)
        bounds = frozen_array("limits.bounds", self.bounds, 1, 2)
        if len(directions) == 0:
            raise ValueError("limits.directions: at least one direction is needed")
        _check_bounds("limits.bounds", bounds, len(directions))
        for row in np.flatnonzero(np.abs(np.linalg.norm(directions, axis=1) - 1) > 1e-6)[:1]:
            raise ValueError(f"limits.directions[{row}] is {directions[row]}: not a unit vector")
        if self.spectral and not np.array_equal(directions, np.eye(len(directions))):
            raise ValueError("limits.directions: exact limits have the material axes, in order")
        kept = {"directions": directions, "bounds": bounds}
        if self.lower is not None:
            kept["lower"] = self._checked_lower(bounds)
        keep = _distinct(directions, *[kept[name] for name in kept if name != "directions"])
        for name, array in kept.items():
            distinct = array[keep] if name == "directions" else array[..., keep]
            distinct.setflags(write=False)
            object.__setattr__(self, name, distinct)

    def _checked_lower(self, bounds: FloatArray) -> FloatArray:
        assert self.lower is not None
        if self.spectral:
            raise ValueError("limits.lower: exact limits have upper bounds alone")
        lower = frozen_array("limits.lower", self.lower, 1, 2)
        _check_bounds("limits.lower", lower, bounds.shape[-1])
        if lower.ndim == bounds.ndim == 2 and len(lower) != len(bounds):
            raise ValueError(
                f"limits.lower: {len(lower)} rows, but limits.bounds has {len(bounds)}"
            )
        for index in np.argwhere(lower > bounds)[:1]:
            least, largest = (a[tuple(index)] for a in np.broadcast_arrays(lower, bounds))
            raise ValueError(
                f"limits.lower{index.tolist()} is {least}: at most the bound {largest} is valid"
            )
        return lower

    def first(self) -> StretchLimits:
        """Those of the first element, for all elements of another mesh."""
        lower = None if self.lower is None else np.atleast_2d(self.lower)[0]
        return replace(self, bounds=np.atleast_2d(self.bounds)[0], lower=lower)

    @classmethod
    def isotropic(
        cls, bound: float, directions: int = 4, lower: float | None = None
    ) -> StretchLimits:
        """The same bound in `directions` equally spaced angles in [-pi/2, pi/2) (section 3.1).

        Between the samples the true stretch can reach bound / cos(pi / (2 directions)).
        """
        if not isinstance(directions, (int, np.integer)) or directions < 1:
            raise ValueError(f"directions is {directions!r}: a whole number of at least 1 is valid")
        angles = -np.pi / 2 + np.pi * np.arange(directions) / directions
        return cls.sampled(angles, np.full(directions, bound), lower)

    @classmethod
    def orthotropic(
        cls, warp: float, weft: float, shear: float, lower: float | None = None
    ) -> StretchLimits:
        """Bounds along warp (0 degrees), weft (90 degrees) and both diagonals (+-45 degrees)."""
        angles = np.pi / 4 * np.array([-2, -1, 0, 1])
        return cls.sampled(angles, [weft, shear, warp, shear], lower)

    @classmethod
    def exact(cls, bound: ArrayLike, weft: ArrayLike | None = None, dim: int = 2) -> StretchLimits:
        """No direction is stretched beyond the limit: a bound on F's largest singular value.

        Parameters
        ----------
        bound : float or (e,)
            ||F||_2 <= bound, for all elements or for each.
        weft : float or (e,), optional
            The orthotropic limit ||F D||_2 <= 1 with D = diag(1 / bound, 1 / weft): the stretch
            in a direction d is at most ||D^-1 d||, `bound` along warp (0 degrees) and `weft`
            along weft (90 degrees).
        dim : 2 for surfaces, 3 for volumes, which have no weft.
        """
        if dim not in (2, 3) or (dim == 3 and weft is not None):
            raise ValueError(f"dim is {dim}: valid are 2, or 3 without a weft")
        warp = frozen_array("limits.bound", bound, 0, 1)
        other = warp if weft is None else frozen_array("limits.weft", weft, 0, 1)
        try:
            axes = np.broadcast_arrays(warp, *[other] * (dim - 1))
        except ValueError:
            raise ValueError(f"limits.weft: shape {other.shape} for bound {warp.shape}") from None
        return cls(np.eye(dim), np.stack(axes, axis=-1), spectral=True)

    @classmethod
    def sampled(
        cls, angles: ArrayLike, bounds: ArrayLike, lower: ArrayLike | None = None
    ) -> StretchLimits:
        """Any curve, by its samples: `angles` (m,) [rad], `bounds` (m,) or (e, m).

        `lower` may be one number, the least stretch in every direction.
        """
        alpha = frozen_array("limits.angles", angles, 1)
        directions = np.column_stack([np.cos(alpha), np.sin(alpha)])
        if lower is not None:
            least = frozen_array("limits.lower", lower, 0, 1, 2)
            lower = np.full(len(alpha), least) if least.ndim == 0 else least
        return cls(directions, frozen_array("limits.bounds", bounds, 1, 2), lower=lower)

    @classmethod
    def from_csv(cls, path: str | Path) -> StretchLimits:
        """A sampled curve from a CSV file with the columns `angle_degrees` and `bound`.

        Instead of `bound` there may be `strain` (0.05) or `percent` (5), and `angle_radians`
        instead of degrees. Semicolons and tabs part columns too; with them numbers may have
        decimal commas. Stretches outside `curve.PLAUSIBLE` are refused, as strains or percentages.

        Raises
        ------
        ValueError
            One line that names the file, and the line in it where it is about one.
        """
        return cls.sampled(*read_curve(Path(path)))


def _check_bounds(name: str, bounds: FloatArray, directions: int) -> None:
    """ValueError where bounds do not match the directions or are not above 0."""
    if bounds.shape[-1] != directions:
        raise ValueError(
            f"{name}: shape {bounds.shape} does not match {directions} directions; "
            f"valid are ({directions},) and (elements, {directions})"
        )
    for index in np.argwhere(bounds <= 0)[:1]:
        raise ValueError(
            f"{name}{index.tolist()} is {bounds[tuple(index)]}: a bound must be above 0"
        )


def _distinct(directions: FloatArray, *bounds: FloatArray) -> list[int]:
    """Indices of the distinct directions: a curve given from -90 to 90 degrees has one twice."""
    keep: list[int] = []
    for j, direction in enumerate(directions):
        others = directions[keep]
        apart = np.minimum(
            np.linalg.norm(others - direction, axis=1), np.linalg.norm(others + direction, axis=1)
        )
        twins = [k for k, distance in zip(keep, apart, strict=True) if distance < SAME_DIRECTION]
        if not twins:
            keep.append(j)
        elif not all(np.array_equal(b[..., twins[0]], b[..., j]) for b in bounds):
            raise ValueError(
                f"limits.directions[{j}] repeats direction {twins[0]} with another bound"
            )
    return keep
