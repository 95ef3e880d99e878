"""The KKT residual, 0 at a local optimum and near 1 elsewhere, and what certify makes of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from strainbench import Problem, StretchLimits, certify, solve
from strainbench.referee.kkt import kkt_residual
from strainbench.referee.reference import content_key, reference_of
from strainbench.solver.registry import find_solver, list_solvers
from tests.problems import moved, random_problem, rotation

REST = np.array([[0.0, 0.0], [1.0, 0.0], [0.2, 0.8]])
MASS = np.array([1.0, 2.0, 5.0])


def compressed(mass=MASS, lower=0.9, unit=1.0):
    """One direction of one triangle too short, and the nearest positions in closed form."""
    target = unit * np.column_stack([0.5 * REST, [0.0, 0.1, -0.1]])
    limits = StretchLimits.sampled([0.3], [1.1], lower=lower)
    problem = Problem(unit * REST, [[0, 1, 2]], target, limits, mass=mass)
    g = problem.row_coefficients[0]
    y = g @ target
    length = np.linalg.norm(y)
    step = np.outer(g / problem.weights, y / length) / (g**2 @ (1 / problem.weights))
    return problem, target + step * ((lower or length) - length)


# --- the residual


@pytest.mark.parametrize("seed", range(10))
def test_it_vanishes_at_a_certified_optimum_and_nowhere_near_it(seed):
    problem = random_problem(np.random.default_rng(seed))
    reference = reference_of(problem)
    assert kkt_residual(problem, reference.positions) < 1e-4
    assert kkt_residual(problem, solve(problem, "gauss-seidel").positions) > 0.1


@pytest.mark.parametrize("mass", [None, MASS])
def test_it_vanishes_at_the_nearest_point_to_a_compressed_triangle(mass):
    problem, nearest = compressed(mass)
    assert problem.violations(nearest).max() < 1e-12
    assert kkt_residual(problem, nearest) < 2e-5


def test_a_lower_limit_only_pushes():
    """Pulled back to its lower bound from a feasible target: no multiplier has that sign."""
    problem, short = compressed()
    inside = problem.with_target(short + 0.1 * (short - problem.target))
    assert problem.violations(inside.target).max() == 0
    assert kkt_residual(inside, inside.target) == 0
    assert kkt_residual(inside, short) == pytest.approx(1, abs=1e-5)


def test_without_active_limits_every_move_is_residual():
    problem, nearest = compressed()
    assert kkt_residual(problem, 1.05 * nearest) > 0.2
    free = problem.with_target(nearest)
    assert kkt_residual(free, 1.1 * nearest) == pytest.approx(1, rel=1e-12)


@pytest.mark.parametrize("seed", range(4))
def test_it_depends_neither_on_where_the_cloth_is_nor_on_the_unit(seed):
    rng = np.random.default_rng(seed)
    problem = random_problem(rng, mass=True)
    x = solve(problem, "gauss-seidel").positions
    residual = kkt_residual(problem, x)
    Q, shift = rotation(rng), rng.normal(size=3)
    assert kkt_residual(moved(problem, Q, shift), x @ Q.T + shift) == pytest.approx(
        residual, abs=1e-4
    )
    one, nearest = compressed(unit=1e-3)
    other, same = compressed()
    perturbed = kkt_residual(other, same + 0.01 * REST @ np.eye(2, 3))
    assert kkt_residual(one, nearest + 1e-5 * REST @ np.eye(2, 3)) == pytest.approx(
        perturbed, rel=1e-4
    )


def test_pinned_vertices_are_not_counted(rng):
    problem, nearest = compressed()
    assert kkt_residual(replace(problem, pinned=[0, 1, 2]), nearest) == 0


def test_exact_limits_have_none():
    problem, _ = compressed()
    with pytest.raises(ValueError, match="sampled directions"):
        kkt_residual(replace(problem, limits=StretchLimits.exact(1.1)), problem.target)


# --- certificates under lower bounds


def test_a_local_optimum_is_feasible_and_called_local():
    problem, nearest = compressed()
    found = certify(problem, nearest)
    assert found.outcome == "feasible"
    assert found.reason.startswith("at best a local optimum")
    assert found.kkt_residual < 2e-5
    assert found.best_known == pytest.approx(found.objective, rel=1e-5)
    for name in ("lower_bound", "relative_gap", "distance", "distance_bound", "reference_error"):
        assert np.isnan(getattr(found, name))


def test_a_point_within_the_limits_that_is_no_local_optimum_says_so():
    problem, nearest = compressed()
    found = certify(problem, 1.1 * nearest)
    assert found.outcome == "feasible"
    assert found.reason.startswith("no local optimum: KKT residual")
    assert found.best_known < 0.9 * found.objective


def test_compression_beyond_its_limit_is_a_violation():
    problem, _ = compressed()
    found = certify(problem, problem.target)
    assert found.outcome == "violated"
    assert found.max_violation == pytest.approx(0.9 - problem.stretches(problem.target)[0])


def test_not_even_the_target_is_called_optimal():
    problem, nearest = compressed()
    found = certify(problem.with_target(nearest), nearest)
    assert (found.outcome, found.objective, found.best_known) == ("feasible", 0, 0)


def test_the_best_known_objective_may_be_given():
    problem, nearest = compressed()
    low = 0.5 * problem.objective(nearest)
    assert certify(problem, nearest, best_known=low).best_known == low
    assert "1.00e+00 above the best known" in certify(problem, nearest, best_known=low).reason


def test_a_convex_problem_has_no_local_words():
    problem, _ = compressed(lower=None)
    found = certify(problem, solve(problem, "clarabel").positions)
    assert found.outcome == "optimal"
    assert np.isnan(found.kkt_residual)


def test_the_key_of_a_reference_knows_the_lower_bounds():
    keys = {content_key(compressed(lower=lower)[0]) for lower in (None, 0.9, 0.8)}
    assert len(keys) == 3


# --- solvers under lower bounds

TAKEN = [
    e.name
    for e in list_solvers()
    if not e.unavailable and find_solver(e.name).supports(compressed()[0]) is None
]


def test_only_methods_with_a_form_for_lower_bounds_take_them():
    assert {"ipopt", "gauss-seidel", "sequential-cuts", "none"} >= set(TAKEN) - {
        "ipopt-default",
        "ipopt-default-lbfgs",
    }
    assert "lower bounds" in str(find_solver("clarabel").supports(compressed()[0]))


@pytest.mark.parametrize("name", sorted(set(TAKEN) - {"none"}))
def test_they_find_the_nearest_point_to_a_compressed_triangle(name):
    problem, nearest = compressed()
    assert solve(problem, name).positions == pytest.approx(nearest, abs=5e-5)
