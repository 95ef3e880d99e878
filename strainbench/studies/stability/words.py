"""The boundary of a map in words, always between two cells that were run."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import groupby, pairwise

from strainbench.studies.stability.axis import Axis
from strainbench.studies.stability.refine import Point

HOLDS, FAILS, LATE = "holds", "fails", "runs out of time"


def boundary(x: Axis, y: Axis, did: Mapping[Point, str]) -> list[str]:
    """Sentences that say where along x a method holds, for the levels of y.

    Parameters
    ----------
    did : of each point (index along x, along y) that is known, what the method did there: HOLDS,
        or a verb of how it failed
    """
    rows: dict[int, dict[int, str]] = {}
    for (i, j), verb in sorted(did.items()):
        rows.setdefault(j, {})[i] = verb
    lines = [(j, _line(x, rows[j])) for j in sorted(rows)]
    sentences = []
    for said, group in groupby(lines, key=lambda line: line[1]):
        levels = [j for j, _ in group]
        span = y.shown[levels[0]] + (f" to {y.shown[levels[-1]]}" if len(levels) > 1 else "")
        where = "everywhere" if len(levels) == len(y.words) else f"at {y.key} {span}"
        sentences.append(f"{said} {where}")
    return sentences


def _line(x: Axis, did: Mapping[int, str]) -> str:
    """One line of a map: where it changes, or that it does not, or that it does more than once."""
    changes = [(i, j) for i, j in pairwise(did) if (did[i] == HOLDS) != (did[j] == HOLDS)]
    name, at = x.key, x.shown
    if not changes:
        run = "" if len(did) == len(x.words) else " run"
        return f"{' or '.join(sorted(set(did.values())))} at every {name}{run}"
    if len(changes) > 1:
        return f"irregular between {name} {at[changes[0][0]]} and {at[changes[-1][1]]}"
    below, above = changes[0]
    if did[above] == HOLDS:
        return f"holds from {name} {at[above]} on ({did[below]} at {at[below]})"
    return f"holds up to {name} {at[below]} ({did[above]} at {at[above]})"
