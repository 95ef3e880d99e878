"""A garment from a mesh file, hung by its highest vertices (ours)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from strainbench.limits import FloatArray
from strainbench.meshfile import MeshFile, flattened, read_mesh
from strainbench.problem import IntArray
from strainbench.scenario import ClothScenario

DATA = Path(__file__).parent / "data"
WAIST, HEM, SLANT = 0.10, 0.25, 0.40
"""Radii and slant height of the skirt [m]: a small A-line skirt, made up."""
RESTS = ("auto", "texture", "flattened")


@dataclass(frozen=True)
class Garment(ClothScenario):
    """A garment from a mesh file, hung by its highest vertices (ours).

    Without a file it is a skirt: a cone, cut from a sector of a ring and sewn along one seam,
    4 `resolution` cells around and `resolution` down. With one, `resolution` has no meaning.
    Each triangle's rest shape is its texture coordinates where the file has them (OBJ only), as
    pattern pieces in the unit of the positions; seams need nothing else. Otherwise it is the
    triangle as it lies in space, its first material axis horizontal. Hinges are flat at rest.

    Parameters
    ----------
    path : a file that meshio reads (OBJ, PLY, STL, VTK ...), or a name in scenarios/data; "" is
        the skirt.
    scale : length of the file's unit [m]; the skirt is in metres.
    rest : "texture", "flattened", or "auto": texture where there is one.
    pin_fraction : the vertices in the highest such part of the height are pinned; 0 pins the
        highest alone.
    """

    name = "garment"
    needs = frozenset({"inertia", "gravity", "membrane", "bending"})

    norm: str = "mass"
    path: str = ""
    scale: float = 1.0
    rest: str = "auto"
    pin_fraction: float = 0.01

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0 < self.scale < float("inf"):
            raise ValueError(f"scale is {self.scale}: a number above 0 is valid")
        if self.rest not in RESTS:
            raise ValueError(f"rest is {self.rest!r}: valid are {', '.join(RESTS)}")
        if not 0 <= self.pin_fraction < 1:
            raise ValueError(
                f"pin_fraction is {self.pin_fraction}: a number from 0 to below 1 is valid"
            )
        if self.path:
            self._mesh  # noqa: B018  # a bad file is named before anything runs

    @cached_property
    def _mesh(self) -> MeshFile:
        if not self.path:
            return skirt(self.resolution)
        file = Path(self.path)
        return read_mesh(file if file.exists() or not (DATA / file).exists() else DATA / file)

    def pattern(self) -> FloatArray:
        """(e, 3, 2) rest positions of each triangle's corners [m]."""
        mesh = self._mesh
        flat = self.scale * flattened(mesh.positions, mesh.elements)
        if self.rest == "flattened" or (self.rest == "auto" and mesh.texture is None):
            return flat
        if mesh.texture is None:
            raise ValueError(f"rest is 'texture', but {self.path} has no texture coordinates")
        pieces = self.scale * mesh.texture
        ratio = float(np.sqrt(doubled_areas(pieces).sum() / doubled_areas(flat).sum()))
        if not 0.5 < ratio < 2:
            raise ValueError(
                f"{self.path}: lengths on the texture are {ratio:.3g} times those in space, so it "
                f"is no pattern in the unit of the positions; rest=flattened does without"
            )
        return pieces

    def sheet(self) -> tuple[FloatArray, IntArray, FloatArray, IntArray]:
        """Rest positions (e, 3, 2), triangles (e, 3), initial positions (n, 3), pins (p,)."""
        mesh = self._mesh
        positions = self.scale * mesh.positions
        height = positions[:, 1]
        above = height.max() - max(self.pin_fraction, 1e-9) * np.ptp(height)
        return self.pattern(), mesh.elements, positions, np.flatnonzero(height >= above)

    def warm_up(self) -> None:
        """With the smallest skirt, whatever the mesh."""
        project: Callable[[FloatArray], FloatArray] = lambda target: target  # noqa: E731
        next(replace(self, path="", rest="auto", scale=1.0, resolution=2).play(project))


def doubled_areas(corners: FloatArray) -> FloatArray:
    """(e,) twice the areas of triangles (e, 3, 2) [m^2]."""
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    return np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])


def skirt(resolution: int) -> MeshFile:
    """A truncated cone of 4 `resolution` x `resolution` cells; its texture is its pattern [m].

    The pattern is the sector of a ring that the cone unrolls to. The flat triangles of the cone
    differ from those of the pattern a little: by less than 3e-5 in stretch at 4 cells down.
    """
    around = 4 * resolution
    i, j = (a.ravel() for a in np.meshgrid(np.arange(around), np.arange(resolution), indexing="ij"))
    right = np.stack([i, i + 1, i + 1, i], axis=1)
    down = np.stack([j, j, j + 1, j + 1], axis=1)
    turn = (i + j) % 2 == 1  # alternating diagonals
    split = np.where(turn[:, None], [0, 1, 3, 1, 2, 3], [0, 1, 2, 0, 2, 3])
    columns = np.take_along_axis(right, split, axis=1).reshape(-1, 3)
    rows = np.take_along_axis(down, split, axis=1).reshape(-1, 3)
    radius = WAIST + (HEM - WAIST) * rows / resolution
    slope = (HEM - WAIST) / SLANT
    angle = 2 * np.pi * slope * columns / around
    texture = (radius / slope)[..., None] * np.stack([np.sin(angle), -np.cos(angle)], axis=-1)
    k, ring = np.divmod(np.arange(around * (resolution + 1)), resolution + 1)
    radii = WAIST + (HEM - WAIST) * ring / resolution
    fall = np.sqrt(SLANT**2 - (HEM - WAIST) ** 2) * ring / resolution
    turn_angle = 2 * np.pi * k / around
    positions = np.column_stack([radii * np.sin(turn_angle), -fall, radii * np.cos(turn_angle)])
    return MeshFile(positions, columns % around * (resolution + 1) + rows, texture)
