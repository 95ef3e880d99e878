"""A square sheet that swings from two corners (Tang et al. 2022, section 5, Table 1)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from strainbench.arrays import FloatArray, IntArray
from strainbench.problem.grid import square_grid
from strainbench.scenario.cloth import ClothScenario

SIDE = 0.5  # [m]


@dataclass(frozen=True)
class Swing(ClothScenario):
    """A square sheet that swings from two corners (Tang et al. 2022, section 5, Table 1).

    It starts at rest in the horizontal xz-plane, with two adjacent corners pinned.

    Parameters
    ----------
    diagonals : "alternating" or "uniform".
    offset : angle by which the sampled directions are turned [degrees].
    """

    name = "swing"
    needs = frozenset({"inertia", "gravity", "membrane", "bending"})

    diagonals: str = "alternating"
    offset: float = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.diagonals not in ("alternating", "uniform"):
            raise ValueError(f"diagonals is {self.diagonals!r}: valid are alternating, uniform")
        if not np.isfinite(self.offset) or (self.offset and self.directions == "exact"):
            valid = "an angle, or 0 with exact directions, is valid"
            raise ValueError(f"offset is {self.offset:g}: {valid}")

    def sampled_angles(self) -> FloatArray:
        """See the base class; turned by the offset."""
        angles: FloatArray = super().sampled_angles() + np.deg2rad(self.offset)
        return angles

    def sheet(self) -> tuple[FloatArray, IntArray, FloatArray, IntArray]:
        """See the base class."""
        rest, elements = square_grid(self.resolution, SIDE, self.diagonals)
        positions = np.column_stack([rest[:, 0], np.zeros(len(rest)), rest[:, 1]])
        pinned = np.array([0, self.resolution * (self.resolution + 1)])
        return rest, elements, positions, pinned
