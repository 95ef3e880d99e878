"""The contract that every solver keeps; new solvers are found by themselves."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from strainbench import Problem, StretchLimits, certify, solve
from strainbench.discovery import UnavailableError, find_solver, list_solvers
from tests.problems import random_problem

NAMES = [e.name for e in list_solvers() if not e.unavailable]
ROUGH = {
    "cvxpy-scs": 1e-6,
    "cvxpy-scs-default": 1e-3,
    "linearized-qp-default": 1e-6,
    "linearized-qp-plain": 1e-6,
}
"""Solvers that often end with limits violated, and the violation that their "solved" allows."""
EDGES = ["ipopt-edges"]
"""They limit the lengths of edges: another set of positions than the problem's."""
FIXED_COUNT = ["augmented-lagrangian-arcsim", "xpbd-20", "xpbd-compliant"]
"""Variants as they are used elsewhere: so many iterations, wherever these end."""
LIMITING = [n for n in NAMES if n not in ["none", *EDGES, *ROUGH, *FIXED_COUNT]]
TO_OPTIMALITY = [
    "admm",
    "augmented-lagrangian",
    "clarabel",
    "clarabel-default",
    "cvxpy",
    "dykstra",
    "dykstra-plain",
    "ipopt",
    "linearized-qp",
    "newton-ipm",
    "qoco",
]
"""Solvers of the projection itself; the others stop at a point within the limits."""
UNSCALED = [
    "clarabel-default",
    "clarabel-paper",
    "cvxpy-default",
    "cvxpy-ecos-default",
    "cvxpy-qoco-default",
    "ipopt-default",
    "qoco-default",
]
"""Out of the box: an objective known to 1e-8 of its size leaves positions uncertain by 1e-4."""


def exactness(name):
    return 5e-4 if name in UNSCALED else 5e-6


def available(name):
    try:
        return find_solver(name)
    except UnavailableError as error:
        pytest.skip(str(error))


def answer(problem, name):
    """The solver's solution; the test is skipped, with the reason, where it refuses the limits."""
    solver = available(name)
    if reason := solver.supports(problem):
        pytest.skip(f"{name}: {reason}")
    return solve(problem, solver)


def stretched_triangle(limit=1.1, mass=None):
    """One limited direction, no pins: the projection is known in closed form."""
    rest = np.array([[0.0, 0.0], [1.0, 0.0], [0.2, 0.8]])
    target = np.column_stack([1.5 * rest, [0.0, 0.3, -0.1]])
    limits = StretchLimits.sampled([0.3], [limit])
    return Problem(rest, np.array([[0, 1, 2]]), target, limits, mass=mass)


def closest(problem):
    """Closed form: one constraint, x = t - M^-1 g (|y| - b) / (g' M^-1 g) y / |y|."""
    g = problem.row_coefficients[0]
    y = g @ problem.target
    length = np.linalg.norm(y)
    step = g / problem.weights
    return problem.target - np.outer(step, y / length) * (length - problem.bounds[0]) / (g @ step)


@pytest.mark.parametrize("name", NAMES)
def test_label_and_docstring(name):
    solver = available(name)
    assert solver.label == name
    assert solver.__doc__.split("\n")[0].rstrip(".").endswith(")")


@pytest.mark.parametrize("name", LIMITING)
@pytest.mark.parametrize("mass", [None, np.array([1.0, 2.0, 5.0])])
def test_a_single_stretched_triangle_has_its_analytic_projection(name, mass):
    problem = stretched_triangle(mass=mass)
    solution = answer(problem, name)
    assert solution.positions == pytest.approx(closest(problem), abs=exactness(name))


@pytest.mark.parametrize("name", LIMITING)
@pytest.mark.parametrize("seed", range(6))
def test_answers_lie_within_the_limits(name, seed):
    rng = np.random.default_rng(seed)
    problem = random_problem(rng, directions=4, limit=0.02)
    solution = answer(problem, name)
    found = certify(problem, solution.positions)
    assert found.outcome in ("optimal", "feasible"), (found.reason, solution.status)
    if name in TO_OPTIMALITY:
        assert found.relative_gap < 1e-3, solution.status


@pytest.mark.parametrize("name", ROUGH)
@pytest.mark.parametrize("seed", range(3))
def test_rough_settings_claim_no_more_than_they_reach(name, seed):
    problem = random_problem(np.random.default_rng(seed), directions=4, limit=0.02)
    solution = solve(problem, available(name), time_limit=1.0)
    violation = problem.violations(solution.positions).max()
    assert np.isfinite(violation)
    assert solution.status != "solved" or violation <= ROUGH[name]


@pytest.mark.parametrize("name", TO_OPTIMALITY)
@pytest.mark.parametrize("seed", range(6))
def test_solvers_of_the_projection_agree(name, seed):
    problem = random_problem(np.random.default_rng(100 + seed), directions=3, limit=0.05)
    reference = solve(problem, "clarabel").positions
    positions = answer(problem, name).positions
    assert np.abs(positions - reference).max() < 1e-3 * problem.edge_length


@pytest.mark.parametrize("name", NAMES)
def test_a_feasible_target_is_its_own_answer(name):
    problem = stretched_triangle(limit=2.0)
    solution = answer(problem, name)
    assert np.abs(solution.positions - problem.target).max() < exactness(name)
    outcomes = ["optimal", "feasible"] if name in UNSCALED else ["optimal"]
    assert certify(problem, solution.positions).outcome in outcomes


@pytest.mark.parametrize("name", [*LIMITING, *EDGES, *FIXED_COUNT])
def test_rigid_motion_of_the_target_moves_the_answer(name):
    problem = random_problem(np.random.default_rng(5), directions=4, limit=0.05)
    rotation = Rotation.random(rng=np.random.default_rng(1)).as_matrix()
    moved = problem.with_target(problem.target @ rotation.T + [1.0, -2.0, 0.5])
    expected = answer(problem, name).positions @ rotation.T + [1.0, -2.0, 0.5]
    assert answer(moved, name).positions == pytest.approx(expected, abs=10 * exactness(name))


@pytest.mark.parametrize("name", NAMES)
def test_pins_stay_and_the_problem_is_not_changed(name):
    problem = random_problem(np.random.default_rng(7), directions=4, limit=0.05)
    before = problem.target.copy()
    solution = answer(problem, name)
    assert np.array_equal(problem.target, before)
    assert solution.positions[problem.pinned] == pytest.approx(before[problem.pinned], abs=1e-12)


@pytest.mark.parametrize("name", [*TO_OPTIMALITY, "clarabel-paper"])
def test_multipliers_are_stationary(name):
    problem = random_problem(np.random.default_rng(9), directions=4, limit=0.05)
    solution = answer(problem, name)
    force = (problem.weights[:, None] * (problem.target - solution.positions))[problem.free]
    assert solution.multipliers is not None
    back = (problem.G.T @ solution.multipliers)[problem.free]
    assert np.abs(back - force).max() < 1e-2 * np.abs(force).max()


@pytest.mark.parametrize("name", NAMES)
def test_iterates_are_shown_with_the_iterations_that_they_took(name):
    """Those of a whole number of iterations, rising, the last one at most half of them back."""
    problem = random_problem(np.random.default_rng(11), directions=4, limit=0.02)
    shown = []

    def watch(seconds, iterations, positions, multipliers):
        assert np.shape(positions) == problem.target.shape
        shown.append((iterations, seconds))

    solution = solve(problem, available(name), watch=watch)
    counts, seconds = zip(*shown, strict=True) if shown else ((), ())
    assert list(counts) == sorted(set(counts))
    assert list(seconds) == sorted(seconds)
    if shown:
        assert counts[-1] <= solution.iterations <= 2 * counts[-1] + 1
