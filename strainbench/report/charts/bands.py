"""What lies behind the points of a plane: the references' error, and the question asked."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import isfinite

from strainbench.report.charts.canvas import BAND, SOFT, Plane
from strainbench.report.charts.text import Box, width

UNKNOWN = "below the largest error of the references"
QUESTION = "question"
"""The parameter {seconds, value} that frames what is both faster and more accurate; or null."""


def unknown_band(plane: Plane, errors: Iterable[float]) -> float:
    """Grey, below what the reference itself is known to, in m; its height."""
    error = 1000 * max(filter(isfinite, errors), default=0.0)
    if not error > plane.y.low:
        return 0.0
    _, y = plane.pixel(plane.x.low, error)
    plane.box_layer(Box(0, max(y, 0), plane.width, plane.height), BAND)
    return plane.height - max(y, 0)


def note(plane: Plane, text: str, boxes: Sequence[Box], taken: Sequence[Box]) -> list[Box]:
    """A word in the first place where it covers nothing, which is returned; else nowhere."""
    for box in boxes:
        if box.right <= plane.width and not any(box.shared(other) for other in taken):
            where = {"px": (box.left + box.right) / 2, "py": (box.top + box.bottom) / 2}
            plane.texts([where | {"text": text, "ink": SOFT}], "center")
            return [box]
    return []


def name_band(plane: Plane, height: float, taken: Sequence[Box]) -> list[Box]:
    """What the band is, at its left or right where nothing is covered."""
    size = plane.target.sizes.text
    wide, rows = width(UNKNOWN, size) + size, max(int(height / size / 0.8) - 1, 1)
    middles = [plane.height - (0.9 + 0.8 * k) * size for k in range(rows)]
    boxes = [
        Box(x, y - 0.7 * size, x + wide, y + 0.7 * size)
        for x in (0, plane.width - wide)
        for y in middles
    ]
    return note(plane, UNKNOWN, boxes, taken)


def question(plane: Plane) -> None:
    """The frame of what is both faster and more accurate than was asked for."""
    across = f"clamp(scale('x', {QUESTION}.seconds), 0, width)"
    down = f"clamp(scale('y', {QUESTION}.value), 0, height)"
    box = {"x": 0, "x2": {"expr": f"{QUESTION} ? {across} : 0"}}
    box |= {"y": {"expr": f"{QUESTION} ? {down} : height"}, "y2": {"expr": "height"}}
    plane.add({"type": "rect", "color": "#FFF3C4", **box}, [{}], {})
