"""A garment from a mesh file, hung by its highest vertices (ours)."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from strainbench.arrays import FloatArray, IntArray
from strainbench.scenario.cloth import ClothScenario
from strainbench.scenario.meshcheck import (
    level_openings,
    odd_edges,
    parts,
    pattern_stretches,
    unsewn,
)
from strainbench.scenario.meshfile import MeshFile, flattened, read_mesh

DATA = Path(__file__).parent / "data"
WAIST, HEM, SLANT = 0.10, 0.25, 0.40
"""Radii and slant height of the skirt [m]: a small A-line skirt, made up."""
RESTS = ("auto", "texture", "flattened")
TURNS = {
    "y": np.eye(3),
    "z": np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]]),
    "x": np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]]),
}
"""The rotation that takes each up axis to y."""
PATTERN, CLOSE = 1.25, 1.05
"""A pattern's lengths over those in space lie between 1/1.25 and 1.25 but for 5% of the area, as
no drape of cloth reaches that; outside 1/1.05 to 1.05, which a body's fit may reach, it is said.
Both are chosen by us: an atlas unwrapped with little distortion, in metres, is a pattern."""


@dataclass(frozen=True)
class Garment(ClothScenario):
    """A garment from a mesh file, hung by its highest vertices (ours).

    Without a file it is a skirt: a cone, cut from a sector of a ring and sewn along one seam,
    4 `resolution` cells around and `resolution` down. With one, `resolution` has no meaning.
    Each triangle's rest shape is its texture coordinates where the file has them (OBJ only), as
    pattern pieces in the unit of the positions; seams need nothing else. Otherwise it is the
    triangle as it lies in space, its first material axis horizontal. Hinges are flat at rest.
    A texture whose triangles have other shapes than those in space is an atlas, no pattern, and
    refused: where lengths on more than 5% of the area differ by more than a factor of 1.25.

    Parameters
    ----------
    path : a file that meshio reads (OBJ, PLY, STL, VTK ...), or a name in scenarios/data; "" is
        the skirt; "~" is the home folder.
    scale : length of the file's unit [m]; the skirt is in metres.
    up : the file's axis that points up, "x", "y" or "z"; "auto" is y, and says so where it looks
        like z.
    rest : "texture" whatever its shapes, "flattened", or "auto": texture where there is one.
    pin_fraction : the vertices in the highest such part of the height are pinned; 0 pins the
        highest alone.
    """

    name = "garment"
    needs = frozenset({"inertia", "gravity", "membrane", "bending"})

    norm: str = "mass"
    path: str = ""
    scale: float = 1.0
    up: str = "auto"
    rest: str = "auto"
    pin_fraction: float = 0.01

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0 < self.scale < float("inf"):
            raise ValueError(f"scale is {self.scale}: a number above 0 is valid")
        if self.up not in ("auto", *TURNS):
            raise ValueError(f"up is {self.up!r}: valid are auto, x, y, z")
        if self.rest not in RESTS:
            raise ValueError(f"rest is {self.rest!r}: valid are {', '.join(RESTS)}")
        if not 0 <= self.pin_fraction < 1:
            raise ValueError(
                f"pin_fraction is {self.pin_fraction}: a number from 0 to below 1 is valid"
            )
        object.__setattr__(self, "path", os.path.expanduser(self.path))
        if self.path:
            self.pattern()  # a bad file is named before anything runs

    @cached_property
    def _mesh(self) -> MeshFile:
        if not self.path:
            return skirt(self.resolution)
        file = Path(self.path)
        found = file if file.exists() or not (DATA / file).exists() else DATA / file
        mesh = read_mesh(found, texture=self.rest != "flattened")
        turn = TURNS["y" if self.up == "auto" else self.up]
        return replace(mesh, positions=mesh.positions @ turn.T)

    def pattern(self) -> FloatArray:
        """(e, 3, 2) rest positions of each triangle's corners [m]."""
        mesh = self._mesh
        flat = flattened(mesh.positions, mesh.elements)
        if self.rest == "flattened" or (self.rest == "auto" and mesh.texture is None):
            return self.scale * flat
        if mesh.texture is None:
            raise ValueError(f"rest is 'texture', but {self.path} has no texture coordinates")
        if self.rest == "auto" and (odd := self._off_pattern(PATTERN)):
            raise ValueError(
                f"{self.path}: {odd}, so it is no pattern in the unit of the positions; "
                "rest=flattened does without, rest=texture takes it"
            )
        return self.scale * mesh.texture

    def _off_pattern(self, factor: float) -> str:
        """How lengths on the texture differ, if by more than `factor` on over 5% of the area."""
        mesh = self._mesh
        assert mesh.texture is not None
        flat = flattened(mesh.positions, mesh.elements)
        ratios, areas = pattern_stretches(flat, mesh.texture), doubled_areas(flat)
        off = ((ratios > factor) | (ratios < 1 / factor)).any(axis=1)
        if areas[off].sum() <= 0.05 * areas.sum():
            return ""
        least, most = ratios[off].min(), ratios[off].max()
        return f"lengths on the texture are {least:.3g} to {most:.3g} times those in space"

    def notes(self) -> list[str]:
        """What is odd about the file; see the base class."""
        if not self.path:
            return []
        mesh, pins = self._mesh, self.sheet()[3]
        said = list(mesh.notes)
        if self.up == "auto" and level_openings(mesh.positions, mesh.elements) == "z":
            said.append("z looks like its up axis, and y is taken; up=z takes z, up=y says y")
        count, loose = parts(mesh.elements, pins)
        if loose:
            said.append(f"{loose} of its {count} parts have no pin and fall")
        if len(pins) == len(mesh.positions):
            said.append("all its vertices are pinned: nothing moves")
        if twins := unsewn(mesh.positions):
            said.append(f"{twins} vertices lie on others: the cloth is not joined there")
        if edges := odd_edges(mesh.elements):
            said.append(f"{edges} edges belong to more than two triangles, and bend by pairs")
        if (
            mesh.texture is not None
            and self.rest != "flattened"
            and (odd := self._off_pattern(CLOSE))
        ):
            said.append(f"{odd}; the texture is its rest shape")
        return [f"{self.path}: {note}" for note in said]

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
        next(replace(self, path="", rest="auto", up="auto", scale=1.0, resolution=2).play(project))


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
