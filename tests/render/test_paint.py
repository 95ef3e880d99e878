"""What lies before is drawn before, to the pixel; light, sides and outlines of surfaces."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from scenarios.collision import SPHERE, Collision
from strainbench.render.camera import Camera, Window
from strainbench.render.film import Film, State
from strainbench.render.obstacles import patches
from strainbench.render.paint import Surface, contours, corner_normals, greyer, paint
from strainbench.render.picture import STAGE, Picture
from strainbench.render.raster import nearest
from strainbench.render.stage import facing

RED, GREY = np.array([1.0, 0.0, 0.0]), np.full(3, 0.8)
TRIANGLE = np.array([[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [0.0, 1.0, 0.0]])
ONE = np.array([[0, 1, 2]])


def window_of(camera, *points, size=(90, 90)):
    return Window.around([camera.view(p) for p in points], size)


def at(image, camera, window, point):
    """The colour at a point's place in a picture."""
    x, y, _ = window.pixels(camera.view(point[None]))[0]
    return image[int(y), int(x)].astype(int)


def is_red(colour):
    return colour[0] > 100 and colour[1] < 30


def is_grey(colour):
    return np.ptp(colour) < 10


@pytest.mark.parametrize("angles", [(30.0, 32.0), (-70.0, 10.0), (0.0, 90.0), (200.0, -60.0)])
def test_a_triangle_before_the_ball_hides_it_and_one_behind_is_hidden(angles):
    camera, centre = Camera(*angles), np.array(SPHERE.centre)
    ball = patches([SPHERE], centre[None])
    towards = camera.axes[2]
    flat = 0.3 * SPHERE.radius * TRIANGLE @ camera.axes
    window = window_of(camera, ball[0])
    for side, seen in ((1.05, is_red), (0.95, is_grey), (-1.05, is_grey)):  # 0.95: within it
        place = centre + side * SPHERE.radius * towards
        image = paint([Surface(place + flat, ONE, RED), Surface(*ball, GREY)], camera, window)
        assert seen(at(image, camera, window, place))


def test_surfaces_that_cut_each_other_are_cut_at_the_line_where_they_do():
    camera = Camera(0.0, 0.0)
    upright = Surface(10 * TRIANGLE, ONE, GREY)
    corners = np.array([[-1.0, -0.1, -1.0], [-1.0, 0.1, -1.0], [1.0, 0.0, 1.0]])  # z = x
    window = Window((-1.0, -1.0), 0.01, (200, 200))
    row = paint([upright, Surface(corners, ONE, RED)], camera, window, 1)[100].astype(int)
    red = [is_red(colour) for colour in row]
    assert not any(red[:100])
    assert all(red[101:190])


def test_a_picture_has_cloth_before_the_ball_before_it():
    """The scene itself: the farthest and the nearest vertex over the middle of the ball."""
    problem = Collision(resolution=6).problem()
    camera, centre = Camera(), np.array(SPHERE.centre)
    middle = problem.target.mean(axis=0)
    colours = {}
    for name, side in (("before", 2.0), ("behind", -2.0)):
        moved = problem.target - middle + centre + side * SPHERE.radius * camera.axes[2]
        film = Film("collision", "none", problem, [State(0, 0.0, moved)], None, "", (SPHERE,))
        picture = Picture(film, camera, top=0.1)
        x, y, _ = picture.stage.window.pixels(camera.view(centre[None]))[0]
        image = picture.draw(0).astype(int)
        top = image.shape[0] - STAGE[1] - STAGE[3]
        colours[name] = image[top + int(y), STAGE[0] + int(x)]
    assert not is_grey(colours["before"])
    assert is_grey(colours["behind"])


def test_each_pixel_sees_the_nearest_triangle_and_no_hole_between_neighbours(rng):
    grid = rng.uniform(0, 40, size=(60, 3, 3))
    face, weights, depths = nearest(grid.reshape(-1, 3), np.arange(180).reshape(-1, 3), (40, 40))
    rows, columns = np.nonzero(face >= 0)
    seen = np.einsum("pk,pkc->pc", weights[rows, columns], grid[face[rows, columns]])
    np.testing.assert_allclose(seen[:, 0], columns + 0.5, atol=1e-6)
    np.testing.assert_allclose(seen[:, 1], rows + 0.5, atol=1e-6)
    np.testing.assert_allclose(seen[:, 2], depths[rows, columns], atol=1e-6)
    for triangle in grid:  # no other one lies before it
        edges = np.column_stack([triangle[1] - triangle[0], triangle[2] - triangle[0]])
        b, c = np.linalg.solve(edges[:2], (seen - triangle[0])[:, :2].T)
        inside = (b > 1e-6) & (c > 1e-6) & (b + c < 1 - 1e-6)
        depth = triangle[0, 2] + edges[2] @ [b, c]
        assert np.all(depth[inside] <= seen[inside, 2] + 1e-6)
    fan = np.array([[0.0, 0, 0], [40, 0, 0], [40, 40, 0], [0, 40, 0], [13.5, 17.5, 0]])
    around = np.array([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]])
    assert np.all(nearest(fan, around, (40, 40))[0] >= 0)


def test_what_lies_outside_of_the_window_is_left_out():
    points = np.array([[-1e6, -1e6, 0.0], [1e6, -1e6, 0.0], [0.0, 1e6, 0.0]])
    assert np.all(nearest(points, ONE, (5, 4))[0] == 0)
    assert np.all(nearest(points + np.array([1e7, 0, 0]), ONE, (5, 4))[0] == -1)
    assert np.all(nearest(points * [1, 0, 1], ONE, (5, 4))[0] == -1)  # edge-on


def test_the_back_of_a_surface_is_greyer_where_it_has_two_sides():
    window = window_of(Camera(0, 0), TRIANGLE)
    place = np.zeros(3)
    for sides in (True, False):
        sheet = Surface(TRIANGLE, ONE, RED, sides=sides)
        front, back = (
            at(paint([s], Camera(0, 0), window), Camera(0, 0), window, place)
            for s in (sheet, replace(sheet, faces=ONE[:, ::-1]))
        )
        assert is_red(front)
        expected = greyer(RED) * front[0] if sides else front
        np.testing.assert_allclose(back, expected, atol=1.5)


def test_a_surface_that_shows_its_back_is_turned_round_but_a_closed_one_is_not():
    assert np.array_equal(facing(TRIANGLE, ONE), ONE)
    assert np.array_equal(facing(TRIANGLE, ONE[:, ::-1]), ONE)
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    closed = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    assert np.array_equal(facing(corners, closed), closed)
    assert np.array_equal(facing(corners, closed[:, ::-1]), closed[:, ::-1])


def test_light_is_smooth_over_gentle_bends_and_breaks_at_creases():
    def bent(degrees):
        angle = np.deg2rad(degrees)
        points = np.array([[0.0, 0, 0], [0, 1, 0], [-1, 0, 0], [np.cos(angle), 0, -np.sin(angle)]])
        normals, front = corner_normals(points, np.array([[0, 1, 2], [1, 0, 3]]))
        assert front.all()
        return normals

    gentle, sharp = bent(20), bent(89)
    np.testing.assert_allclose(gentle[0, 0], gentle[1, 1])
    np.testing.assert_allclose(sharp[0, 0], [0, 0, 1])
    np.testing.assert_allclose(np.linalg.norm(gentle, axis=2), 1)


def test_contours_lie_on_the_nearer_side_of_a_jump_in_depth():
    depth = np.zeros((4, 5))
    depth[1:3, 1:4] = 2.0
    assert np.array_equal(contours(depth, 1.0), depth > 0)
    assert not contours(depth, 3.0).any()


def test_outlines_are_darker_than_the_triangles_and_fade_when_these_are_small():
    square = np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    halves = np.array([[0, 1, 2], [0, 2, 3]])
    darkest = {}
    for size in ((90, 90), (4, 4)):
        window = Window.around([square], size, margin=-0.1)  # nothing but the diagonal
        plain, lined = (
            paint([Surface(square, halves, GREY, outlined=o)], Camera(0, 0), window).astype(float)
            for o in (False, True)
        )
        assert np.all(lined <= plain)
        darkest[size] = np.max((plain - lined) / plain)
    assert 0.1 < darkest[90, 90] < 0.3
    assert 0 < darkest[4, 4] < darkest[90, 90]


def test_a_window_holds_its_points_with_square_pixels_upright():
    points = np.array([[0.0, 0.0, 5.0], [4.0, 1.0, 7.0]])
    window = Window.around([points, np.empty((0, 3))], (200, 100))
    (x0, y0, _), (x1, y1, _) = window.pixels(points)
    assert 0 < x0 < x1 < 200
    assert 0 < y1 < y0 < 100  # upwards is up
    assert (x1 - x0) / (y0 - y1) == pytest.approx(4)
