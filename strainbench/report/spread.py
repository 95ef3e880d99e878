"""How sure a ratio of times is: intervals from repeats."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from strainbench.arrays import FloatArray

FEWEST = 3
"""Repeats on each side from which on there is an interval."""
SAMPLES, SHARE, SEED = 2000, 0.95, 2022
PARTS = 20  # of the samples, one after the other, to spare memory
Times = Sequence[Sequence[float]]
"""Seconds of each projection, as often as it was measured."""


def rounds(times: Times) -> FloatArray:
    """(projections, rounds) seconds, of the rounds that every projection has."""
    count = min(map(len, times), default=0)
    return np.array([each[:count] for each in times]).reshape(len(times), count)


def interval(before: Times, after: Times) -> tuple[float, float] | None:
    """Between which the ratio of mean seconds, after over before, lies with 95%, or None.

    A bootstrap: rounds are drawn again with replacement, all projections of a round together, as
    what disturbs a machine lasts longer than one of them.
    """
    sides = [rounds(times) for times in (before, after)]
    if any(side.shape[1] < FEWEST or not side.size for side in sides):
        return None
    generator = np.random.default_rng(SEED)
    a, b = (_resampled(side, generator) for side in sides)
    low, high = np.quantile(b / a, [(1 - SHARE) / 2, (1 + SHARE) / 2])
    return float(low), float(high)


def _resampled(times: FloatArray, generator: np.random.Generator) -> FloatArray:
    """(SAMPLES,) means over projections of the medians over rounds drawn."""
    count = times.shape[1]
    drawn = generator.integers(count, size=(SAMPLES, count))
    parts = np.array_split(drawn, PARTS)
    return np.concatenate([np.median(times[:, part], axis=2).mean(axis=0) for part in parts])


def repeated(steps: Sequence[Mapping[str, str]]) -> dict[str, list[list[float]]]:
    """By cell, the seconds of its projections, of those that were repeated."""
    found: dict[str, list[list[float]]] = {}
    for step in steps:
        if step["seconds_each"]:
            seconds = [float(word) for word in step["seconds_each"].split()]
            found.setdefault(step["cell"], []).append(seconds)
    return found
