"""Triangle meshes from files: positions, triangles, and the pattern that they are cut from.

meshio reads every format but OBJ: its OBJ reader drops the faces' texture indices, and refuses
files with more texture coordinates than vertices, that is, with seams. So those few lines are read
here. Quadrilaterals and larger faces become fans.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import meshio
import numpy as np

from strainbench.limits import FloatArray
from strainbench.problem import IntArray


@dataclass(frozen=True, eq=False)
class MeshFile:
    """A triangle mesh.

    Parameters
    ----------
    positions : (n, 3), each vertex a corner of some triangle
    elements : (e, 3)
    texture : (e, 3, 2) texture coordinates of each triangle's corners, or None
    """

    positions: FloatArray
    elements: IntArray
    texture: FloatArray | None = None


def read_mesh(path: str | Path) -> MeshFile:
    """A mesh from any file that meshio reads, with its texture coordinates if it is an OBJ file.

    Raises
    ------
    ValueError
        One line: no such file, not readable, no triangles, an index out of range, a position
        that is not finite.
    """
    file = Path(path)
    if not file.is_file():
        raise ValueError(f"{path}: no such mesh file")
    try:
        mesh = _read_obj(file) if file.suffix.lower() == ".obj" else _read_other(file)
    except (Exception, SystemExit) as error:  # meshio raises all kinds, and exits on some
        reason = " ".join(str(error).split()) or type(error).__name__
        raise ValueError(f"{path}: not a readable mesh ({reason})") from None
    return _checked(str(path), mesh)


def _fan(face: list[int]) -> list[list[int]]:
    return [[face[0], face[i], face[i + 1]] for i in range(1, len(face) - 1)]


def _read_obj(file: Path) -> MeshFile:
    """The lines v, vt and f of an OBJ file; negative indices count from the latest."""
    points: list[list[float]] = []
    texture: list[list[float]] = []
    corners: list[list[int]] = []
    texture_corners: list[list[int]] = []
    for number, line in enumerate(file.read_text().splitlines(), start=1):
        word, *rest = line.split("#")[0].split() or [""]
        try:
            if word == "v":
                x, y, z = map(float, rest[:3])
                points.append([x, y, z])
            elif word == "vt":
                s, t = map(float, rest[:2])
                texture.append([s, t])
            elif word == "f":
                indices = [[int(i or 0) for i in f"{item}/".split("/")[:2]] for item in rest]
                corners += _fan([_from_zero(i, len(points)) for i, _ in indices])
                texture_corners += _fan([_from_zero(i, len(texture)) for _, i in indices])
        except ValueError:
            raise ValueError(f"line {number}: {line.strip()}") from None
    elements = np.array(corners, dtype=np.int64).reshape(-1, 3)
    places = np.array(texture_corners, dtype=np.int64).reshape(-1, 3)
    known = len(texture) > 0 and len(places) > 0 and places.min() >= 0
    if known and places.max() >= len(texture):
        raise ValueError(f"a face names texture coordinate {places.max() + 1} of {len(texture)}")
    coordinates = np.array(texture)[places] if known else None
    return MeshFile(np.array(points).reshape(-1, 3), elements, coordinates)


def _from_zero(index: int, count: int) -> int:
    """An OBJ index from 1, or back from the end if negative, as one from 0; -1 if there is none."""
    return index - 1 if index >= 0 else count + index


def _read_other(file: Path) -> MeshFile:
    with np.errstate(over="ignore"):  # meshio's count of a binary STL file's bytes
        mesh = meshio.read(file)
    faces = [
        triangle
        for block in mesh.cells
        if block.type in ("triangle", "quad", "polygon")
        for face in np.asarray(block.data).tolist()
        for triangle in _fan(face)
    ]
    points = np.asarray(mesh.points, dtype=np.float64)
    if points.ndim != 2 or points.shape[1] != 3:
        raise ValueError(f"points of shape {points.shape}")
    return MeshFile(points, np.array(faces, dtype=np.int64).reshape(-1, 3))


def _checked(path: str, mesh: MeshFile) -> MeshFile:
    """The mesh without vertices that belong to no triangle."""
    if len(mesh.elements) == 0:
        raise ValueError(f"{path}: no triangles")
    bad = np.argwhere((mesh.elements < 0) | (mesh.elements >= len(mesh.positions)))
    if len(bad):
        e, c = bad[0]
        raise ValueError(
            f"{path}: triangle {e} names vertex {mesh.elements[e, c] + 1} of {len(mesh.positions)}"
        )
    used, elements = np.unique(mesh.elements, return_inverse=True)
    positions = mesh.positions[used]
    for name, array in (("vertex", positions), ("texture coordinate", mesh.texture)):
        if array is not None and not np.all(np.isfinite(array)):
            row = array[~np.isfinite(array).all(axis=-1)][0]
            raise ValueError(f"{path}: {name} {row} is not finite")
    return MeshFile(positions, elements.reshape(-1, 3), mesh.texture)


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
    Path(path).write_text("\n".join(lines) + "\n")


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
