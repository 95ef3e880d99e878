"""Triangle meshes from files: positions, triangles, and the pattern that they are cut from.

meshio reads every format but OBJ, whose lines are read here: of the libraries tried, meshio drops
the faces' texture indices and refuses seams; tinyobjloader 2.0rc13 reads 0 for NaN and for what is
no number, and refuses comments behind a face; trimesh 5.2 makes fans of concave faces and fills in
texture coordinates; libigl 2.6 refuses textures on some faces, and takes indices out of range; each
stumbles over a byte-order mark or a continued line. Faces of more than three corners are cut into
triangles by mapbox_earcut where a fan from their first corner would not do.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from io import StringIO
from pathlib import Path

import mapbox_earcut
import meshio
import numpy as np

from strainbench.arrays import FloatArray, IntArray
from strainbench.textfile import read_lines


@dataclass(frozen=True, eq=False)
class MeshFile:
    """A triangle mesh.

    Parameters
    ----------
    positions : (n, 3), each vertex a corner of some triangle
    elements : (e, 3)
    texture : (e, 3, 2) texture coordinates of each triangle's corners, or None
    notes : what was left out in reading, a line each
    """

    positions: FloatArray
    elements: IntArray
    texture: FloatArray | None = None
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class _Polygons:
    """A mesh as a file has it.

    Parameters
    ----------
    points : (n, 3)
    faces : vertices of each
    names : how each face is called in an error
    texture : (t, 2) texture coordinates
    places : texture coordinates of each face's corners, none where it has none
    """

    points: FloatArray
    faces: list[list[int]]
    names: Sequence[str]
    texture: FloatArray
    places: list[list[int]]


def read_mesh(path: str | Path, texture: bool = True) -> MeshFile:
    """A mesh from any file that meshio reads, with its texture coordinates if it is an OBJ file.

    Faces that repeat the vertices or the places of others, as sheets with two sides have them,
    and faces with fewer than three different corners are left out, which the notes say.

    Parameters
    ----------
    texture : whether its texture coordinates are of interest; else they are not looked at.

    Raises
    ------
    ValueError
        One line: no such file, not readable, no triangles, an index out of range, a position
        that is not finite, a face without area or one that crosses itself, texture coordinates
        of some faces only.
    """
    file = Path(path)
    if not file.is_file():
        what = "a folder, no mesh file" if file.is_dir() else "no such mesh file"
        raise ValueError(f"{path}: {what}")
    try:
        mesh = _read_obj(file, texture) if file.suffix.lower() == ".obj" else _read_other(file)
        return _triangulated(mesh)
    except OSError as error:
        raise ValueError(f"{path}: not a readable mesh ({error.strerror or error})") from None
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None


# --- OBJ


def _read_obj(file: Path, texture: bool) -> _Polygons:
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
            raise ValueError(f"line {number}: {_short([word, *rest])} ({error})") from None
    array = np.array(coordinates).reshape(-1, 2)
    return _Polygons(np.array(points).reshape(-1, 3), faces, names, array, places)


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


def _short(words: list[str]) -> str:
    text = " ".join(words)
    return text if len(text) <= 60 else f"{text[:57]}..."


# --- all other formats


def _read_other(file: Path) -> _Polygons:
    if not any(file.name.lower().endswith(end) for end in meshio.extension_to_filetypes):
        valid = ", ".join(sorted({".obj", *meshio.extension_to_filetypes}))
        raise ValueError(
            f"not a readable mesh ({file.suffix or 'no extension'}: valid extensions are {valid})"
        )
    said = StringIO()  # meshio prints reasons, and exits
    try:
        with np.errstate(over="ignore"), redirect_stdout(said), redirect_stderr(said):
            mesh = meshio.read(file)
    except (Exception, SystemExit) as error:  # meshio raises all kinds
        words = said.getvalue() if isinstance(error, SystemExit) else str(error)
        reason = _short(words.split()) or type(error).__name__
        raise ValueError(f"not a readable mesh ({reason})") from None
    surface = ("triangle", "quad", "polygon")
    for block in mesh.cells:
        if block.type not in (*surface, "line", "vertex"):
            raise ValueError(f"cells of type {block.type}; valid are {', '.join(surface)}")
    faces = [f for b in mesh.cells if b.type in surface for f in np.asarray(b.data).tolist()]
    points = np.asarray(mesh.points, dtype=np.float64)
    if points.ndim != 2 or points.shape[1] != 3:
        raise ValueError(f"points of shape {points.shape}; valid is (n, 3)")
    names = [f"face {i + 1}" for i in range(len(faces))]
    return _Polygons(points, faces, names, np.empty((0, 2)), [[]] * len(faces))


# --- what is checked of every file


def _triangulated(mesh: _Polygons) -> MeshFile:
    """The triangles of the faces that count, and the vertices that belong to one."""
    if not mesh.faces:
        raise ValueError("no triangles")
    textured = _check(mesh)
    kept, notes = _distinct(mesh)
    if not kept:
        raise ValueError("no triangles: no face has three different corners")
    faces = [[mesh.faces[i][c] for c in corners] for i, corners in kept]
    cuts = _cuts(mesh.points, faces, [mesh.names[i] for i, _ in kept])
    elements = np.concatenate([np.array(f)[cut] for f, cut in zip(faces, cuts, strict=True)])
    texture = None
    if textured:
        at = [np.array(mesh.places[i])[corners] for i, corners in kept]
        texture = mesh.texture[np.concatenate([a[c] for a, c in zip(at, cuts, strict=True)])]
    used, elements = np.unique(elements, return_inverse=True)
    return MeshFile(mesh.points[used], elements.reshape(-1, 3), texture, notes)


def _check(mesh: _Polygons) -> bool:
    """ValueError that names the first bad face; whether all faces have texture coordinates."""
    textured = any(mesh.places)
    whats = [("vertex", mesh.points, mesh.faces)]
    whats += [("texture coordinate", mesh.texture, mesh.places)] if textured else []
    for name, face, places in zip(mesh.names, mesh.faces, mesh.places, strict=True):
        if textured and len(places) != len(face):
            raise ValueError(
                f"{name}: a face without texture coordinates, others have them; "
                "rest=flattened does without"
            )
    for what, array, indices in whats:
        endless = set(np.flatnonzero(~np.isfinite(array).all(axis=1)).tolist())
        for name, corners in zip(mesh.names, indices, strict=True):
            for i in corners:
                if not 0 <= i < len(array):
                    raise ValueError(f"{name}: a face names {what} {i + 1} of {len(array)}")
                if i in endless:
                    raise ValueError(f"{name}: {what} {array[i]} is not finite")
    return textured


def _distinct(mesh: _Polygons) -> tuple[list[tuple[int, IntArray]], tuple[str, ...]]:
    """Which faces count, each with those of its corners that do not repeat the one before.

    Whole faces are compared, not triangles: two sides of a quadrilateral may be cut otherwise.
    """
    _, inverse = np.unique(mesh.points + 0.0, axis=0, return_inverse=True)  # no negative zeros
    place = inverse.ravel().tolist()
    seen: set[tuple[int, ...]] = set()
    kept, empty, doubled = [], [], []
    for i, face in enumerate(mesh.faces):
        corners = [c for c in range(len(face)) if face[c] != face[c - 1]]
        key = tuple(sorted(place[face[c]] for c in corners))
        if len(set(key)) < 3:
            empty.append(mesh.names[i])
        elif key in seen:
            doubled.append(mesh.names[i])
        else:
            seen.add(key)
            kept.append((i, np.array(corners)))
    whats = (
        (empty, "with fewer than three different corners"),
        (doubled, "that repeat the corners of others, as in sheets with two sides,"),
    )
    return kept, tuple(
        f"{len(names)} of {len(mesh.faces)} faces {what} are left out (first: {names[0]})"
        for names, what in whats
        if names
    )


def _cuts(points: FloatArray, faces: list[list[int]], names: list[str]) -> list[IntArray]:
    """(k - 2, 3) corners of the triangles that each face of k corners is cut into.

    Its first corner's fan where all of it turns as the whole does, else what mapbox_earcut finds.
    """
    cuts: dict[int, IntArray] = {}
    for size in sorted({len(face) for face in faces}):
        which = [i for i, face in enumerate(faces) if len(face) == size]
        corners = points[np.array([faces[i] for i in which])]
        last = np.arange(2, size)
        fan = np.column_stack([np.zeros_like(last), last - 1, last])
        edges = corners[:, 1:] - corners[:, :1]
        normals = np.cross(edges[:, :-1], edges[:, 1:])  # twice the areas, with direction
        total = normals.sum(axis=1)
        scale = 1e-12 * np.abs(edges).max(axis=(1, 2)) ** 2
        flat = np.linalg.norm(total, axis=1) <= scale
        for i in np.flatnonzero(flat)[:1]:
            raise ValueError(f"{names[which[i]]}: a face without area")
        turned: FloatArray = np.einsum("fkc,fc->fk", normals, total)
        even = turned.min(axis=1) > 0
        for i, face in enumerate(which):
            cut = fan if even[i] else _ears(corners[i], total[i])
            if cut is None:
                raise ValueError(f"{names[face]}: a face that crosses itself")
            cuts[face] = cut
    return [cuts[i] for i in range(len(faces))]


def _ears(corners: FloatArray, normal: FloatArray) -> IntArray | None:
    """(k - 2, 3) triangles of a polygon (k, 3) that turn as it does; None where it crosses itself.

    `normal` is twice its area, with direction; it is seen along the axis nearest to that.
    """
    axis = int(np.argmax(np.abs(normal)))
    flat = np.ascontiguousarray(corners[:, [(axis + 1) % 3, (axis + 2) % 3]])
    found = mapbox_earcut.triangulate_float64(flat, np.array([len(flat)], dtype=np.uint32))
    cut: IntArray = found.astype(np.int64).reshape(-1, 3)
    a, b = np.moveaxis(flat[cut[:, 1:]] - flat[cut[:, :1]], 1, 0)
    areas = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    whole = float(np.sum(np.abs(areas)))
    if len(cut) != len(corners) - 2 or abs(whole - abs(normal[axis])) > 1e-9 * whole:
        return None
    turned = areas * normal[axis] < 0
    cut[turned] = cut[turned, ::-1]
    return cut


def write_obj(path: str | Path, mesh: MeshFile) -> None:
    """An OBJ file; equal texture coordinates are written once."""
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in mesh.positions.tolist()]
    if mesh.texture is None:
        lines += [f"f {a} {b} {c}" for a, b, c in (mesh.elements + 1).tolist()]
    else:
        unique, places = np.unique(mesh.texture.reshape(-1, 2), axis=0, return_inverse=True)
        lines += [f"vt {s!r} {t!r}" for s, t in unique.tolist()]
        pairs = np.stack([mesh.elements, places.reshape(-1, 3)], axis=-1) + 1
        lines += ["f " + " ".join(f"{v}/{t}" for v, t in face) for face in pairs.tolist()]
    Path(path).write_text("\n".join(lines) + "\n", encoding="utf-8")


def flattened(positions: FloatArray, elements: IntArray) -> FloatArray:
    """(e, 3, 2) each triangle laid flat by itself: its own shape is its rest shape.

    Its first axis is its own horizontal (the vertical y cross its normal), so that limited
    directions run around a garment and up it; in a horizontal triangle it is the x axis.
    """
    corners = positions[elements]
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    normal = np.cross(a, b)
    area = np.linalg.norm(normal, axis=1, keepdims=True)
    normal = np.divide(normal, area, out=np.zeros_like(normal), where=area > 0)
    across = np.cross([0.0, 1.0, 0.0], normal)
    length = np.linalg.norm(across, axis=1, keepdims=True)
    level = length < 1e-9
    across = np.where(level, [1.0, 0.0, 0.0], across / np.where(level, 1.0, length))
    up = np.cross(normal, across)
    zero = np.zeros(len(a))
    flat = [[zero, zero]] + [
        [np.sum(edge * across, axis=1), np.sum(edge * up, axis=1)] for edge in (a, b)
    ]
    return np.moveaxis(np.array(flat), 2, 0)
