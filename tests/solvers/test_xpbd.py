"""What is special to position-based dynamics."""

from __future__ import annotations

import numpy as np
import pytest

from solvers.xpbd import Xpbd
from strainbench import certify, solve
from strainbench.solver.solver import Clock
from tests.problems import central_difference, random_problem, scattered_triangles


def problem_of(seed):
    return random_problem(np.random.default_rng(seed), directions=4, limit=0.02)


def test_one_step_on_one_row_is_newtons():
    """Along the constraint's gradient, to where its linearisation is 0: l = C / |grad C|_W^2."""
    problem, _ = scattered_triangles(np.random.default_rng(4), count=1, mass=True)
    t = problem.target

    def constraint(x):
        return float(np.sum((problem.G @ x) ** 2) - problem.bounds[0] ** 2)

    gradient = central_difference(constraint, t).reshape(t.shape)
    if constraint(t) < 0:
        t = t * 2 * problem.bounds[0] / problem.stretches(t)
        problem = problem.with_target(t)
        gradient = central_difference(constraint, t).reshape(t.shape)
    down = gradient / problem.weights[:, None]
    expected = t - down * constraint(t) / np.sum(gradient * down)
    found = solve(problem, Xpbd(max_sweeps=1))
    assert found.positions == pytest.approx(expected, rel=1e-6)


def test_a_row_alone_keeps_the_compliant_part_of_its_violation():
    """At rest C = a l, and the move t - x = W grad C l: so the strain energy balances the move."""
    problem, _ = scattered_triangles(np.random.default_rng(5), count=1)
    problem = problem.with_target(problem.target * 2 / problem.stretches(problem.target))
    b, compliance = problem.bounds[0], 1e-2
    found = solve(problem, Xpbd(compliance=compliance, max_sweeps=200))
    leverage = np.sum(problem.row_coefficients[0] ** 2)
    C = problem.stretches(found.positions)[0] ** 2 - b**2
    multiplier = np.linalg.norm(found.multipliers) / (2 * np.sqrt(C + b**2))
    assert found.status == "iteration limit"
    assert C > 0
    assert pytest.approx(4 * b**2 * leverage * compliance * multiplier, rel=1e-9) == C


@pytest.mark.parametrize("seed", range(3))
def test_a_fixed_count_is_never_called_solved_outside_the_limits(seed):
    problem = problem_of(seed)
    found = solve(problem, "xpbd-20")
    assert problem.violations(found.positions).max() > 1e-6
    assert (found.status, found.iterations) == ("iteration limit", 20)
    assert certify(problem, found.positions).outcome == "violated"


@pytest.mark.parametrize("clamped", [False, True])
def test_multipliers_push_inwards_only(clamped):
    problem = problem_of(7)
    solution = solve(problem, Xpbd(clamped=clamped))
    along = np.sum(solution.multipliers * (problem.G @ solution.positions), axis=1)
    assert along.min() >= 0
    assert along.max() > 0


def test_it_goes_on_from_a_given_point():
    problem = problem_of(9)
    solver, clock = Xpbd(), Clock()
    state, x, l = solver.prepare(problem).mesh, problem.target.copy(), np.zeros(problem.rows)  # noqa: E741
    whole = solver.relax(problem, state, x, l, 1e-6, clock.monitor, clock)
    again = solver.relax(problem, state, x, l, 1e-6, clock.monitor, clock)
    assert whole.iterations > again.iterations == 0


def test_settings_are_checked():
    with pytest.raises(ValueError, match="compliance is -1"):
        Xpbd(compliance=-1.0)
