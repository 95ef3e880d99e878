"""The lines of an OBJ file.

They are read here: of the libraries tried, meshio drops the faces' texture indices and refuses
seams; tinyobjloader 2.0rc13 reads 0 for NaN and for what is no number, and refuses comments behind
a face; trimesh 5.2 makes fans of concave faces and fills in texture coordinates; libigl 2.6 refuses
textures on some faces, and takes indices out of range; each stumbles over a byte-order mark or a
continued line.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from strainbench.scenario.polygons import Polygons
from strainbench.textfile import read_lines


def read_obj(file: Path, texture: bool) -> Polygons:
    """The lines v, vt and f of an OBJ file; negative indices count from the latest."""
    points: list[list[float]] = []
    coordinates: list[list[float]] = []
    faces: list[list[int]] = []
    places: list[list[int]] = []
    names: list[str] = []
    for number, (word, *rest) in _obj_lines(file):
        try:
            if word == "v":
                x, y, z = map(float, rest[:3])
                points.append([x, y, z])
            elif word == "vt" and texture:
                s, t = map(float, rest[:2])
                coordinates.append([s, t])
            elif word in ("f", "fo"):
                corners = [_corner(item) for item in rest]
                if len(corners) < 3:
                    raise ValueError("a face has three corners or more")
                faces.append([_from_zero("vertex", v, len(points)) for v, _ in corners])
                known = [t for _, t in corners if t is not None and texture]
                count = len(coordinates)
                places.append([_from_zero("texture coordinate", t, count) for t in known])
                names.append(f"line {number}")
        except ValueError as error:
            raise ValueError(f"line {number}: {shortened([word, *rest])} ({error})") from None
    array = np.array(coordinates).reshape(-1, 2)
    return Polygons(np.array(points).reshape(-1, 3), faces, names, array, places)


def _obj_lines(file: Path) -> Iterator[tuple[int, list[str]]]:
    """The words of each line, with its number; comments cut off, lines that end in \\ joined.

    A backslash behind a character that is not ASCII is half of one (Shift-JIS), and joins none.
    """
    words: list[str] = []
    for number, line in enumerate(read_lines(file), start=1):
        text, hash_sign, _ = line.partition("#")
        joined = re.search(r"(?<![^\x00-\x7f])\\\s*$", text) if not hash_sign else None
        words += (text[: joined.start()] if joined else text).split()
        if words and not joined:
            yield number, words
            words = []
    if words:
        yield number, words


def _corner(item: str) -> tuple[int, int | None]:
    """Vertex and texture index, from 1, of a corner v, v/t, v//n or v/t/n of a face."""
    vertex, *others = item.split("/")
    if len(others) > 2:
        raise ValueError(f"{item!r} is no corner")
    place = others[0] if others else ""
    return int(vertex), int(place) if place else None


def _from_zero(what: str, index: int, count: int) -> int:
    """An OBJ index from 1, or back from the end if negative, as one from 0."""
    if index == 0 or index < -count:
        raise ValueError(f"a face names {what} {index} of {count}")
    return index - 1 if index > 0 else count + index


def shortened(words: Sequence[str]) -> str:
    """For a message."""
    text = " ".join(words)
    return text if len(text) <= 60 else f"{text[:57]}..."
