"""Add a scene: `strainbench run examples/add_a_scene.py --solver clarabel` finds the class below.

A strip hangs from its upper edge, and nothing holds it but its limits. In each step gravity moves
it as if it were free, and a projection brings it back: position-based dynamics. It comes to rest
where it is as long as its limits let it be.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import islice

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import Delaunay

from strainbench import SheetScenario, StepReport, solve

LENGTH, STEP = 1.0, 1 / 60  # [m], [s]
Array = NDArray[np.float64]
Indices = NDArray[np.int64]


@dataclass(frozen=True)
class Strip(SheetScenario):
    """A strip that hangs by its limits alone (ours)."""

    name = "strip"
    needs = frozenset({"inertia", "gravity"})

    def sheet(self) -> tuple[Array, Indices, Array, Indices]:
        """Rest positions (n, 2), triangles (e, 3), initial positions (n, 3), pins (p,)."""
        down = np.linspace(0, LENGTH, self.resolution + 1)
        rest = np.stack(np.meshgrid([0, 1 / self.resolution], down), axis=-1).reshape(-1, 2)
        positions = np.column_stack([rest[:, 0], -rest[:, 1], np.zeros(len(rest))])
        return rest, Delaunay(rest).simplices, positions, np.array([0, 1])

    def play(self, project: Callable[[Array], Array]) -> Iterator[StepReport]:
        """Fall freely, project; the velocity is what the two together have moved."""
        x, v, k = self.problem().target, np.zeros(3), 0
        while True:
            candidate = x + STEP * v + STEP**2 * np.array([0, -9.81, 0])
            candidate[[0, 1]] = x[[0, 1]]
            x, v, k = (moved := project(candidate)), (moved - x) / STEP, k + 1
            yield StepReport(time=k * STEP)


def main(steps: int = 40) -> float:
    """How far below its pins the strip hangs in the end [m]."""
    scene, sheets = Strip(resolution=6, limit=0.1), []

    def project(target: Array) -> Array:
        sheets.append(solve(scene.problem().with_target(target), "newton-ipm", 1e-9).positions)
        return sheets[-1]

    list(islice(scene.play(project), steps))
    return float(-sheets[-1][:, 1].min())


if __name__ == "__main__":
    print(f"a strip of {LENGTH} m with a limit of 10% hangs {main():.6f} m down")
