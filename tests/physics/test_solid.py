"""Volumes: their mesh, the stiffness with rotations held, both steps, and a beam at rest."""

from __future__ import annotations

import numpy as np
import pytest

from strainbench.physics.implicit_euler import NewtonSettings, minimise_step
from strainbench.physics.solid import Solid, SolidMaterial, linearised_step
from strainbench.problem.draws import rotation
from strainbench.problem.grid import box_grid

BEAM = (10, 2, 2), np.array([1.0, 0.2, 0.2])
NO_GRAVITY = np.zeros(3)


def beam(young=2e5, cells=BEAM[0], gravity=None, **constants):
    rest, elements = box_grid(cells, BEAM[1])
    material = SolidMaterial(young, **constants)
    pinned = np.flatnonzero(rest[:, 0] == 0)
    more = {} if gravity is None else {"gravity": gravity}
    return Solid(rest, elements, material, pinned, **more)


def test_the_beam_is_200_tetrahedra_of_two_sizes():
    body = beam()
    faces = np.sort(np.concatenate([np.delete(body.elements, k, axis=1) for k in range(4)]))
    faces.sort(axis=1)
    _, count = np.unique(faces, axis=0, return_counts=True)
    assert body.rest.shape == (99, 3)
    assert body.elements.shape == (200, 4)
    assert ((count == 2).sum(), (count == 1).sum(), count.max()) == (312, 176, 2)
    sizes, of_each = np.unique(body.elastic.volumes.round(12), return_counts=True)
    assert sizes == pytest.approx([1 / 6000, 1 / 3000], abs=1e-11)
    assert of_each.tolist() == [160, 40]
    assert body.mass.sum() == pytest.approx(40)
    assert 3 * len(body.pattern.free) == 270


def test_held_rotations_are_the_stiffness_of_mueller_and_gross(rng):
    """K_ab = w (lam b_a b_b^T + mu b_b b_a^T + mu (b_a . b_b) I), b = R B."""
    body = beam(cells=(2, 1, 1))
    x = body.rest @ rotation(rng).T + 0.02 * rng.normal(size=body.rest.shape)
    elastic, (lam, mu) = body.elastic, body.material.lame
    U, _, V = elastic.frames(x)
    b = np.einsum("exi,eyi,eky->ekx", U, V, elastic.gradients)
    expected = np.zeros((x.size, x.size))
    for e, corners in enumerate(body.elements):
        for i, j in np.ndindex(4, 4):
            block = lam * np.outer(b[e, i], b[e, j]) + mu * np.outer(b[e, j], b[e, i])
            block += mu * (b[e, i] @ b[e, j]) * np.eye(3)
            at = np.ix_(3 * corners[i] + np.arange(3), 3 * corners[j] + np.arange(3))
            expected[at] += elastic.volumes[e] * block
    np.testing.assert_allclose(elastic.stiffness(x).toarray(), expected, atol=1e-8 * mu)


def test_turning_costs_nothing_and_an_inverted_element_is_turned_back(rng):
    body = beam(cells=(2, 1, 1))
    turned = body.rest @ rotation(rng).T + [1.0, 2.0, 3.0]
    assert body.elastic.value(turned) == pytest.approx(0, abs=1e-20 * body.material.young)
    mirrored = body.rest * [1, 1, -1]
    out = np.zeros_like(mirrored)
    assert body.elastic.add_gradient(mirrored, out) > 0
    assert np.all(np.isfinite(out))
    assert np.all(np.linalg.eigvalsh(body.metric(mirrored, 0.01).toarray()) > 0)


def test_free_fall_is_exact_and_drag_slows_it():
    body = beam(young=1e4, cells=(2, 1, 1))
    falling = Solid(body.rest, body.elements, body.material, np.array([], dtype=np.int64))
    moved = linearised_step(falling, body.rest, np.zeros_like(body.rest), 0.01)
    fallen = np.broadcast_to(1e-4 * falling.gravity, moved.shape)
    np.testing.assert_allclose(moved - body.rest, fallen, atol=1e-15)
    dragged = SolidMaterial(1e4, alpha=10.0)
    slow = Solid(body.rest, body.elements, dragged, falling.pinned, gravity=NO_GRAVITY)
    v = np.full_like(body.rest, 1.0)
    moved = linearised_step(slow, body.rest, v, 0.1)
    np.testing.assert_allclose(moved - body.rest, 0.1 / 2)


def test_pins_that_move_take_the_body_along():
    body = beam(cells=(2, 1, 1), gravity=NO_GRAVITY)
    pins = body.rest[body.pinned] + np.array([0.01, 0, 0])
    x, v = body.rest, np.full_like(body.rest, [0.1, 0, 0])
    moved = linearised_step(body, x, v, 0.1, pins)
    shift = np.broadcast_to([0.01, 0, 0], moved.shape)
    np.testing.assert_allclose(moved - body.rest, shift, atol=1e-12)


def test_both_steps_agree_where_forces_are_nearly_linear():
    body = beam(young=2e5)
    x, v, h = body.rest, np.zeros_like(body.rest), 1e-3
    linear = linearised_step(body, x, v, h)
    nonlinear, report = minimise_step(body, x, x, h, NewtonSettings(tolerance=1e-10))
    assert report.converged
    fallen = np.abs(linear - x).max()
    np.testing.assert_allclose(linear, nonlinear, atol=1e-4 * fallen)


def test_a_beam_hangs_at_rest_where_it_is_known_to():
    """E = 200 kPa: the tip at (.6479, -.6399, .1), singular values from .686 to 1.350."""
    body = beam(alpha=6.0)
    start = body.rest.copy()
    for h in (0.01, 0.02, 0.05, 0.1, 0.3, 1, 1, 1, 1, 1, 1, 1, 1):
        start, report = minimise_step(body, start, start, h, NewtonSettings(tolerance=1e-8))
        assert report.converged
    tip = int(np.flatnonzero(np.all(np.isclose(body.rest, [1, 0.1, 0.1]), axis=1))[0])
    s = body.elastic.frames(start).s
    np.testing.assert_allclose(start[tip], [0.6479, -0.6399, 0.1], atol=1e-3)
    assert (s.min(), s.max()) == pytest.approx((0.686, 1.350), abs=1e-3)
    still = linearised_step(body, start, np.zeros_like(start), 5e-3)
    assert np.abs(still - start).max() < 1e-6


@pytest.mark.parametrize(
    ("constants", "words"),
    [
        ({"young": 0.0}, r"young is 0\.0: a number above 0"),
        ({"young": 1.0, "poisson": 0.5}, r"poisson is 0\.5: a number above -1 and below 0\.5"),
        ({"young": 1.0, "density": -1.0}, r"density is -1\.0"),
        ({"young": 1.0, "alpha": float("nan")}, "alpha is nan: a number from 0 on"),
    ],
)
def test_constants_that_are_none_are_named(constants, words):
    with pytest.raises(ValueError, match=words):
        SolidMaterial(**constants)
