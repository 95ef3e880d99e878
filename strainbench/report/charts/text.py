"""How wide text is, and where it goes so that nothing overlaps."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

FONT = "Helvetica Neue, Helvetica, Arial, Liberation Sans, sans-serif"
WIDTHS = (
    *(278, 278, 355, 556, 556, 889, 667, 191, 333, 333, 389, 584, 278, 333, 278, 278),
    *(556,) * 10,
    *(278, 278, 584, 584, 584, 556, 1015),
    *(667, 667, 722, 722, 667, 611, 778, 722, 278, 500, 667, 556, 833),
    *(722, 778, 667, 778, 722, 667, 611, 722, 667, 944, 667, 667, 611),
    *(278, 278, 278, 469, 556, 333),
    *(556, 556, 500, 556, 556, 278, 556, 556, 222, 222, 500, 222, 833),
    *(556, 556, 556, 556, 333, 500, 278, 556, 500, 722, 500, 500, 500),
    *(334, 260, 334, 584),
)
"""Of Helvetica's characters from the space to the tilde, in thousandths of its size; Arial and
Liberation Sans have the same."""
OTHER = 600
HELD = "\u00a0"
BOLD = 1.07  # times as wide, about
HEIGHT = 1.15  # of a line, in its size
RINGS = (1.0, 1.6, 2.4, 3.4, 4.6, 6.0, 8.0, 10.0)
ANGLES = 2 * np.pi * np.arange(16) / 16
COS, SIN = np.cos(ANGLES), np.sin(ANGLES)
ALONG = np.arange(9) / 8  # of a leader's length
FEW = 12  # of the cheapest places, for which leaders are looked at
CROSSED = 25.0
Boxes = NDArray[np.float64]
"""(boxes, 4) left, top, right, bottom."""


def width(text: str, size: float) -> float:
    """Of a line of text."""
    return _thousandths(text) * size / 1000


@lru_cache(maxsize=10_000)  # names and words come again on every chart
def _thousandths(text: str) -> int:
    return sum(WIDTHS[ord(c) - 32] if 32 <= ord(c) < 127 else OTHER for c in plain(text))


def plain(text: str) -> str:
    """With spaces in place of those at which a line never breaks."""
    return text.replace(HELD, " ")


def wrapped(text: str, room: float, size: float) -> list[str]:
    """Lines of whole words, each at most so wide where its words are."""
    lines = [""]
    for word in text.split(" "):
        longer = f"{lines[-1]} {word}".strip()
        if lines[-1] and width(longer, size) > room:
            lines.append(word)
        else:
            lines[-1] = longer
    return lines


@dataclass(frozen=True)
class Box:
    """A rectangle in pixels, y downwards."""

    left: float
    top: float
    right: float
    bottom: float

    @classmethod
    def around(cls, x: float, y: float, half: float, more: float | None = None) -> Box:
        """Of half a width, and of half a height if another."""
        up = half if more is None else more
        return cls(x - half, y - up, x + half, y + up)

    def shared(self, other: Box) -> float:
        """The area that both cover."""
        across = min(self.right, other.right) - max(self.left, other.left)
        down = min(self.bottom, other.bottom) - max(self.top, other.top)
        return max(across, 0.0) * max(down, 0.0)

    def beyond(self, outer: Box) -> float:
        """The area that sticks out of another."""
        return (self.right - self.left) * (self.bottom - self.top) - self.shared(outer)


@dataclass(frozen=True)
class Name:
    """A text beside the point x, y; `more` is said after it."""

    text: str
    x: float
    y: float
    more: str = ""

    @property
    def whole(self) -> str:
        """All that is shown."""
        return self.text + self.more


@dataclass(frozen=True)
class Placed:
    """A name where it stands; `led` where a line must lead to its point."""

    name: Name
    box: Box
    led: bool

    @property
    def x(self) -> float:
        """Its middle."""
        return (self.box.left + self.box.right) / 2

    @property
    def y(self) -> float:
        """Its middle."""
        return (self.box.top + self.box.bottom) / 2

    @property
    def near(self) -> tuple[float, float]:
        """Where on its edge a leader ends."""
        box = self.box
        return (
            min(max(self.name.x, box.left), box.right),
            min(max(self.name.y, box.top), box.bottom),
        )


def place(
    names: Sequence[Name], taken: Iterable[Box], plane: Box, size: float, mark: float
) -> list[Placed]:
    """Names beside their points, one after the other, each where least is covered and nearest.

    Parameters
    ----------
    taken : by marks and bars
    mark : half the width of a mark
    """
    boxes, placed = _edges(list(taken)), []
    for name in names:
        places = _places(name, size, mark)
        costs = _costs(places, name, boxes, _edges([plane]))
        few = np.argsort(costs, kind="stable")[:FEW]
        best = places[few[0]]
        if _crossed(best[None], name, boxes, mark).any():
            crossed = CROSSED * _crossed(places[few], name, boxes, mark)
            best = places[few[np.argmin(costs[few] + crossed)]]
        end = _nearest(best[None], name)
        led = float(np.hypot(*(end[0] - (name.x, name.y)))) > 2.2 * mark + 2
        placed.append(Placed(name, Box(*map(float, best)), led))
        boxes = np.concatenate([boxes, best[None], _leaders(end, name)[0]])
    return placed


def along(x: float, y: float, then_x: float, then_y: float) -> Iterator[Box]:
    """Small boxes that cover a leader."""
    for share in ALONG:
        yield Box.around(x + share * (then_x - x), y + share * (then_y - y), 1.0)


def _edges(boxes: Sequence[Box]) -> Boxes:
    return np.array([(b.left, b.top, b.right, b.bottom) for b in boxes]).reshape(-1, 4)


def _places(name: Name, size: float, mark: float) -> Boxes:
    """Boxes around the point, the nearest first."""
    half, up = width(name.whole, size) / 2 + 1, HEIGHT * size / 2
    reach = mark + 2 + (np.array(RINGS) - 1)[:, None] * size
    x = (name.x + COS * (reach + half)).ravel()
    y = (name.y + SIN * (reach + up)).ravel()
    return np.stack([x - half, y - up, x + half, y + up], axis=1)


def _costs(places: Boxes, name: Name, taken: Boxes, plane: Boxes) -> Boxes:
    """Covering anything costs more than any distance; sticking out still more."""
    covered = _shared(places, taken).sum(axis=1)
    areas = (places[:, 2] - places[:, 0]) * (places[:, 3] - places[:, 1])
    outside = areas - _shared(places, plane)[:, 0]
    away = np.hypot(*(_nearest(places, name) - (name.x, name.y)).T)
    return np.asarray(100 * covered + 1000 * outside + away)


def _shared(some: Boxes, others: Boxes) -> Boxes:
    """The areas (a, b) that boxes of the one and the other cover both."""
    a, b = some[:, None], others[None]
    across = np.minimum(a[..., 2], b[..., 2]) - np.maximum(a[..., 0], b[..., 0])
    down = np.minimum(a[..., 3], b[..., 3]) - np.maximum(a[..., 1], b[..., 1])
    return np.asarray(np.maximum(across, 0.0) * np.maximum(down, 0.0))


def _crossed(places: Boxes, name: Name, taken: Boxes, mark: float) -> Boxes:
    """How many points of the leader to each place, beyond its own mark, are taken."""
    steps = _leaders(_nearest(places, name), name)
    away = np.abs(steps[..., :2] - (name.x, name.y)).sum(axis=2) > 2 * mark
    met = (_shared(steps.reshape(-1, 4), taken) > 0).any(axis=1).reshape(away.shape)
    return np.asarray((met & away).sum(axis=1))


def _nearest(places: Boxes, name: Name) -> Boxes:
    """(places, 2) where leaders end."""
    return np.asarray(np.clip((name.x, name.y), places[:, :2], places[:, 2:]))


def _leaders(ends: Boxes, name: Name) -> Boxes:
    """(ends, points, 4) small boxes that cover leaders."""
    start = np.array([name.x, name.y])
    points = start + ALONG[None, :, None] * (ends[:, None] - start)
    return np.concatenate([points - 1.0, points + 1.0], axis=2)


def spread(wanted: Sequence[float], sizes: Sequence[float], low: float, high: float) -> list[float]:
    """Middles of things of these sizes, one after the other, between two ends if there is room.

    Each goes as near as can be to where it is wanted; they keep their order.
    """
    order = sorted(range(len(wanted)), key=lambda k: wanted[k])
    groups: list[list[int]] = []
    for k in order:
        groups.append([k])
        while len(groups) > 1:
            above, below = (_span(group, wanted, sizes, low, high) for group in groups[-2:])
            if above[1] <= below[0]:
                break
            groups[-2:] = [groups[-2] + groups[-1]]
    found = [0.0] * len(wanted)
    for group in groups:
        top, _ = _span(group, wanted, sizes, low, high)
        for k in group:
            found[k] = top + sizes[k] / 2
            top += sizes[k]
    return found


def _span(
    group: Sequence[int], wanted: Sequence[float], sizes: Sequence[float], low: float, high: float
) -> tuple[float, float]:
    """From where to where things reach that touch each other."""
    before, tops = 0.0, []
    for k in group:
        tops.append(wanted[k] - before - sizes[k] / 2)
        before += sizes[k]
    top = max(min(sum(tops) / len(tops), high - before), low)
    return top, top + before
