"""ADMM's parts against plain numpy, its stop rule, and its start."""

from __future__ import annotations

import numpy as np
import pytest

from solvers.admm import Admm, Iteration
from solvers.admm.anderson import Anderson
from solvers.admm.steps import Steps
from strainbench import certify, solve
from strainbench.solver.solver import Clock
from tests.problem.test_conic import exact
from tests.problems import random_problem


def test_balls_are_projected_on(rng):
    problem = random_problem(rng)
    v = rng.normal(size=(problem.rows, 3)) * rng.uniform(0.1, 3, (problem.rows, 1))
    z = Steps(problem).project(v, problem.bounds)
    lengths = np.linalg.norm(v, axis=1)
    expected = v * np.minimum(1, problem.bounds / lengths)[:, None]
    assert z == pytest.approx(expected, abs=1e-14)


@pytest.mark.parametrize("equal", [False, True])
def test_singular_values_are_clamped(rng, equal):
    problem = exact(random_problem(rng))
    v = rng.normal(size=(problem.constraints, 2, 3))
    U, s, Vt = np.linalg.svd(v, full_matrices=False)
    if equal:  # the closed form divides by their difference
        s[:, 1] = s[:, 0]
        v = (U * s[:, None]) @ Vt
    expected = (U * np.minimum(s, problem.bounds[:, None])[:, None]) @ Vt
    z = Steps(problem).project(v.reshape(-1, 3), problem.bounds)
    assert z == pytest.approx(expected.reshape(-1, 3), abs=1e-8)


def test_the_matrix_is_the_mass_and_the_weighted_rows(rng):
    problem = random_problem(rng, pins=2, mass=True)
    steps, w = Steps(problem), rng.uniform(0.5, 2, problem.rows)
    steps.factorise(w)
    G = problem.G[:, problem.free].toarray()
    A = np.diag(problem.weights[problem.free]) + G.T @ (w[:, None] * G)
    b = rng.normal(size=(len(A), 3))
    assert steps.linear.solve(b) == pytest.approx(np.linalg.solve(A, b), rel=1e-8)


@pytest.mark.parametrize("fields", [{}, {"memory": 6}, {"weights": "residuals", "relaxation": 1.0}])
@pytest.mark.parametrize("limits", ["sampled", "exact"])
def test_what_it_calls_solved_is_certified(fields, limits):
    problem = random_problem(np.random.default_rng(4), directions=3, limit=0.05)
    problem = exact(problem) if limits == "exact" else problem
    solution = solve(problem, Admm(**fields))
    found = certify(problem, solution.positions)
    assert solution.status == "solved"
    assert found.max_violation <= 1e-6
    assert found.relative_gap <= 2e-6


def test_the_iteration_limit_is_not_solved(rng):
    problem = random_problem(rng, limit=0.02)
    assert solve(problem, Admm(max_iterations=3)).status == "iteration limit"


def test_the_optimum_with_its_multipliers_is_where_it_stays():
    problem = random_problem(np.random.default_rng(9), directions=3, limit=0.05)
    cold = solve(problem, "admm", tolerance=1e-8)
    again = Iteration(Admm(), problem, Steps(problem), cold.positions, cold.multipliers)
    status, iterations = again.run(1e-6, Clock().monitor, Clock())
    assert (status, iterations) == ("solved", 10)
    assert np.abs(again.x - cold.positions).max() < 1e-5 * problem.edge_length


def test_anderson_acceleration_solves_a_linear_map_in_as_many_steps_as_it_has_dimensions(rng):
    A, b = 0.9 * np.linalg.qr(rng.normal(size=(6, 6)))[0], rng.normal(size=6)
    accelerate, v = Anderson(6), np.zeros((2, 3))
    for _ in range(12):
        plain = (A @ v.ravel() + b).reshape(2, 3)
        v = accelerate(plain, plain - v, np.ones(2))
    assert v.ravel() == pytest.approx(np.linalg.solve(np.eye(6) - A, b), abs=1e-6)
