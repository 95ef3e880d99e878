"""One linearised step, by projected Gauss-Seidel and by an interior point."""

from __future__ import annotations

from dataclasses import replace
from itertools import islice

import numpy as np
import pytest

from scenarios.beam import Beam
from solvers.lcp_pgs import LcpPgs
from solvers.lcp_pgs.step import Forces, Linearised
from solvers.lcp_qp import LcpQp
from strainbench import PrincipalLimits, Problem, StretchLimits, certify, solve
from strainbench.problem.grid import square_grid
from strainbench.scenario.stage import Stage

EXACT = {"residual": 1e-9, "max_sweeps": 100_000}


@pytest.fixture(scope="module")
def frame():
    """A step of the falling beam at which many rows are near their limits."""
    scene = Beam(alpha=0.0, step=0.01)
    stage = Stage.opened(scene, LcpQp())
    for _ in stage.steps(8):
        pass
    return stage.frame


def pulled(by, scale=1.0, **more):
    """A sheet in its plane, stretched along a limited axis beyond the limit."""
    rest, elements = square_grid(3, 1.0, "alternating")
    target = np.column_stack([rest * [1, by], np.zeros(len(rest))])
    at = np.column_stack([rest * [1, scale], np.zeros(len(rest))])
    limits = PrincipalLimits("hyperbolic", (None, 0.95), (None, 1.05))
    return Problem(rest, elements, target, limits, linearise_at=at, **more)


def test_both_solve_the_same_quadratic_program(frame):
    once = {"rounds": 1}
    sweeps = solve(frame, LcpPgs(**once, **EXACT))
    interior = solve(frame, LcpQp(**once))
    assert sweeps.status == interior.status == "linearised step solved"
    np.testing.assert_allclose(sweeps.positions, interior.positions, atol=1e-6)
    assert sweeps.details["rows"] == interior.details["rows"] > 10


def test_the_answer_is_within_the_linearised_limits_and_stationary(frame):
    """A (d - d*) = J^T l with l >= 0, and l = 0 but where J d + c = 0."""
    solver = LcpPgs(rounds=1, **EXACT)
    step = Linearised(frame, "exact")
    chosen = solver._flagged(step)
    rows = solver._rows(step, chosen, Forces.none(step))
    d = (solve(frame, solver).positions - step.start)[frame.free].ravel()
    room = rows.J @ d + rows.c
    assert room.min() > -1e-8
    pull = step.A @ (d - step.proposed)
    active = room < 1e-7
    l, _, _, _ = np.linalg.lstsq(rows.J[active].T.toarray(), pull)  # noqa: E741
    left = pull - rows.J[active].T @ l
    assert np.abs(left).max() < 1e-5 * np.abs(pull).max()
    assert frame.objective(step.positions(d)) > 0


def test_the_jacobian_is_the_derivative_of_the_rows(frame, rng):
    step = Linearised(frame, "exact")
    chosen = np.flatnonzero(step.C < 0.02)
    J, moved = step.jacobian(chosen)
    assert not moved.any()
    d = 1e-6 * rng.normal(size=J.shape[1])
    here, there = (
        -frame.kind.measure(frame.G @ step.positions(s * d))[chosen] for s in (-1.0, 1.0)
    )
    gaps = frame.kind.gaps(frame.G @ step.start)[chosen // (len(step.C) // len(frame.elements))]
    apart = gaps > 0.02
    assert apart.sum() > 10
    np.testing.assert_allclose((J @ d)[apart], (there - here)[apart] / 2, rtol=1e-3, atol=1e-9)


def test_pins_that_move_are_part_of_the_rows():
    sheet = pulled(1.0)
    top = np.flatnonzero(sheet.rest[:, 1] == 1)
    target = sheet.target.copy()
    target[top, 1] += 0.03
    moved = Problem(
        sheet.rest, sheet.elements, target, sheet.limits, top, linearise_at=sheet.target
    )
    step = Linearised(moved, "exact")
    _, by_pins = step.jacobian(np.arange(len(step.C)))
    assert np.abs(by_pins).max() > 0.05
    found = solve(moved, LcpPgs())
    np.testing.assert_array_equal(found.positions[top], target[top])
    assert moved.violations(found.positions).max() < 2e-3


@pytest.mark.parametrize("solver", [LcpPgs(**EXACT), LcpQp()])
def test_a_uniform_stretch_ends_at_its_limit_in_one_step(solver):
    """Principal axes do not turn: the rows are linear, and the step is the projection."""
    problem = pulled(1.2, 1.01)
    found = solve(problem, solver)
    assert problem.violations(found.positions).max() < 1e-7
    y = found.positions[:, 1]
    assert np.ptp(y) == pytest.approx(1.05, abs=1e-6)
    verdict = certify(problem, found.positions)
    assert (verdict.outcome, "at best a local optimum" in verdict.reason) == ("feasible", True)


def test_gamma_makes_good_a_share_of_what_a_step_starts_with():
    problem = pulled(1.2, 1.15)  # .1 beyond
    for gamma, left in ((1.0, 0.0), (0.2, 0.08), (0.5, 0.05)):
        found = solve(problem, LcpQp(gamma=gamma))
        assert problem.violations(found.positions).max() == pytest.approx(left, abs=1e-6)


def test_nothing_is_done_away_from_the_limits():
    problem = pulled(1.01)
    for solver in (LcpPgs(), LcpQp(), LcpPgs(select="violated")):
        found = solve(problem, solver)
        assert found.status == "nothing near a limit"
        np.testing.assert_array_equal(found.positions, problem.target)


def test_what_no_step_can_meet_is_infeasible_or_not_converged():
    """Pins apart by 30%, all of it from the pins."""
    sheet = pulled(1.3)
    ends = np.flatnonzero(np.isin(sheet.rest[:, 1], (0, 1)))
    start = np.column_stack([sheet.rest, np.zeros(len(sheet.rest))])
    pressed = Problem(
        sheet.rest, sheet.elements, sheet.target, sheet.limits, ends, linearise_at=start
    )
    assert solve(pressed, LcpQp()).status == "infeasible"
    found = solve(pressed, LcpPgs())
    assert found.status == "sweep limit"
    assert found.details["unconverged"] > 0
    assert certify(pressed, found.positions).outcome == "violated"


def test_masses_and_no_weights_are_norms_too():
    mass = np.linspace(1, 3, 16)
    for more in ({}, {"mass": mass}):
        problem = pulled(1.2, 1.01, **more)
        one, other = (solve(problem, s).positions for s in (LcpPgs(**EXACT), LcpQp()))
        np.testing.assert_allclose(one, other, atol=1e-6)


def test_biot_rows_and_exact_ones_differ_in_their_derivatives_alone(frame):
    one, two = (Linearised(frame, rows) for rows in ("exact", "biot"))
    np.testing.assert_array_equal(one.C, two.C)
    assert np.abs(one.slopes - two.slopes).max() > 0.1
    assert np.linalg.norm(two.slopes, axis=(1, 2)).max() < 1 + 1e-12
    isotropic = replace(Beam(), material="isotropic").problem()
    assert "Biot rows are those of hyperbolic" in LcpPgs(rows="biot").supports(isotropic)


def worst_and_median(solver, step, material):
    """Violations of .24 s without damping: the worst, and the median of the second half."""
    scene = Beam(alpha=0.0, step=step, material=material)
    stage, seen = Stage.opened(scene, solver), []
    for _ in islice(stage.steps(), round(0.24 / step)):
        seen.append(float(stage.problem.violations(stage.positions).max()))
    return max(seen), float(np.median(seen[len(seen) // 2 :]))


@pytest.mark.slow
def test_near_rows_a_share_and_rounds_violate_less_than_the_paper():
    literal = LcpPgs(select="violated", gamma=1.0, rounds=1)
    worst, median = worst_and_median(literal, 5e-3, "anisotropic")
    assert (worst, median) == (pytest.approx(0.090, rel=0.25), pytest.approx(0.045, rel=0.25))
    worst, median = worst_and_median(LcpQp(), 5e-3, "anisotropic")
    assert (worst, median) == (pytest.approx(0.009, rel=0.25), pytest.approx(0.005, rel=0.25))


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"select": "all"}, "select is 'all': valid are near, violated"),
        ({"rows": "frozen"}, "rows is 'frozen': valid are exact, biot"),
        ({"gamma": 0.0}, r"gamma is 0\.0: a number above 0, up to 1"),
        ({"rounds": 0}, "rounds is 0: a whole number above 0"),
        ({"residual": 0.0}, r"residual is 0\.0"),
    ],
)
def test_wrong_settings_are_named(settings, words):
    with pytest.raises(ValueError, match=words):
        LcpPgs(**settings)


def test_other_limits_are_refused_with_the_reason():
    sheet = pulled(1.2)
    sampled = Problem(sheet.rest, sheet.elements, sheet.target, StretchLimits.isotropic(1.1))
    assert LcpPgs().supports(sampled) == "it limits principal stretches alone"
