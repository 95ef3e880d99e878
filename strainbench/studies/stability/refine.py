"""Which points of a grid to evaluate: those along the boundaries between outcomes.

A quadtree: the corners of blocks first; a block whose corners differ is halved both ways, one whose
corners agree is taken to be all of that outcome. Then a closure, as outcomes need not be monotone:
all neighbours of two adjacent points that differ are evaluated, until nothing new is found. Islands
smaller than the first blocks may be missed.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Set
from itertools import pairwise, product

Point = tuple[int, int]
STRIDE = 4  # of the first blocks


def wanted(shape: Point, known: Mapping[Point, str], stride: int = STRIDE) -> set[Point]:
    """The points to evaluate next, where outcomes are `known` already; none at the end."""
    missing = set[Point]()
    for block in _blocks(shape, stride):
        missing |= _open_corners(block, known)
    return missing or _closure(shape, known, inferred(shape, known, stride))


def coarseness(shape: Point, point: Point) -> int:
    """The stride of the coarsest lattice that a point is on: those first give a whole map early."""
    ends = max(shape)  # coarser than any point within
    return min(i & -i if 0 < i < n - 1 else ends for n, i in zip(shape, point, strict=True))


def inferred(shape: Point, known: Mapping[Point, str], stride: int = STRIDE) -> dict[Point, str]:
    """The outcomes of all points in blocks whose corners agree, and of those that are known."""
    found: dict[Point, str] = {}
    for block in _blocks(shape, stride):
        found |= dict(_filled(block, known))
    return found | dict(known)


Block = tuple[Point, Point]
"""First and last index along each axis; the last may be the first."""


def _blocks(shape: Point, stride: int) -> Iterator[Block]:
    edges = [sorted({*range(0, n, stride), n - 1}) for n in shape]
    yield from product(*([*pairwise(e)] or [(0, 0)] for e in edges))


def _corners(block: Block) -> Set[Point]:
    return set(product(*block))


def _children(block: Block) -> list[Block]:
    """The block's halves in both directions; none of one that has no points within."""
    across, up = (_halves(*span) for span in block)
    children = list(product(across, up))
    return [] if children == [block] else children


def _halves(first: int, last: int) -> list[Point]:
    middle = (first + last) // 2
    return [(first, middle), (middle, last)] if last - first > 1 else [(first, last)]


def _open_corners(block: Block, known: Mapping[Point, str]) -> set[Point]:
    corners = _corners(block)
    missing = corners - known.keys()
    if missing or len({known[c] for c in corners}) == 1:
        return set(missing)
    return set().union(*(_open_corners(child, known) for child in _children(block)))


def _filled(block: Block, known: Mapping[Point, str]) -> Iterator[tuple[Point, str]]:
    outcomes = {known.get(corner) for corner in _corners(block)}
    if len(outcomes) == 1 and (outcome := outcomes.pop()) is not None:
        across, up = (range(first, last + 1) for first, last in block)
        for point in product(across, up):
            yield point, outcome
        return
    for child in _children(block):
        yield from _filled(child, known)


def _closure(shape: Point, known: Mapping[Point, str], all_of: Mapping[Point, str]) -> set[Point]:
    found = set[Point]()
    for point, outcome in all_of.items():
        for step in ((0, 1), (1, 0)):
            other = point[0] + step[0], point[1] + step[1]
            if other in all_of and all_of[other] != outcome:
                found |= {*_around(shape, point), *_around(shape, other)}
    return found - known.keys()


def _around(shape: Point, point: Point) -> Iterator[Point]:
    """A point and its neighbours."""
    for i, j in product((-1, 0, 1), repeat=2):
        x, y = point[0] + i, point[1] + j
        if 0 <= x < shape[0] and 0 <= y < shape[1]:
            yield x, y
