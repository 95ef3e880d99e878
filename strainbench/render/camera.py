"""From where a scene is seen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from strainbench.arrays import FloatArray


@dataclass(frozen=True)
class Camera:
    """An orthographic view at `azimuth` about the vertical y axis and `elevation` [degrees].

    Azimuth 0 looks along -z, 90 along -x.
    """

    azimuth: float = 30.0
    elevation: float = 32.0

    @property
    def axes(self) -> FloatArray:
        """(3, 3) rows: to the right, upwards, towards the viewer."""
        a, e = np.deg2rad([self.azimuth, self.elevation])
        right = np.array([np.cos(a), 0.0, -np.sin(a)])
        towards = np.array([np.sin(a) * np.cos(e), np.sin(e), np.cos(a) * np.cos(e)])
        return np.stack([right, np.cross(towards, right), towards])

    def view(self, positions: FloatArray) -> FloatArray:
        """(n, 3) right, up and depth [m], the depth growing towards the viewer."""
        seen: FloatArray = positions @ self.axes.T
        return seen


@dataclass(frozen=True)
class Window:
    """The part of the picture's plane that is drawn: its lower left corner and pixels.

    Parameters
    ----------
    corner : (right, up) [m]
    pixel : side of a pixel [m]
    size : width and height in pixels
    """

    corner: tuple[float, float]
    pixel: float
    size: tuple[int, int]

    @staticmethod
    def around(seen: Sequence[FloatArray], size: tuple[int, int], margin: float = 0.05) -> Window:
        """One that holds all of the points (n, 3) `seen`, and some more on each side."""
        low = np.min([points[:, :2].min(axis=0) for points in seen if len(points)], axis=0)
        high = np.max([points[:, :2].max(axis=0) for points in seen if len(points)], axis=0)
        extent = high - low + 2 * margin * (high - low).max()
        pixel = float(np.max(extent / size))
        left, bottom = (low + high - pixel * np.array(size)) / 2
        return Window((float(left), float(bottom)), pixel, size)

    @property
    def width(self) -> float:
        """[m]."""
        return self.pixel * self.size[0]

    @property
    def height(self) -> float:
        """[m]."""
        return self.pixel * self.size[1]

    def pixels(self, seen: FloatArray) -> FloatArray:
        """(n, 3) pixels from the left and from above, and depth in pixels, of points `seen`."""
        left, bottom = self.corner
        x, y = seen[:, 0] - left, bottom + self.height - seen[:, 1]
        return np.column_stack([x, y, seen[:, 2]]) / self.pixel
