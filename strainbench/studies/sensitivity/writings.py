"""The same problem in other numbers: orders, rotations, translations, units of length."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from strainbench.arrays import FloatArray, IntArray
from strainbench.problem.draws import Random, rotation
from strainbench.problem.kinds import Limits
from strainbench.problem.limits import StretchLimits
from strainbench.problem.problem import Problem

AS_IT_IS = "as it is"
GROUPS = (AS_IT_IS, "orders", "rotations", "translations", "units")
UNITS = {"m": 1.0, "mm": 1000.0, "km": 0.001}
FARTHEST = 1000.0  # [m] of the translations, whose lengths grow evenly from 1 m in their logarithms


@dataclass(frozen=True, eq=False)
class Writing:
    """A problem in other numbers.

    Parameters
    ----------
    group : of GROUPS
    words : which of them it is
    back : from its positions (n, 3) to those of the problem as it is
    """

    group: str
    words: str
    problem: Problem
    back: Callable[[FloatArray], FloatArray]


def writings(problem: Problem, draws: int, seed: int) -> Iterator[Writing]:
    """So many of each group, in the groups' order; of units there are three.

    Raises
    ------
    ValueError
        Limits that differ by element and whose kind is not ours: they cannot be reordered.
    """
    rng = np.random.default_rng(seed)
    for k in range(draws):
        yield Writing(AS_IT_IS, str(k + 1), problem, lambda x: x)
    for k in range(draws):
        yield reordered(problem, rng, str(k + 1))
    for k in range(draws):
        yield rotated(problem, rng, str(k + 1))
    for distance in np.geomspace(1.0, FARTHEST, draws):
        yield moved(problem, rng, float(distance))
    for unit in UNITS:
        yield in_unit(problem, unit)


def count(draws: int) -> int:
    """How many writings there are."""
    return (len(GROUPS) - 1) * draws + len(UNITS)


def reordered(problem: Problem, rng: Random, words: str) -> Writing:
    """Vertices and elements in a random order."""
    order = rng.permutation(problem.vertices)
    elements = rng.permutation(len(problem.elements))
    place = np.argsort(order)  # of each vertex in the new order
    other = Problem(
        problem.rest[order if problem.rest.ndim == 2 else elements],
        place[problem.elements[elements]],
        problem.target[order],
        _reordered_limits(problem, elements),
        rng.permutation(place[problem.pinned]),
        None if problem.mass is None else problem.mass[order],
    )
    return Writing("orders", words, other, lambda x: x[place])


def _reordered_limits(problem: Problem, elements: IntArray) -> Limits:
    limits = problem.limits
    arrays = {"bounds": limits.bounds, "lower": limits.lower}
    by_element = {k: a[elements] for k, a in arrays.items() if a is not None and a.ndim == 2}
    if not by_element:
        return limits
    if not isinstance(limits, StretchLimits):
        raise ValueError(f"limits: {type(limits).__name__} by element cannot be put in an order")
    return replace(limits, **by_element)  # type: ignore[arg-type]


def rotated(problem: Problem, rng: Random, words: str) -> Writing:
    """Turned in space about the origin."""
    turn = rotation(rng)
    return Writing(
        "rotations", words, problem.with_target(problem.target @ turn.T), lambda x: x @ turn
    )


def moved(problem: Problem, rng: Random, distance: float) -> Writing:
    """So many metres away, in a random direction."""
    way = rng.normal(size=3)
    way *= distance / np.linalg.norm(way)
    other = problem.with_target(problem.target + way)
    return Writing("translations", f"{distance:.3g} m", other, lambda x: x - way)


def in_unit(problem: Problem, unit: str) -> Writing:
    """Lengths in another unit; masses stay."""
    size = UNITS[unit]
    other = replace(problem, rest=size * problem.rest, target=size * problem.target)
    return Writing("units", unit, other, lambda x: x / size)
