"""A sheet of 3D-printed chainmail that swings from two corners (Tang et al. 2022, Fig. 1)."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from strainbench.arrays import FloatArray, IntArray
from strainbench.problem.grid import square_grid
from strainbench.problem.limits import StretchLimits
from strainbench.scenario.cloth import ClothScenario

SIDE = 0.5  # [m]

PATTERNS: dict[str, Callable[[FloatArray], FloatArray]] = {
    "rows": lambda angle: 0.2 + 0.8 * np.sin(angle) ** 2,
    "hexagonal": lambda angle: 0.4 + 0.6 * np.cos(3 * angle) ** 2,
}
"""Largest strain in a material direction [rad], as a fraction of the largest over all directions.

Illustrative: the paper measured two printed patterns and shows the curves, but not as numbers.
"rows" has links in straight rows, tight along them (0 degrees) and loose across; "hexagonal" has
links with six neighbours, loose along three axes and tight between them.
"""


@dataclass(frozen=True)
class Chainmail(ClothScenario):
    """A sheet of 3D-printed chainmail that swings from two corners (Tang et al. 2022, Fig. 1).

    Links slide freely until they lock, at a strain that depends on the direction: the limit is a
    curve. The soft part is the paper's membrane. No bending is built: the hinges of the paper's
    fabric would move the sheet by 26 mm in 60 steps at 10 cells (`strainbench ledger chainmail`),
    but loose links turn freely until they lock. Chainmail's bending is a limit, which the paper
    names as future work, not a stiffness; one of fabric would be made up.
    The two patterns' curves are illustrative (see `PATTERNS`): the measured ones are not published
    as numbers. Whoever has measured one gives it as a file.

    Parameters
    ----------
    limit : the largest strain over all directions; it scales the pattern's curve.
    directions : samples of the pattern's curve.
    pattern : "rows" or "hexagonal".
    curve_file : path of a measured curve, a CSV file with the columns angle_degrees and bound, or
        strain or percent instead of bound; "~" is the home folder. It is taken as it stands:
        `limit`, `directions` and `pattern` stay at their defaults.
    """

    name = "chainmail"
    needs = frozenset({"inertia", "gravity", "membrane"})
    omits = {"bending": "loose links turn freely"}

    limit: float = 0.25
    directions: int | str = 18
    norm: str = "mass"
    pattern: str = "rows"
    curve_file: str = ""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.pattern not in PATTERNS:
            valid = ", ".join(PATTERNS)
            raise ValueError(f"pattern is {self.pattern!r}: valid are {valid}")
        object.__setattr__(self, "curve_file", os.path.expanduser(self.curve_file))
        if not self.curve_file:
            self.sampled_angles()
            return
        if not Path(self.curve_file).is_file():
            raise ValueError(f"curve_file is {self.curve_file!r}: no such file")
        for key in ("limit", "directions", "pattern"):
            if getattr(self, key) != getattr(type(self), key):
                raise ValueError(
                    f"{key} is {getattr(self, key)}: a measured curve is taken as it stands, "
                    f"so set {key} or curve_file, not both"
                )
        self.limits()

    def curve(self) -> tuple[FloatArray, FloatArray]:
        """Angles [rad] and largest stretches of the underlying curve: samples of a measured one."""
        if self.curve_file:
            measured = self.limits()
            x, y = measured.directions.T
            return np.arctan2(y, x), measured.bounds
        angles = np.deg2rad(np.linspace(-90.0, 90.0, 361))
        return angles, 1 + self.limit * PATTERNS[self.pattern](angles)

    def limits(self) -> StretchLimits:
        """The curve at equally spaced angles in [-pi/2, pi/2), or a measured one."""
        if self.curve_file:
            return StretchLimits.from_csv(self.curve_file)
        angles = self.sampled_angles()
        return StretchLimits.sampled(angles, 1 + self.limit * PATTERNS[self.pattern](angles))

    def sheet(self) -> tuple[FloatArray, IntArray, FloatArray, IntArray]:
        """See the base class."""
        rest, elements = square_grid(self.resolution, SIDE, "alternating")
        positions = np.column_stack([rest[:, 0], np.zeros(len(rest)), rest[:, 1]])
        pinned = np.array([0, self.resolution * (self.resolution + 1)])
        return rest, elements, positions, pinned
