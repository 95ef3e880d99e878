"""Kinds of limits, as objects: everything that the suite asks of limits by their kind.

An element's rows of G x are y_j = F d_j for material directions d_j. Limits measure them,

    lower_i <= measure_i(y_1, ..., y_m) <= b_i,

and a kind says what its measure is: the stretch ||y_j|| in each direction (`Sampled`), the largest
singular value of all (`Exact`). A third kind is a third class: derive it from `Kind` and give it to
`Problem` as limits (CONTRIBUTING.md has one of 20 lines). No other file needs to know of it.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import replace
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import ArrayLike

from strainbench.arrays import FloatArray, IntArray, frozen_array
from strainbench.problem.limits import StretchLimits
from strainbench.problem.reach import gauge


class Kind(ABC):
    """What limits demand of an element: lower <= measure(rows) <= bounds.

    A kind has `needs`, `formula`, `measure` and `tightened`, and for the referee `dual_norms` where
    its measure is a norm, `convex = False` and `derivatives` where it is none.

    Parameters
    ----------
    directions : (m, dim)
        Material directions d_j: an element has the m rows F d_j of G x.
    bounds : (c,) or (e, c)
        Largest measures of the c constraints an element, for all elements or for each.
    lower : as bounds, optional
        Least measures.

    Attributes
    ----------
    formula : the constraint in a line
    cone : "second-order" where the measure is the Euclidean length of all rows of a constraint,
        "semidefinite" where it is their spectral norm: see `strainbench.problem.conic`
    """

    formula: str
    cone: ClassVar[Literal["second-order", "semidefinite"] | None] = None

    def __init__(
        self, directions: ArrayLike, bounds: ArrayLike, lower: ArrayLike | None = None
    ) -> None:
        self.directions = frozen_array("limits.directions", directions, 2)
        self.bounds = frozen_array("limits.bounds", bounds, 1, 2)
        self.lower = None if lower is None else frozen_array("limits.lower", lower, 1, 2)

    @property
    @abstractmethod
    def needs(self) -> Mapping[str, str]:
        """What a solver must declare to take them, and why one that does not cannot."""

    @abstractmethod
    def measure(self, rows: FloatArray) -> FloatArray:
        """(constraints,) what is bounded, of `rows` (rows of G, 3) of G x."""

    @abstractmethod
    def tightened(self, margin: float) -> Limits:
        """The same limits with all bounds lowered by `margin`, lower ones raised; G stays."""

    @property
    def convex(self) -> bool:
        """Whether measures are norms and bounded from above alone: optima are then certified."""
        return self.lower is None

    @property
    def strains(self) -> FloatArray:
        """The largest strains that a picture shows as limits; none where there are none."""
        return np.asarray(self.bounds - 1).ravel()

    def coefficients(self, gradients: FloatArray) -> FloatArray:
        """(e, m, k) the rows of G, from shape function gradients (e, k, dim) [1/m]."""
        entries: FloatArray = np.einsum("ekc,mc->emk", gradients, self.directions)
        return entries

    def dual_norms(self, multipliers: FloatArray) -> FloatArray:
        """(constraints,) the norm dual to `measure` of `multipliers` (rows, 3)."""
        raise NotImplementedError(f"limits {self.formula} have no dual norm")

    def derivatives(self, rows: FloatArray, active: IntArray) -> tuple[IntArray, FloatArray]:  # noqa: ARG002
        """Which rows (a, r) of G constraints `active` (a,) measure, and d measure (a, r, 3)."""
        raise ValueError("limits: the KKT residual is that of sampled directions")

    def longest(self, vectors: FloatArray) -> FloatArray:
        """(e, p) an upper bound on the length of material `vectors` (e, p, dim); infinite here."""
        return np.full(vectors.shape[:-1], np.inf)

    def first(self) -> Limits:
        """Those of the first element, for all elements of another mesh."""
        return self

    def check(self, dim: int, elements: int) -> None:
        """ValueError where they are not limits of `elements` in `dim` material coordinates."""
        if self.directions.shape[1] != dim:
            raise ValueError(
                f"limits.directions: {self.directions.shape[1]} coordinates, "
                f"but the material space of rest has {dim}"
            )
        for name, array in (("bounds", self.bounds), ("lower", self.lower)):
            if array is not None and array.ndim == 2 and len(array) != elements:
                raise ValueError(f"limits.{name}: {len(array)} rows for {elements} elements")


Limits = StretchLimits | Kind
"""What a problem takes as its limits."""


class Sampled(Kind):
    """Stretch in sampled directions, a constraint each: ||F d_j|| <= b_j."""

    formula = "||(G x)_i|| <= b_i"
    cone = "second-order"

    def __init__(self, limits: StretchLimits) -> None:
        super().__init__(limits.directions, limits.bounds, limits.lower)
        self._limits = limits

    @property
    def needs(self) -> Mapping[str, str]:
        """Lower bounds alone need a word."""
        reason = "it has no form for lower bounds, which are not convex"
        return {} if self.lower is None else {"takes_lower": reason}

    def measure(self, rows: FloatArray) -> FloatArray:
        """||(G x)_i||."""
        lengths: FloatArray = np.linalg.norm(rows, axis=1)
        return lengths

    def dual_norms(self, multipliers: FloatArray) -> FloatArray:
        """|Y_i|."""
        return self.measure(multipliers)

    def derivatives(self, rows: FloatArray, active: IntArray) -> tuple[IntArray, FloatArray]:
        """Each constraint has one row y, and derivative y / ||y||; 0 at y = 0, which has none."""
        y = rows[active]
        lengths = np.linalg.norm(y, axis=1, keepdims=True)
        return active[:, None], (y / np.where(lengths > 0, lengths, 1.0))[:, None]

    def longest(self, vectors: FloatArray) -> FloatArray:
        """With e = sum_j c_j d_j, ||F e|| <= sum_j |c_j| b_j, the least over all coefficients."""
        longest = np.empty(vectors.shape[:2])
        kinds, kind = np.unique(np.atleast_2d(self.bounds), axis=0, return_inverse=True)
        kind = np.broadcast_to(kind.ravel(), len(vectors))
        order = np.argsort(kind, kind="stable")
        starts = np.searchsorted(kind[order], np.arange(1, len(kinds)))
        for b, same in zip(kinds, np.split(order, starts), strict=True):
            longest[same] = gauge(self.directions, b, vectors[same])
        return longest

    def tightened(self, margin: float) -> StretchLimits:
        """Each bound by the margin."""
        lower = None if self.lower is None else self.lower + margin
        return replace(self._limits, bounds=self.bounds - margin, lower=lower)


class Exact(Kind):
    """The largest singular value of all rows: ||F D||_2 <= 1, D = diag(1 / bounds of the axes).

    Rows are scaled so that the tightest axis has D = 1, and its bound is that of the measure.
    """

    formula = "||F_e D||_2 <= b_e"
    cone = "semidefinite"
    needs = {"takes_exact": "it has no form for exact limits, only for sampled directions"}

    def __init__(self, limits: StretchLimits) -> None:
        super().__init__(limits.directions, limits.bounds.min(axis=-1, keepdims=True))
        self._limits = limits

    @property
    def strains(self) -> FloatArray:
        """Those of all axes."""
        return np.asarray(self._limits.bounds - 1).ravel()

    def coefficients(self, gradients: FloatArray) -> FloatArray:
        """Each axis is scaled by D."""
        scale = self.bounds / self._limits.bounds
        return super().coefficients(gradients) * np.atleast_2d(scale)[:, :, None]

    def measure(self, rows: FloatArray) -> FloatArray:
        """Spectral norms ||F D||_2."""
        return self._norms(rows, 2)

    def dual_norms(self, multipliers: FloatArray) -> FloatArray:
        """Nuclear norms."""
        return self._norms(multipliers, "nuc")

    def _norms(self, rows: FloatArray, order: Literal[2, "nuc"]) -> FloatArray:
        blocks = rows.reshape(-1, len(self.directions), 3)
        finite = np.isfinite(blocks).all(axis=(1, 2))  # numpy raises for others
        norms: FloatArray = np.full(len(blocks), np.nan)
        norms[finite] = np.linalg.norm(blocks[finite], order, axis=(1, 2))
        return norms

    def longest(self, vectors: FloatArray) -> FloatArray:
        """||F e|| <= ||D^-1 e||."""
        axes = np.atleast_2d(self._limits.bounds)
        lengths: FloatArray = np.linalg.norm(vectors * axes[:, None], axis=2)
        return lengths

    def tightened(self, margin: float) -> StretchLimits:
        """The tightest axis by the margin, all by the same factor: D stays as it is."""
        return replace(self._limits, bounds=self._limits.bounds * (1 - margin / self.bounds))


def kind_of(limits: object) -> Kind:
    """The kind of a problem's limits; ValueError for what are none."""
    if isinstance(limits, Kind):
        return limits
    if not isinstance(limits, StretchLimits):
        raise ValueError(f"limits: {limits!r} is not a StretchLimits")
    return Exact(limits) if limits.spectral else Sampled(limits)
