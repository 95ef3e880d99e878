"""Series of meshes for other programs: OBJ and PLY of the surface, VTU with strains (meshio)."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterable
from pathlib import Path

import meshio
import numpy as np

from strainbench.arrays import FloatArray, IntArray
from strainbench.problem.elements import rest_corners
from strainbench.problem.problem import Problem
from strainbench.render.film import Film, State, Track, principal_stretches, untracked

MESH_FORMATS = ("obj", "ply", "vtu")
OUTWARDS = ((0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3))
"""Corners of each face of a tetrahedron of positive volume, anticlockwise from without."""


def surface(problem: Problem) -> tuple[IntArray, IntArray]:
    """What can be seen of a mesh: all triangles, or the outer faces of tetrahedra.

    These are anticlockwise from without.

    Returns
    -------
    faces : (f, 3) vertex indices
    owner : (f,) the element that each is of
    """
    elements = problem.elements
    if elements.shape[1] == 3:
        return elements, np.arange(len(elements))
    faces = np.concatenate([elements[:, list(c)] for c in OUTWARDS])
    owner = np.tile(np.arange(len(elements)), 4)
    corners = rest_corners(problem.rest, elements)
    mirrored = np.linalg.det(corners[:, 1:] - corners[:, :1]) < 0
    faces = np.where(mirrored[owner][:, None], faces[:, ::-1], faces)
    _, first, count = np.unique(np.sort(faces), axis=0, return_index=True, return_counts=True)
    outer = np.sort(first[count == 1])
    return faces[outer], owner[outer]


def element_data(problem: Problem, positions: FloatArray) -> dict[str, FloatArray]:
    """(e,) arrays by name: each principal stretch, and the largest violation of a limit."""
    stretches = principal_stretches(problem, positions)
    data = {f"principal_stretch_{k + 1}": stretches[:, k] for k in range(stretches.shape[1])}
    violations = problem.violations(positions).reshape(len(problem.elements), -1)
    return data | {"violation": violations.max(axis=1)}


def write_meshes(
    film: Film, kind: str, folder: Path, track: Track = untracked, digits: int = 4
) -> list[Path]:
    """One file a state, and for VTU the collection `frames.pvd` that gives their times."""
    paths = []
    states: Iterable[State] = track(film.states, f"writing {kind.upper()}", len(film.states))
    for state in states:
        path = folder / f"frame-{state.step:0{digits}d}.{kind}"
        meshio.write(path, _mesh(film.problem, state.positions, kind))
        paths.append(path)
    if kind == "vtu":
        times = [float(f.step) if f.time is None else f.time for f in film.states]
        paths.append(write_collection(folder / "frames.pvd", times, paths))
    return paths


def _mesh(problem: Problem, positions: FloatArray, kind: str) -> meshio.Mesh:
    if kind != "vtu":
        return meshio.Mesh(positions, [("triangle", surface(problem)[0].astype(np.int32))])
    cell = "triangle" if problem.elements.shape[1] == 3 else "tetra"
    data = {name: [values] for name, values in element_data(problem, positions).items()}
    return meshio.Mesh(positions, [(cell, problem.elements)], cell_data=data)


def write_collection(path: Path, times: Iterable[float], files: Iterable[Path]) -> Path:
    """A ParaView collection: which file shows which time [s]."""
    root = ET.Element("VTKFile", type="Collection", version="0.1")
    collection = ET.SubElement(root, "Collection")
    for time, file in zip(times, files, strict=True):
        ET.SubElement(collection, "DataSet", timestep=f"{time:.9g}", part="0", file=file.name)
    ET.indent(root)
    ET.ElementTree(root).write(path, encoding="utf-8", xml_declaration=True)
    return path
