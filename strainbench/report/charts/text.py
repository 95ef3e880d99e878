"""How wide text is, and where it goes so that nothing overlaps."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from math import cos, hypot, pi, sin

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
BOLD = 1.07  # times as wide, about
HEIGHT = 1.15  # of a line, in its size
RINGS = (1.0, 1.6, 2.4, 3.4, 4.6, 6.0, 8.0, 10.0)
DIRECTIONS = 16


def width(text: str, size: float) -> float:
    """Of a line of text."""
    known = (WIDTHS[ord(c) - 32] if 32 <= ord(c) < 127 else OTHER for c in text)
    return sum(known) * size / 1000


def wrapped(text: str, room: float, size: float) -> list[str]:
    """Lines of whole words, each at most so wide where its words are."""
    lines = [""]
    for word in text.split():
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
    boxes, placed = list(taken), []
    for name in names:
        best = min(_places(name, size, mark), key=lambda p: _cost(p, name, boxes, plane))
        x, y = _nearest(best, name)
        placed.append(Placed(name, best, hypot(x - name.x, y - name.y) > 2.2 * mark + 2))
        boxes += [best, *along(name.x, name.y, x, y)]
    return placed


def along(x: float, y: float, then_x: float, then_y: float, parts: int = 8) -> Iterator[Box]:
    """Small boxes that cover a leader."""
    for k in range(parts + 1):
        share = k / parts
        yield Box.around(x + share * (then_x - x), y + share * (then_y - y), 1.0)


def _places(name: Name, size: float, mark: float) -> Iterator[Box]:
    """Boxes around the point, the nearest first."""
    half, up = width(name.whole, size) / 2 + 1, HEIGHT * size / 2
    for ring in RINGS:
        for k in range(DIRECTIONS):
            angle = 2 * pi * k / DIRECTIONS
            reach = mark + 2 + (ring - 1) * size
            x = name.x + cos(angle) * (reach + half)
            y = name.y + sin(angle) * (reach + up)
            yield Box.around(x, y, half, up)


def _cost(box: Box, name: Name, taken: Sequence[Box], plane: Box) -> float:
    """Covering anything costs more than any distance; sticking out still more."""
    covered = sum(box.shared(other) for other in taken)
    x, y = _nearest(box, name)
    return 100 * covered + 1000 * box.beyond(plane) + hypot(x - name.x, y - name.y)


def _nearest(box: Box, name: Name) -> tuple[float, float]:
    return min(max(name.x, box.left), box.right), min(max(name.y, box.top), box.bottom)


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
