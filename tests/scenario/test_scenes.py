"""Each scene against what it is made to show."""

from __future__ import annotations

from dataclasses import replace
from itertools import islice

import numpy as np
import pytest

from scenarios.chainmail import PATTERNS, Chainmail
from scenarios.collision import Collision
from scenarios.flag import HEADING, Flag
from scenarios.sphere_drop import SphereDrop
from scenarios.stretch_square import StretchSquare
from scenarios.twist import Twist
from strainbench import certify, solve
from strainbench.bench.journal import FRAMES
from strainbench.bench.judge import _missed
from strainbench.bench.plan import plan
from strainbench.referee.reference import reference_of
from strainbench.scenario.cloth import ClothScenario
from strainbench.scenario.registry import find_scenario, list_scenarios
from strainbench.scenario.scenario import SheetScenario
from strainbench.scenario.volume import VolumeScenario

NAMES = [
    e.name for e in list_scenarios() if not issubclass(find_scenario(e.name), VolumeScenario)
]  # of cloth; volumes have tests of their own


def run(scene, steps):
    """Reports and, for each projection, candidate, answer and certificate."""
    problem, seen = scene.problem(), []

    def project(target):
        frame = problem.with_target(target)
        answer = solve(frame, solver="clarabel").positions
        seen.append((target, answer, certify(frame, answer)))
        return answer

    return list(islice(scene.play(project), steps)), seen


@pytest.mark.parametrize("name", NAMES)
def test_clarabel_is_optimal_on_every_step(name):
    scene = find_scenario(name)(resolution=6)
    reports, seen = run(scene, 4)
    assert [c.outcome for _, _, c in seen] == ["optimal"] * len(seen)
    assert all(r.newton_converged for r in reports)
    if isinstance(scene, ClothScenario):
        still = {"equilibrium_residual", "equilibrium_distance"}  # of scenes at rest alone
        values = [[v for k, v in vars(r).items() if k not in still] for r in reports]
        assert np.all(np.isfinite(np.array(values, dtype=float)))


@pytest.mark.parametrize("name", NAMES)
def test_what_a_scene_does_not_need_is_not_built(name):
    scene = find_scenario(name)(resolution=4)
    if not hasattr(scene, "cloth"):
        assert scene.needs == frozenset()
        return
    cloth, x = scene.cloth(), scene.sheet()[2]
    assert ("bending" in scene.needs) == (len(cloth.pattern.slots[1]) > 0)
    assert ("contact" in scene.needs) == (cloth.contact is not None)
    if not isinstance(scene, ClothScenario):
        assert "inertia" not in scene.needs  # it is at rest
        return
    assert ("wind" in scene.needs) == (scene.force(x, np.zeros_like(x), 0.0) is not None)


@pytest.mark.parametrize("name", NAMES)
def test_all_but_the_swing_project_in_the_norm_of_the_masses(name):
    scene = find_scenario(name)(resolution=4)
    assert (scene.problem().mass is None) == (name == "swing")
    if not isinstance(scene, SheetScenario):
        return  # the norm is its method's own
    assert replace(scene, norm="unweighted").problem().mass is None
    with pytest.raises(ValueError, match="norm is 'max': valid are unweighted, mass"):
        replace(scene, norm="max")


# --- stretch-square


def test_the_square_is_stretched_and_projected_without_a_state():
    scene = StretchSquare(resolution=3, scale_x=1.5, scale_y=1.0)
    reports, seen = run(scene, 2)
    assert np.array_equal(seen[0][0], seen[1][0])
    np.testing.assert_allclose(np.ptp(seen[0][0], axis=0), [0.75, 0.5, 0])
    assert scene.problem().stretches(seen[0][0]).max() == pytest.approx(1.5)
    assert certify(scene.problem(), seen[0][1]).max_principal_stretch < 1.1
    assert all(np.isnan(r.kinetic_energy) for r in reports)


def test_the_norm_of_the_square_does_not_depend_on_the_unit_of_mass():
    frame = StretchSquare(resolution=4).problem()
    heavy = replace(frame, mass=1000 * frame.mass)
    a, b = (solve(p, solver="clarabel", tolerance=1e-8).positions for p in (frame, heavy))
    np.testing.assert_allclose(a, b, atol=1e-5)


def test_a_limit_on_compression_is_the_least_stretch_of_every_direction():
    assert StretchSquare().problem().convex
    problem = StretchSquare(resolution=3, compression=0.1).problem()
    np.testing.assert_array_equal(problem.lower_bounds, np.full(problem.rows, 0.9))
    with pytest.raises(ValueError, match=r"compression is 1\.5: a strain between 0 and 1"):
        StretchSquare(compression=1.5)
    with pytest.raises(ValueError, match="exact limits have none"):
        StretchSquare(directions="exact", compression=0.1)


@pytest.mark.parametrize("scale", [0.0, -1.0, float("nan")])
def test_a_scale_that_is_not_one_is_named(scale):
    with pytest.raises(ValueError, match=f"scale_y is {scale}"):
        StretchSquare(scale_y=scale)


# --- twist


def turned(scene, angle):
    problem = scene.problem()
    target = problem.target.copy()
    target[problem.pinned] = scene.pin_positions(angle)
    return problem.with_target(target)


@pytest.mark.parametrize("limit", [0.01, 0.1])
@pytest.mark.parametrize("directions", [2, 3, 4])
def test_past_its_angle_a_twist_is_infeasible_and_not_before(limit, directions):
    scene = Twist(resolution=6, limit=limit, directions=directions)
    angle = scene.infeasible_angle
    assert turned(scene, 0.999 * angle).infeasible_pins() is None
    assert "infeasible: pinned vertices" in turned(scene, 1.001 * angle).infeasible_pins()


@pytest.mark.parametrize("limit", [0.01, 0.1])
def test_the_angle_is_the_derived_one_and_sharp(limit):
    scene = Twist(resolution=6, limit=limit)
    angle = scene.infeasible_angle
    assert np.sin(angle / 2) == pytest.approx(np.sqrt((1 + limit) ** 2 - 1))
    before = turned(scene, 0.999 * angle)
    assert not np.any(before.violations(reference_of(before).positions))


def test_a_loose_limit_never_stops_a_twist():
    assert Twist(resolution=3, limit=0.5).infeasible_angle == float("inf")


def test_a_twist_ends_without_an_answer_past_its_angle():
    scene = Twist(resolution=6, step=0.1)
    first = next(k for k in range(1, 9) if np.deg2rad(9 * k) > scene.infeasible_angle)
    problem, outcomes, statuses = scene.problem(), [], []

    def project(target):
        frame = problem.with_target(target)
        solution = solve(frame, solver="clarabel")
        outcomes.append(certify(frame, solution.positions).outcome)
        statuses.append(str(solution.status))
        return solution.positions

    with pytest.raises(ValueError, match="target"):  # no step follows one without an answer
        list(islice(scene.play(project), first + 1))
    assert outcomes == ["optimal"] * (first - 1) + ["no answer"]
    assert statuses[-1].startswith("infeasible: pinned vertices")


def test_the_ends_turn_rigidly_and_against_each_other():
    scene = Twist(resolution=4)
    x0, x1 = scene.pin_positions(0.0), scene.pin_positions(0.6)
    lengths = [np.linalg.norm(x[:, None, 1:] - x[None, :, 1:], axis=2)[:5, :5] for x in (x0, x1)]
    np.testing.assert_allclose(*lengths)
    np.testing.assert_allclose(x1[:5, 1], -x1[5:, 1])
    a, b = x1[4] - x1[0], x1[9] - x1[5]
    assert a @ b / (np.linalg.norm(a) * np.linalg.norm(b)) == pytest.approx(np.cos(0.6))


# --- contact


@pytest.mark.parametrize(("scene", "steps"), [(Collision, 36), (SphereDrop, 26)])
def test_penalties_stop_the_sheet_near_the_surface(scene, steps):
    scene = scene(resolution=10)
    reports, seen = run(scene, steps)
    assert all(r.newton_converged for r in reports)
    assert max(r.contact_energy for r in reports) > 0
    assert max(r.penetration for r in reports) < 0.01, "a tenth of the sphere's radius"
    last = scene.contact().penetration(seen[-1][1])
    assert reports[-1].penetration == last


def test_without_the_sphere_the_sheet_would_be_inside():
    scene = Collision(resolution=6, stiffness=1e-9)
    reports, _ = run(scene, 36)
    assert max(r.penetration for r in reports) > 0.03


def test_the_collision_may_have_a_floor():
    assert len(Collision(floor=-0.2).contact().obstacles) == 2
    with pytest.raises(ValueError, match="margin is 0"):
        Collision(margin=0)


@pytest.mark.parametrize("name", ["collision", "sphere-drop"])
def test_sheets_start_outside_the_margin(name):
    scene = find_scenario(name)(resolution=8)
    x = scene.sheet()[2]
    assert scene.contact().penalty(np.ones(len(x))).value(x) == 0


# --- flag


def test_wind_pushes_with_the_area_that_it_meets():
    """A flat flag of 0.25 m^2: c A (u.n) in all, along its normal."""
    scene = Flag(resolution=5, wind=4.0, drag=0.7)
    x = scene.sheet()[2]
    total = scene.force(x, np.zeros_like(x), 0.0).sum(axis=0)
    np.testing.assert_allclose(total, [0, 0, 0.7 * 0.25 * 4.0 * HEADING[2]], atol=1e-15)


def test_cloth_that_flies_with_the_wind_feels_none():
    scene = Flag(resolution=3)
    x = scene.sheet()[2]
    force = scene.force(x, np.tile(scene.wind * HEADING, (len(x), 1)), 0.0)
    np.testing.assert_allclose(force, 0, atol=1e-15)


def test_drag_takes_energy_from_still_air(rng):
    scene = Flag(resolution=4, wind=0.0)
    x, v = (rng.normal(size=scene.sheet()[2].shape) for _ in range(2))
    assert np.sum(scene.force(x, v, 0.0) * v) < 0


def test_the_wind_carries_the_flag_out_of_its_plane():
    reports = list(islice(Flag(resolution=4).play(lambda x: x), 10))
    still = list(islice(Flag(resolution=4, wind=0.0).play(lambda x: x), 10))
    assert reports[-1].momentum_z > 1e-3
    assert abs(still[-1].momentum_z) < 1e-9


# --- chainmail


@pytest.mark.parametrize("pattern", PATTERNS)
def test_the_limit_is_the_largest_strain_of_the_curve(pattern):
    scene = Chainmail(pattern=pattern, limit=0.3)
    angles, bounds = scene.curve()
    assert bounds.max() == pytest.approx(1.3)
    assert bounds.min() > 1
    assert bounds[0] == pytest.approx(bounds[-1])
    limits = scene.limits()
    x, y = limits.directions.T
    expected = np.interp(np.arctan2(y, x), angles, bounds)
    np.testing.assert_allclose(limits.bounds, expected, atol=1e-4)
    assert len(limits.bounds) == 18


def test_a_measured_curve_is_taken_as_it_stands(tmp_path):
    path = tmp_path / "measured.csv"
    path.write_text("angle_degrees,bound\n-90,1.1\n0,1.2\n45,1.4\n")
    scene = Chainmail(resolution=3, curve_file=str(path))
    np.testing.assert_allclose(scene.problem().limits.bounds, [1.1, 1.2, 1.4])
    np.testing.assert_allclose(np.rad2deg(scene.curve()[0]), [-90, 0, 45], atol=1e-12)
    for key, value in (("limit", 0.1), ("directions", 4), ("pattern", "hexagonal")):
        with pytest.raises(ValueError, match=f"{key} is {value}.*not both"):
            replace(scene, **{key: value})


def test_a_curve_or_pattern_that_is_not_there_is_named(tmp_path):
    with pytest.raises(ValueError, match=r"curve_file is 'nowhere\.csv': no such file"):
        Chainmail(curve_file="nowhere.csv")
    with pytest.raises(ValueError, match="pattern is 'knit': valid are rows, hexagonal"):
        Chainmail(pattern="knit")
    (tmp_path / "bad.csv").write_text("angle,bound\n0,1.1\n")
    with pytest.raises(ValueError, match="columns"):
        Chainmail(curve_file=str(tmp_path / "bad.csv"))


# --- what a scene is about


def test_a_run_that_is_not_told_takes_enough_steps():
    assert Collision().usual_steps == 60
    assert SphereDrop().usual_steps == 80
    assert Flag().usual_steps == 10
    assert Collision(step=0.001).usual_steps == 300
    assert Twist(resolution=4).usual_steps == 12
    assert Twist(resolution=4, limit=0.5).usual_steps == 10
    assert [c.steps for c in plan_all("collision")] == [60]


def plan_all(scene):
    return plan([scene], ["none"], [], "simulate", None, [1e-6], None)


def test_contact_has_begun_in_the_margin_and_not_above():
    scene = SphereDrop(resolution=4)
    frame = scene.problem()
    assert not scene.has_begun(frame)
    assert scene.has_begun(frame.with_target(frame.target - [0.0, 0.011, 0.0]))
    assert Flag(resolution=4).has_begun(Flag(resolution=4).problem())


def test_a_twist_has_begun_where_no_positions_meet_the_limits():
    scene = Twist(resolution=4)
    first = int(scene.first_step)
    degrees = scene.turn_rate * scene.step
    turns = [turned(scene, np.deg2rad(degrees * k)) for k in (first - 1, first)]
    assert [scene.has_begun(frame) for frame in turns] == [False, True]


def test_a_row_says_what_never_happened(tmp_path):
    scene, folder = Collision(resolution=4), tmp_path / "cell"
    folder.mkdir()
    with (folder / FRAMES).open("wb") as file:
        for _ in range(2 * 5):  # candidates and answers
            np.save(file, scene.sheet()[2])
    (cell,) = plan(["collision"], ["none"], ["resolution=4"], "simulate", 5, [1e-6], None)
    nothing, contact = _missed(cell, folder, 5)
    assert nothing == "no candidate was beyond the limits: nothing had to be projected"
    assert contact == "contact never happened in these 5 steps; it begins at about step 19"
