from dataclasses import replace

import numpy as np
import pytest

from scenarios.stretch_square import StretchSquare
from scenarios.swing import Swing
from solvers.sequential_cuts import SequentialCuts
from solvers.sequential_cuts.cuts import RESTRICTIONS
from solvers.sequential_cuts.program import Program
from solvers.sequential_cuts.starts import accordion, candidate
from strainbench import Problem, StretchLimits, certify, solve
from strainbench.problem.grid import square_grid
from strainbench.referee.kkt import kkt_residual
from strainbench.solver.registry import find_solver
from strainbench.solver.solver import Clock, run_solver

SADDLE = 3.133955e-3  # the flat answer at 6 cells, which passes KKT


def pulled(resolution):
    return StretchSquare(resolution=resolution, compression=0.1).problem()


def sheet(target, pinned=(), directions=4, lower=0.9):
    """A square of 4 cells, 1 m; `target` is a function of its positions (n, 3)."""
    rest, elements = square_grid(4, 1.0, "alternating")
    flat = np.column_stack([rest, np.zeros(len(rest))])
    limits = StretchLimits.isotropic(1.05, directions, lower)
    pins = np.array(pinned, dtype=np.int64)
    return Problem(rest, elements, target(flat), limits, pins)


# --- the restrictions


@pytest.mark.parametrize("name", RESTRICTIONS)
def test_a_restriction_admits_nothing_beyond_the_limits_and_touches_them(name, rng):
    problem = sheet(lambda x: x + 0.1 * rng.normal(size=x.shape))
    cuts = RESTRICTIONS[name](problem)
    C, admitted = cuts.coefficients(problem.target), 0

    def kept(x):
        """By element: how far the entries lie within their cones."""
        entries = np.einsum("qkc,qkc->q", C, x[cuts.vertices]) - cuts.offsets
        if name == "rows":
            return entries
        a = entries.reshape(-1, 3)
        return (a[:, 0] - np.linalg.norm(a[:, 1:], axis=1)) / 2

    def excess(x):
        """By how much the limits hold."""
        if name == "rows":
            return problem.stretches(x) - problem.lower_bounds
        F = problem.deformation_gradients(x)
        return np.linalg.svd(F, compute_uv=False)[:, 1] - 0.9

    np.testing.assert_allclose(kept(problem.target), excess(problem.target), atol=1e-12)
    for _ in range(20):
        other = problem.target + 0.2 * rng.normal(size=problem.target.shape)
        admitted += np.sum(kept(other) >= 0)
        assert np.all(excess(other) >= kept(other) - 1e-12)
    assert admitted > 0


@pytest.mark.parametrize("name", RESTRICTIONS)
def test_no_round_raises_the_objective_or_leaves_the_limits(name):
    problem = pulled(6)
    program = Program(problem, RESTRICTIONS[name](problem), slack=False)
    x, last = accordion(problem), np.inf
    for _ in range(12):
        x = program.solve(problem, x, 1e-6, Clock()).positions
        assert problem.violations(x).max() <= 1e-6
        assert problem.objective(x) <= last * (1 + 1e-6)
        last = problem.objective(x)


# --- a square pulled, and pressed together


@pytest.mark.parametrize(
    ("resolution", "restriction", "objective"),
    [
        (6, "rows", 2.802766e-3),
        (6, "polar", 2.803007e-3),
        (10, "rows", 2.644407e-3),
        (10, "polar", 2.644434e-3),
    ],
)
def test_the_pulled_square_folds(resolution, restriction, objective):
    problem = pulled(resolution)
    found = solve(problem, SequentialCuts(restriction, starts=("accordion",)))
    assert found.status == "solved"
    assert problem.violations(found.positions).max() <= 1e-6
    assert problem.objective(found.positions) == pytest.approx(objective, rel=1e-5)
    assert found.details["stationarity"] < 1e-5
    assert 12 <= found.details["rounds"] <= 22
    if restriction == "rows":
        assert kkt_residual(problem, found.positions) < 1e-5
        residual = problem.weights[:, None] * (problem.target - found.positions)
        residual -= problem.G.T @ found.multipliers
        assert np.abs(residual).max() < 1e-4 * np.abs(problem.weights.max())
    else:
        F = problem.deformation_gradients(found.positions)
        assert np.linalg.svd(F, compute_uv=False).min() >= 0.9 - 1e-6


def test_noise_leads_to_the_same_fold_in_more_rounds():
    problem = pulled(6)
    for start in ("candidate", "rest"):
        found = solve(problem, SequentialCuts(starts=(start,)))
        assert problem.objective(found.positions) == pytest.approx(2.802766e-3, rel=1e-5)
        assert 42 <= found.details["rounds"] <= 60


def test_without_noise_a_flat_sheet_stays_flat():
    problem = pulled(6)
    program = Program(problem, RESTRICTIONS["rows"](problem), slack=False)
    x = np.column_stack([problem.rest, np.zeros(problem.vertices)])
    for _ in range(3):
        x = program.solve(problem, x, 1e-6, Clock()).positions
    assert problem.objective(x) == pytest.approx(SADDLE, rel=1e-5)
    assert kkt_residual(problem, x) < 1e-5
    assert np.abs(x[:, 2]).max() < 1e-8


def test_the_best_of_all_starts_is_the_answer():
    problem = pulled(4)
    alone = [solve(problem, SequentialCuts(starts=(name,))) for name in ("accordion", "candidate")]
    found = solve(problem, SequentialCuts())
    least = min(problem.objective(s.positions) for s in alone)
    assert problem.objective(found.positions) == pytest.approx(least, rel=1e-9)
    assert found.iterations == sum(s.iterations for s in alone)
    assert found.details["starts"] == 2


def test_the_referee_calls_the_answer_local():
    problem = pulled(4)
    found = certify(problem, solve(problem, "sequential-cuts").positions)
    assert found.outcome == "feasible"
    assert "at best a local optimum" in found.reason
    assert found.objective == pytest.approx(found.best_known, rel=1e-9)


def test_a_flat_answer_is_above_the_best_that_is_known():
    problem = pulled(4)
    flat = np.column_stack([problem.rest, np.zeros(problem.vertices)])
    program = Program(problem, RESTRICTIONS["rows"](problem), slack=False)
    for _ in range(2):
        flat = program.solve(problem, flat, 1e-6, Clock()).positions
    found = certify(problem, flat)
    assert found.reason.startswith("at best a local optimum")
    assert found.best_known < 0.95 * found.objective


def test_it_stops_where_it_is_told_to():
    found = solve(pulled(4), SequentialCuts(max_rounds=2, starts=("candidate",)))
    assert (found.status, found.details["rounds"]) == ("iteration limit", 2)
    assert pulled(4).violations(found.positions).max() <= 1e-6


def test_the_clock_ends_it_within_the_limits():
    problem = pulled(10)
    solver = SequentialCuts(starts=("accordion",))
    for limit in (1e-3, 0.05):
        found = run_solver(solver, problem, solver.prepare(problem), 1e-6, limit)
        assert found.status in ("time limit", "solved")
        assert problem.violations(found.positions).max() <= 1e-6


# --- starts


OPEN = np.array([[0.0]] + 3 * [[1.0]] + [[0.0]] + 20 * [[1.0]])  # all but vertices 0 and 4


def noisy(size):
    return size * np.random.default_rng(3).normal(size=(25, 3))


@pytest.mark.parametrize("restriction", RESTRICTIONS)
@pytest.mark.parametrize(
    ("target", "pinned"),
    [
        pytest.param(lambda x: 0 * x, (), id="a point"),
        pytest.param(lambda x: x * [1, 0, 0], (), id="a line"),
        pytest.param(lambda x: x + noisy(0.2), (), id="rough"),
        pytest.param(lambda x: 1.3 * x * [-1, 1, 1], (), id="turned over"),
        pytest.param(lambda x: 0.5 * x, (), id="pressed in both directions"),
        pytest.param(lambda x: x * [1, 0.7, 1], (0, 4), id="pins closer"),
        pytest.param(lambda x: 0.7 * x + noisy(0.05) * OPEN, (0, 4), id="pins closer and rough"),
    ],
)
def test_from_wherever_the_target_is_the_limits_are_met(target, pinned, restriction):
    problem = sheet(target, pinned)
    found = solve(problem, SequentialCuts(restriction, max_rounds=3))
    assert found.status in ("solved", "iteration limit")
    assert problem.violations(found.positions).max() <= 1e-6
    np.testing.assert_array_equal(found.positions[list(pinned)], problem.target[list(pinned)])


def test_pins_that_press_an_edge_leave_no_start():
    problem = sheet(lambda x: x * [1, 0.6, 1], range(5))
    found = solve(problem, "sequential-cuts")
    assert found.status == "no start within the limits"
    assert np.all(np.isfinite(found.positions))


def test_upper_bounds_that_cannot_be_met_are_said_to_be_infeasible():
    problem = sheet(lambda x: x * [1, 1.2, 1], range(5))
    solver = SequentialCuts()  # asked itself: `solve` sees from the pins that there is no answer
    found = run_solver(solver, problem, solver.prepare(problem), 1e-6)
    assert found.status == "PrimalInfeasible"
    assert not np.any(np.isfinite(found.positions))


def test_a_target_within_the_limits_is_the_answer():
    problem = sheet(lambda x: x * [1.02, 0.95, 1])
    found = solve(problem, "sequential-cuts")
    assert np.abs(found.positions - problem.target).max() < 1e-6


def test_noise_keeps_pins():
    problem = sheet(lambda x: x, (0, 4))
    moved = np.any(candidate(problem) != problem.target, axis=1)
    np.testing.assert_array_equal(np.flatnonzero(~moved), [0, 4])


# --- other problems


def test_a_problem_without_lower_bounds_is_one_program():
    problem = StretchSquare(resolution=6).problem()
    found = solve(problem, "sequential-cuts")
    assert (found.status, found.iterations) == ("solved", 1)
    assert certify(problem, found.positions).outcome == "optimal"


def test_a_pressed_tetrahedron_is_pushed_out():
    rest = np.vstack([np.zeros(3), np.eye(3)])
    limits = StretchLimits(np.eye(3), np.full(3, 1.1), lower=np.full(3, 0.9))
    problem = Problem(rest, [[0, 1, 2, 3]], rest * [1.0, 1.0, 0.5], limits)
    found = solve(problem, "sequential-cuts")
    assert found.status == "solved"
    expected = problem.target + 0.2 * np.outer([-1, 0, 0, 1], [0, 0, 1])
    np.testing.assert_allclose(found.positions, expected, atol=1e-6)
    assert "triangles" in SequentialCuts("polar").supports(problem)


def test_from_the_last_frame_a_swing_takes_few_rounds():
    scene = Swing(resolution=4, norm="mass")
    first = scene.problem()
    limited = replace(first, limits=StretchLimits.isotropic(1.01, 4, lower=0.9))
    solver, rounds = SequentialCuts(warm=True), []
    state = solver.prepare(limited)

    def project(target):
        frame = limited.with_target(target)
        found = run_solver(solver, frame, state, 1e-6)
        assert found.status == "solved"
        assert frame.violations(found.positions).max() <= 1e-6
        rounds.append(found.iterations)
        return found.positions

    playing = scene.play(project)
    while len(rounds) < 12:
        next(playing)
    assert np.mean(rounds) < 8
    assert max(rounds) < 60


# --- what it does not take


def test_exact_limits_are_refused():
    limits = StretchLimits.exact(1.1)
    problem = replace(sheet(lambda x: x), limits=limits)
    assert "exact limits" in find_solver("sequential-cuts").supports(problem)
    with pytest.raises(ValueError, match="cannot take this problem: it has no form for exact"):
        solve(problem, "sequential-cuts")


def test_the_polar_restriction_has_one_lower_bound():
    limits = StretchLimits.sampled([0.0, 1.0], [1.1, 1.1], lower=[0.9, 0.8])
    problem = replace(sheet(lambda x: x), limits=limits)
    assert "one lower bound for all directions" in SequentialCuts("polar").supports(problem)
    assert SequentialCuts().supports(problem) is None


@pytest.mark.parametrize(
    ("setting", "words"),
    [
        ({"restriction": "planes"}, "restriction is 'planes': valid are rows, polar"),
        ({"starts": ("rest", "there")}, "starts has 'there': valid are accordion, candidate, rest"),
        ({"max_rounds": 0}, "max_rounds is 0: a number above 0 is valid"),
    ],
)
def test_settings_that_are_none_are_named(setting, words):
    with pytest.raises(ValueError, match=words):
        SequentialCuts(**setting)
