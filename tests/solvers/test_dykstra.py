"""What is special to block coordinate ascent on the dual."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from solvers.dykstra import Dykstra, accelerated, blocks, judge, plain, start
from strainbench import Problem, StretchLimits, solve
from strainbench.solver.solver import Clock
from tests.problems import own_gap, random_problem, stretched_cube


@pytest.mark.parametrize("accelerate", [True, False])
@pytest.mark.parametrize("exact", [True, False])
@pytest.mark.parametrize("seed", range(4))
def test_its_own_multipliers_certify_it(seed, exact, accelerate):
    rng = np.random.default_rng(40 + seed)
    problem = random_problem(rng, limit=0.05, exact=exact)
    solution = solve(problem, Dykstra(accelerate=accelerate))
    assert solution.status == "solved"
    assert problem.violations(solution.positions).max() < 1e-6
    assert own_gap(problem, solution) < 3e-6


@pytest.mark.parametrize(
    "limits",
    [StretchLimits.exact(1.05, dim=3), StretchLimits(np.eye(3), np.array([1.05, 1.1, 1.02]))],
)
def test_volumes(limits):
    problem = stretched_cube(limits)
    assert own_gap(problem, solve(problem, Dykstra())) < 3e-6


def test_an_equilateral_triangle_has_its_singular_values_clamped():
    """G W G^T is a multiple of the identity there, so that the projection is the paper's clamp."""
    rest = np.array([[0.0, 0.0], [1.0, 0.0], [0.5, np.sqrt(0.75)]])
    target = np.random.default_rng(2).normal(size=(3, 3)) + np.column_stack([2 * rest, [0, 1, 0]])
    problem = Problem(rest, np.array([[0, 1, 2]]), target, StretchLimits.exact(1.1))
    F = problem.deformation_gradients(solve(problem, Dykstra()).positions)[0]
    U, s, Vt = np.linalg.svd(problem.deformation_gradients(target)[0], full_matrices=False)
    assert s.max() > 1.1
    assert pytest.approx((U * np.minimum(s, 1.1)) @ Vt, abs=1e-6) == F


@pytest.mark.parametrize("exact", [True, False])
@pytest.mark.parametrize("accelerate", [True, False])
def test_the_dual_objective_never_falls(exact, accelerate):
    problem = random_problem(np.random.default_rng(8), limit=0.01, exact=exact)
    G = blocks(problem)
    frame, run = start(problem, G, np.zeros((problem.rows, 3)))

    def dual(Y):
        back = (problem.G.T @ Y)[problem.free] ** 2 / problem.weights[problem.free, None]
        linear = np.sum(Y * (problem.G @ problem.target))
        return linear - problem.bounds @ problem.dual_norms(Y) - 0.5 * np.sum(back)

    values = []
    for _ in range(200):
        values.append(dual(run.Y.reshape(-1, 3)))
        run = (accelerated if accelerate else plain)(G, frame, run, 2)
        judge(G, frame, run)
    rounding = 1e-12 * values[-1]
    assert values[-1] > 0
    assert all(later >= earlier - rounding for earlier, later in pairwise(values))


def test_it_goes_on_from_given_multipliers():
    problem = random_problem(np.random.default_rng(11), directions=4, limit=0.02)
    solver, clock = Dykstra(), Clock()
    state = solver.prepare(problem).mesh
    cold = solve(problem, solver)
    warm = solver.ascend(problem, state, cold.multipliers, 1e-6, clock.monitor, clock)
    assert cold.iterations > warm.iterations == 0
    assert warm.positions == pytest.approx(cold.positions, abs=1e-12)


@pytest.mark.parametrize("accelerate", [True, False])
def test_a_limit_is_not_success(accelerate):
    problem = random_problem(np.random.default_rng(12), directions=4, limit=0.02, mass=False)
    few = solve(problem, Dykstra(accelerate=accelerate, max_sweeps=4))
    assert (few.status, few.iterations) == ("iteration limit", 4)
    assert solve(problem, Dykstra(), time_limit=1e-9).status == "time limit"
