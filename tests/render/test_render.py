"""Pictures, animations, mesh series and polar plots: written, readable, and true."""

from __future__ import annotations

import shutil
import xml.etree.ElementTree as ET
from dataclasses import replace

import meshio
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from PIL import Image

from strainbench import PrincipalLimits, Problem, StretchLimits
from strainbench.bench.plan import plan_one
from strainbench.render import FORMATS, Camera, Film, Picture, render, write_film
from strainbench.render.animation import durations
from strainbench.render.export import surface
from strainbench.render.film import State, measured, principal_stretches, shoot
from strainbench.render.picture import DPI, SIZE, nice_above
from strainbench.render.planes import directions, uniaxial
from strainbench.render.polar import admissible, directional_stretches, draw_polar, polar
from tests.cli.test_cli import strainbench
from tests.problems import random_problem, rotation

SMALL = ["resolution=3"]
PIXELS = (round(SIZE[0] * DPI), round(SIZE[1] * DPI))


@pytest.fixture(scope="module")
def film():
    cell = plan_one("swing", "clarabel", SMALL, 5, 1e-6)
    return shoot(cell, every=2)


def vars_of(film):
    """What a film has beside its names."""
    return film.problem, film.states, film.interval


def stretched(rng, stretches=(1.3, 0.8)):
    """A problem, and positions under one affine map with these principal stretches."""
    problem = random_problem(rng, directions=4, limit=0.1)
    F = rotation(rng)[:, :2] * stretches @ rotation(rng, 2).T
    return problem, F, problem.rest @ F.T + rng.normal(size=3)


def test_a_film_keeps_the_start_each_kth_step_and_the_last(film):
    assert [f.step for f in film.states] == [0, 2, 4, 5]
    assert [f.time for f in film.states] == pytest.approx([0, 2 / 60, 4 / 60, 5 / 60])
    assert film.interval == pytest.approx(2 / 60)
    assert not film.stopped
    for frame in film.states:
        assert film.problem.violations(frame.positions).max() < 1e-5


def test_principal_stretches_of_an_affine_map(rng):
    problem, _, x = stretched(rng)
    assert principal_stretches(problem, x) == pytest.approx(
        np.tile([1.3, 0.8], (len(problem.elements), 1))
    )


def test_directional_stretches_of_an_affine_map(rng):
    problem, F, x = stretched(rng)
    angles = np.linspace(0, np.pi, 7)
    expected = np.linalg.norm(F @ [np.cos(angles), np.sin(angles)], axis=0)
    found = directional_stretches(problem, x, angles)
    assert found == pytest.approx(np.tile(expected, (len(problem.elements), 1)))


@pytest.mark.parametrize("directions", [2, 4, 9])
def test_between_equal_samples_the_stretch_reaches_b_over_cos(directions):
    limits = StretchLimits.isotropic(1.01, directions)
    samples = np.arctan2(limits.directions[:, 1], limits.directions[:, 0])
    assert admissible(limits, samples) == pytest.approx(np.full(directions, 1.01), rel=1e-6)
    between = samples + np.pi / (2 * directions)
    assert admissible(limits, between) == pytest.approx(
        np.full(directions, 1.01 / np.cos(np.pi / (2 * directions))), rel=1e-4
    )


def test_no_answer_lies_outside_what_the_samples_admit(rng):
    limits = StretchLimits.sampled([0.1, 0.9, 1.7, 2.6], [1.1, 1.3, 1.05, 1.2])
    angles = np.linspace(0, np.pi, 12)
    d = np.column_stack([np.cos(angles), np.sin(angles)])
    most = admissible(limits, angles)
    for _ in range(50):
        F = rng.normal(size=(3, 2))
        F /= (np.linalg.norm(limits.directions @ F.T, axis=1) / limits.bounds).max()
        assert np.all(np.linalg.norm(d @ F.T, axis=1) <= most * (1 + 1e-4))


def test_one_sample_leaves_other_directions_free():
    assert np.isinf(admissible(StretchLimits.isotropic(1.01, 1), np.array([0.0])))


@pytest.mark.parametrize("kind", ["obj", "ply", "vtu"])
def test_meshes_read_back(film, kind, tmp_path):
    write_film(film, [kind], tmp_path)
    for frame in film.states:
        mesh = meshio.read(tmp_path / f"frame-{frame.step:04d}.{kind}")
        assert mesh.points == pytest.approx(frame.positions, abs=1e-12)
        assert np.array_equal(mesh.cells_dict["triangle"], film.problem.elements)


def test_vtu_carries_stretches_and_violation(film, tmp_path):
    write_film(film, ["vtu"], tmp_path)
    mesh = meshio.read(tmp_path / "frame-0005.vtu")
    x = film.states[-1].positions
    data = {name: values[0] for name, values in mesh.cell_data.items()}
    stretches = principal_stretches(film.problem, x)
    assert data["principal_stretch_1"] == pytest.approx(stretches[:, 0])
    assert data["principal_stretch_2"] == pytest.approx(stretches[:, 1])
    violations = film.problem.violations(x).reshape(len(stretches), -1).max(axis=1)
    assert data["violation"] == pytest.approx(violations)


def test_the_collection_gives_every_file_its_time(film, tmp_path):
    write_film(film, ["vtu"], tmp_path)
    entries = list(ET.parse(tmp_path / "frames.pvd").iter("DataSet"))
    assert [float(e.get("timestep")) for e in entries] == pytest.approx(
        [f.time for f in film.states]
    )
    assert all((tmp_path / e.get("file")).exists() for e in entries)


def two_tetrahedra():
    rest = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]], dtype=float)
    elements = np.array([[0, 1, 2, 3], [1, 2, 3, 4]])
    limits = StretchLimits(np.eye(3), np.full(3, 1.1))
    return Problem(rest, elements, 1.2 * rest, limits)


def test_of_tetrahedra_the_outer_faces_are_seen(tmp_path):
    problem = two_tetrahedra()
    faces, owner = surface(problem)
    assert len(faces) == 6
    assert [1, 2, 3] not in np.sort(faces).tolist()
    for face, element in zip(faces, owner, strict=True):
        assert set(face) <= set(problem.elements[element])
    a, b, c = np.moveaxis(problem.rest[faces], 1, 0)
    assert np.linalg.det(np.stack([a, b, c], axis=1)).sum() / 6 == pytest.approx(1 / 6 + 1 / 3)
    film = Film("two", "none", problem, [State(0, None, problem.target)], None)
    write_film(film, ["png", "ply", "vtu"], tmp_path)
    assert len(meshio.read(tmp_path / "frame-0000.ply").cells_dict["triangle"]) == 6
    volume = meshio.read(tmp_path / "frame-0000.vtu")
    assert np.array_equal(volume.cells_dict["tetra"], problem.elements)
    assert volume.cell_data["principal_stretch_3"][0] == pytest.approx(np.full(2, 1.2))


def test_pictures_and_their_animation(film, tmp_path):
    lines = write_film(film, ["png", "gif"], tmp_path)
    assert lines == [
        f"wrote 4 files, {tmp_path}/frame-0000.png to frame-0005.png",
        f"wrote {tmp_path}/animation.gif",
    ]
    with Image.open(tmp_path / "frame-0004.png") as picture:
        assert picture.size == PIXELS
        assert len(picture.convert("RGB").getcolors(maxcolors=PIXELS[0] * PIXELS[1])) > 50
    with Image.open(tmp_path / "animation.gif") as animation:
        assert animation.size == PIXELS
        assert animation.n_frames == 4


def test_the_gif_alone_leaves_no_pictures(film, tmp_path):
    write_film(film, ["gif"], tmp_path)
    assert [p.name for p in tmp_path.iterdir()] == ["animation.gif"]


@pytest.mark.parametrize(("interval", "total"), [(1 / 60, 2000), (1 / 30, 3330), (None, 10000)])
def test_an_animation_lasts_as_long_as_the_scene(interval, total):
    each = durations(100, interval)
    assert sum(each) == total
    assert set(np.mod(each, 10)) == {0}  # a GIF's own unit


def test_without_ffmpeg_mp4_is_left_out_in_one_line(film, tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", "")
    assert write_film(film, ["mp4"], tmp_path) == ["left out mp4: no ffmpeg on the path"]


@pytest.mark.skipif(shutil.which("ffmpeg") is None, reason="no ffmpeg on the path")
def test_with_ffmpeg_there_is_a_video(film, tmp_path):
    assert write_film(film, ["mp4"], tmp_path) == [f"wrote {tmp_path}/animation.mp4"]
    assert b"ftyp" in (tmp_path / "animation.mp4").read_bytes()[:16]


def test_an_ffmpeg_that_fails_is_one_line(film, tmp_path, monkeypatch):
    fake = tmp_path / "ffmpeg"
    fake.write_text("#!/bin/sh\necho Unknown encoder >&2\nexit 1\n")
    fake.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(ValueError, match="ffmpeg failed: Unknown encoder"):
        write_film(film, ["mp4"], tmp_path)


def test_scale_and_camera_stay_the_same_over_a_film(film):
    picture = Picture(film)
    before = picture.norm.vmin, picture.norm.vmax, picture.ax.get_xlim(), picture.ax.get_ylim()
    images = [picture.draw(k) for k in range(len(film.states))]
    after = picture.norm.vmin, picture.norm.vmax, picture.ax.get_xlim(), picture.ax.get_ylim()
    assert before == after
    bars = [image[:, int(0.84 * PIXELS[0]) :] for image in images]  # colour bar and its labels
    assert all(np.array_equal(bars[0], bar) for bar in bars)
    assert not np.array_equal(images[0], images[-1])


def test_the_scale_holds_the_limits_and_what_is_seen(film):
    top = Picture(film).norm.vmax
    assert top > 1.0
    assert top >= 100 * max(np.quantile(s, 0.999) for s in film.strains)
    assert Picture(film, top=0.2).norm.vmax == 20


def test_every_frame_lies_within_the_picture(film):
    picture = Picture(film, Camera(-50, 70))
    low, high = np.transpose([picture.ax.get_xlim(), picture.ax.get_ylim()])
    for frame in film.states:
        seen = picture.camera.view(frame.positions)[:, :2]
        assert np.all((low < seen) & (seen < high))


def test_nothing_is_cut_off_or_overlaps(film):
    long = Film("swing " * 40, "clarabel[" + 60 * "x=1," + "]", *vars_of(film))
    picture = Picture(long)
    picture.draw(1)
    renderer = picture.canvas.get_renderer()
    heading, line = (t.get_window_extent(renderer) for t in (picture.heading, picture.line))
    assert not heading.overlaps(line)
    box = picture.figure.get_tightbbox(renderer)
    assert box.x0 >= 0
    assert box.y0 >= 0
    assert box.x1 <= SIZE[0]
    assert box.y1 <= SIZE[1]


def test_the_camera_sees_lengths_in_its_plane_as_they_are(rng):
    axes = Camera(*rng.uniform(-90, 90, 2)).axes
    assert axes @ axes.T == pytest.approx(np.eye(3))
    assert np.linalg.det(axes) == pytest.approx(1)
    assert Camera(0, 0).view(np.array([[1.0, 2.0, 3.0]])) == pytest.approx(np.array([[1, 2, 3]]))


def test_a_picture_says_what_is_kept_and_how_far_the_cloth_goes_between():
    rest = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])

    def said(stretches, limits):
        positions = np.column_stack([rest * stretches, np.zeros(3)])
        return measured(Problem(rest, np.array([[0, 1, 2]]), positions, limits), positions)

    one = StretchLimits.sampled([0.0], [1.01])
    assert said((1.01 + 1e-7, 1.023), one).startswith("1 sampled direction within 1e-07 of 1%")
    assert said((1.01 + 1e-7, 1.023), one).endswith("; between them up to 2.30%")
    assert said((1.0, 1.005), one) == "1 sampled direction within 1%; largest strain 0.50%"
    assert said((1.03, 1.0), one).startswith("1 sampled direction up to 2.00% beyond 1%")
    exact = StretchLimits.exact(1.01)
    assert said((1.01, 1.0), exact) == "principal stretch within 1%; largest strain 1.00%"
    curve = StretchLimits.sampled([0.0, np.pi / 2], [1.01, 1.3])
    assert said((1.0, 1.2), curve) == "2 sampled directions within 1% to 30%; largest strain 20.00%"


def test_a_picture_says_how_deep_the_cloth_is_in_an_obstacle(film):
    from strainbench.physics.energies.contact import Floor

    for heights, said in (((-9.0,), ""), ((0.0025, -9.0), "vertices up to 2.5 mm inside")):
        picture = Picture(replace(film, obstacles=tuple(Floor(h) for h in heights)))
        picture.draw(0)
        assert said in picture.line.get_text()
        assert ("inside" in picture.line.get_text()) == bool(said)


@pytest.mark.parametrize(
    ("value", "above"), [(1, 1), (1.01, 1.5), (0.0301, 0.04), (9, 10), (101, 150), (0.02, 0.02)]
)
def test_round_numbers(value, above):
    assert nice_above(value) == pytest.approx(above)


def test_a_solver_that_fails_ends_the_film_early(tmp_path):
    (tmp_path / "weak.py").write_text(
        "import numpy as np\n"
        "from strainbench import Solution, Solver\n"
        "class Weak(Solver):\n"
        "    'Gives up when the sheet has fallen (nobody)'\n"
        "    name = 'weak'\n"
        "    def solve(self, problem, state, **_):\n"
        "        fallen = problem.target[:, 1].min() < -0.02\n"
        "        return Solution(problem.target * (np.nan if fallen else 1), 'tired', 1)\n"
    )
    lines = render("swing", str(tmp_path / "weak.py"), SMALL, 9, 1, "png", tmp_path)
    assert "weak ended in step" in lines[0]
    assert "'tired'" in lines[0]
    assert (tmp_path / "frame-0001.png").exists()
    assert not (tmp_path / "frame-0009.png").exists()


@pytest.mark.parametrize("suffix", ["svg", "png", "pdf"])
def test_polar_plots(suffix, tmp_path):
    path = tmp_path / "sub" / f"polar.{suffix}"
    lines = polar("swing", "clarabel,none", SMALL, 3, path)
    assert lines == [f"wrote {path}"]
    if suffix == "svg":
        words = path.read_text()
        for word in ("clarabel", "none", "its 4 samples", "warp", "%"):
            assert word in words


def test_a_polar_plot_cuts_nothing_off(film):
    named = Film(film.scene, "gauss-seidel[" + 9 * "max_sweeps=50," + "]", *vars_of(film))
    torn = Film(film.scene, "none", film.problem, [State(5, 0.1, 3 * film.problem.target)], None)
    figure = draw_polar([film, named, torn])
    assert "beyond the axis" in " ".join(t.get_text() for t in figure.legends[0].get_texts())
    box = figure.get_tightbbox(FigureCanvasAgg(figure).get_renderer())
    width, height = figure.get_size_inches()
    assert box.x0 >= 0
    assert box.y0 >= 0
    assert box.x1 <= width
    assert box.y1 <= height


RENDER = ["render", "swing", "--set", "resolution=2", "--steps", "1"]
POLAR = ["polar", "swing", "--set", "resolution=2", "--steps", "1"]


@pytest.mark.parametrize(
    ("words", "line"),
    [
        ([*RENDER, "--format", "png,bmp"], f"--format bmp: valid are {', '.join(FORMATS)}"),
        ([*RENDER, "--steps", "0"], "--steps 0: a whole number above 0 is valid"),
        ([*RENDER, "--every", "0"], "--every 0: a whole number above 0 is valid"),
        ([*RENDER, "-o", "file/pictures"], "file/pictures cannot be written to"),
        ([*RENDER, "--set", "limit=1%,2%"], "give 2 scenes: one at a time"),
        ([*RENDER, "--solver", "none,clarabel"], "give 2 solvers (none, clarabel): one is valid"),
        ([*RENDER, "--scale", "-1"], "--scale -1: a strain above 0 is valid"),
        ([*RENDER, "--camera", "30"], "--camera 30: AZIMUTH,ELEVATION in degrees is valid"),
        (["render", "swim"], "no scenario called 'swim'; valid are"),
        ([*POLAR, "-o", "polar.bmp"], "-o polar.bmp: a name that ends in .svg, .png, .pdf"),
        ([*POLAR, "-o", "file/polar.svg"], "file cannot be written to"),
        ([*POLAR, "-o", "folder.svg"], "-o folder.svg cannot be written to"),
    ],
)
def test_a_wrong_word_is_one_line_and_exit_2(words, line, tmp_path):
    (tmp_path / "file").write_text("")
    (tmp_path / "folder.svg").mkdir()
    done = strainbench(*words, cwd=tmp_path)
    assert done.returncode == 2
    assert line in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1
    assert "Traceback" not in done.stdout


def test_obstacles_are_grey_surfaces_of_their_shape():
    from strainbench.physics.energies.contact import Floor, Sphere
    from strainbench.render.obstacles import patches

    cloth = np.array([[0.0, 1.0, 0.0], [2.0, 1.0, 1.0]])
    vertices, faces = patches([Sphere((1.0, 2.0, 3.0), 0.5), Floor(-1.0)], cloth)
    flat = vertices[:, 1] == -1.0
    np.testing.assert_allclose(np.linalg.norm(vertices[~flat] - [1, 2, 3], axis=1), 0.5)
    assert vertices[flat, 0].min() < 0 < 2 < vertices[flat, 0].max()
    assert vertices[flat, 2].min() < 0 < 1 < vertices[flat, 2].max()
    assert set(faces.ravel()) == set(range(len(vertices)))
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
    on_floor = flat[faces].all(axis=1)
    assert area[~on_floor].sum() == pytest.approx(4 * np.pi * 0.25, rel=0.01)
    assert area[on_floor].sum() == pytest.approx(2.6 * 1.6)


def test_a_ball_hides_what_is_behind_it_and_cloth_in_front_hides_the_ball():
    from scenarios.collision import SPHERE, Collision

    cell = plan_one("collision", "none", ["resolution=4"], 1, 1e-6)
    film = shoot(cell)
    assert film.obstacles == Collision().contact().obstacles == (SPHERE,)
    bare = replace(film, obstacles=())
    for elevation, hidden in ((90.0, True), (-90.0, False)):
        camera = Camera(0.0, elevation)
        ball, none = (Picture(f, camera).draw(0).astype(int) for f in (film, bare))
        changed = np.abs(ball - none).max(axis=2) > 40  # not but the seams between triangles
        assert np.any(changed) != hidden


def test_a_volumes_limits_are_drawn_in_the_planes_of_its_axes(tmp_path):
    path = tmp_path / "planes.svg"
    assert polar("beam", "none", ["resolution=1"], 2, path)[-1] == f"wrote {path}"
    text = path.read_text(encoding="utf-8")
    assert all(f">{plane}<" in text for plane in ("xy", "xz", "yz"))
    assert "limits on uniaxial strain" in text


def test_uniaxial_limits_in_a_plane():
    """Hyperbolic: d / |cos| to both sides, and nothing along the free axis; isotropic: d."""
    limits = PrincipalLimits("hyperbolic", (None, 0.95, 0.95), (None, 1.05, 1.05))
    u = directions((0, 1))
    allowed, cosine = uniaxial(limits, u, 1.0), np.abs(u[:, 1])
    seen = cosine > 0.01
    assert allowed[seen] == pytest.approx(0.05 / cosine[seen], abs=1e-6)
    assert np.all(np.isinf(allowed[cosine < 1e-12]))
    steep = cosine > 0.1
    assert uniaxial(limits, u, -1.0)[steep] == pytest.approx(-0.05 / cosine[steep], abs=1e-6)
    same = PrincipalLimits("isotropic", 0.9, 1.1)
    assert uniaxial(same, u, 1.0) == pytest.approx(0.1)
    assert uniaxial(StretchLimits.exact(1.1, dim=3), u, 1.0) == pytest.approx(0.1)
