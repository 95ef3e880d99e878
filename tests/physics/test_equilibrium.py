"""The barrier method finds a constrained minimum, and says so only where it has."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from scenarios.drape import SAMPLES, Drape
from strainbench.physics.body import GRAVITY
from strainbench.physics.equilibrium import (
    BarrierSettings,
    add_limits_hessian,
    equilibrium,
    longest_step,
)
from strainbench.physics.linear import symmetric

SETTINGS = BarrierSettings()


def hung(scene, settings=SETTINGS):
    return equilibrium(scene.cloth(), scene.problem(), settings)


def energy(scene, x):
    return sum(scene.cloth().potential(x)[0].values())


@pytest.fixture(params=SAMPLES)
def scene(request):
    return Drape(resolution=6, shape=request.param)


def test_the_conditions_of_a_minimum_hold(scene):
    found, reason = hung(scene)
    assert reason == ""
    cloth, problem = scene.cloth(), scene.problem()
    assert problem.violations(found.positions).max() == 0
    left = (cloth.potential(found.positions)[1] + found.limit_forces)[problem.free]
    weight = np.linalg.norm(GRAVITY) * np.linalg.norm(cloth.mass[problem.free])
    assert np.linalg.norm(left) / weight == pytest.approx(found.residual)
    assert found.residual <= SETTINGS.tolerance
    assert np.array_equal(found.positions[problem.pinned], problem.target[problem.pinned])


def test_the_limit_forces_are_normals_of_the_limits(scene, rng):
    # C is convex and f its normal at x: f . (z - x) <= 0 for every z within the limits
    found, _ = hung(scene)
    problem, start = scene.problem(), scene.sheet()[2]
    for _ in range(20):
        noise = 1e-3 * rng.normal(size=start.shape)
        noise[problem.pinned] = 0
        z = start + noise
        if problem.violations(z).max() == 0:
            assert np.vdot(found.limit_forces, z - found.positions) < 0
    assert np.abs(found.limit_forces).max() > 0


def test_no_small_move_within_the_limits_lowers_the_energy(scene, rng):
    found, _ = hung(scene)
    least = energy(scene, found.positions)
    start = scene.sheet()[2]
    for scale in (1e-4, 1e-3):
        for _ in range(10):  # the segment towards a point within the limits stays within them
            inside = start + 1e-4 * rng.normal(size=start.shape)
            inside[scene.problem().pinned] = start[scene.problem().pinned]
            x = found.positions + scale * (inside - found.positions)
            assert energy(scene, x) > least


def test_a_turned_sheet_hangs_turned(scene):
    found, _ = hung(scene)
    turn = np.array([[0.6, 0.0, 0.8], [0.0, 1.0, 0.0], [-0.8, 0.0, 0.6]])
    problem = scene.problem()
    turned, reason = equilibrium(
        scene.cloth(), problem.with_target(problem.target @ turn.T), SETTINGS
    )
    assert reason == ""
    np.testing.assert_allclose(turned.positions, found.positions @ turn.T, atol=1e-5)


def test_a_tight_limit_holds_up_what_a_loose_one_lets_hang():
    tight, loose = (hung(Drape(resolution=5, limit=b))[0] for b in (0.01, 0.5))
    assert tight.positions[:, 1].min() > loose.positions[:, 1].min() + 0.01


def test_the_iteration_limit_is_a_reason(scene):
    found, reason = hung(scene, replace(SETTINGS, max_iterations=3))
    assert "3 iterations, residual" in reason
    assert found.residual > SETTINGS.tolerance
    assert scene.problem().violations(found.positions).max() == 0


def test_a_start_beyond_the_limits_is_refused(scene):
    problem = scene.problem()
    with pytest.raises(ValueError, match="strictly within sampled limits"):
        equilibrium(scene.cloth(), problem.with_target(2 * problem.target), SETTINGS)


def test_the_hessian_of_the_limits_is_that_of_the_barrier(rng):
    scene = Drape(resolution=2)
    cloth, problem, mu = scene.cloth(), scene.problem(), 0.3
    x = problem.target + 1e-3 * rng.normal(size=problem.target.shape)
    free, pattern = problem.free, cloth.pattern

    def gradient(x):
        y = problem.G @ x
        q = 0.5 * (problem.bounds**2 - np.sum(y**2, axis=1))
        return (problem.G.T @ (mu / q[:, None] * y))[free].ravel()

    y = problem.G @ x
    q = 0.5 * (problem.bounds**2 - np.sum(y**2, axis=1))
    data = np.zeros(len(pattern.indices))
    triangles = pattern.blocks(data)[0]
    add_limits_hessian(problem.row_coefficients, y, mu / q, mu / q**2, triangles)
    H = symmetric(pattern.matrix(data)).toarray()
    for _ in range(5):
        d = np.zeros_like(x)
        d[free] = rng.normal(size=(len(free), 3))
        h = 1e-6
        found = (gradient(x + h * d) - gradient(x - h * d)) / (2 * h)
        np.testing.assert_allclose(H @ d[free].ravel(), found, atol=1e-6 * np.abs(found).max())


def test_the_longest_step_uses_up_the_room(rng):
    y, dy, room = rng.normal(size=(30, 3)), rng.normal(size=(30, 3)), rng.uniform(0.1, 1, 30)
    a = longest_step(y, dy, room)
    used = 0.5 * np.sum((y + a * dy) ** 2, axis=1) - 0.5 * np.sum(y**2, axis=1) - room
    assert used.max() == pytest.approx(0, abs=1e-9)
    assert longest_step(y, np.zeros_like(y), room) == np.inf
