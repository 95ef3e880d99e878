"""newton-ipm's exact limits on tetrahedra: 3 x 3 matrices."""

from __future__ import annotations

import numpy as np
import pytest

from solvers.newton_ipm import NewtonIPM, State
from solvers.newton_ipm.jacobi import diagonalise, scale, singular_values
from strainbench import StretchLimits, certify, solve
from strainbench.solver.solver import run_solver
from tests.problems import central_difference, random_volume, stretched_cube


def projected(problem, solver=None, state=None, tolerance=1e-8):
    solver = NewtonIPM() if solver is None else solver
    state = solver.prepare(problem) if state is None else state
    return run_solver(solver, problem, state, tolerance)


@pytest.mark.parametrize("seed", range(6))
def test_random_volumes_agree_with_clarabel(seed):
    """With bounds an axis and element, masses and pins drawn at random."""
    problem, _ = random_volume(np.random.default_rng(seed))
    other = certify(problem, solve(problem, "clarabel-tight").positions)
    assert other.outcome == "optimal"
    found = projected(problem)
    assert found.status == "solved"
    assert problem.violations(found.positions).max() < 1e-8
    assert problem.objective(found.positions) == pytest.approx(other.lower_bound, rel=1e-7)


@pytest.mark.parametrize("bound", [1.0001, 1.01, 1.3])
def test_a_cube_is_certified(bound):
    problem = stretched_cube(StretchLimits.exact(bound, dim=3))
    assert certify(problem, projected(problem).positions).outcome == "optimal"


def test_a_warm_start_gives_the_same_answers():
    first, _ = random_volume(np.random.default_rng(1))
    solver = NewtonIPM(warm=True)
    state = solver.prepare(first)
    for frame in range(4):
        target = first.target * [1, 1, 1 + 0.01 * frame]
        target[first.pinned] = first.target[first.pinned]
        problem = first.with_target(target)
        warm, cold = projected(problem, solver, state, 1e-9), projected(problem, tolerance=1e-9)
        apart = 2 * np.sqrt(2e-9 * problem.objective(cold.positions) / problem.least_weight)
        assert warm.positions == pytest.approx(cold.positions, abs=apart)  # two gaps of 1e-9


def test_the_matrix_is_the_derivative_of_the_condition_that_it_solves():
    """Where s = q, a Newton step for fixed products makes K the derivative of r_d at l = mu/s."""
    problem, placed = random_volume(np.random.default_rng(3))
    x = 0.9 * placed
    assert not np.any(problem.violations(x))
    state, mu = State(problem), 0.3
    cones, free = state.cones, problem.free

    def gradient(moved):
        """Of 1/2 ||x - target||_M^2 - mu log det of the slacks."""
        cones.place(problem.bounds, moved)
        cones.start(0.0, mu)
        Y, pull = np.zeros((problem.rows, 3)), np.zeros_like(moved)
        cones.measure(cones.at.y, Y, pull)
        return (problem.weights[:, None] * (moved - problem.target) + pull)[free].ravel()

    by_all = central_difference(gradient, x, 1e-5 * problem.edge_length)
    expected = by_all[:, free].reshape(3 * len(free), -1)
    gradient(x)
    cones.assemble(state.matrix.mass())
    lower = state.matrix.lower.toarray()
    K = lower + np.tril(lower, -1).T
    assert np.abs(K - expected).max() < 1e-6 * np.abs(K).max()


def test_the_scaling_makes_slack_and_multiplier_one_diagonal_matrix():
    """With eigenvalues over twelve decades, and where two are the same."""
    rng = np.random.default_rng(5)
    for values in ([1.0, 1e-6, 1e-12], [2.0, 2.0, 1e-9], [1.0, 1.0, 1.0]):
        axes = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        s, l = axes * values @ axes.T, axes / values @ axes.T  # noqa: E741
        R, inverse, d, work = np.empty((3, 3)), np.empty((3, 3)), np.empty(3), np.empty((3, 3, 3))
        scale((s + s.T) / 2, (l + l.T) / 2, R, inverse, d, work)
        np.testing.assert_allclose(inverse @ R, np.eye(3), atol=1e-8)
        np.testing.assert_allclose(d, 1.0, rtol=1e-3)  # S L = I, but for rounding of S
        np.testing.assert_allclose(R.T @ l @ R, np.diag(d), atol=1e-3)


@pytest.mark.parametrize("values", [[3.0, 2.0, 1.0], [1.0, 1.0, 1.0], [1.0, 1e-9, 0.0], [0, 0, 0]])
def test_jacobi_finds_singular_values_and_axes(values):
    rng = np.random.default_rng(2)
    U, V = (np.linalg.qr(rng.normal(size=(3, 3)))[0] for _ in range(2))
    y = U * values @ V
    largest, total = singular_values(y, np.empty((3, 3)), np.zeros((3, 3)))
    assert (largest, total) == pytest.approx((max(values), sum(values)), rel=1e-14)
    A, axes = U * values @ U.T, np.empty((3, 3))
    D = (A + A.T) / 2
    diagonalise(D, axes)
    np.testing.assert_allclose(axes * np.diag(D) @ axes.T, A, atol=1e-14)
    np.testing.assert_allclose(axes.T @ axes, np.eye(3), atol=1e-14)
