"""A sheet dropped on a spike, which a single vertex or a few meet (nobody)."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from strainbench.arrays import FloatArray, IntArray
from strainbench.physics.energies.contact import Contact, Rod
from strainbench.problem.grid import square_grid
from strainbench.scenario.cloth import ClothScenario
from strainbench.scenario.scenario import Scenario

SIDE, GAP = 0.5, 0.01  # [m]
RADIUS = 0.1  # [m] at severity 0
EASY = 0.1


@dataclass(frozen=True)
class Spike(ClothScenario):
    """A sheet dropped on a spike, which a single vertex or a few meet (nobody).

    It starts at rest, horizontal, centred 1 cm above the margin of an upright rod, whose radius is
    10 cm / 10^severity. One thinner than a cell stops the vertex in the middle alone, while all
    others fall on. Projected in steps of 1/200 s it is impaled, of 1/500 s not (newton-ipm).

    Parameters
    ----------
    severity : 1, or 0.1 for the easier neighbour.
    stiffness : of the penalty, see `Contact` [N/m].
    margin : the distance at which the penalty begins [m].
    """

    name = "spike"
    needs = frozenset({"inertia", "gravity", "membrane", "bending", "contact"})
    begins = float(np.sqrt(2 * GAP / 9.81))
    lasts = 0.2

    resolution: int = 10
    norm: str = "mass"
    step: float = 1 / 500
    severity: float = 1.0
    stiffness: float = 1000.0
    margin: float = 5e-3

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0 <= self.severity < float("inf"):
            raise ValueError(f"severity is {self.severity}: a number from 0 on is valid")
        self.contact()

    def easier(self) -> Scenario | None:
        """See the base class."""
        return replace(self, severity=EASY) if self.severity > EASY else super().easier()

    def contact(self) -> Contact:
        """The spike."""
        radius = RADIUS * 10**-self.severity
        rod = Rod((SIDE / 2, -radius - self.margin - GAP, SIDE / 2), radius)
        return Contact(self.stiffness, self.margin, (rod,))

    def sheet(self) -> tuple[FloatArray, IntArray, FloatArray, IntArray]:
        """See the base class."""
        rest, elements = square_grid(self.resolution, SIDE, "alternating")
        positions = np.column_stack([rest[:, 0], np.zeros(len(rest)), rest[:, 1]])
        return rest, elements, positions, np.array([], dtype=np.int64)
