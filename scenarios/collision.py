"""A sheet that swings against a sphere (Tang et al. 2022, Fig. 6)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from strainbench.arrays import FloatArray, IntArray
from strainbench.physics.energies.contact import Contact, Floor, Sphere
from strainbench.problem.grid import square_grid
from strainbench.scenario.cloth import ClothScenario

SIDE = 0.5  # [m]
SPHERE = Sphere((0.25, -0.15, 0.30), 0.1)


@dataclass(frozen=True)
class Collision(ClothScenario):
    """A sheet that swings against a sphere (Tang et al. 2022, Fig. 6).

    It starts at rest in the horizontal xz-plane with two adjacent corners pinned, as the swing,
    and meets the sphere on its way down. The paper gives neither the sphere nor the penalty: both
    were chosen in experiments, where k = 10 N/m and 1/200 s left millimetres of penetration. The
    projection may undo what the penalty did, so a stiffer one hardly helps; at 1/60 s it fails.

    Parameters
    ----------
    stiffness : of the penalty, see `Contact` [N/m].
    margin : the distance at which the penalty begins [m].
    floor : height of a floor [m], or None.
    """

    name = "collision"
    needs = frozenset({"inertia", "gravity", "membrane", "bending", "contact"})
    begins = 0.095  # measured at 6, 10 and 20 cells
    lasts = 0.3

    limit: float = 0.001
    norm: str = "mass"
    step: float = 1 / 200
    stiffness: float = 10.0
    margin: float = 5e-3
    floor: float | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        self.contact()

    def contact(self) -> Contact:
        """The sphere, and the floor if there is one."""
        floors = () if self.floor is None else (Floor(self.floor),)
        return Contact(self.stiffness, self.margin, (SPHERE, *floors))

    def sheet(self) -> tuple[FloatArray, IntArray, FloatArray, IntArray]:
        """See the base class."""
        rest, elements = square_grid(self.resolution, SIDE, "alternating")
        positions = np.column_stack([rest[:, 0], np.zeros(len(rest)), rest[:, 1]])
        pinned = np.array([0, self.resolution * (self.resolution + 1)])
        return rest, elements, positions, pinned
