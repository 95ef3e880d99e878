"""Triangle meshes from files: positions, triangles, and the pattern that they are cut from.

meshio reads every format but OBJ.
"""

from __future__ import annotations

from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np

from strainbench.arrays import FloatArray, IntArray
from strainbench.plugins import Library
from strainbench.scenario.obj import read_obj, shortened
from strainbench.scenario.polygons import Polygons, triangulated

meshio = Library("meshio")


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
        mesh = read_obj(file, texture) if file.suffix.lower() == ".obj" else _read_other(file)
        return MeshFile(*triangulated(mesh))
    except OSError as error:
        raise ValueError(f"{path}: not a readable mesh ({error.strerror or error})") from None
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None


def meshio_mesh(file: Path) -> Any:
    """What meshio makes of a file; ValueError with its reason in a line."""
    if not any(file.name.lower().endswith(end) for end in meshio.extension_to_filetypes):
        valid = ", ".join(sorted({".obj", *meshio.extension_to_filetypes}))
        raise ValueError(
            f"not a readable mesh ({file.suffix or 'no extension'}: valid extensions are {valid})"
        )
    said = StringIO()  # meshio prints reasons, and exits
    try:
        with np.errstate(over="ignore"), redirect_stdout(said), redirect_stderr(said):
            return meshio.read(file)
    except (Exception, SystemExit) as error:  # meshio raises all kinds
        words = said.getvalue() if isinstance(error, SystemExit) else str(error)
        reason = shortened(words.split()) or type(error).__name__
        raise ValueError(f"not a readable mesh ({reason})") from None


def _read_other(file: Path) -> Polygons:
    mesh = meshio_mesh(file)
    surface = ("triangle", "quad", "polygon")
    for block in mesh.cells:
        if block.type not in (*surface, "line", "vertex"):
            raise ValueError(f"cells of type {block.type}; valid are {', '.join(surface)}")
    faces = [f for b in mesh.cells if b.type in surface for f in np.asarray(b.data).tolist()]
    points = np.asarray(mesh.points, dtype=np.float64)
    if points.ndim != 2 or points.shape[1] != 3:
        raise ValueError(f"points of shape {points.shape}; valid is (n, 3)")
    names = [f"face {i + 1}" for i in range(len(faces))]
    return Polygons(points, faces, names, np.empty((0, 2)), [[]] * len(faces))


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
