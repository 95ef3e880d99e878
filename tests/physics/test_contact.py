"""Penalties against obstacles: derivatives, what they do, and that their absence costs nothing."""

from __future__ import annotations

import numpy as np
import pytest

from strainbench.physics.cloth import Cloth, Material
from strainbench.physics.energies.contact import Contact, Floor, Penalty, Rod, Sphere
from strainbench.physics.implicit_euler import NewtonSettings, minimise_step
from strainbench.physics.pattern import Pattern
from strainbench.problem.grid import square_grid
from tests.problems import central_difference, hessian

SPHERE = Sphere((0.1, -0.2, 0.3), 0.25)
FLOOR = Floor(-0.1)
ROD = Rod((0.1, -0.2, 0.3), 0.25)
SEEDS = range(4)
OBSTACLES = [(SPHERE,), (FLOOR,), (SPHERE, FLOOR)]


def contact(obstacles, stiffness=7.0, margin=0.1):
    return Contact(stiffness, margin, obstacles)


def points(rng, n=20):
    """About the obstacles: inside, within the margin and outside."""
    return np.array(SPHERE.centre) + rng.uniform(-0.5, 0.5, (n, 3))


def energy_and_gradient(c, x, k):
    out = np.zeros_like(x)
    return penalty(c, k).add_gradient(x, out), out


def penalty(c, k):
    return Penalty(np.arange(len(k))[:, None], k, c.margin, c.obstacles)


def hessian_blocks(c, x, k):
    """(n, 3, 3): those on the diagonal; there are no others."""
    pattern = Pattern.of([np.arange(len(x))[:, None]], len(x), np.array([], dtype=np.int64))
    data = np.zeros(9 * len(x))
    penalty(c, k).add_hessian(x, *pattern.blocks(data), clamp=False)
    return data.reshape(-1, 3, 3)


def test_distances_are_signed_lengths_along_unit_normals(rng):
    for obstacle in (SPHERE, FLOOR, ROD):
        x = points(rng)
        d, n = obstacle.distances(x)
        assert d.min() < 0 < d.max()
        np.testing.assert_allclose(np.linalg.norm(n, axis=1), 1)
        surface = x - d[:, None] * n
        np.testing.assert_allclose(obstacle.distances(surface)[0], 0, atol=1e-14)


@pytest.mark.parametrize("obstacles", [*OBSTACLES, (ROD,)])
@pytest.mark.parametrize("seed", SEEDS)
def test_gradient_is_the_derivative_of_the_energy(obstacles, seed):
    rng = np.random.default_rng(seed)
    x, c = points(rng), contact(obstacles)
    k = rng.uniform(1, 5, len(x))
    numeric = central_difference(lambda x: energy_and_gradient(c, x, k)[0], x)
    np.testing.assert_allclose(energy_and_gradient(c, x, k)[1], numeric, atol=1e-6)


@pytest.mark.parametrize("obstacles", OBSTACLES)
@pytest.mark.parametrize("seed", SEEDS)
def test_hessian_is_the_derivative_of_the_gradient_less_its_negative_curvature(obstacles, seed):
    rng = np.random.default_rng(seed)
    x, c = points(rng), contact(obstacles)
    k = rng.uniform(1, 5, len(x))
    found = hessian_blocks(c, x, k)
    expected = np.zeros_like(found)
    for obstacle in obstacles:
        one = contact((obstacle,))
        numeric = central_difference(lambda x, c=one: energy_and_gradient(c, x, k)[1], x)
        for i, block in enumerate(numeric[np.arange(len(x)), :, np.arange(len(x))]):
            w, V = np.linalg.eigh(0.5 * (block + block.T))
            expected[i] += V * np.maximum(w, 0) @ V.T
    np.testing.assert_allclose(found, expected, atol=1e-5)
    assert np.linalg.eigvalsh(found).min() >= -1e-12


def test_nothing_happens_outside_the_margin():
    c = contact((SPHERE, FLOOR))
    x = np.array([[5.0, 0.05, 0.0], [0.1, 0.2, 0.3]])
    energy, gradient = energy_and_gradient(c, x, np.ones(2))
    assert energy == 0
    assert not gradient.any()
    assert not hessian_blocks(c, x, np.ones(2)).any()
    assert c.penetration(x) == 0


def test_penetration_is_the_depth_of_the_deepest_vertex():
    x = np.array([[0.1, -0.2 + 0.25 - 0.03, 0.3], [5.0, -0.17, 0.0], [9.0, 9.0, 9.0]])
    assert contact((SPHERE, FLOOR)).penetration(x) == pytest.approx(0.07)
    assert contact((SPHERE,)).penetration(x) == pytest.approx(0.03)
    assert contact((FLOOR,)).penetration(x[2:]) == 0


def test_the_centre_of_a_sphere_is_pushed_up():
    _, gradient = energy_and_gradient(contact((SPHERE,)), np.array([SPHERE.centre]), np.ones(1))
    np.testing.assert_allclose(gradient, [[0, -0.35, 0]])


@pytest.mark.parametrize("pins", [(), (0, 3)])
def test_the_cloths_hessian_gains_just_the_blocks(rng, pins):
    rest, elements = square_grid(3, 0.5, "alternating")
    x = np.column_stack([rest, np.zeros(len(rest))]) + 0.02 * rng.normal(size=(len(rest), 3))
    pinned = np.array(pins, dtype=np.int64)
    c = contact((Sphere((0.2, 0.2, -0.1), 0.2),), margin=0.05)
    with_contact = Cloth(rest, elements, Material(), pinned, c)
    without = Cloth(rest, elements, Material(), pinned)
    diagonal = np.ones(len(x))
    change = (hessian(with_contact, x, diagonal) - hessian(without, x, diagonal)).toarray()
    k = 7.0 * without.mass / without.mass.mean()
    expected = np.zeros_like(change)
    for i, vertex in enumerate(without.pattern.free):
        expected[3 * i : 3 * i + 3, 3 * i : 3 * i + 3] = hessian_blocks(c, x, k)[vertex]
    assert expected.any()
    np.testing.assert_allclose(change, expected, atol=1e-12)


def test_a_sheet_at_rest_on_the_floor_sinks_in_as_deep_as_its_weight_asks():
    """k_i depth = m_i g with k_i = k m_i / mean m: the same depth everywhere."""
    rest, elements = square_grid(4, 0.5, "alternating")
    c = contact((Floor(0.0),), stiffness=10.0, margin=5e-3)
    cloth = Cloth(rest, elements, Material(), np.array([], dtype=np.int64), c)
    x = np.column_stack([rest[:, 0], np.full(len(rest), 5e-3), rest[:, 1]])
    h = 0.5
    for _ in range(40):
        x, report = minimise_step(cloth, x, x, h, NewtonSettings())
        assert report.converged
    np.testing.assert_allclose(5e-3 - x[:, 1], 9.81 * cloth.mass.mean() / 10.0, rtol=1e-4)


@pytest.mark.parametrize("key", ["stiffness", "margin"])
@pytest.mark.parametrize("value", [0.0, -1.0, float("nan"), float("inf")])
def test_wrong_values_are_named(key, value):
    with pytest.raises(ValueError, match=f"{key} is {value}"):
        contact((FLOOR,), **{key: value})


def test_without_bending_there_are_no_hinges(rng):
    rest, elements = square_grid(3, 0.5, "alternating")
    x = np.column_stack([rest, np.zeros(len(rest))]) + 0.02 * rng.normal(size=(len(rest), 3))
    pinned = np.array([0])
    soft, none = (Cloth(rest, elements, Material(bending=b), pinned) for b in (1e-30, 0.0))
    assert none.gradient(x)[0]["bending"] == 0
    assert len(none.pattern.slots[1]) == 0
    assert len(none.pattern.indices) < len(soft.pattern.indices)
    a, b = (hessian(c, x, np.ones(len(x))).toarray() for c in (soft, none))
    np.testing.assert_allclose(a, b, atol=1e-14)
