"""The rooms of a checkout and what imports what: `python -m tests.imports [ROOT]`.

A room is what lies directly in strainbench/, or the solvers, or the scenarios. Its floor is 1 where
it imports no other room, else one above the highest that it imports; rooms that import each other
in a circle share a floor. Upward is an import from a lower to a higher layer of the order that
pyproject.toml declares, and that `lint-imports` enforces.
"""

from __future__ import annotations

import argparse
import sys
import tomllib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import grimp
import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

OURS = ("strainbench", "solvers", "scenarios")
HERE = Path(__file__).parent.parent
Arrow = tuple[str, str]


@dataclass(frozen=True)
class Graph:
    """Nodes, and arrows from each to what it imports."""

    nodes: tuple[str, ...]
    arrows: frozenset[Arrow]

    @cached_property
    def _group(self) -> dict[str, int]:
        """Nodes in a circle are one group."""
        number = {node: i for i, node in enumerate(self.nodes)}
        pairs = np.array([(number[a], number[b]) for a, b in self.arrows]).reshape(-1, 2)
        shape = 2 * (len(self.nodes),)
        matrix = csr_array((np.ones(len(pairs)), tuple(pairs.T)), shape)
        groups = connected_components(matrix, connection="strong")[1]
        return dict(zip(self.nodes, groups.tolist(), strict=True))

    @property
    def circles(self) -> list[list[str]]:
        """Nodes that import each other, directly or by others."""
        groups = self._group.values()
        together = [[n for n in self.nodes if self._group[n] == g] for g in sorted(set(groups))]
        return [nodes for nodes in together if len(nodes) > 1]

    @cached_property
    def floors(self) -> dict[str, int]:
        """The longest way down from each node, circles taken as one; 1 at the bottom."""
        below: dict[int, set[int]] = {group: set() for group in self._group.values()}
        for a, b in self.arrows:
            below[self._group[a]].add(self._group[b])
        known: dict[int, int] = {}

        def floor(group: int) -> int:
            if group not in known:
                known[group] = 1 + max((floor(g) for g in below[group] - {group}), default=0)
            return known[group]

        return {node: floor(self._group[node]) for node in self.nodes}

    def upward(self, layers: list[list[str]]) -> list[Arrow]:
        """Arrows from a lower layer to a higher one; `layers` begin with the highest."""
        height = {node: -i for i, layer in enumerate(layers) for node in layer}
        judged = [(a, b) for a, b in self.arrows if a in height and b in height]
        return sorted((a, b) for a, b in judged if height[a] < height[b])


def read(root: Path, by_room: bool) -> Graph:
    """The imports of a checkout, of modules or of rooms."""
    sys.path.insert(0, str(root))
    try:
        graph = grimp.build_graph(*OURS, cache_dir=None)
    finally:
        sys.path.pop(0)
    if by_room:
        for room in {*OURS[1:], *graph.find_children("strainbench")}:
            graph.squash_module(room)
    nodes = tuple(sorted(graph.modules))
    arrows = {(a, b) for a in nodes for b in graph.find_modules_directly_imported_by(a)}
    return Graph(nodes, frozenset(arrows))


def layers(pyproject: Path = HERE / "pyproject.toml") -> list[list[str]]:
    """The order of the rooms, the highest first, as import-linter is told it."""
    tool = tomllib.loads(pyproject.read_text())["tool"]["importlinter"]
    (inside,) = (c["layers"] for c in tool["contracts"] if "containers" in c)
    rooms = [[f"strainbench.{name.strip('() ')}" for name in layer.split(":")] for layer in inside]
    return [list(OURS[1:]), *rooms]


def files(root: Path, room: str) -> list[Path]:
    """The Python files of a room."""
    place = root / room.replace(".", "/")
    if room == "strainbench":
        return [place / "__init__.py"]
    return sorted(place.rglob("*.py")) if place.is_dir() else [place.with_suffix(".py")]


def lines(paths: Iterable[Path]) -> int:
    """Lines of files, blank ones and comments too."""
    return sum(len(path.read_text().splitlines()) for path in paths)


def summary(graph: Graph, what: str) -> str:
    """Nodes, floors, arrows and circles in one line."""
    return (
        f"{len(graph.nodes)} {what} on {max(graph.floors.values())} floors, "
        f"{len(graph.arrows)} arrows, {len(graph.circles)} circles"
    )


def report(root: Path) -> Iterator[str]:
    """A table of the rooms, the highest floor first, and what is wrong with them."""
    rooms, modules = read(root, by_room=True), read(root, by_room=False)
    yield f"{'floor':>5}  {'lines':>5}  {'files':>5}  room: what it imports"
    for room in sorted(rooms.nodes, key=lambda r: (-rooms.floors[r], r)):
        paths = files(root, room)
        below = " ".join(sorted(_short(b) for a, b in rooms.arrows if a == room))
        cells = f"{rooms.floors[room]:>5}  {lines(paths):>5}  {len(paths):>5}"
        yield f"{cells}  {_short(room)}: {below or '-'}"
    every = [path for room in rooms.nodes for path in files(root, room)]
    upward = rooms.upward(layers())
    yield f"\n{summary(rooms, 'rooms')}, {len(upward)} upward"
    yield f"{summary(modules, 'modules')}; {lines(every)} lines"
    longest = max(every, key=lambda path: lines([path]))
    yield f"longest file: {longest.relative_to(root)}, {lines([longest])} lines"
    yield from (f"upward: {_short(a)} imports {_short(b)}" for a, b in upward)
    yield from (f"circle: {' '.join(map(_short, circle))}" for circle in rooms.circles)


def _short(room: str) -> str:
    return room.removeprefix("strainbench.")


def main() -> None:
    """Print it."""
    parser = argparse.ArgumentParser(description="What imports what, room by room.")
    parser.add_argument("root", nargs="?", type=Path, default=HERE, help="a checkout")
    print("\n".join(report(parser.parse_args().root.resolve())))


if __name__ == "__main__":
    main()
