"""Obstacles as grey surfaces among the faces of the cloth."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from strainbench.arrays import FloatArray, IntArray
from strainbench.physics.energies.contact import Floor, Obstacle, Rod, Sphere

TURNS = 96  # meridians of a sphere: within 0.05% of its radius
PIN_TURNS = 16
BEYOND = 0.15  # of the cloth's extent, by which a floor goes further than it


def patches(obstacles: Sequence[Obstacle], cloth: FloatArray) -> tuple[FloatArray, IntArray]:
    """Vertices (v, 3) [m] and triangles (t, 3) of the obstacles that have a known shape.

    Parameters
    ----------
    cloth : (n, 3) positions over all states [m]: a floor reaches a little beyond them, a rod down
        to the lowest
    """
    grids = [ball(np.array(o.centre), o.radius) for o in obstacles if isinstance(o, Sphere)]
    grids += [_rod(o, cloth) for o in obstacles if isinstance(o, Rod)]
    grids += [_tile(o, cloth) for o in obstacles if isinstance(o, Floor)]
    return together(grids)


def pin_heads(pins: FloatArray, radius: float) -> tuple[FloatArray, IntArray]:
    """Small balls at pinned points (p, 3), as vertices and triangles."""
    return together([ball(pin, radius, PIN_TURNS) for pin in pins])


def together(grids: Sequence[FloatArray]) -> tuple[FloatArray, IntArray]:
    """Vertices (v, 3) and triangles (t, 3) of grids of points (r, c, 3)."""
    vertices, faces = np.empty((0, 3)), np.empty((0, 3), dtype=np.int64)
    for points in grids:
        faces = np.concatenate([faces, _triangles(points) + len(vertices)])
        vertices = np.concatenate([vertices, points.reshape(-1, 3)])
    return vertices, faces


def ball(centre: FloatArray, radius: float, turns: int = TURNS) -> FloatArray:
    """(r, c, 3) points along meridians and parallels."""
    theta = np.linspace(0, np.pi, turns // 2 + 1)[:, None]
    phi = np.linspace(0, 2 * np.pi, turns + 1)
    height = np.broadcast_to(np.cos(theta), (len(theta), len(phi)))
    unit = np.stack([np.sin(theta) * np.sin(phi), height, np.sin(theta) * np.cos(phi)], axis=-1)
    return centre + radius * unit


def _rod(rod: Rod, cloth: FloatArray) -> FloatArray:
    """A ball whose lower half is drawn down to the lowest cloth."""
    points = ball(np.array(rod.tip), rod.radius, PIN_TURNS)
    points[points[..., 1] < rod.tip[1], 1] = min(cloth[:, 1].min(), rod.tip[1])
    return points


def _tile(floor: Floor, cloth: FloatArray) -> FloatArray:
    """(2, 2, 3) corners of a rectangle below the cloth."""
    low, high = cloth[:, [0, 2]].min(axis=0), cloth[:, [0, 2]].max(axis=0)
    beyond = BEYOND * (high - low).max()
    x, z = np.stack([low - beyond, high + beyond], axis=1)
    grid = np.meshgrid(z, x)
    return np.stack([grid[1], np.full_like(grid[0], floor.height), grid[0]], axis=-1)


def _triangles(points: FloatArray) -> IntArray:
    """(t, 3) two for each quadrangle of a grid of points (r, c, 3)."""
    number = np.arange(points[..., 0].size).reshape(points.shape[:2])
    a, b, c, d = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    return np.concatenate([np.stack(t, -1).reshape(-1, 3) for t in ((a, b, c), (a, c, d))])
