"""The drape: a minimum within the limits, shown by its own optimality conditions."""

from __future__ import annotations

from dataclasses import replace
from itertools import islice

import numpy as np
import pytest

from scenarios.drape import SAMPLES, Drape, pleat
from strainbench import certify
from strainbench.physics.body import GRAVITY
from strainbench.physics.implicit_euler import NewtonSettings, minimise_step
from strainbench.physics.statics import StaticsSettings, balanced
from strainbench.solver.registry import find_solver
from strainbench.solver.solver import run_solver


def projector(scene):
    problem = scene.problem()
    solver = find_solver("clarabel-tight")
    state = solver.prepare(problem)
    return lambda t: run_solver(solver, problem.with_target(t), state, 1e-6).positions


def hung(scene, steps):
    return list(islice(scene.equilibria(projector(scene)), steps))


@pytest.fixture(scope="module")
def isotropic():
    scene = Drape(resolution=6)
    return scene, hung(scene, 150)


def test_the_residual_falls(isotropic):
    residuals = [state.residual for state in isotropic[1]]
    assert residuals[-1] < 5e-3
    assert residuals[-1] < 1e-2 * residuals[0]


def test_the_drape_is_within_its_limits(isotropic):
    scene, states = isotropic
    assert scene.problem().violations(states[-1].positions).max() < 1e-6


def test_the_projected_gradient_agrees(isotropic):
    # ||x - P(x - s M^-1 grad E)|| / s, which knows nothing of the iteration's own multipliers
    scene, states = isotropic
    cloth, x, s = scene.cloth(), states[-1].positions, 1e-3
    gradient = cloth.potential(x)[1]
    gradient[cloth.pinned] = 0  # pins stay at their targets
    moved = projector(scene)(x - s * gradient / cloth.mass[:, None])
    force = cloth.mass[:, None] * (x - moved) / s
    weight = np.linalg.norm(GRAVITY) * np.linalg.norm(cloth.mass[cloth.pattern.free])
    assert np.linalg.norm(force) / weight < 2e-2


def test_the_limit_forces_pull_along_stretched_directions_only(isotropic):
    # the projection of x + s M^-1 f is x again: f is a normal of the feasible set at x
    scene, states = isotropic
    last, problem, cloth = states[-1], scene.problem(), scene.cloth()
    pushed = last.positions + 1e-3 * last.limit_forces / cloth.mass[:, None]
    certificate = certify(problem.with_target(pushed), last.positions, violation=1e-6)
    assert certificate.distance < 1e-5


def test_no_step_within_the_limits_lowers_the_energy(isotropic):
    # C is convex: towards any feasible point y, grad E . (y - x) >= 0 up to the residual
    scene, states = isotropic
    cloth, x, project = scene.cloth(), states[-1].positions, projector(scene)
    gradient = cloth.potential(x)[1]
    weight = np.linalg.norm(GRAVITY) * np.linalg.norm(cloth.mass[cloth.pattern.free])
    for seed in range(5):
        noise = np.random.default_rng(seed).normal(size=x.shape)
        noise[scene.problem().pinned] = 0
        d = project(x + 0.02 * noise) - x
        assert np.sum(gradient * d) >= -states[-1].residual * weight * np.linalg.norm(d) * 1.01


def test_the_drape_lies_below_the_fixed_point_of_step_and_project(isotropic):
    scene, states = isotropic
    cloth, project, h = scene.cloth(), projector(scene), 1 / 60
    x, v = scene.sheet()[2], 0.0
    for _ in range(150):
        after = project(minimise_step(cloth, x, x + h * v, h, NewtonSettings())[0])
        x, v = after, 0.9 * (after - x) / h
    assert sum(states[-1].energies.values()) < sum(cloth.potential(x)[0].values())


def test_the_isotropic_drape_is_its_own_mirror_image(isotropic):
    scene, states = isotropic
    n = scene.resolution + 1
    x = states[-1].positions.reshape(n, n, 3)
    np.testing.assert_allclose(x[::-1] * [-1, 1, 1], x, atol=1e-3)


@pytest.mark.parametrize("shape", SAMPLES)
def test_the_first_steps_lower_the_energy_for_every_curve(shape):
    scene = Drape(resolution=4, shape=shape)
    states = hung(scene, 40)
    assert states[-1].residual < 0.5 * states[0].residual
    assert scene.problem().violations(states[-1].positions).max() < 1e-6


def test_a_looser_curve_hangs_lower():
    lowest = {
        shape: hung(Drape(resolution=4, shape=shape), 40)[-1].positions[:, 1].min()
        for shape in ("isotropic", "orthotropic")
    }
    assert lowest["orthotropic"] < lowest["isotropic"] - 0.02


@pytest.mark.parametrize("shape", SAMPLES)
def test_the_limits_sample_the_curve(shape):
    scene = Drape(resolution=2, shape=shape)
    limits = scene.limits()
    assert len(limits.directions) == SAMPLES[shape]
    angles, bounds = scene.curve()
    sampled = np.arctan2(limits.directions[:, 1], limits.directions[:, 0])
    found = np.interp(sampled, angles, bounds, period=np.pi)
    np.testing.assert_allclose(found, limits.bounds, rtol=1e-4)
    np.testing.assert_allclose(scene.bound(angles + np.pi), bounds, rtol=1e-12)


def test_the_orthotropic_curve_has_its_bounds_on_the_axes():
    bound = Drape(shape="orthotropic", limit=0.01).bound
    np.testing.assert_allclose(bound(np.array([0.0, np.pi / 2])), [1.01, 1.30])


@pytest.mark.parametrize("gather", [0.0, 0.1, 0.2, 0.5])
@pytest.mark.parametrize("folds", [1, 2, 3])
def test_the_pleat_keeps_its_length_and_brings_its_ends_together(gather, folds):
    x, z = pleat(np.linspace(0, 1, 4001), gather, folds)
    assert np.hypot(np.diff(x), np.diff(z)).sum() == pytest.approx(1, abs=1e-4)
    assert x[-1] - x[0] == pytest.approx(1 - gather, abs=1e-9)
    assert abs(z[-1]) < 1e-9


@pytest.mark.parametrize("resolution", [2, 3, 7])
@pytest.mark.parametrize("gather", [0.0, 0.2, 0.5])
def test_the_start_is_within_the_limits(resolution, gather):
    problem = Drape(resolution=resolution, gather=gather).problem()
    assert problem.violations(problem.target).max() == 0


def test_the_pseudo_time_step_follows_the_leading_residual():
    settings = StaticsSettings()
    assert balanced(0.1, 3.0, 1.0, settings) == pytest.approx(0.1 / 1.5)
    assert balanced(0.1, 1.0, 3.0, settings) == pytest.approx(0.1 * 1.5)
    assert balanced(0.1, 1.0, 1.5, settings) == 0.1
    assert balanced(0.3, 1.0, 9.0, settings) == settings.longest
    assert balanced(0.003, 9.0, 1.0, settings) == settings.shortest


@pytest.mark.parametrize(
    ("key", "value"),
    [("shape", "round"), ("gather", -0.1), ("folds", 0), ("start", "rest"), ("diagonals", "x")],
)
def test_wrong_values_are_named(key, value):
    with pytest.raises(ValueError, match=f"{key} is {value!r}"):
        replace(Drape(), **{key: value})


@pytest.mark.parametrize("shape", SAMPLES)
def test_a_true_projection_keeps_the_drape_where_it_is(shape):
    scene = Drape(resolution=5, shape=shape)
    reports = list(islice(scene.play(projector(scene)), 12))
    assert max(r.equilibrium_residual for r in reports) < 5e-3
    assert max(r.equilibrium_distance for r in reports) < 5e-5


def test_no_projection_does_not_keep_it():
    reports = list(islice(Drape(resolution=5).play(lambda target: target), 12))
    assert reports[-1].equilibrium_distance > 1e-2


def test_from_the_folds_the_steps_approach_a_drape():
    scene = Drape(resolution=5, start="folds")
    reports = list(islice(scene.play(projector(scene)), 80))
    assert reports[0].equilibrium_distance > 1e-2
    assert reports[-1].equilibrium_residual < 1e-1 * reports[0].equilibrium_residual


def test_exact_limits_start_from_the_folds():
    with pytest.raises(ValueError, match="start is 'drape': with exact directions only folds"):
        Drape(directions="exact")
    scene = Drape(resolution=3, directions="exact", start="folds")
    report = next(scene.play(lambda target: target))
    assert np.isnan(report.equilibrium_distance)
    assert np.isfinite(report.equilibrium_residual)


@pytest.mark.parametrize("shape", SAMPLES)
@pytest.mark.parametrize("limit", [0.001, 0.1])
@pytest.mark.parametrize("gather", [0.0, 0.5])
def test_any_drape_warms_up(shape, limit, gather):
    Drape(resolution=20, shape=shape, limit=limit, gather=gather, folds=3).warm_up()


def test_a_drape_that_is_not_certified_is_not_played():
    scene = Drape(resolution=3, folds=3)  # flat: too few cells for its folds
    with pytest.raises(ArithmeticError, match="no certified drape: 1000 iterations, residual"):
        next(scene.play(lambda target: target))
