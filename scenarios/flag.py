"""A flag in the wind (nobody; a load that grows with the area it meets)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from strainbench.arrays import FloatArray, IntArray
from strainbench.problem.grid import square_grid
from strainbench.scenario.cloth import ClothScenario

SIDE = 0.5  # [m]
HEADING = np.array([np.cos(0.2), 0.0, np.sin(0.2)])
"""Of the wind: 0.2 rad out of the flag's plane, in which it would press on nothing."""


@dataclass(frozen=True)
class Flag(ClothScenario):
    """A flag in the wind (nobody; a load that grows with the area it meets).

    A vertical square with one side pinned to a pole. The wind u pushes each triangle with
    c A ((u - v).n) n: its area A, its unit normal n, the mean velocity v of its vertices. It is an
    explicit force, taken at the start of a sub-step, and as weak as the drag that it stands for:
    c step / (mass per area) = 0.1 at the defaults, far below the 2 at which explicit drag blows up.

    No bending is built, which is wrong for the paper's material: Tang et al. use hinges in all
    cases, and at 10 cells they move this flag by 85 mm in 60 steps (`strainbench ledger flag`). But
    a hinge's angle has no derivative where a triangle collapses, which limits on stretch alone do
    not prevent: with hinges Newton's method fails on steps 31 and 38 at 20 cells and throws the
    flag away, without them on none. The flag is a load on limits, not a prediction of a fabric.

    Parameters
    ----------
    wind : its speed [m/s].
    drag : c [N s/m^3]; half the density of air times the speed is 3 at 5 m/s.
    """

    name = "flag"
    needs = frozenset({"inertia", "gravity", "membrane", "wind"})

    norm: str = "mass"
    step: float = 1 / 100
    wind: float = 5.0
    drag: float = 1.0

    def __post_init__(self) -> None:
        super().__post_init__()
        for key in ("wind", "drag"):
            if not 0 <= getattr(self, key) < float("inf"):
                raise ValueError(f"{key} is {getattr(self, key)}: a number of at least 0 is valid")

    def sheet(self) -> tuple[FloatArray, IntArray, FloatArray, IntArray]:
        """See the base class; the pole is x = 0."""
        rest, elements = square_grid(self.resolution, SIDE, "alternating")
        positions = np.column_stack([rest, np.zeros(len(rest))])
        return rest, elements, positions, np.arange(self.resolution + 1)

    def force(self, positions: FloatArray, velocities: FloatArray, time: float) -> FloatArray:  # noqa: ARG002
        """A third of each triangle's push at each of its vertices; with N = A n it is
        c (w.N) N / |N| for the relative wind w."""
        elements = self.sheet()[1]
        x0, x1, x2 = np.moveaxis(positions[elements], 1, 0)
        N = 0.5 * np.cross(x1 - x0, x2 - x0)
        area = np.linalg.norm(N, axis=1)
        relative = self.wind * HEADING - velocities[elements].mean(axis=1)
        along = self.drag * np.sum(relative * N, axis=1)
        push = np.divide(along, area, out=np.zeros_like(area), where=area > 0)[:, None] * N
        force = np.zeros_like(positions)
        np.add.at(force, elements, push[:, None] / 3)
        return force
