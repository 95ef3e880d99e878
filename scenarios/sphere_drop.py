"""A sheet dropped on a sphere above a floor (nobody; a scene without pins)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from strainbench.arrays import FloatArray, IntArray
from strainbench.physics.energies.contact import Contact, Floor, Sphere
from strainbench.problem.grid import square_grid
from strainbench.scenario.cloth import ClothScenario

SIDE = 0.5  # [m]
RADIUS = 0.1  # [m]
GAP = 0.01  # [m] that the sheet falls before it is in the margin
DEPTH = 0.3  # [m] of the floor below the sheet


@dataclass(frozen=True)
class SphereDrop(ClothScenario):
    """A sheet dropped on a sphere above a floor (nobody; a scene without pins).

    It starts at rest, horizontal, centred 1 cm above the margin of the sphere, drapes over it
    and reaches the floor with its corners. The stiffness was chosen on 80 steps of 10 cells with
    step-and-project: 10, 30, 100, 300 N/m leave 15.8, 9.1, 6.8, 6.1 mm of penetration.

    Parameters
    ----------
    stiffness : of the penalty, see `Contact` [N/m].
    margin : the distance at which the penalty begins [m].
    """

    name = "sphere-drop"
    needs = frozenset({"inertia", "gravity", "membrane", "bending", "contact"})
    begins = float(np.sqrt(2 * GAP / 9.81))
    lasts = 0.4  # the corners meet the floor at 0.25 s

    norm: str = "mass"
    step: float = 1 / 200
    stiffness: float = 100.0
    margin: float = 5e-3

    def __post_init__(self) -> None:
        super().__post_init__()
        self.contact()

    def contact(self) -> Contact:
        """The sphere and the floor."""
        sphere = Sphere((SIDE / 2, -RADIUS - self.margin - GAP, SIDE / 2), RADIUS)
        return Contact(self.stiffness, self.margin, (sphere, Floor(-DEPTH)))

    def sheet(self) -> tuple[FloatArray, IntArray, FloatArray, IntArray]:
        """See the base class."""
        rest, elements = square_grid(self.resolution, SIDE, "alternating")
        positions = np.column_stack([rest[:, 0], np.zeros(len(rest)), rest[:, 1]])
        return rest, elements, positions, np.array([], dtype=np.int64)
