"""Tetrahedral meshes from files, by meshio: Gmsh, VTU, MEDIT and others that it reads."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from strainbench.arrays import FloatArray, IntArray, frozen_array, index_array
from strainbench.scenario.meshfile import meshio_mesh

FLAT = 1e-14
"""A determinant of edges below that times their size is none, to working precision."""
BESIDE = ("vertex", "line", "triangle", "quad")  # of surfaces, as Gmsh adds them


def read_volume(path: str | Path) -> tuple[FloatArray, IntArray]:
    """Positions (n, 3) and tetrahedra (e, 4) of a file; points of no tetrahedron are left out.

    Raises
    ------
    ValueError
        One line: no such file, not readable, no tetrahedra or other cells with a volume beside
        them, an index out of range, a position that is not finite, a tetrahedron that is flat or
        inverted.
    """
    file = Path(path).expanduser()
    if not file.is_file():
        what = "a folder, no mesh file" if file.is_dir() else "no such mesh file"
        raise ValueError(f"{path}: {what}")
    try:
        return _tetrahedra(meshio_mesh(file))
    except OSError as error:
        raise ValueError(f"{path}: not a readable mesh ({error.strerror or error})") from None
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None


def _tetrahedra(mesh: Any) -> tuple[FloatArray, IntArray]:
    """Those of a mesh, checked."""
    blocks = []
    for i, block in enumerate(mesh.cells):
        if block.type == "tetra":
            blocks.append(np.asarray(block.data))
        elif block.type not in BESIDE:
            valid = "tetra, with surfaces and lines beside them that are left out, is valid"
            raise ValueError(f"cells[{i}] is of type {block.type}: {valid}")
    if not sum(map(len, blocks)):
        types = ", ".join(dict.fromkeys(b.type for b in mesh.cells)) or "nothing"
        raise ValueError(f"cells: {types}, a mesh without volume; tetra is valid")
    points = frozen_array("points", mesh.points, 2)
    if points.shape[1] != 3:
        raise ValueError(f"points: shape {points.shape}; (n, 3) is valid")
    elements = index_array("tetra", np.concatenate(blocks), 2, len(points))
    _check_volumes(points, elements)
    used, number = np.unique(elements, return_inverse=True)
    return points[used], number.reshape(elements.shape)


def _check_volumes(points: FloatArray, elements: IntArray) -> None:
    edges = points[elements[:, 1:]] - points[elements[:, :1]]
    determinants = np.linalg.det(edges)
    size = np.abs(edges).max(axis=(1, 2)) ** 3
    for i in np.flatnonzero(determinants <= FLAT * size)[:1]:
        word = "flat" if determinants[i] >= -FLAT * size[i] else "inverted"
        raise ValueError(
            f"tetra[{i}] is {elements[i].tolist()}, {word}, of volume {determinants[i] / 6:.3g}: "
            "a volume above 0 is valid"
        )
