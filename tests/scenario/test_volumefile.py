"""Tetrahedra from files: those of several formats, our own export, and what is wrong in one."""

from __future__ import annotations

import meshio
import numpy as np
import pytest

from scenarios.beam import Beam
from strainbench.bench.plan import plan_one
from strainbench.problem.grid import box_grid
from strainbench.render.export import write_meshes
from strainbench.render.film import shoot
from strainbench.scenario.stage import Stage
from strainbench.scenario.volumefile import read_volume
from strainbench.solver.registry import find_solver

POINTS, TETRA = box_grid((3, 1, 1), np.array([0.6, 0.2, 0.2]))


def written(path, points=POINTS, cells=(("tetra", TETRA),)):
    options = {"file_format": "gmsh22"} if path.suffix == ".msh" else {}
    meshio.write(path, meshio.Mesh(points, list(cells)), **options)
    return path


@pytest.mark.parametrize("name", ["a.msh", "a.vtu", "a.mesh"])
def test_gmsh_vtu_and_medit_are_read(tmp_path, name):
    beside = ("triangle", TETRA[:2, :3])
    extra = np.vstack([POINTS, [[9.0, 9.0, 9.0]]])  # in no tetrahedron
    points, elements = read_volume(written(tmp_path / name, extra, [beside, ("tetra", TETRA)]))
    np.testing.assert_allclose(points, POINTS)
    np.testing.assert_array_equal(elements, TETRA)


def test_a_beam_from_a_file_is_fixed_where_x_is_least_and_plays(tmp_path):
    scene = Beam(path=str(written(tmp_path / "a.vtu", POINTS - np.eye(3)[0])), step=0.01)
    assert len(scene.solid().pinned) == 4
    stage = Stage.opened(scene, find_solver("lcp-qp"))
    list(stage.steps(3))
    assert stage.positions[:, 1].min() < 0


def test_what_render_exports_is_read_back(tmp_path):
    film = shoot(plan_one("beam", "lcp-qp", ["step=0.02"], 2, 1e-6), every=2)
    path, *_ = write_meshes(film, "vtu", tmp_path)
    points, elements = read_volume(path)
    np.testing.assert_allclose(points, film.states[0].positions)
    np.testing.assert_array_equal(elements, film.problem.elements)
    assert len(Beam(path=str(path)).problem().elements) == 200


FLAT, TURNED = POINTS.copy(), TETRA.copy()
FLAT[:] *= [1, 1, 0]
TURNED[7, :2] = TETRA[7, 1::-1]
NOT_FINITE = POINTS.copy()
NOT_FINITE[3, 1] = np.nan
HEXES = ("hexahedron", np.arange(8)[None])


@pytest.mark.parametrize(
    ("points", "cells", "words"),
    [
        (FLAT, [("tetra", TETRA)], r"tetra\[0\] is \[.*\], flat, of volume "),
        (POINTS, [("tetra", TURNED)], r"tetra\[7\] is \[.*\], inverted, of volume -0\.00"),
        (POINTS, [("tetra", TETRA), HEXES], r"cells\[1\] is of type hexahedron: tetra, with"),
        (POINTS, [("triangle", TETRA[:, :3])], "cells: triangle, a mesh without volume; tetra is"),
        (NOT_FINITE, [("tetra", TETRA)], r"points\[3, 1\] is nan: every entry must be finite"),
    ],
)
def test_what_is_wrong_in_a_file_is_named_in_a_line(tmp_path, points, cells, words):
    path = written(tmp_path / "a.vtu", points, cells)
    with pytest.raises(ValueError, match=words) as error:
        Beam(path=str(path))
    assert str(error.value).startswith(str(path))
    assert "\n" not in str(error.value)


def test_files_that_are_none_are_named(tmp_path):
    with pytest.raises(ValueError, match="no such mesh file"):
        Beam(path=str(tmp_path / "a.msh"))
    with pytest.raises(ValueError, match="a folder, no mesh file"):
        read_volume(tmp_path)
    (tmp_path / "a.vtu").write_text("no mesh")
    with pytest.raises(ValueError, match="not a readable mesh"):
        read_volume(tmp_path / "a.vtu")
