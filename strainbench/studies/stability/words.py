"""The boundary of a map in words, always between two cells that were run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import groupby, pairwise

from strainbench.studies.stability.axis import Axis
from strainbench.studies.stability.refine import Point


def boundary(x: Axis, y: Axis, holds: Mapping[Point, bool]) -> list[str]:
    """Sentences that say where along x a method holds, for the levels of y.

    Parameters
    ----------
    holds : of each point (index along x, along y) that is known, whether the method held there
    """
    lines = [
        (j, _line(x, [holds.get((i, j)) for i in range(len(x.words))])) for j in _levels(holds)
    ]
    sentences = []
    for said, group in groupby(lines, key=lambda line: line[1]):
        levels = [j for j, _ in group]
        span = y.shown[levels[0]] + (f" to {y.shown[levels[-1]]}" if len(levels) > 1 else "")
        where = "everywhere" if len(levels) == len(y.words) else f"at {y.key} {span}"
        sentences.append(f"{said} {where}")
    return sentences


def _levels(holds: Mapping[Point, bool]) -> list[int]:
    return sorted({j for _, j in holds})


def _line(x: Axis, held: Sequence[bool | None]) -> str:
    """One line of a map: where it changes, or that it does not, or that it does more than once."""
    known = [(i, h) for i, h in enumerate(held) if h is not None]
    changes = [(i, j) for (i, a), (j, b) in pairwise(known) if a != b]
    name, at = x.key, x.shown
    if not changes:
        run = "" if len(known) == len(held) else " run"
        return f"{'holds' if known[0][1] else 'fails'} at every {name}{run}"
    if len(changes) > 1:
        return f"irregular between {name} {at[changes[0][0]]} and {at[changes[-1][1]]}"
    below, above = changes[0]
    if held[above]:
        return f"holds from {name} {at[above]} on (fails at {at[below]})"
    return f"holds up to {name} {at[below]} (fails at {at[above]})"
