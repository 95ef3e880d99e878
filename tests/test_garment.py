"""Garments: meshes from files, their rest shapes, and what is said of bad files."""

from __future__ import annotations

from itertools import islice

import meshio
import numpy as np
import pytest

from scenarios.garment import DATA, Garment, doubled_areas, skirt
from strainbench.meshfile import MeshFile, flattened, read_mesh, write_obj
from strainbench.physics.cloth import Cloth


@pytest.fixture
def bumpy(rng):
    """A mesh that lies flat nowhere."""
    mesh = skirt(3)
    return MeshFile(mesh.positions + 0.01 * rng.normal(size=mesh.positions.shape), mesh.elements)


@pytest.fixture
def rng():
    return np.random.default_rng(5)


def test_obj_with_texture_comes_back_as_it_was(tmp_path):
    mesh = skirt(3)
    write_obj(tmp_path / "skirt.obj", mesh)
    again = read_mesh(tmp_path / "skirt.obj")
    np.testing.assert_array_equal(again.positions, mesh.positions)
    np.testing.assert_array_equal(again.elements, mesh.elements)
    np.testing.assert_array_equal(again.texture, mesh.texture)


def test_obj_without_texture_comes_back_as_it_was(tmp_path, bumpy):
    write_obj(tmp_path / "bumpy.obj", bumpy)
    again = read_mesh(tmp_path / "bumpy.obj")
    np.testing.assert_array_equal(again.positions, bumpy.positions)
    np.testing.assert_array_equal(again.elements, bumpy.elements)
    assert again.texture is None


@pytest.mark.parametrize("suffix", [".ply", ".stl", ".vtk", ".off"])
def test_what_meshio_writes_comes_back(tmp_path, bumpy, suffix):
    path = tmp_path / f"bumpy{suffix}"
    meshio.Mesh(bumpy.positions, [("triangle", bumpy.elements)]).write(path)
    again = read_mesh(path)
    expected = bumpy.positions[bumpy.elements]
    np.testing.assert_allclose(again.positions[again.elements], expected, atol=1e-6)
    assert again.texture is None


def test_the_obj_reader_agrees_with_meshio(tmp_path):
    mesh = skirt(2)  # without its texture: meshio refuses an OBJ file with seams
    write_obj(tmp_path / "skirt.obj", MeshFile(mesh.positions, mesh.elements))
    ours, theirs = read_mesh(tmp_path / "skirt.obj"), meshio.read(tmp_path / "skirt.obj")
    np.testing.assert_array_equal(ours.positions, theirs.points)
    np.testing.assert_array_equal(ours.elements, theirs.cells[0].data)


def test_an_obj_of_the_wild(tmp_path):
    path = tmp_path / "wild.obj"
    path.write_text(
        "# a comment\nmtllib x.mtl\no sheet\nv 9 9 9\n"
        "v 0 0 0\nv 1 0 0 # said\nv 1 1 0\nv 0 1 0 1.0\nvn 0 0 1\n"
        "vt 0 0\nvt 1 0\nvt 1 1 0\nvt 0 1\n\ng a\nusemtl m\ns off\n"
        "f 2/1/1 3/2/1 4/3/1 5/4/1\n\ng b\nf -4/-4 -3/-3 -2/-2\n"
    )
    mesh = read_mesh(path)
    assert len(mesh.positions) == 4  # the first belongs to no triangle
    np.testing.assert_array_equal(mesh.elements, [[0, 1, 2], [0, 2, 3], [0, 1, 2]])
    np.testing.assert_array_equal(mesh.texture, mesh.positions[mesh.elements][:, :, :2])


def test_normals_alone_are_no_texture(tmp_path):
    (tmp_path / "n.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nf 1//1 2//1 3//1\n")
    assert read_mesh(tmp_path / "n.obj").texture is None


TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "no triangles"),
        (TRIANGLE, "no triangles"),
        (TRIANGLE + "f 1 2 7\n", "triangle 0 names vertex 7 of 3"),
        (TRIANGLE + "f 1 2 0\n", "triangle 0 names vertex 0 of 3"),
        (TRIANGLE.replace("1", "nan") + "f 1 2 3\n", "is not finite"),
        (TRIANGLE + "f 1 2 x\n", "line 4: f 1 2 x"),
        ("v 0 0\n", "line 1: v 0 0"),
        (TRIANGLE + "vt 0 0\nf 1/1 2/1 3/2\n", "texture coordinate 2 of 1"),
        (TRIANGLE + "vt 0 inf\nf 1/1 2/1 3/1\n", "texture coordinate .* is not finite"),
    ],
)
def test_a_bad_obj_gets_one_clear_line(tmp_path, text, said):
    path = tmp_path / "bad.obj"
    path.write_text(text)
    with pytest.raises(ValueError, match=said) as error:
        Garment(path=str(path))
    assert str(path) in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("name", ["bad.ply", "bad.vtk", "bad.xyz", "bad"])
def test_a_bad_file_of_another_kind_gets_one_clear_line(tmp_path, name, capsys):
    path = tmp_path / name
    path.write_bytes(b"nothing of the kind\x00\xff")
    with pytest.raises(ValueError, match="not a readable mesh") as error:
        Garment(path=str(path))
    assert "\n" not in str(error.value)


def test_a_missing_file_is_named():
    with pytest.raises(ValueError, match=r"nowhere/at-all\.obj: no such mesh file"):
        Garment(path="nowhere/at-all.obj")


def test_a_flattened_garment_is_unstrained(tmp_path, bumpy):
    write_obj(tmp_path / "bumpy.obj", bumpy)
    scene = Garment(path=str(tmp_path / "bumpy.obj"), scale=2.5)
    problem = scene.problem()
    F = problem.deformation_gradients(problem.target)
    squares = np.swapaxes(F, 1, 2) @ F
    np.testing.assert_allclose(squares, np.broadcast_to(np.eye(2), squares.shape), atol=1e-12)
    assert scene.cloth().energies(problem.target)[0] < 1e-20
    np.testing.assert_allclose(doubled_areas(scene.pattern()), 2 * problem.measures, rtol=1e-12)


def test_the_first_axis_of_a_flattened_triangle_is_horizontal(bumpy):
    flat = flattened(bumpy.positions, bumpy.elements)
    corners = bumpy.positions[bumpy.elements]
    edges, material = corners[:, 1:] - corners[:, :1], flat[:, 1:] - flat[:, :1]
    F = np.swapaxes(np.linalg.solve(material, edges), 1, 2)
    np.testing.assert_allclose(F[:, 1, 0], 0, atol=1e-12)
    assert np.all(F[:, 1, 1] > 0)


def test_a_horizontal_and_an_empty_triangle_flatten():
    x = np.array([[0.0, 0, 0], [1, 0, 0], [0, 0, 1], [2, 0, 0]])
    flat = flattened(x, np.array([[0, 1, 2], [0, 1, 3]]))
    assert doubled_areas(flat) == pytest.approx([1, 0])


def test_the_skirt_is_its_pattern_sewn_along_a_seam():
    mesh = skirt(6)
    corners = np.concatenate([mesh.elements[..., None], mesh.texture], axis=-1).reshape(-1, 3)
    places = len(np.unique(corners.round(12), axis=0))
    assert places == len(mesh.positions) + 7  # seven vertices of the seam lie on both its sides
    problem = Garment(resolution=6).problem()
    stretches = np.linalg.svd(problem.deformation_gradients(problem.target), compute_uv=False)
    assert np.abs(stretches - 1).max() < 5e-3


def test_the_seam_bends_as_any_edge():
    quads, weights = Garment(resolution=4).cloth()._hinges
    assert len(quads) == (3 * 128 - 32) // 2  # every edge but those of waist and hem
    on_seam = np.all(quads[:, :2] < 5, axis=1)  # vertices 0 to 4 are the seam
    middle = np.all((quads[:, :2] >= 40) & (quads[:, :2] < 45), axis=1)
    np.testing.assert_allclose(np.sort(weights[on_seam]), np.sort(weights[middle]), rtol=1e-10)


def test_the_shipped_skirt_is_the_built_in_one():
    assert (DATA / "skirt.obj").exists()
    shipped, ours = Garment(path="skirt.obj").problem(), Garment(resolution=6).problem()
    np.testing.assert_array_equal(shipped.target, ours.target)
    np.testing.assert_array_equal(shipped.rest, ours.rest)


def test_resolution_has_no_meaning_for_a_file():
    few, many = (Garment(path="skirt.obj", resolution=r).problem() for r in (2, 30))
    np.testing.assert_array_equal(few.elements, many.elements)


def test_the_waist_is_pinned():
    problem = Garment(resolution=5).problem()
    assert len(problem.pinned) == 20
    np.testing.assert_allclose(problem.target[problem.pinned, 1], 0)
    assert len(Garment(resolution=5, pin_fraction=0.25).problem().pinned) == 40
    tilted = Garment(path="skirt.obj", rest="flattened", pin_fraction=0.0)
    assert len(tilted.problem().pinned) == 24  # all are the highest


def test_scale_scales_mesh_and_pattern():
    small, large = (Garment(path="skirt.obj", scale=s).problem() for s in (1.0, 3.0))
    np.testing.assert_allclose(large.target, 3 * small.target)
    np.testing.assert_allclose(large.measures, 9 * small.measures)


def test_a_texture_that_is_no_pattern_is_refused(tmp_path):
    mesh = skirt(2)
    write_obj(tmp_path / "unit.obj", MeshFile(mesh.positions, mesh.elements, 20 * mesh.texture))
    with pytest.raises(ValueError, match=r"are 20.* rest=flattened does without"):
        Garment(path=str(tmp_path / "unit.obj")).problem()
    assert Garment(path=str(tmp_path / "unit.obj"), rest="flattened").problem().rows


def test_asking_for_texture_that_is_not_there(tmp_path, bumpy):
    write_obj(tmp_path / "bumpy.obj", bumpy)
    with pytest.raises(ValueError, match="no texture coordinates"):
        Garment(path=str(tmp_path / "bumpy.obj"), rest="texture").problem()


def test_a_file_plays(tmp_path):
    scene = Garment(path="skirt.obj")
    scene.warm_up()
    seen = []
    reports = list(islice(scene.play(lambda t: seen.append(t) or t), 2))
    assert all(r.newton_converged for r in reports)
    assert seen[1][:, 1].min() < seen[0][:, 1].min()


def test_rest_by_corner_is_the_same_cloth_where_nothing_is_sewn(rng):
    rest = rng.uniform(size=(5, 2))
    elements = np.array([[0, 1, 2], [2, 1, 3], [3, 4, 2]])
    x = rng.normal(size=(5, 3))
    one, other = (
        Cloth(r, elements, Garment().material(), np.array([0])) for r in (rest, rest[elements])
    )
    np.testing.assert_array_equal(one.mass, other.mass)
    for a, b in zip(one.energies(x), other.energies(x), strict=True):
        np.testing.assert_allclose(a, b, rtol=1e-13)
    ones = np.ones(5)
    np.testing.assert_allclose(one.hessian(x, ones).data, other.hessian(x, ones).data, rtol=1e-12)


@pytest.mark.parametrize(
    ("key", "value"), [("scale", 0.0), ("rest", "flat"), ("pin_fraction", 1.0)]
)
def test_wrong_values_are_named(key, value):
    with pytest.raises(ValueError, match=f"{key} is {value!r}"):
        Garment(**{key: value})
