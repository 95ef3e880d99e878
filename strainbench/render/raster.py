"""Which triangle is seen at each pixel: a depth buffer, exact where surfaces cut each other."""

from __future__ import annotations

from math import ceil, floor

import numpy as np
from numpy.typing import NDArray

from strainbench.arrays import FloatArray, IntArray
from strainbench.compiled import compiled

INSIDE = -1e-9  # of a triangle: rounding leaves no holes along shared edges


def nearest(
    points: FloatArray, faces: IntArray, size: tuple[int, int]
) -> tuple[IntArray, FloatArray, FloatArray]:
    """The nearest triangle at each of `size` (width, height) pixels.

    Parameters
    ----------
    points : (v, 3) pixels to the right of the left edge and below the upper one, and depth,
        growing towards the viewer
    faces : (f, 3) vertex indices; triangles seen edge-on are not seen

    Returns
    -------
    face : (h, w) the triangle that the pixel's middle sees, -1 where there is none
    weights : (h, w, 3) the barycentric coordinates of the point that is seen
    depth : (h, w) of that point, -1e300 where there is none
    """
    width, height = size
    face = np.full((height, width), -1, dtype=np.int64)
    weights, depth = np.zeros((height, width, 3)), np.full((height, width), -1e300)
    _fill(points, faces, face, weights, depth)
    return face, weights, depth


@compiled
def _fill(
    points: NDArray[np.float64],
    faces: NDArray[np.int64],
    face: NDArray[np.int64],
    weights: NDArray[np.float64],
    depth: NDArray[np.float64],
) -> None:
    """Fill the arrays of `nearest`, triangle by triangle."""
    height, width = depth.shape
    for f in range(len(faces)):
        (x0, y0, z0), (x1, y1, z1), (x2, y2, z2) = points[faces[f]]
        doubled = (x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)
        if doubled == 0:
            continue
        first, last = ceil(min(x0, x1, x2) - 0.5), floor(max(x0, x1, x2) - 0.5)
        upper, lower = ceil(min(y0, y1, y2) - 0.5), floor(max(y0, y1, y2) - 0.5)
        for row in range(max(0, upper), min(height, lower + 1)):
            for column in range(max(0, first), min(width, last + 1)):
                x, y = column + 0.5 - x0, row + 0.5 - y0
                b = (x * (y2 - y0) - (x2 - x0) * y) / doubled
                c = ((x1 - x0) * y - x * (y1 - y0)) / doubled
                a = 1 - b - c
                z = a * z0 + b * z1 + c * z2
                if min(a, b, c) >= INSIDE and z > depth[row, column]:
                    face[row, column], depth[row, column] = f, z
                    weights[row, column, 0] = a
                    weights[row, column, 1] = b
                    weights[row, column, 2] = c
