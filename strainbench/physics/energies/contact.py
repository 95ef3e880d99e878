"""Vertices kept off a sphere or a floor by penalties (Tang et al. 2022, Fig. 6).

A vertex at the signed distance d below a margin d_0 stores 1/2 k (d_0 - d)^2. With the outward
normal n = grad(d), its gradient is -k (d_0 - d) n. Its Hessian is k n n^T - k (d_0 - d) grad(n); a
sphere's grad(n) = (1 - n n^T) / r has no negative eigenvalue, so k n n^T is the nearest positive
semidefinite matrix, and all there is for a floor.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from strainbench.arrays import FloatArray, IntArray

UP = np.array([0.0, 1.0, 0.0])


class Obstacle(Protocol):
    """What vertices are kept off."""

    def distances(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Signed distances (n,) of points x (n, 3) [m], negative inside, and normals (n, 3)."""
        ...


@dataclass(frozen=True)
class Sphere:
    """A ball at rest: `centre` (3,) [m], `radius` [m]."""

    centre: tuple[float, float, float]
    radius: float

    def distances(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """See `Obstacle`; the centre itself is pushed upwards."""
        offset = x - np.array(self.centre)
        r = np.linalg.norm(offset, axis=1)
        normals = np.divide(offset, r[:, None], out=np.tile(UP, (len(x), 1)), where=r[:, None] > 0)
        return r - self.radius, normals


@dataclass(frozen=True)
class Floor:
    """Everything below y = `height` [m]."""

    height: float

    def distances(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """See `Obstacle`."""
        return x[:, 1] - self.height, np.broadcast_to(UP, x.shape)


@dataclass(frozen=True)
class Contact:
    """Penalties against obstacles.

    Parameters
    ----------
    stiffness : k [N/m] of a vertex of mean mass; others in proportion to theirs, so that a stack
        of vertices sinks in equally deep everywhere.
    margin : d_0 [m], where the penalty starts.
    obstacles : what the vertices are kept off.
    """

    stiffness: float
    margin: float
    obstacles: tuple[Obstacle, ...]

    def __post_init__(self) -> None:
        for name in ("stiffness", "margin"):
            value = getattr(self, name)
            if not 0 < value < float("inf"):
                raise ValueError(f"{name} is {value}: a number above 0 is valid")

    def stiffnesses(self, mass: FloatArray) -> FloatArray:
        """(n,) k_i [N/m] of vertices of these masses (n,)."""
        k: FloatArray = self.stiffness * mass / mass.mean()
        return k

    def add_gradient(self, x: FloatArray, k: FloatArray, out: FloatArray) -> float:
        """Add the gradient (n, 3) [N] to `out`; return the energy [J]. `k` (n,) is [N/m]."""
        energy = 0.0
        for obstacle in self.obstacles:
            d, normals = obstacle.distances(x)
            depth = np.maximum(0.0, self.margin - d)
            energy += 0.5 * float(np.sum(k * depth**2))
            out -= (k * depth)[:, None] * normals
        return energy

    def hessian_blocks(self, x: FloatArray, k: FloatArray) -> FloatArray:
        """(n, 3, 3) positive semidefinite diagonal blocks of the Hessian [N/m]; no others."""
        blocks = np.zeros((len(x), 3, 3))
        for obstacle in self.obstacles:
            d, normals = obstacle.distances(x)
            touching = np.where(d < self.margin, k, 0.0)
            blocks += touching[:, None, None] * normals[:, :, None] * normals[:, None, :]
        return blocks

    def touches(self, x: FloatArray) -> bool:
        """Whether a vertex lies within the margin of an obstacle, or inside one."""
        return any(bool(np.any(o.distances(x)[0] < self.margin)) for o in self.obstacles)

    def penetration(self, x: FloatArray) -> float:
        """How deep the deepest vertex lies inside an obstacle [m]; 0 if none does."""
        return max(float(np.max(-o.distances(x)[0], initial=0.0)) for o in self.obstacles)


def add_blocks(
    blocks: FloatArray, free: IntArray, diagonal: IntArray, stride: IntArray, data: FloatArray
) -> None:
    """Add the blocks (n, 3, 3) of the free vertices to the values of a sparse matrix.

    `free`, `diagonal` and `stride` are those of the cloth's `Pattern`.
    """
    for c in range(3):
        for a in range(3):
            data[diagonal + c * stride[free] + a] += blocks[free, a, c]
