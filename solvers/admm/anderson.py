"""Anderson acceleration of a fixed-point iteration (Zhang et al. 2019, Alg. 1)."""

from __future__ import annotations

import numpy as np

from strainbench.arrays import FloatArray


class Anderson:
    """Anderson acceleration that falls back on the plain step (Zhang et al. 2019, Alg. 1)."""

    def __init__(self, memory: int) -> None:
        self._memory = memory
        self._points: list[FloatArray] = []
        self._residuals: list[FloatArray] = []
        self._fallback: FloatArray | None = None

    def __call__(self, plain: FloatArray, step: FloatArray, weights: FloatArray) -> FloatArray:
        """The next point, from the end of the plain step (rows, 3) and the step itself."""
        if self._memory == 0:
            return plain
        residual = np.sqrt(weights)[:, None] * step
        residuals, points = self._residuals, self._points
        if self._fallback is not None and np.sum(residual**2) > np.sum(residuals[-1] ** 2):
            back, self._fallback = self._fallback, None  # the accelerated point was a worse one
            residuals.clear()
            points.clear()
            return back
        residuals.append(residual.ravel())
        points.append(plain.ravel())
        del residuals[: -self._memory - 1], points[: -self._memory - 1]
        if len(points) == 1:
            return plain
        self._fallback = plain
        steps = np.diff(residuals, axis=0)
        normal = steps @ steps.T
        normal[np.diag_indices_from(normal)] += 1e-12 * np.trace(normal)
        share = np.linalg.solve(normal, steps @ residuals[-1])
        return (points[-1] - share @ np.diff(points, axis=0)).reshape(plain.shape)
