"""A square pulled to another rectangle, projected back (nobody; the least there is)."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from strainbench.arrays import FloatArray, IntArray
from strainbench.problem.grid import square_grid
from strainbench.problem.problem import Problem
from strainbench.scenario.scenario import Scenario, SheetScenario, StepReport

SIDE = 0.5  # [m]
EASY_SCALE = 1.1


@dataclass(frozen=True)
class StretchSquare(SheetScenario):
    """A square pulled to another rectangle, projected back (nobody; the least there is).

    One projection and nothing else: no pins, no material, no time. Each step projects the same
    candidate again.

    Parameters
    ----------
    scale_x, scale_y : the candidate's sides over the square's.
    compression : largest compression allowed in the sampled directions; 0.1, or 10%, is a least
        stretch of 0.9. 1, the default, is none; below it the projection is not convex.
    """

    name = "stretch-square"
    needs = frozenset()

    scale_x: float = 2.0
    scale_y: float = 0.5
    compression: float = 1.0

    def __post_init__(self) -> None:
        super().__post_init__()
        for key in ("scale_x", "scale_y"):
            if not 0 < getattr(self, key) < float("inf"):
                raise ValueError(f"{key} is {getattr(self, key)}: a number above 0 is valid")

        if not 0 <= self.compression <= 1:
            raise ValueError(
                f"compression is {self.compression}: a strain between 0 and 1 is valid, 0.1 or 10%"
            )
        if self.compression < 1 and self.directions == "exact":
            raise ValueError("compression: exact limits have none; sampled directions do")

    def easier(self) -> Scenario | None:
        """See the base class: pulled by a tenth."""
        return replace(self, scale_x=EASY_SCALE) if self.scale_x > EASY_SCALE else super().easier()

    def problem(self) -> Problem:
        """See the base class; with the least stretch where compression is limited."""
        problem = super().problem()
        if self.compression == 1:
            return problem
        limits = self.limits()
        lower = np.full(len(limits.directions), 1 - self.compression)
        return replace(problem, limits=replace(limits, lower=lower))

    def sheet(self) -> tuple[FloatArray, IntArray, FloatArray, IntArray]:
        """See the base class; the positions are the candidate."""
        rest, elements = square_grid(self.resolution, SIDE, "alternating")
        positions = np.column_stack([rest * [self.scale_x, self.scale_y], np.zeros(len(rest))])
        return rest, elements, positions, np.array([], dtype=np.int64)

    def play(self, project: Callable[[FloatArray], FloatArray]) -> Iterator[StepReport]:
        """The same projection in every step."""
        candidate = self.sheet()[2]
        while True:
            project(candidate)
            yield StepReport()
