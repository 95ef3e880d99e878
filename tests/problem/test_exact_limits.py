"""Solvers that take exact limits agree, and their multipliers are those of the spectral norm."""

from __future__ import annotations

import numpy as np
import pytest

from strainbench import Problem, StretchLimits, certify, solve
from strainbench.problem.grid import square_grid
from strainbench.solver.registry import find_solver, list_solvers
from tests.problem.test_conic import exact
from tests.problems import random_problem

EXACT = [e.name for e in list_solvers() if not e.unavailable and find_solver(e.name).takes_exact]
SECOND_ORDER = ["cvxpy-ecos", "cvxpy-ecos-default", "cvxpy-qoco", "cvxpy-qoco-default"]
REFUSING = ["clarabel-paper", *SECOND_ORDER]
TO_OPTIMALITY = ["clarabel", "clarabel-default", "cvxpy", "admm"]


def stretched_square(cells, weft=None):
    """A pinned sheet, 8% too long and with noise: rest size 0.3 m."""
    rest, elements = square_grid(cells, 0.3, "alternating")
    rng = np.random.default_rng(cells)
    target = np.column_stack([1.08 * rest, np.zeros(len(rest))])
    target += 0.003 * rng.normal(size=target.shape)
    target[0] = 0
    return Problem(rest, elements, target, StretchLimits.exact(1.01, weft), np.array([0]))


@pytest.mark.parametrize("weft", [None, 1.05])
def test_semidefinite_cones_directly_and_through_cvxpy_agree(weft):
    problem = stretched_square(2, weft)
    first, second = (solve(problem, n, tolerance=1e-8).positions for n in ("clarabel", "cvxpy"))
    assert np.abs(first - second).max() < 1e-7


@pytest.mark.parametrize("name", TO_OPTIMALITY)
@pytest.mark.parametrize("seed", range(4))
def test_answers_are_optimal(name, seed):
    problem = random_problem(np.random.default_rng(seed), limit=0.05)
    problem = exact(problem, 1.05, 1.2 if seed % 2 else None)
    solution = solve(problem, name)
    found = certify(problem, solution.positions)
    assert found.outcome == "optimal", (found.reason, solution.status)


@pytest.mark.parametrize("name", TO_OPTIMALITY)
def test_multipliers_are_stationary_and_complementary(name):
    problem = stretched_square(3)
    solution = solve(problem, name, tolerance=1e-8)
    force = (problem.target - solution.positions)[problem.free]
    back = (problem.G.T @ solution.multipliers)[problem.free]
    assert np.abs(back - force).max() < 1e-3 * np.abs(force).max()
    products = np.sum(solution.multipliers * (problem.G @ solution.positions))
    priced = problem.dual_norms(solution.multipliers) @ problem.bounds
    assert products == pytest.approx(priced, rel=1e-3)


@pytest.mark.parametrize("name", REFUSING)
def test_others_say_why_not(name):
    if name in EXACT:
        assert "exact limits" in find_solver(name).supports(stretched_square(2))


@pytest.mark.parametrize("name", ["clarabel", "cvxpy", "admm"])
def test_a_volume_has_exact_limits_too(name):
    rest = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]])
    elements = np.array([[0, 1, 2, 3], [1, 2, 3, 4]])
    target = rest * [1.3, 1.1, 0.9]
    problem = Problem(rest, elements, target, StretchLimits.exact(1.05, dim=3))
    found = certify(problem, solve(problem, name).positions)
    assert found.outcome == "optimal", found.reason
    assert found.max_principal_stretch == pytest.approx(1.05, abs=1e-5)


def test_positions_that_are_not_finite_have_no_stretch():
    problem = stretched_square(2)
    positions = problem.target.copy()
    positions[0] = np.nan
    touched = np.any(problem.elements == 0, axis=1)
    assert np.array_equal(np.isnan(problem.stretches(positions)), touched)


def test_the_referee_says_so_where_limits_cannot_be_met():
    problem = stretched_square(2)
    apart = problem.rest * [1.02, 1]
    target = np.column_stack([apart, np.zeros(len(apart))])
    pins = np.arange(len(apart))[problem.rest[:, 1] == 0][[0, -1]]
    impossible = Problem(problem.rest, problem.elements, target, problem.limits, pins)
    found = certify(impossible, target)
    assert found.outcome == "violated"
    assert found.reason.startswith("infeasible")
