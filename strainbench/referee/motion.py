"""How smooth a motion is, from nothing but its positions."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import pairwise

import numpy as np

from strainbench.arrays import FloatArray


@np.errstate(over="ignore", invalid="ignore")
def jitter(positions: Iterable[FloatArray]) -> float:
    """How much accelerations change in a step, over how large they are: root mean squares.

    Parameters
    ----------
    positions : (n, 3) each [m], after equal steps; four of them or more

    Returns
    -------
    0 for an even acceleration, 1.4 for accelerations that are independent from step to step, 2 for
    a motion to and fro at every step; NaN for fewer positions, or where none accelerates.

    Examples
    --------
    >>> jitter(np.full((1, 3), float(s**2)) for s in range(6))
    0.0
    >>> jitter(np.full((1, 3), (-1.0) ** s) for s in range(9))
    2.0
    """
    squares, changes, count = 0.0, 0.0, 0
    velocities = (after - before for before, after in pairwise(positions))
    accelerations = (after - before for before, after in pairwise(velocities))
    for before, after in pairwise(accelerations):
        if not count:
            squares += float(np.mean(before**2))
        squares += float(np.mean(after**2))
        changes += float(np.mean((after - before) ** 2))
        count += 1
    if not count or squares == 0:
        return float("nan")
    return float(np.sqrt((changes / count) / (squares / (count + 1))))
