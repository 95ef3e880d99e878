"""A square pulled to another rectangle, projected back (nobody; the least there is)."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from strainbench.limits import FloatArray
from strainbench.mesh import square_grid
from strainbench.problem import IntArray
from strainbench.scenario import SheetScenario, StepReport

SIDE = 0.5  # [m]


@dataclass(frozen=True)
class StretchSquare(SheetScenario):
    """A square pulled to another rectangle, projected back (nobody; the least there is).

    One projection and nothing else: no pins, no material, no time. Each step projects the same
    candidate again.

    Parameters
    ----------
    scale_x, scale_y : the candidate's sides over the square's.
    """

    name = "stretch-square"
    needs = frozenset()

    scale_x: float = 2.0
    scale_y: float = 0.5

    def __post_init__(self) -> None:
        super().__post_init__()
        for key in ("scale_x", "scale_y"):
            if not 0 < getattr(self, key) < float("inf"):
                raise ValueError(f"{key} is {getattr(self, key)}: a number above 0 is valid")

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
