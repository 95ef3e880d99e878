"""A vertex in no element stays at its target, and the others are as without it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from strainbench import Problem, StretchLimits, certify, solve
from strainbench.physics.linear import available_linear_solvers
from strainbench.referee.kkt import kkt_residual
from strainbench.referee.reference import reference_of
from strainbench.solver.registry import find_solver, list_solvers
from strainbench.solver.solver import run_solver
from tests.problems import random_problem, stretched_cube

SOLVERS = [e.name for e in list_solvers() if not e.unavailable]
PLACES = np.array([0, 3, 7])  # of the isolated vertices, among the others
KINDS = {
    "sampled": lambda: random_problem(np.random.default_rng(1), directions=4, vertices=12, pins=2),
    "exact": lambda: random_problem(np.random.default_rng(2), vertices=12, exact=True, pins=2),
    "free": lambda: random_problem(np.random.default_rng(3), directions=2, vertices=12, pins=0),
    "volume": lambda: stretched_cube(StretchLimits(np.eye(3), np.full(3, 1.05))),
    "exact volume": lambda: stretched_cube(StretchLimits.exact(1.05, dim=3)),
}


def with_isolated(problem, pinned=False):
    """The same with three more vertices, the first perhaps pinned; where the old ones are."""
    n = problem.vertices + len(PLACES)
    old = np.setdiff1d(np.arange(n), PLACES)

    def spread(array, rest):
        larger = np.empty((n, *array.shape[1:]))
        larger[old], larger[PLACES] = array, rest
        return larger

    target = spread(problem.target, 5 + np.arange(9).reshape(3, 3))
    heavy = None if problem.mass is None else spread(problem.mass, [1e3, 1.0, 1e-6])
    pins = np.concatenate([PLACES[:1] if pinned else PLACES[:0], old[problem.pinned]])
    rest = spread(problem.rest, np.arange(3)[:, None])
    larger = Problem(rest, old[problem.elements], target, problem.limits, pins, heavy)
    return larger, old


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("pinned", [False, True])
def test_it_does_not_count_as_free(kind, pinned):
    problem = KINDS[kind]()
    larger, old = with_isolated(problem, pinned)
    assert np.array_equal(larger.free, old[problem.free])
    assert np.array_equal(larger.isolated, PLACES[1:] if pinned else PLACES)
    assert set(larger.held) == set(larger.pinned) | set(larger.isolated)
    assert larger.mean_weight == pytest.approx(problem.mean_weight)
    assert larger.least_weight == problem.least_weight
    assert larger.objective_floor == pytest.approx(problem.objective_floor)
    assert larger.largest_objective == pytest.approx(problem.largest_objective)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["sampled", "exact", "volume"])
@pytest.mark.parametrize("name", SOLVERS)
def test_every_solver_leaves_it_at_its_target(name, kind):
    problem = KINDS[kind]()
    if refusal := find_solver(name).supports(problem):
        pytest.skip(refusal)
    plain = solve(problem, name, time_limit=0.3)
    larger, old = with_isolated(problem, pinned=True)
    found = solve(larger, name, time_limit=0.3)
    assert np.array_equal(found.positions[PLACES], larger.target[PLACES])
    if plain.status == "solved":
        assert found.status == "solved"
        scale = np.abs(problem.target).max()
        assert np.allclose(found.positions[old], plain.positions, atol=1e-5 * scale, rtol=0)


@pytest.mark.parametrize("linear", available_linear_solvers(), ids=lambda kind: kind.name)
def test_newton_ipm_with_each_linear_solver(linear, monkeypatch):
    monkeypatch.setattr("solvers.newton_ipm.iterate.best_linear_solver", linear)
    problem = KINDS["sampled"]()
    larger, old = with_isolated(problem)
    found = solve(larger, "newton-ipm")
    assert found.status == "solved"
    assert np.allclose(found.positions[old], solve(problem, "newton-ipm").positions, atol=1e-9)


@pytest.mark.slow
def test_a_warm_start_leaves_it_at_its_target():
    larger, _ = with_isolated(KINDS["sampled"]())
    for name in SOLVERS:
        solver = find_solver(name)
        if solver.starts_warm is None:
            continue
        solver = replace(solver, warm=True)
        state = solver.prepare(larger)
        for shift in (0.0, 0.1, 1 / 3):
            frame = larger.with_target(larger.target * (1 + shift))
            if frame.infeasible_pins():
                continue
            found = run_solver(solver, frame, state, 1e-6, time_limit=2.0)
            assert np.array_equal(found.positions[PLACES], frame.target[PLACES]), name


@pytest.mark.parametrize("kind", KINDS)
def test_the_certificate_is_that_of_the_others(kind):
    problem = KINDS[kind]()
    larger, old = with_isolated(problem)
    x = solve(problem, "clarabel").positions
    y = larger.target.copy()
    y[old] = x
    plain, found = certify(problem, x), certify(larger, y)
    assert found.outcome == plain.outcome == "optimal"
    for name in ("lower_bound", "objective", "max_violation", "distance"):
        assert getattr(found, name) == pytest.approx(getattr(plain, name), rel=1e-9, abs=1e-9)
    assert found.distance_bound == pytest.approx(plain.distance_bound, rel=1e-2, abs=1e-9)


def test_an_answer_that_moved_it_is_told_so():
    """Its objective and distance are exactly what it adds: 1/2 m |d|^2, and |d|."""
    larger, _ = with_isolated(random_problem(np.random.default_rng(1), mass=True, pins=2))
    best = reference_of(larger).positions
    moved = best.copy()
    moved[PLACES[1]] += [0.3, 0.0, 0.4]
    before, after = certify(larger, best), certify(larger, moved)
    added = 0.5 * larger.mass[PLACES[1]] * 0.25
    assert before.outcome == "optimal"
    assert after.outcome == "feasible"
    assert after.objective - before.objective == pytest.approx(added)
    assert after.relative_gap == pytest.approx(added / before.lower_bound, rel=1e-3)
    assert after.distance == pytest.approx(0.5)
    assert after.distance_bound == pytest.approx(0.5, rel=1e-2)


def test_moving_it_is_no_local_optimum():
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [5.0, 5.0]])
    target = np.column_stack([square, np.zeros(5)])
    limits = StretchLimits.isotropic(1.1, lower=0.9)
    problem = Problem(square, [[0, 1, 2], [0, 2, 3]], target, limits)
    assert kkt_residual(problem, target) == 0
    moved = target.copy()
    moved[4, 2] = 1.0
    assert kkt_residual(problem, moved) == pytest.approx(1.0)
    assert "no local optimum" in certify(problem, moved).reason


@pytest.mark.slow
def test_all_others_may_be_pinned():
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [9.0, 9.0]])
    target = np.column_stack([square, np.ones(4)])
    limits = StretchLimits.isotropic(1.01)
    problem = Problem(square, [[0, 1, 2]], target, limits, [0, 1, 2], [1.0, 1.0, 1.0, 2.0])
    assert len(problem.free) == 0
    for name in SOLVERS:
        if not find_solver(name).supports(problem):
            assert np.array_equal(solve(problem, name).positions, target), name
    assert certify(problem, target).outcome == "optimal"
    moved = certify(problem, target + np.array([0, 0, 0.5]))
    assert moved.outcome == "feasible"
    assert moved.objective == 0.25
    assert moved.distance_bound == 0.5
    assert moved.relative_gap == float("inf")
