"""Limits on principal stretches along material axes (Hernandez et al. 2013), a kind of limits."""

from __future__ import annotations

import copy
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from strainbench.arrays import FloatArray, IntArray, frozen_array, read_only
from strainbench.problem.kinds import Kind
from strainbench.problem.principal_rows import (
    FREE,
    KINDS,
    Frames,
    biot_slopes,
    rotation_svd,
    slopes,
)

Axes = Sequence[float | None] | float | None
"""A limit for each material axis, None where it is free; or one for all."""


class PrincipalLimits(Kind):
    """Limits on principal stretches, by material axis: `strainbench.problem.principal_rows`.

    They are not convex. Where singular values are equal, principal axes are what LAPACK's
    decomposition says, and so is what is within the limits.

    Parameters
    ----------
    kind : hyperbolic, orthogonal, linear, ellipsoid or isotropic
    lower, upper : by material axis, None for a free one: it has no row, but where axes are
        interpolated between ("linear", "ellipsoid") the limits of `principal_rows.FREE`. One
        number is that of all `dim` axes. At least 0 and at most 1, and at least 1.
    dim : material axes, 2 or 3, where neither limit says how many

    Attributes
    ----------
    lower_limits, upper_limits : (dim,), NaN where free

    Examples
    --------
    A fibre stretched by 5% along an axis that is limited to 4%:

    >>> import numpy as np
    >>> limits = PrincipalLimits("hyperbolic", (None, 0.96), (None, 1.04))
    >>> F = np.array([[[1.0, 0.0], [0.0, 1.05], [0.0, 0.0]]])
    >>> float(limits.values(F).min().round(12))
    -0.01
    """

    def __init__(self, kind: str, lower: Axes = None, upper: Axes = None, dim: int = 3) -> None:
        if kind not in KINDS:
            raise ValueError(f"limits.kind is {kind!r}: valid are {', '.join(KINDS)}")
        given = [len(a) for a in (lower, upper) if isinstance(a, Sequence)]
        dim = given[0] if given else dim
        if len(set(given)) > 1 or dim not in (2, 3):
            counts = " and ".join(map(str, given or [dim]))
            raise ValueError(f"limits: {counts} axes; 2 or 3, above as below, is valid")
        self.name = kind
        self.lower_limits = _checked("lower", lower, dim, 0.0, 1.0)
        self.upper_limits = _checked("upper", upper, dim, 1.0, np.inf)
        if kind == "isotropic":
            _check_equal("lower", self.lower_limits)
            _check_equal("upper", self.upper_limits)
        self._sides = self._limited()
        if not self._sides:
            raise ValueError("limits: no axis is limited; one at least, below or above, is valid")
        at_rest = [g.shape[1:] for g in self._demands(rotation_svd(np.eye(3, dim)[None]))]
        which = [np.tile(np.arange(k) + 3 * side, n) for side, (n, k) in enumerate(at_rest)]
        self._limit_of_row = np.concatenate(which)
        super().__init__(np.eye(dim), np.zeros(len(self._limit_of_row)))
        words = f"{self.lower_limits.tolist()} to {self.upper_limits.tolist()}"
        self.formula = f"C(F_e) >= 0, {kind} limits {words}"

    def _limited(self) -> list[tuple[float, FloatArray]]:
        """(sign, limit) below and above, as the rows take them; without a side that is free."""
        sides = []
        for k, (sign, limit) in enumerate(((1.0, self.lower_limits), (-1.0, self.upper_limits))):
            free = np.isnan(limit)
            if not np.all(free):
                fill = FREE.get(self.name, (np.nan, np.nan))[k]
                least = 1e-6 if self.name == "ellipsoid" else 0.0  # an axis may vanish
                sides.append((sign, np.maximum(np.where(free, fill, limit), least)))
        return sides

    @property
    def needs(self) -> dict[str, str]:
        """See the base class."""
        return {"takes_principal": "it has no form for limits on principal stretches"}

    @property
    def convex(self) -> bool:
        """See the base class."""
        return False

    @property
    def tightest(self) -> float:
        """The least strain that is a limit; 0 only where a limit is the rest length itself."""
        both = np.concatenate([self.lower_limits, self.upper_limits])
        return float(np.nanmin(np.abs(both - 1)))

    @property
    def strains(self) -> FloatArray:
        """Those of the limited axes that are stretched to less than the double."""
        strains = self.upper_limits - 1
        return strains[strains < 1]

    def values(self, F: FloatArray) -> FloatArray:
        """(e, c) C at F (e, 3, dim): 0 or more within the limits, [strain]."""
        return self._values(rotation_svd(F))

    def _values(self, frames: Frames) -> FloatArray:
        return np.concatenate([_by_element(g) for g in self._demands(frames)], axis=1)

    def _demands(self, frames: Frames) -> list[FloatArray]:
        """(e, n, k) C below and above, of k rows a principal axis."""
        s, c, demand = frames.s, frames.components, KINDS[self.name]
        return [sign * demand(s, c, limit).value for sign, limit in self._sides]

    def linearised(self, F: FloatArray, rows: str = "exact") -> tuple[FloatArray, FloatArray]:
        """C (e, c), and its derivative (e, c, 3, dim), at F (e, 3, dim).

        Parameters
        ----------
        rows : "exact", or "biot" for the Biot rows of hyperbolic limits
        """
        if rows not in ("exact", "biot") or (rows == "biot" and self.name != "hyperbolic"):
            valid = "exact, and biot with hyperbolic limits"
            raise ValueError(f"rows is {rows!r} with {self.name} limits: valid are {valid}")
        frames = rotation_svd(F)
        s, c = frames.s, frames.components
        parts = [
            sign * biot_slopes(frames, limit)
            if rows == "biot"
            else sign * slopes(frames, KINDS[self.name](s, c, limit))
            for sign, limit in self._sides
        ]
        return self._values(frames), np.concatenate([_by_element(p) for p in parts], axis=1)

    def measure(self, rows: FloatArray) -> FloatArray:
        """-C; NaN where an element's rows are not finite."""
        F = self._gradients(rows)
        finite = np.isfinite(F).all(axis=(1, 2))  # LAPACK raises for others
        found = np.full((len(F), len(self.bounds)), np.nan)
        found[finite] = -self.values(F[finite])
        return found.ravel()

    def whichever_axis(self, rows: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """(e c,) marked rows, and those of the same limit on an element's other principal axes.

        Principal axes are numbered by size, so that a row of one F may be another's of the next.
        Isotropic limits see sizes alone, and keep theirs.
        """
        if self.name == "isotropic":
            return rows
        limit = self._limit_of_row
        found: NDArray[np.bool_] = rows.reshape(-1, len(limit)) @ (limit[:, None] == limit)
        return found.ravel()

    def derivatives(self, rows: FloatArray, active: IntArray) -> tuple[IntArray, FloatArray]:
        """An element's rows of G, the columns of F."""
        element, row = np.divmod(active, len(self.bounds))
        dim = len(self.directions)
        slope = -self.linearised(self._gradients(rows)[element])[1]
        own = slope[np.arange(len(active)), row]
        return dim * element[:, None] + np.arange(dim), np.swapaxes(own, 1, 2)

    def gaps(self, rows: FloatArray) -> FloatArray:
        """(e,) least difference of two absolute singular values of each element."""
        return rotation_svd(self._gradients(rows)).gaps

    def _gradients(self, rows: FloatArray) -> FloatArray:
        """(e, 3, dim) F, whose columns are the rows of G x."""
        return np.swapaxes(rows.reshape(-1, len(self.directions), 3), 1, 2)

    def longest(self, vectors: FloatArray) -> FloatArray:
        """Isotropic limits bound all lengths alike, others none that is of use."""
        lengths: FloatArray = np.full(vectors.shape[:-1], np.inf)
        if self.name == "isotropic" and not np.isnan(self.upper_limits[0]):
            lengths = self.upper_limits[0] * np.linalg.norm(vectors, axis=-1)
        return lengths

    def tightened(self, margin: float) -> PrincipalLimits:
        """C >= margin."""
        other = copy.copy(self)
        other.bounds = read_only(self.bounds - margin)
        return other

    def check(self, dim: int, elements: int) -> None:
        """See the base class."""
        if len(self.directions) > dim:
            both = (("lower", self.lower_limits), ("upper", self.upper_limits))
            limited = [(n, float(a[dim])) for n, a in both if not np.isnan(a[dim])]
            name, value = limited[0] if limited else ("lower", None)
            raise ValueError(
                f"limits.{name}[{dim}] is {value}: the elements have {dim} material axes"
            )
        super().check(dim, elements)


def _by_element(rows: FloatArray) -> FloatArray:
    """Rows (e, n, k, ...) by principal axis as (e, n k, ...)."""
    e, n, k = rows.shape[:3]
    return rows.reshape(e, n * k, *rows.shape[3:])


def _checked(name: str, given: Axes, dim: int, least: float, largest: float) -> FloatArray:
    """(dim,) limits, NaN where free; ValueError naming index and value."""
    axes = given if isinstance(given, Sequence) else [given] * dim
    numbers = frozen_array(f"limits.{name}", [1.0 if a is None else a for a in axes], 1)
    for j in np.flatnonzero((numbers < least) | (numbers > largest))[:1]:
        valid = "0 to 1" if least == 0 else "1 or more"
        raise ValueError(f"limits.{name}[{j}] is {numbers[j]}: {valid}, or None, is valid")
    return read_only(np.where([a is None for a in axes], np.nan, numbers))


def _check_equal(name: str, limits: FloatArray) -> None:
    """ValueError where isotropic limits differ between axes."""
    for j in np.flatnonzero(limits != limits[0])[:1]:
        if not np.all(np.isnan(limits)):
            raise ValueError(
                f"limits.{name}[{j}] is {limits[j]}, but {limits[0]} on axis 0: "
                "isotropic limits are the same on all axes"
            )
