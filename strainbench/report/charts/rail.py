"""The frame above a plane that names what failed, and why: it is no point of the plane."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from strainbench.report.charts.canvas import Plane
from strainbench.report.charts.target import Target
from strainbench.report.charts.text import Box, width, wrapped
from strainbench.report.measures import OUT_OF_TIME, VIOLATED
from strainbench.report.rows import Row

HEAD = "violates the limits (by), or out of time (steps done):"
GROUND, INK = "#FBEDEA", "#A8281B"
ROW = 1.35  # of a line, in its size


def why_failed(run: Row) -> str:
    """Why a cell does not count, beside its name."""
    if run["ending"] == VIOLATED:
        return str(run["why"]).removeprefix("violates ")
    if run["ending"] == OUT_OF_TIME:
        return f"{run['done']:.0f}/{run['steps_asked']:.0f} steps"
    return str(run["why"])


def rail_height(entries: Sequence[Mapping[str, Any]], head: str, target: Target) -> float:
    """Of rows that hold what failed, below a heading; 0 without any."""
    if not entries:
        return 0.0
    size, room = target.sizes.text, Plane.room(target) - target.sizes.text
    last = flow(entries, room, size)[-1]
    rows = last.row + len(last.lines) + len(wrapped(head, room, size))
    return rows * ROW * size + 0.8 * size


def draw_rail(plane: Plane, entries: Sequence[Mapping[str, Any]], head: str) -> None:
    """In the room that the plane keeps for it.

    Parameters
    ----------
    entries : with a `text`, and what `strainbench.report.charts.canvas.about` says of a method
    """
    if not entries:  # the room may be kept for those of a panel beside
        return
    size = plane.target.sizes.text
    plane.box_layer(Box(0, -plane.rail, plane.across, 0), GROUND)
    line, top = ROW * size, -plane.rail + 0.9 * size
    lines = wrapped(head, plane.across - size, size)
    said = [{"px": size / 2, "py": top + k * line, "text": t} for k, t in enumerate(lines)]
    plane.texts([row | {"ink": INK} for row in said])
    first = top + len(lines) * line
    crosses, texts = [], []
    for entry, at in zip(entries, flow(entries, plane.across - size, size), strict=True):
        here = {**entry, "px": size + at.x, "py": first + at.row * line}
        crosses.append(here)
        for k, text in enumerate(at.lines):
            texts.append(
                {**here, "px": here["px"] + 0.7 * size, "py": here["py"] + k * line, "text": text}
            )
    plane.crosses(crosses)
    plane.texts(texts)


class Flown(NamedTuple):
    """Where an entry stands: its x, its first row, its lines."""

    x: float
    row: int
    lines: Sequence[str]


def flow(entries: Sequence[Mapping[str, Any]], room: float, size: float) -> list[Flown]:
    """Entries in rows, by their `text`; one that is wider than the room has lines of its own."""
    found, x, row = [], 0.0, 0
    for entry in entries:
        lines = wrapped(entry["text"], room - 1.4 * size, size)
        needed = max(width(text, size) for text in lines) + 1.4 * size
        if x > 0 and (len(lines) > 1 or x + needed > room):
            x, row = 0.0, row + 1
        found.append(Flown(x, row, lines))
        x += needed + size
        if len(lines) > 1:
            x, row = 0.0, row + len(lines)
    return found
