"""A projection from a file: an instance of a test set (ours)."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from math import isqrt

import numpy as np

from scenarios.stretch_square import StretchSquare
from strainbench import FloatArray, Problem, Scenario, StepReport, StretchLimits
from strainbench.export import load_problem


@dataclass(frozen=True)
class Instance(Scenario):
    """A projection from a file: an instance of a test set (ours).

    Each step projects the same candidate again. With a file, `limit` and `directions` are those of
    its limits, the tightest bound that is above 1, and `resolution` is that of a square of as many
    triangles: what is set of them has no meaning.

    Parameters
    ----------
    path : an npz of `strainbench export` or `testset`; "~" is the home folder; "" is a square
        stretched by a fifth.
    """

    name = "instance"
    needs = frozenset()

    path: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "path", os.path.expanduser(self.path))
        if self.path:
            found = self._problem  # a bad file is named before anything runs
            limits, strain = found.limits, found.bounds - 1
            if np.any(ok := (strain > 0) & (strain < 1)):
                object.__setattr__(self, "limit", float(strain[ok].min().round(12)))
            exact = isinstance(limits, StretchLimits) and limits.spectral
            count = "exact" if exact else found.rows // len(found.elements)
            object.__setattr__(self, "directions", count)
            object.__setattr__(self, "resolution", max(1, isqrt(len(found.elements) // 2)))
        super().__post_init__()

    @cached_property
    def _problem(self) -> Problem:
        if self.path:
            return load_problem(self.path)
        square = (self.resolution, self.limit, self.directions)
        return StretchSquare(*square, scale_x=1.2, scale_y=1.0).problem()

    @property
    def usual_steps(self) -> int:
        """See the base class: there is one projection."""
        return 1

    def easier(self) -> Scenario | None:
        """See the base class; a file has no neighbour."""
        return None if self.path else super().easier()

    def limits(self) -> StretchLimits:
        """See the base class."""
        limits = self._problem.limits
        assert isinstance(limits, StretchLimits)  # a file holds no others
        return limits

    def problem(self) -> Problem:
        """The projection itself."""
        return self._problem

    def play(self, project: Callable[[FloatArray], FloatArray]) -> Iterator[StepReport]:
        """The same projection in every step."""
        while True:
            project(self._problem.target)
            yield StepReport()
