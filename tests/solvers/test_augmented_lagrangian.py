"""What is special to the augmented Lagrangian."""

from __future__ import annotations

import numpy as np
import pytest

from solvers.augmented_lagrangian import AugmentedLagrangian
from solvers.augmented_lagrangian.minimum import Blocks, Minimum, diagonal, product
from strainbench import StretchLimits, certify, solve
from strainbench.solver.solver import Clock
from tests.problems import own_gap, random_problem, stretched_cube


def instance(kind):
    """A problem, and multipliers at random."""
    rng = np.random.default_rng(21)
    if kind == "volume":
        problem = stretched_cube(StretchLimits.exact(1.05, dim=3))
    else:
        problem = random_problem(rng, limit=0.05, directions=4, pins=2, exact=kind == "exact")
    shape = (problem.constraints, -1, 3)
    Y = 1e-3 * problem.edge_length**2 * rng.normal(size=(problem.rows, 3)).reshape(shape)
    return problem, Blocks.of(problem), Y


def free_part(problem, array):
    out = np.zeros_like(array)
    out[problem.free] = array[problem.free]
    return out


@pytest.mark.parametrize("kind", ["sampled", "exact", "volume"])
def test_gradient_and_hessian_are_those_of_the_value(kind):
    problem, G, Y = instance(kind)
    p = free_part(problem, np.random.default_rng(1).normal(size=problem.target.shape))
    p *= problem.edge_length
    x = problem.target + 0.01 * p[::-1]

    def at(t):
        return Minimum(G, problem, Y, 10.0, x + t * p)

    here, h = at(0.0), 1e-6
    slope = (at(h).value - at(-h).value) / (2 * h)
    assert np.sum(here.gradient * p) == pytest.approx(slope, rel=1e-6)
    found = np.empty_like(p)
    product(here.hessian, p, found)
    expected = (at(h).gradient - at(-h).gradient) / (2 * h)
    assert found == pytest.approx(expected, abs=1e-6 * np.abs(expected).max())


@pytest.mark.parametrize("kind", ["sampled", "exact", "volume"])
def test_the_preconditioner_is_the_diagonal(kind):
    problem, G, Y = instance(kind)
    here = Minimum(G, problem, Y, 10.0, problem.target)
    found, column = diagonal(here.hessian), np.empty_like(problem.target)
    for vertex in problem.free[:5]:
        for c in range(3):
            unit = np.zeros_like(problem.target)
            unit[vertex, c] = 1.0
            product(here.hessian, unit, column)
            assert found[vertex, :, c] == pytest.approx(column[vertex], rel=1e-9, abs=1e-9)
    assert np.array_equal(found[problem.pinned], np.tile(np.eye(3), (len(problem.pinned), 1, 1)))


@pytest.mark.parametrize("exact", [True, False])
@pytest.mark.parametrize("seed", range(4))
def test_its_own_multipliers_certify_it(seed, exact):
    problem = random_problem(np.random.default_rng(60 + seed), limit=0.05, exact=exact)
    solution = solve(problem, AugmentedLagrangian())
    assert solution.status == "solved"
    assert problem.violations(solution.positions).max() < 1e-6
    assert own_gap(problem, solution) < 3e-6


@pytest.mark.parametrize(
    "limits",
    [StretchLimits.exact(1.05, dim=3), StretchLimits(np.eye(3), np.array([1.05, 1.1, 1.02]))],
)
def test_volumes(limits):
    problem = stretched_cube(limits)
    assert own_gap(problem, solve(problem, AugmentedLagrangian())) < 3e-6


def test_arcsims_counts_end_anywhere():
    problem = random_problem(np.random.default_rng(3), directions=4, limit=0.02)
    found = solve(problem, "augmented-lagrangian-arcsim")
    assert (found.status, found.iterations) == ("iteration limit", 100)
    assert certify(problem, found.positions).outcome == "violated"


def test_it_goes_on_from_a_given_point():
    problem = random_problem(np.random.default_rng(11), directions=4, limit=0.02)
    solver, clock = AugmentedLagrangian(), Clock()
    state = solver.prepare(problem).mesh
    cold = solve(problem, solver)
    start = (cold.positions, cold.multipliers)
    warm = solver.update(problem, state, *start, 1e-6, clock.monitor, clock)
    assert cold.iterations > warm.iterations == 0
    assert np.array_equal(warm.positions, cold.positions)


def test_a_limit_is_not_success():
    problem = random_problem(np.random.default_rng(12), directions=4, limit=0.02)
    few = solve(problem, AugmentedLagrangian(max_updates=1))
    assert (few.status, few.details["updates"]) == ("iteration limit", 1)
    assert solve(problem, AugmentedLagrangian(), time_limit=1e-9).status == "time limit"


def test_settings_are_checked():
    with pytest.raises(ValueError, match="inner is 'lbfgs'"):
        AugmentedLagrangian(inner="lbfgs")


def test_nonlinear_conjugate_gradients_find_the_same_answer():
    problem = random_problem(np.random.default_rng(14), directions=4, limit=0.05)
    slow = AugmentedLagrangian(inner="cg", inner_steps=10_000)
    solution = solve(problem, slow)
    assert solution.status == "solved"
    assert own_gap(problem, solution) < 3e-6
