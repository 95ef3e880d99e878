"""Garments: meshes from files, their rest shapes, and what is said of bad files."""

from __future__ import annotations

from itertools import islice

import meshio
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scenarios.garment import DATA, Garment, doubled_areas, skirt
from strainbench.physics.cloth import Cloth
from strainbench.scenario.meshfile import MeshFile, flattened, read_mesh, write_obj
from tests.problems import hessian


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
        (TRIANGLE + "f 1 2 7\n", "line 4: a face names vertex 7 of 3"),
        (TRIANGLE + "f 1 2 0\n", "line 4: f 1 2 0 .*vertex 0 of 3"),
        (TRIANGLE.replace("1", "nan") + "f 1 2 3\n", "is not finite"),
        (TRIANGLE + "f 1 2 x\n", "line 4: f 1 2 x"),
        ("v 0 0\n", "line 1: v 0 0"),
        (TRIANGLE + "vt 0 0\nf 1/1 2/1 3/2\n", "line 5: .* texture coordinate 2 of 1"),
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
    assert scene.cloth().gradient(problem.target)[0]["membrane"] < 1e-20
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
    _, bending = Garment(resolution=4).cloth().energies
    quads, weights = bending.elements, bending.weights
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
    (values, gradient), (others, same) = one.gradient(x), other.gradient(x)
    assert values == pytest.approx(others, rel=1e-13)
    np.testing.assert_allclose(gradient, same, rtol=1e-13)
    ones = np.ones(5)
    np.testing.assert_allclose(hessian(one, x, ones).data, hessian(other, x, ones).data, rtol=1e-12)


@pytest.mark.parametrize(
    ("key", "value"), [("scale", 0.0), ("rest", "flat"), ("pin_fraction", 1.0), ("up", "Z")]
)
def test_wrong_values_are_named(key, value):
    with pytest.raises(ValueError, match=f"{key} is {value!r}"):
        Garment(**{key: value})


# --- files as people have them

L_SHAPE = "v 2 0 0\nv 2 1 0\nv 1 1 0\nv 1 2 0\nv 0 2 0\nv 0 0 0\n"
SQUARE = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"
FACE = "f 1 2 3\n"


def area(mesh):
    a, b, c = np.moveaxis(mesh.positions[mesh.elements], 1, 0)
    return 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()


def written(tmp_path, content, name="mesh.obj"):
    path = tmp_path / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


@pytest.mark.parametrize(
    "turn", [np.eye(3), np.roll(np.eye(3), 1, axis=0), [[0.6, 0.8, 0], [-0.8, 0.6, 0], [0, 0, 1]]]
)
@pytest.mark.parametrize("first", range(6))
@pytest.mark.parametrize("back", [1, -1])
def test_a_concave_face_has_its_area_however_it_is_turned(tmp_path, turn, first, back):
    points = np.array([line.split()[1:] for line in L_SHAPE.splitlines()], float) @ turn
    face = np.roll(np.arange(1, 7), first)[::back]
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in points.tolist()]
    mesh = read_mesh(written(tmp_path, "\n".join([*lines, "f " + " ".join(map(str, face))])))
    assert mesh.elements.shape == (4, 3)
    assert area(mesh) == pytest.approx(3, rel=1e-12)
    a, b, c = np.moveaxis(mesh.positions[mesh.elements], 1, 0)
    normals = np.cross(b - a, c - a)
    assert np.all(normals @ normals[0] > 0)  # all turn as the face does


def test_a_concave_face_keeps_its_texture(tmp_path):
    places = L_SHAPE.replace(" 0\n", "\n").replace("v ", "vt ")
    mesh = read_mesh(
        written(tmp_path, L_SHAPE + places + "f " + " ".join(f"{i}/{i}" for i in range(1, 7)))
    )
    np.testing.assert_array_equal(mesh.texture, mesh.positions[mesh.elements][:, :, :2])


@pytest.mark.parametrize("name", ["face.ply", "FACE.PLY"])
def test_a_concave_face_of_a_ply_file(tmp_path, name):
    points = L_SHAPE.replace("v ", "").encode()
    head = (
        b"ply\nformat ascii 1.0\nelement vertex 6\nproperty float x\nproperty float y\n"
        b"property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
    )
    mesh = read_mesh(written(tmp_path, head + points + b"6 0 1 2 3 4 5\n", name))
    assert area(mesh) == pytest.approx(3)


@settings(max_examples=60, deadline=None)
@given(st.integers(3, 12), st.integers(0, 2**32 - 1))
def test_star_shaped_faces_have_the_area_of_the_shoelace_formula(tmp_path_factory, size, seed):
    rng = np.random.default_rng(seed)
    angle = 2 * np.pi * (np.arange(size) + rng.uniform(0, 0.4, size)) / size
    x, y = rng.uniform(0.3, 1, size) * np.array([np.cos(angle), np.sin(angle)])
    lines = [f"v {a!r} {b!r} 0" for a, b in zip(x.tolist(), y.tolist(), strict=True)]
    face = "f " + " ".join(map(str, range(1, size + 1)))
    mesh = read_mesh(written(tmp_path_factory.mktemp("star"), "\n".join([*lines, face])))
    expected = 0.5 * abs(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))
    assert area(mesh) == pytest.approx(expected, rel=1e-9)
    assert len(mesh.elements) == size - 2
    assert len(mesh.positions) == size


def test_a_vertex_in_the_middle_of_a_side_is_kept(tmp_path):
    text = "v 0 0 0\nv 1 0 0\nv 2 0 0\nv 2 1 0\nv 0 1 0\nf 1 2 3 4 5\n"
    mesh = read_mesh(written(tmp_path, text))
    assert len(mesh.positions) == 5
    assert area(mesh) == pytest.approx(2)


@pytest.mark.parametrize(
    "content",
    [
        b"\xef\xbb\xbf" + (TRIANGLE + FACE).encode(),
        (TRIANGLE + FACE).encode("utf-16"),
        b"# caf\xe9\n" + (TRIANGLE + FACE).encode(),
        "# \uce58\ub9c8\n".encode("cp949") + (TRIANGLE + FACE).encode(),
        b"# \x95\\\n" + TRIANGLE.encode() + b"g \x95\\\nf 1 2 3\n",  # half of a Shift-JIS sign
        (TRIANGLE + "f 1 \\\n2 \\\n 3\n").encode(),
        (TRIANGLE + FACE).replace("\n", "\r\n").encode(),
        (TRIANGLE + FACE).replace("\n", "\r").encode(),
        (TRIANGLE + FACE).replace(" ", "\t").encode(),
        (TRIANGLE + "f -3 -2 -1").encode(),
        (TRIANGLE + "vn 0 0 1\nf 1//1 2//1 3//1\nl 1 2\np 3\n").encode(),
        (TRIANGLE + "o one\ng two # of them\nusemtl m\ns 1\nf 1 2 3 # the last\n").encode(),
        b"v 0 0 0 1 0 0\nv 1e0 0 0 1 0 0\nv 0 1.0E+00 0 .5 0 0\nf 1 2 3\n",
        ("f 1 2 3\n" + TRIANGLE).encode(),
    ],
)
def test_what_people_write_is_read_right(tmp_path, content):
    mesh = read_mesh(written(tmp_path, content))
    np.testing.assert_array_equal(mesh.positions, [[0, 0, 0], [1, 0, 0], [0, 1, 0]])
    np.testing.assert_array_equal(mesh.elements, [[0, 1, 2]])


UV = "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (SQUARE + UV + "f 1/1 2/2 3/3\nf 1 3 4\n", "line 10: a face without texture coordinates"),
        (SQUARE + UV + "f 1/1 2/2 3\n", "line 9: a face without texture coordinates"),
        (SQUARE + UV + "f 1/1 2/2 3/-9\n", "line 9: .*texture coordinate -9 of 4"),
        (SQUARE + UV + "f 1/1 2/2 3/0\n", "line 9: .*texture coordinate 0 of 4"),
        (SQUARE + "f 1/1 2/2 3/3\n", "line 5: .*texture coordinate 1 of 0"),
        (SQUARE + "f -5 1 2\n", "line 5: .*vertex -5 of 4"),
        (SQUARE + "f 1 2\n", "line 5: f 1 2 .*three corners"),
        (SQUARE + "f 1 2 3/1/1/1\n", "line 5: .*no corner"),
        (SQUARE + "f 1 3 2 4\n", "line 5: a face that crosses itself|line 5: a face without area"),
        ("v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n", "line 4: a face without area"),
        ("v 0 0 0\nv 0 0 0\nv 2 0 0\nf 1 2 3\n", "no face has three different corners"),
        ("v 0,5 0 0\n", "line 1: v 0,5 0 0"),
        (SQUARE + "f 1 1 2\n", "no face has three different corners"),
        (SQUARE + "f " + 999 * "1 " + "x\n", r"line 5: f 1 1 1 .*\.\.\."),
    ],
)
def test_what_cannot_be_read_right_is_a_line_that_names_it(tmp_path, text, said):
    with pytest.raises(ValueError, match=said) as error:
        Garment(path=str(written(tmp_path, text)))
    assert "\n" not in str(error.value)
    assert len(str(error.value)) < 400


def test_a_texture_that_is_not_wanted_is_not_looked_at(tmp_path):
    path = written(tmp_path, SQUARE + UV + "f 1/1 2/2 3/3\nf 1 3 4\n")
    assert Garment(path=str(path), rest="flattened").problem().measures.sum() == pytest.approx(1)


def test_extensions_and_folders_are_named(tmp_path):
    (tmp_path / "folder.obj").mkdir()
    with pytest.raises(ValueError, match="a folder, no mesh file"):
        read_mesh(tmp_path / "folder.obj")
    with pytest.raises(ValueError, match=r"\.xyz: valid extensions are .*\.obj.*\.stl"):
        read_mesh(written(tmp_path, "1 2 3", "a.xyz"))
    assert len(read_mesh(written(tmp_path, TRIANGLE + FACE, "A.OBJ")).elements) == 1


@pytest.mark.parametrize("suffix", [".ply", ".stl", ".vtk", ".vtu"])
def test_a_file_cut_in_two_is_refused(tmp_path, bumpy, suffix):
    path = tmp_path / f"bumpy{suffix}"
    meshio.Mesh(bumpy.positions, [("triangle", bumpy.elements.astype(np.int32))]).write(
        path, binary=True
    )
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 2])
    with pytest.raises(ValueError, match="not a readable mesh") as error:
        read_mesh(path)
    assert "\n" not in str(error.value)


def test_volumes_are_refused(tmp_path):
    points = np.vstack([np.zeros(3), np.eye(3)])
    meshio.Mesh(points, [("tetra", [[0, 1, 2, 3]])]).write(tmp_path / "a.vtk")
    with pytest.raises(ValueError, match="cells of type tetra; valid are triangle, quad, polygon"):
        read_mesh(tmp_path / "a.vtk")


# --- doubled faces, parts, up axes, patterns


def sheet_file(tmp_path, resolution=4, sides="front", wide=1.0, high=0.6, texture=None):
    """A wide x high m panel of quadrilaterals in the xy plane."""
    ticks = np.linspace(0, 1, resolution + 1)
    lines = [f"v {wide * s} {high * t} 0" for s in ticks for t in ticks]
    if texture is not None:
        lines += [f"vt {texture[0] * s} {texture[1] * t}" for s in ticks for t in ticks]
    for i in range(resolution):
        for j in range(resolution):
            a = i * (resolution + 1) + j + 1
            face = [a, a + resolution + 1, a + resolution + 2, a + 1]
            names = [f"{v}/{v}" if texture is not None else str(v) for v in face]
            lines += ["f " + " ".join(names)] if sides != "back" else []
            lines += ["f " + " ".join(reversed(names))] if sides != "front" else []
    return written(tmp_path, "\n".join(lines), f"{sides}.obj")


def test_a_sheet_with_two_sides_is_the_sheet(tmp_path, rng):
    one, two = (Garment(path=str(sheet_file(tmp_path, sides=sides))) for sides in ("front", "both"))
    assert one.notes() == []
    assert [n for n in two.notes() if "16 of 32 faces that repeat the corners of others" in n]
    np.testing.assert_allclose(one.cloth().mass, two.cloth().mass)
    x = one.problem().target + 0.01 * rng.normal(size=one.problem().target.shape)
    np.testing.assert_allclose(*(c.cloth().gradient(x)[0]["bending"] for c in (two, one)))


def test_sides_with_vertices_of_their_own_are_one_sheet_too(tmp_path):
    back = SQUARE + "f -1 -2 -3 -4\n"
    scene = Garment(path=str(written(tmp_path, SQUARE + "f 1 2 3 4\n" + back)))
    assert len(scene.problem().target) == 4
    assert scene.problem().measures.sum() == pytest.approx(1)


def test_a_quadrilateral_with_a_doubled_corner_is_a_triangle(tmp_path):
    mesh = read_mesh(written(tmp_path, SQUARE + "f 1 2 3 3\nf 1 1 3 4\nf 2 2 3\n"))
    np.testing.assert_array_equal(mesh.elements, [[0, 1, 2], [0, 2, 3]])
    assert mesh.notes == (
        "1 of 3 faces with fewer than three different corners are left out (first: line 7)",
    )


def test_an_atlas_is_no_pattern(tmp_path):
    path = str(sheet_file(tmp_path, texture=(1, 1)))
    with pytest.raises(ValueError, match=r"1 to 1\.67 times those in space, so it is no pattern"):
        Garment(path=path)
    flat = Garment(path=path, rest="flattened").cloth().mass.sum()
    right = Garment(path=str(sheet_file(tmp_path, texture=(1.0, 0.6)))).cloth().mass.sum()
    assert flat == pytest.approx(right, rel=1e-12)
    assert right == pytest.approx(0.06, rel=0.01)


def test_a_texture_can_be_forced(tmp_path):
    scene = Garment(path=str(sheet_file(tmp_path, texture=(1, 1))), rest="texture")
    assert scene.problem().measures.sum() == pytest.approx(1)
    assert any(
        "1.67 times those in space; the texture is its rest shape" in n for n in scene.notes()
    )


def test_a_pattern_that_fits_roughly_is_taken_with_a_word(tmp_path):
    scene = Garment(path=str(sheet_file(tmp_path, texture=(0.9, 0.6))))
    assert scene.problem().measures.sum() == pytest.approx(0.54)
    assert len(scene.notes()) == 1
    assert "0.9" in scene.notes()[0]
    exact = Garment(path=str(sheet_file(tmp_path, texture=(-1.0, 0.6))))  # mirrored
    assert exact.notes() == []


def test_parts_without_a_pin_are_said(tmp_path):
    low = "v 0 -3 0\nv 1 -3 0\nv 1 -2 0\n"
    notes = Garment(path=str(written(tmp_path, SQUARE + "f 1 2 3 4\n" + low + "f 5 6 7\n"))).notes()
    assert len(notes) == 1
    assert "1 of its 2 parts have no pin and fall" in notes[0]


def test_cloth_that_is_not_joined_and_odd_edges_are_said(tmp_path):
    apart = SQUARE + "f 1 2 3\n" + SQUARE + "f 5 7 8\n"
    assert any(
        "2 vertices lie on others" in n for n in Garment(path=str(written(tmp_path, apart))).notes()
    )
    fin = SQUARE + "v 0.5 0.5 1\nf 1 2 3\nf 1 3 4\nf 1 3 5\n"
    assert any(
        "1 edges belong to more than two" in n
        for n in Garment(path=str(written(tmp_path, fin))).notes()
    )


def test_an_up_axis_is_said_and_set(tmp_path):
    mesh = skirt(3)
    x, y, z = mesh.positions.T
    files = {"y": (x, y, z), "z": (x, -z, y), "x": (y, -x, z)}
    scenes = {}
    for up, axes in files.items():
        path = tmp_path / f"{up}.obj"
        write_obj(path, MeshFile(np.column_stack(axes), mesh.elements, mesh.texture))
        scenes[up] = Garment(path=str(path), up=up)
        np.testing.assert_array_equal(scenes[up].problem().target, mesh.positions)
        assert scenes[up].notes() == []
    assert any("up=z" in n for n in Garment(path=scenes["z"].path).notes())
    assert Garment(path=scenes["y"].path).notes() == []
    assert not any("up=z" in n for n in Garment(path=scenes["z"].path, up="y").notes())


def test_a_flat_sheet_hangs_along_its_plane(tmp_path):
    assert Garment(path=str(sheet_file(tmp_path))).notes() == []
    text = sheet_file(tmp_path).read_text()
    lying = [
        " ".join([v, a, c, b])
        for v, a, b, c in (x.split() for x in text.splitlines() if x[0] == "v")
    ]
    faces = [x for x in text.splitlines() if x[0] == "f"]
    notes = Garment(path=str(written(tmp_path, "\n".join(lying + faces), "flat.obj"))).notes()
    assert any("up=z" in n for n in notes)
    assert any("all its vertices are pinned" in n for n in notes)


def test_the_home_folder_is_found(tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", str(tmp_path))
    written(tmp_path, TRIANGLE + FACE, "mine.obj")
    scene = Garment(path="~/mine.obj")
    assert scene.path == str(tmp_path / "mine.obj")
    assert len(scene.problem().elements) == 1
