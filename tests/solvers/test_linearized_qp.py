"""The curvature of linearised limits, and what leaving it out does."""

from __future__ import annotations

import numpy as np
import pytest

from solvers.linearized_qp import LinearizedQP, Steps
from strainbench import certify, solve
from strainbench.solver.solver import run_solver
from tests.problems import central_difference, random_problem


def test_curvature_is_the_hessian_of_the_limits(rng):
    problem = random_problem(rng, vertices=12, pins=1, directions=2)
    method = LinearizedQP()
    steps = Steps(
        method, problem, method.prepare(problem).mesh, problem.target, np.zeros(problem.rows)
    )
    lengths = rng.uniform(0.5, 2, problem.rows)

    def gradient(x):
        y = problem.G @ x
        along = lengths[:, None] * y / np.linalg.norm(y, axis=1)[:, None]
        return (problem.G.T @ along)[problem.free].ravel()

    y = problem.G @ problem.target
    norms = np.linalg.norm(y, axis=1)
    H = steps._curvature(y / norms[:, None], lengths / norms).toarray() / steps.h**2
    n = 3 * len(problem.free)
    numeric = central_difference(gradient, problem.target)[:, problem.free].reshape(n, n)
    assert pytest.approx(numeric, abs=1e-5 * np.abs(numeric).max()) == H


def test_steps_converge_with_the_curvature_and_do_not_without():
    problem = random_problem(np.random.default_rng(3), directions=4, limit=0.02)
    curved, plain = (solve(problem, LinearizedQP(curvature=c)) for c in (True, False))
    assert curved.status == "solved"
    assert curved.iterations < 20
    assert certify(problem, curved.positions).relative_gap < 1e-5
    assert plain.status == "step limit"


def test_the_step_limit_is_not_solved(rng):
    problem = random_problem(rng, limit=0.02, directions=4)
    assert solve(problem, LinearizedQP(max_steps=1)).status == "step limit"


def test_limits_that_cannot_be_met_are_not_solved():
    problem = random_problem(np.random.default_rng(1), directions=4, limit=0.05, pins=4)
    target = problem.target.copy()
    target[problem.pinned] *= 2.0
    apart = problem.with_target(target)
    assert apart.infeasible_pins()
    method = LinearizedQP()
    solution = run_solver(method, apart, method.prepare(apart), 1e-6)
    assert solution.status != "solved"
