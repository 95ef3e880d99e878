"""Add an energy: `strainbench run examples/add_an_energy.py --solver none` finds the scene below.

A sheet lies on a bed of springs, one under each vertex (Winkler 1867). They store
1/2 sum k_i y_i^2, and where k_i = m_i w^2, the sheet comes to rest at a depth of g / w^2,
whatever its mesh.
"""

from dataclasses import dataclass, replace
from itertools import islice

import numpy as np

from strainbench import Blocks, Cloth, ClothScenario, Energy, FloatArray, IntArray, square_grid


@dataclass(frozen=True, eq=False)
class Bed(Energy):
    """Springs that pull vertices to y = 0."""

    name = "bed"
    elements: IntArray  # (n, 1): the energy of each vertex depends on no other
    stiffness: FloatArray  # k (n,) [N/m]

    def add_gradient(self, x: FloatArray, out: FloatArray) -> float:
        """Add k y, upwards; return the energy."""
        force = self.stiffness * x[:, 1]
        out[:, 1] += force
        return 0.5 * float(force @ x[:, 1])

    def add_hessian(self, x: FloatArray, blocks: Blocks, clamp: bool) -> None:
        """Add k q q^T with q upwards: one value and one mode a vertex, none of them negative."""
        blocks.add(self.stiffness[:, None], np.tile([[0.0, 1.0, 0.0]], (len(x), 1, 1)))


@dataclass(frozen=True)
class Lying(ClothScenario):
    """A sheet on a bed of springs (ours)."""

    name = "lying"
    needs = frozenset({"inertia", "gravity", "membrane", "bending"})
    rate: float = 10.0  # w [1/s]

    def sheet(self) -> tuple[FloatArray, IntArray, FloatArray, IntArray]:
        """Rest positions (n, 2), triangles (e, 3), initial positions (n, 3), pins (p,)."""
        rest, elements = square_grid(self.resolution, 0.5, "alternating")
        return rest, elements, np.insert(rest, 1, 0.0, axis=1), np.array([], dtype=np.int64)

    def cloth(self) -> Cloth:
        """The sheet's own energies, and the bed."""
        cloth = super().cloth()
        vertices = np.arange(len(cloth.mass))[:, None]
        return replace(cloth, more=(Bed(vertices, self.rate**2 * cloth.mass),))


def main(steps: int = 20) -> float:
    """How deep the sheet lies in the end [m], on average, from its weight's potential."""
    scene = Lying(resolution=4, step=1.0)
    *_, last = islice(scene.play(lambda x: x), steps)
    return -last.gravity_energy / (9.81 * float(scene.mass().sum()))


if __name__ == "__main__":
    print(f"a sheet on springs of 10 rad/s sinks in by {main():.6f} m")
