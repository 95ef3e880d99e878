"""Vertices kept off spheres, rods and floors by penalties (Tang et al. 2022, Fig. 6).

A vertex at the signed distance d below a margin d_0 stores 1/2 k (d_0 - d)^2. With the outward
normal n = grad(d), its gradient is -k (d_0 - d) n. Its Hessian is k n n^T - k (d_0 - d) grad(n); a
sphere's grad(n) = (1 - n n^T) / r has no negative eigenvalue, so k n n^T is the nearest positive
semidefinite matrix, all there is for a floor, and what is kept for a rod.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from strainbench.arrays import FloatArray, IntArray
from strainbench.physics.energies.energy import Energy
from strainbench.physics.pattern import Blocks

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
class Rod:
    """An upright rod at rest, its round end around `tip` (3,) [m], of `radius` [m]."""

    tip: tuple[float, float, float]
    radius: float

    def distances(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """See `Obstacle`: those of a ball as high as the point, up to the tip."""
        ball = Sphere((0, 0, 0), self.radius)
        offset = x - np.array(self.tip)
        offset[:, 1] = np.maximum(offset[:, 1], 0)
        return ball.distances(offset)


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

    def penalty(self, mass: FloatArray) -> Penalty:
        """The energy of vertices of these masses (n,)."""
        vertices = np.arange(len(mass))[:, None]
        return Penalty(vertices, self.stiffness * mass / mass.mean(), self.margin, self.obstacles)

    def touches(self, x: FloatArray) -> bool:
        """Whether a vertex lies within the margin of an obstacle, or inside one."""
        return any(bool(np.any(o.distances(x)[0] < self.margin)) for o in self.obstacles)

    def penetration(self, x: FloatArray) -> float:
        """How deep the deepest vertex lies inside an obstacle [m]; 0 if none does."""
        return max(float(np.max(-o.distances(x)[0], initial=0.0)) for o in self.obstacles)


@dataclass(frozen=True, eq=False)
class Penalty(Energy):
    """The energy of a `Contact`."""

    name = "contact"
    elements: IntArray  # (n, 1), the vertices
    k: FloatArray  # (n,) [N/m]
    margin: float
    obstacles: tuple[Obstacle, ...]

    def add_gradient(self, x: FloatArray, out: FloatArray) -> float:
        """See the base class."""
        energy = 0.0
        for obstacle in self.obstacles:
            d, normals = obstacle.distances(x)
            depth = np.maximum(0.0, self.margin - d)
            energy += 0.5 * float(np.sum(self.k * depth**2))
            out -= (self.k * depth)[:, None] * normals
        return energy

    def add_hessian(self, x: FloatArray, blocks: Blocks, clamp: bool) -> None:  # noqa: ARG002
        """See the base class; k n n^T always."""
        for obstacle in self.obstacles:
            d, normals = obstacle.distances(x)
            touching = np.where(d < self.margin, self.k, 0.0)
            blocks.add(touching[:, None], normals[:, None])
