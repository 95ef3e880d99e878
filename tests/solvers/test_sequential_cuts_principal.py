"""Sequential cuts under isotropic limits on principal stretches, of triangles and tetrahedra."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from scenarios.beam import Beam
from solvers.sequential_cuts import SequentialCuts
from solvers.sequential_cuts.halfspaces import Restriction
from solvers.sequential_cuts.principal import PrincipalProgram
from solvers.sequential_cuts.starts import candidate, rest
from strainbench import Clock, PrincipalLimits, Problem, StretchLimits, certify, solve
from strainbench import sparse as sp
from strainbench.problem.contact import Plane
from strainbench.problem.grid import box_grid, square_grid
from strainbench.problem.principal_rows import KINDS
from strainbench.referee.kkt import kkt_residual
from strainbench.scenario.stage import Stage
from strainbench.solver.solver import run_solver
from tests.problems import central_difference, random_volume

BOTH = PrincipalLimits("isotropic", 0.9, 1.1, 3)
SEEDS = 0, 3
FLAT = PrincipalLimits("isotropic", 0.9, 1.1, 2)


def sheet(target, limits=FLAT, **more):
    """A square of 4 cells, 1 m; `target` is a function of its positions (n, 3)."""
    corners, elements = square_grid(4, 1.0, "alternating")
    return Problem(corners, elements, target(np.pad(corners, ((0, 0), (0, 1)))), limits, **more)


def block(target, limits=BOTH, **more):
    """Two cubes of 1 m."""
    corners, elements = box_grid((2, 1, 1), np.array([2.0, 1.0, 1.0]))
    return Problem(corners, elements, target(corners), limits, **more)


def volume(seed):
    """Irregular tetrahedra in the norm of a metric, whose step begins within the limits."""
    problem, placed = random_volume(np.random.default_rng(seed), BOTH)
    metric = sp.diags_array(np.repeat(np.linspace(1, 2, problem.vertices), 3))
    return replace(problem, mass=None, metric=metric, linearise_at=placed)


def answer(problem, **settings):
    """Without the warm-up of `solve`."""
    solver = SequentialCuts(**settings)
    return run_solver(solver, problem, solver.prepare(problem), 1e-6)


# --- the restriction


@pytest.mark.parametrize("build", [sheet, block])
def test_half_spaces_touch_the_limits_with_their_derivatives(build, rng):
    problem = build(lambda x: x + 0.2 * rng.normal(size=x.shape))
    x = problem.target

    def room(y):
        """(e, c) of lower limits, then of upper ones, by principal axis."""
        return problem.kind.values(problem.deformation_gradients(y))

    around = Restriction(problem, x)
    rows = around.rows(around.beyond(x, -np.inf))
    within = np.einsum("qkc,qkc->q", rows.coefficients, x[rows.vertices]) - rows.offsets
    dim, e = problem.rest.shape[1], len(problem.elements)
    upper, lower = np.split(within.reshape(2 * e, dim), 2)
    np.testing.assert_allclose(upper, room(x)[:, dim:], atol=1e-12)
    np.testing.assert_allclose(lower, room(x)[:, dim - 1 :: -1], atol=1e-12)
    slopes = np.zeros((2 * e * dim, *x.shape))
    np.add.at(slopes, (np.arange(2 * e * dim)[:, None], rows.vertices), rows.coefficients)
    expected = central_difference(room, x)
    of_upper, of_lower = np.split(slopes.reshape(2 * e, dim, *x.shape), 2)
    np.testing.assert_allclose(of_upper, expected[:, dim:], atol=1e-5)
    np.testing.assert_allclose(of_lower, expected[:, dim - 1 :: -1], atol=1e-5)


@pytest.mark.parametrize("build", [sheet, block])
def test_what_is_beyond_none_is_within_the_limits(build, rng):
    problem = build(lambda x: x)
    around, admitted = Restriction(problem, problem.target), 0
    for size in np.geomspace(0.002, 0.1, 30):
        y = problem.target + size * rng.normal(size=problem.target.shape)
        if len(around.beyond(y, 0.0).element) == 0:
            admitted += 1
            assert problem.violations(y).max() == 0
    assert admitted > 3


@pytest.mark.parametrize("seed", SEEDS)
def test_no_round_raises_the_objective_or_leaves_the_limits(seed):
    problem = volume(seed)
    program, x = PrincipalProgram(slack=False), problem.linearise_at
    last = problem.objective(x)
    for _ in range(4):
        x = program.solve(problem, x, 1e-6, Clock()).positions
        assert problem.violations(x).max() <= 1e-6
        assert problem.objective(x) <= last * (1 + 1e-5)
        last = problem.objective(x)


# --- answers


@pytest.mark.parametrize("seed", SEEDS)
def test_it_ends_where_ipopt_does(seed):
    pytest.importorskip("cyipopt")
    problem = volume(seed)
    found, other = answer(problem), solve(problem, "ipopt-principal")
    assert found.status == "solved"
    assert problem.violations(found.positions).max() <= 1e-6
    assert problem.objective(found.positions) <= problem.objective(other.positions) * (1 + 1e-3)


@pytest.mark.parametrize("build", [sheet, block])
def test_of_upper_limits_alone_the_answer_is_the_optimum(build):
    dim = build(lambda x: x).rest.shape[1]
    limits = PrincipalLimits("isotropic", None, 1.1, dim)
    problem = build(lambda x: x * [1.4, 1.2, 1.0] + 0.3 * x[:, [1, 2, 0]], limits)
    limits = StretchLimits(np.eye(dim), np.full(dim, 1.1), spectral=True)
    exact = replace(problem, limits=limits)
    best = solve(exact, "newton-ipm").positions
    np.testing.assert_allclose(answer(problem).positions, best, atol=1e-5)


def test_a_sheet_pulled_along_one_axis_folds():
    """From folds and from noise to the same; from a flat start it stays flat, a saddle."""
    problem = sheet(lambda x: x * [1.3, 0.7, 1])
    folded = [answer(problem, starts=(name,)) for name in ("accordion", "candidate")]
    for found in folded:
        assert found.status == "solved"
        assert problem.objective(found.positions) == pytest.approx(0.1044258, rel=1e-5)
        assert "at best a local optimum" in certify(problem, found.positions).reason
    flat = replace(problem, linearise_at=problem.target * [1 / 1.3, 1 / 0.7, 1])
    assert problem.objective(answer(flat).positions) == pytest.approx(0.125, rel=1e-6)


@pytest.mark.parametrize("seed", SEEDS)
def test_its_answers_are_local_optima(seed):
    problem = volume(seed)
    assert kkt_residual(problem, answer(problem).positions) < 1e-4


TURNED = np.diag([1.0, -1.0, 1.0])


@pytest.mark.parametrize(
    "change",
    [
        pytest.param(lambda x: x @ TURNED, id="inside out"),
        pytest.param(lambda x: x * [1, 0, 1], id="flat"),
        pytest.param(lambda x: 0 * x, id="a point"),
        pytest.param(lambda x: 1.5 * x, id="larger"),
        pytest.param(lambda x: x + 0.4 * np.sin(9 * x[:, [1, 2, 0]]), id="rough"),
    ],
)
@pytest.mark.parametrize("begun", [True, False])
def test_from_wherever_a_volume_is_the_limits_are_met(change, begun):
    problem = block(change)
    if begun:
        problem = replace(problem, linearise_at=problem.target)
    found = answer(problem, max_rounds=2)
    assert found.status in ("solved", "iteration limit")
    assert problem.violations(found.positions).max() <= 1e-6
    assert np.linalg.det(problem.deformation_gradients(found.positions)).min() > 0


def test_the_rest_shape_is_moved_not_mirrored():
    problem = block(lambda x: x @ TURNED)
    assert np.linalg.det(problem.deformation_gradients(rest(problem))).min() > 0
    assert np.all(np.isfinite(candidate(problem)))


def test_vertices_stay_off_a_plane():
    problem = block(lambda x: x)
    problem = problem.with_target(problem.target, contact=[Plane((0, 0.05, 0), (0, 1, 0))])
    found = answer(problem)
    assert found.status == "solved"
    assert found.positions[:, 1].min() > 0.05 - 1e-6
    assert problem.violations(found.positions).max() <= 1e-6


def test_pins_too_far_apart_are_said_to_be():
    corners = block(lambda x: x).rest
    problem = block(lambda x: x * [1.5, 1, 1], pinned=np.flatnonzero(corners[:, 0] != 1))
    found = answer(problem)
    assert found.status == "PrimalInfeasible"
    assert not np.any(np.isfinite(found.positions))


def test_pins_too_close_leave_no_start():
    problem = block(lambda x: x * [0.5, 1, 1], pinned=np.arange(12))
    found = answer(problem)
    assert found.status == "infeasible"


def test_a_beam_keeps_its_limits_step_by_step():
    stage = Stage.opened(Beam(material="isotropic", alpha=0.0, step=0.02), SequentialCuts())
    for _ in stage.steps(4):
        assert stage.problem.violations(stage.positions).max() <= 1e-6


# --- what it does not take


@pytest.mark.parametrize("kind", sorted(set(KINDS) - {"isotropic"}))
def test_limits_that_see_axes_are_refused(kind):
    limits = PrincipalLimits(kind, (None, 0.9), (None, 1.1))
    assert f"{kind} limits depend on their axes" in SequentialCuts().supports(
        sheet(lambda x: x, limits)
    )


def test_the_polar_restriction_is_that_of_limits_on_stretch():
    assert "limits on stretch" in SequentialCuts("polar").supports(sheet(lambda x: x))


def test_limits_on_stretch_have_no_metric_and_no_planes():
    problem = sheet(lambda x: x, StretchLimits.isotropic(1.1, lower=0.9))
    metric = sp.eye_array(3 * problem.vertices)
    refusal = SequentialCuts().supports(problem.with_target(problem.target, metric))
    assert "norms of masses alone" in refusal
    plane = Plane((0, 0, 0), (0, 0, 1))
    refusal = SequentialCuts().supports(problem.with_target(problem.target, contact=[plane]))
    assert "no rows for contact" in refusal
