"""Planes that vertices are kept off: checked, refused, judged, and friction on them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from scenarios.finger import Finger
from solvers.lcp_pgs import LcpPgs
from solvers.lcp_qp import LcpQp
from strainbench import PrincipalLimits, Problem, StretchLimits, certify, solve
from strainbench.problem.contact import Plane
from strainbench.problem.export import as_npz
from strainbench.problem.grid import box_grid
from strainbench.referee.kkt import kkt_residual
from strainbench.referee.reference import content_key
from strainbench.scenario.stage import Stage
from strainbench.solver.registry import find_solver, list_solvers

REST, ELEMENTS = box_grid((1, 1, 1), np.ones(3))
WIDE = PrincipalLimits("isotropic", 0.2, 3.0)
EXACT = LcpPgs(residual=1e-10, max_sweeps=100_000)
BELOW = np.flatnonzero(REST[:, 1] == 0)


def pushed(move, plane, limits=WIDE, **more):
    """A cube whose vertices are alone but for limits that are far, moved into a plane."""
    mass = np.linspace(1, 2, len(REST))
    at = {"linearise_at": REST, "contact": (plane,)} | more
    return Problem(REST, ELEMENTS, REST + move, limits, mass=mass, **at)


FLOOR = Plane((0, 0, 0), (0, 1, 0))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"point": (0, 0)}, r"contact\.point: shape \(2,\); \(3,\) is valid"),
        ({"normal": (0, 0, 0)}, r"contact\.normal is \[0, 0, 0\]: a vector with a direction"),
        ({"moves": (0, np.nan, 0)}, r"contact\.moves\[1\] is nan"),
        ({"friction": -0.5}, r"contact\.friction is -0\.5: a number from 0 on"),
        ({"friction": np.inf}, r"contact\.friction is inf"),
    ],
)
def test_what_is_no_plane_is_named(change, words):
    with pytest.raises(ValueError, match=words):
        replace(FLOOR, **change)


def test_contact_with_anything_else_is_named():
    with pytest.raises(ValueError, match=r"contact\[1\] is 'floor': a Plane is valid"):
        pushed([0, 0, 0], FLOOR, contact=(FLOOR, "floor"))


@pytest.mark.parametrize("name", [e.name for e in list_solvers() if not e.unavailable])
def test_solvers_say_what_they_do_not_take(name):
    limits = (
        WIDE
        if name.startswith(("lcp", "none", "ipopt-principal", "sequential-cuts"))
        else StretchLimits(np.eye(3), np.ones(3))
    )
    solver, rough = find_solver(name), replace(FLOOR, friction=0.1)
    plain, rubbing = (solver.supports(pushed([0, 0, 0], p, limits)) for p in (FLOOR, rough))
    if name in ("ipopt-principal", "sequential-cuts"):
        assert plain is None
        assert rubbing.startswith("it has no friction")
    elif name == "sequential-cuts-polar":
        assert "limits on stretch" in plain
    elif name.startswith(("lcp-pgs", "none")):
        assert plain is rubbing is None or "Biot" in plain
    elif name.startswith("lcp-qp"):
        assert plain is None or "Biot" in plain
        assert "Biot" in rubbing or rubbing.startswith("it has no friction")
    else:
        assert "contact" in plain or plain == solver.supports(pushed([0, 0, 0], FLOOR, limits))


def test_cloth_solvers_refuse_planes():
    sampled = pushed([0, 0, 0], FLOOR, StretchLimits(np.eye(3), np.ones(3)))
    assert find_solver("newton-ipm").supports(sampled) == "it has no rows for contact with planes"
    with pytest.raises(ValueError, match="not contact with planes"):
        as_npz(sampled, "a cube")


@pytest.mark.parametrize("solver", [EXACT, LcpQp()])
def test_vertices_end_on_a_plane_and_no_others_move(solver):
    problem = pushed([0.1, -0.05, 0], FLOOR)
    found = solve(problem, solver)
    expected = problem.target.copy()
    expected[BELOW, 1] = 0
    np.testing.assert_allclose(found.positions, expected, atol=1e-6)
    assert found.details["contacts"] == len(BELOW)
    push = 0.05 * problem.mass[BELOW].sum()
    assert found.details["push"] == pytest.approx(push, rel=1e-4)


@pytest.mark.parametrize(("mu", "left"), [(0.0, 0.1), (0.5, 0.075), (1.5, 0.025), (3.0, 0.0)])
def test_friction_takes_mu_times_the_push_off_a_slip_or_all_of_it(mu, left):
    """Vertices are alone in the norm of masses: Coulomb's law by hand."""
    along = np.array([0.6, 0, 0.8])
    found = solve(pushed(0.1 * along + [0, -0.05, 0], replace(FLOOR, friction=mu)), EXACT)
    slip = (found.positions - REST)[BELOW]
    np.testing.assert_allclose(slip, np.tile(left * along, (4, 1)), atol=1e-8)
    assert found.details["cone_error"] < 1e-14


def test_a_plane_that_moves_takes_along_what_sticks(rng):
    """The same step seen from the plane."""
    move, moves = np.array([0.05, -0.05, 0.02]), np.array([0.08, 0.01, -0.03])
    for mu in (0.2, 5.0):
        still = solve(pushed(move, replace(FLOOR, friction=mu)), EXACT).positions
        carried = Plane(moves, (0, 1, 0), moves, mu)
        seen = solve(pushed(move + moves, carried), EXACT).positions - moves
        np.testing.assert_allclose(seen, still, atol=1e-8)


def test_pins_that_move_slip_too():
    """A cube dragged by its upper face: what sticks below stays."""
    above = np.flatnonzero(REST[:, 1] == 1)
    plane = replace(FLOOR, friction=50.0)
    found = solve(pushed([0.05, -0.01, 0], plane, pinned=above), EXACT)
    np.testing.assert_allclose(found.positions[BELOW], REST[BELOW], atol=1e-8)
    np.testing.assert_allclose(found.positions[above], REST[above] + [0.05, -0.01, 0])


def test_the_referee_sees_depth_and_stationarity():
    problem = pushed([0.1, -0.05, 0], FLOOR)
    x = solve(problem, EXACT).positions
    assert kkt_residual(problem, x) < 3e-5
    verdict = certify(problem, x)
    assert (verdict.outcome, "at best a local optimum" in verdict.reason) == ("feasible", True)
    deep = certify(problem, problem.target)
    assert deep.outcome == "violated"
    assert deep.max_violation == pytest.approx(0.05 / problem.edge_length)
    moved = x.copy()
    moved[BELOW[0], 0] += 0.1
    assert kkt_residual(problem, moved) > 0.1
    rough = pushed([0.1, -0.05, 0], replace(FLOOR, friction=0.5))
    assert "contact with friction: no projection" in certify(rough, x).reason
    assert content_key(problem) != content_key(pushed([0.1, -0.05, 0], Plane((0, 1, 0), (0, 1, 0))))


def test_both_methods_find_the_same_press_without_friction():
    stage = Stage.opened(Finger(friction=0.0, press="side"), LcpPgs())
    list(stage.steps(8))
    once = {"rounds": 1}
    one = solve(stage.frame, LcpPgs(residual=1e-9, max_sweeps=100_000, **once))
    other = solve(stage.frame, LcpQp(precision=1e-11, **once))
    assert one.details["rows"] == other.details["rows"] > 10
    np.testing.assert_allclose(one.positions, other.positions, atol=1e-8)
    assert one.details["push"] == pytest.approx(other.details["push"], rel=1e-3)
