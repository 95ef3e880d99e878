"""Regular meshes for the scenes: triangles, and tetrahedra."""

from __future__ import annotations

import numpy as np

from strainbench.arrays import FloatArray, IntArray
from strainbench.problem.elements import shape_gradients


def square_grid(resolution: int, side: float, diagonals: str) -> tuple[FloatArray, IntArray]:
    """A square of `resolution` x `resolution` cells, two triangles a cell.

    Parameters
    ----------
    resolution : cells a side; vertex i (resolution + 1) + j lies at (i, j) cells.
    side : length of a side [m].
    diagonals : "alternating" (a checkerboard of both) or "uniform" (all alike).

    Returns
    -------
    rest : (n, 2) [m]
    elements : (2 resolution^2, 3), all turning the same way
    """
    ticks = np.linspace(0.0, side, resolution + 1)
    rest = np.stack(np.meshgrid(ticks, ticks, indexing="ij"), axis=-1).reshape(-1, 2)
    i, j = (a.ravel() for a in np.meshgrid(*2 * [np.arange(resolution)], indexing="ij"))
    v00 = i * (resolution + 1) + j
    v10, v01, v11 = v00 + resolution + 1, v00 + 1, v00 + resolution + 2
    rising = np.stack([v00, v10, v11, v00, v11, v01], axis=1)
    falling = np.stack([v00, v10, v01, v10, v11, v01], axis=1)
    turn = (i + j) % 2 == 1 if diagonals == "alternating" else np.zeros(len(i), dtype=bool)
    elements = np.where(turn[:, None], falling, rising).reshape(-1, 3)
    return rest, elements


def lumped_areas(rest: FloatArray, elements: IntArray) -> FloatArray:
    """(n,) [m^2]: a third of each triangle's rest area (e, 3) at each of its vertices."""
    areas = np.zeros(len(rest))
    np.add.at(areas, elements, shape_gradients(rest, elements)[1][:, None] / 3)
    return areas


CORNERS = np.array(list(np.ndindex(2, 2, 2)))
CUBE = ((0, 6, 5, 3), (4, 0, 5, 6), (2, 0, 6, 3), (1, 0, 3, 5), (7, 3, 6, 5))
"""Five tetrahedra of a cube by the numbers of its corners, the inner one first; mirrored in the
cubes with an even sum of indices."""


def box_grid(cells: tuple[int, int, int], size: FloatArray) -> tuple[FloatArray, IntArray]:
    """A box of `cells` cubes along each axis, five tetrahedra each, neighbours mirrored.

    Parameters
    ----------
    size : (3,) lengths of its sides [m], from the origin on

    Returns
    -------
    rest : (n, 3) [m]
    elements : (5 cells, 4), all of positive volume
    """
    ticks = [np.linspace(0.0, side, count + 1) for side, count in zip(size, cells, strict=True)]
    rest = np.stack(np.meshgrid(*ticks, indexing="ij"), axis=-1).reshape(-1, 3)
    cubes = np.array(list(np.ndindex(cells)))
    even = cubes.sum(axis=1) % 2 == 0
    mirrored = np.where(even[:, None, None], [1, 0, 0] - CORNERS * [1, -1, -1], CORNERS)
    corners = cubes[:, None] + mirrored
    number = np.ravel_multi_index(tuple(np.moveaxis(corners, -1, 0)), [c + 1 for c in cells])
    elements = number[:, CUBE].reshape(-1, 4)
    volumes = np.linalg.det(rest[elements[:, 1:]] - rest[elements[:, :1]])
    elements[volumes < 0] = elements[volumes < 0][:, [0, 2, 1, 3]]
    return rest, elements


EDGES = ((0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3))
EIGHTH = (
    *((0, 4, 5, 6), (4, 1, 7, 8), (5, 7, 2, 9), (6, 8, 9, 3)),
    *((4, 5, 6, 8), (4, 5, 8, 7), (5, 6, 8, 9), (5, 7, 9, 8)),
)
"""A tetrahedron's eighths, by its corners 0 to 3 and the middles 4 to 9 of its edges."""


def halved(rest: FloatArray, elements: IntArray) -> tuple[FloatArray, IntArray]:
    """Each tetrahedron (e, 4) cut into eight at the middles of its edges; shapes stay."""
    edges = np.sort(elements[:, EDGES].reshape(-1, 2), axis=1)
    ends, number = np.unique(edges, axis=0, return_inverse=True)
    nodes = np.concatenate([elements, len(rest) + number.reshape(-1, 6)], axis=1)
    finer = nodes[:, EIGHTH].reshape(-1, 4)
    rest = np.concatenate([rest, rest[ends].mean(axis=1)])
    volumes = np.linalg.det(rest[finer[:, 1:]] - rest[finer[:, :1]])
    finer[volumes < 0] = finer[volumes < 0][:, [0, 2, 1, 3]]
    return rest, finer
