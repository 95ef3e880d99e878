"""From the faces that a mesh file has to triangles: what counts, what is wrong, where to cut.

Faces of more than three corners are cut into triangles by mapbox_earcut where a fan from their
first corner would not do.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import mapbox_earcut
import numpy as np

from strainbench.arrays import FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class Polygons:
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


def triangulated(
    mesh: Polygons,
) -> tuple[FloatArray, IntArray, FloatArray | None, tuple[str, ...]]:
    """The triangles of the faces that count, and the vertices that belong to one.

    Returns
    -------
    Positions (n, 3), triangles (e, 3), texture coordinates of their corners (e, 3, 2) or None,
    and a line about each kind of face that was left out.

    Raises
    ------
    ValueError
        One line that names the first bad face.
    """
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
    return mesh.points[used], elements.reshape(-1, 3), texture, notes


def _check(mesh: Polygons) -> bool:
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


def _distinct(mesh: Polygons) -> tuple[list[tuple[int, IntArray]], tuple[str, ...]]:
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
