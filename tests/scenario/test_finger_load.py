"""The finger under a load: a rigid bone that slides, and a table that carries what pushes it."""

from __future__ import annotations

from math import cos

import numpy as np
import pytest

from scenarios.finger import PRESSES, RATE, TILT, Finger
from solvers.lcp_pgs import LcpPgs
from solvers.lcp_qp import LcpQp
from strainbench.scenario.stage import Stage, StageError


def loaded(steps, solver=None, **settings):
    """The stage after so many steps, the scene's bone, and the force on the table [N]."""
    stage, told = Stage.opened(Finger(**settings), solver or LcpPgs()), {}

    def project(target):
        found = stage.solve(target)
        told.update(found.solution.details)
        return stage.accept(found)

    list(stage.steps(steps, project))
    bone = stage.scenario.solid().bone
    return stage.positions[bone.elements[0]] - bone.rest, told["push"] / stage.scenario.step**2


def test_the_bone_slides_as_one_piece():
    moves, _ = loaded(6, press="side", force=3.0)
    towards = np.array(PRESSES["side"][0])
    gone = (moves @ towards).mean()
    assert gone > 1e-4
    np.testing.assert_allclose(moves, np.tile(gone * towards, (22, 1)), atol=1e-3 * gone)


@pytest.mark.parametrize(("press", "share"), [("flat", cos(TILT)), ("tip", 1.0)])
def test_the_table_carries_the_load(press, share):
    _, force = loaded(20, press=press, force=3.0, friction=0.0, alpha=50.0)
    assert share * force == pytest.approx(3.0, rel=0.01)


def test_a_load_comes_as_deep_as_the_force_at_that_depth():
    stage, told = Stage.opened(Finger(press="tip", depth=5e-4), LcpPgs()), {}

    def project(target):
        found = stage.solve(target)
        told.update(found.solution.details)
        return stage.accept(found)

    list(stage.steps(5, project))
    force = told["push"] / stage.scenario.step**2
    moves, found = loaded(16, press="tip", force=force)
    assert force / RATE < 16 * 5e-3
    assert found == pytest.approx(force, rel=0.02)
    assert moves[:, 0].mean() == pytest.approx(5e-4, rel=0.03)


def test_a_load_on_rigid_limits_has_an_answer_where_a_depth_has_none():
    given = {"press": "tip", "friction": 0.0}
    moves, force = loaded(28, LcpQp(), force=14.0, **given)
    assert force == pytest.approx(14.0, rel=0.01)
    assert 8e-4 < moves[:, 0].mean() < 9e-4
    with pytest.raises(StageError, match="infeasible"):
        list(Stage.opened(Finger(depth=2e-3, **given), LcpQp()).steps(10))


def test_the_bone_has_the_derivatives_of_its_energy():
    body = Finger(press="flat", force=1.0).solid()
    bone = body.bone
    bone.load = 0.7
    rng = np.random.default_rng(3)
    x, d = body.rest + 1e-3 * rng.normal(size=body.rest.shape), rng.normal(size=body.rest.shape)
    slope = np.zeros_like(x)
    bone.add_gradient(x, slope)
    ahead, behind = (bone.value(x + sign * 1e-6 * d) for sign in (1, -1))
    assert (ahead - behind) / 2e-6 == pytest.approx(np.vdot(slope, d), rel=1e-6)
    at, other = np.zeros_like(x), np.zeros_like(x)
    bone.add_gradient(x, at)
    bone.add_gradient(x + d, other)
    np.testing.assert_allclose(
        (bone.matrix(len(x)) @ d.ravel()).reshape(-1, 3), other - at, atol=1e-7 * bone.stiffness
    )


def test_both_integrators_take_the_load():
    gone = [
        loaded(4, press="flat", force=2.0, friction=0.0, integrator=name)[0][:, 1].mean()
        for name in ("linearised", "nonlinear")
    ]
    assert gone[0] == pytest.approx(gone[1], rel=0.05)


def test_a_load_lasts_until_it_has_grown():
    assert Finger(force=40.0).usual_steps == 80
    assert Finger(force=1.0).usual_steps == 10


@pytest.mark.parametrize("force", [-1.0, float("inf"), float("nan")])
def test_loads_that_are_none_are_named(force):
    with pytest.raises(ValueError, match=f"force is {force}: a load from 0 on is valid"):
        Finger(force=force)
