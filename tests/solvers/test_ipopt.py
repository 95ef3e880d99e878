"""Ipopt's derivatives, lower bounds, and the wider set that edge lengths bound."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("cyipopt", reason="ipopt is an optional extra")

from solvers.ipopt import Callbacks, Ipopt
from solvers.ipopt_edges import IpoptEdges
from strainbench import Problem, StretchLimits, solve
from strainbench.problem.grid import square_grid
from strainbench.solver.solver import Clock
from tests.problems import central_difference, random_problem

EQUILATERAL = np.array([[0.0, 0.0], [1.0, 0.0], [0.5, 0.75**0.5]])


def callbacks(solver, problem):
    return Callbacks(problem, solver.prepare(problem).mesh, 0.3, 7.0, lambda x: None, Clock())


def dense(structure, values, shape):
    matrix = np.zeros(shape)
    np.add.at(matrix, structure, values)
    return matrix


def edge_lengths(problem, x):
    edges, longest = problem.longest_edges()
    return np.linalg.norm(x[edges[:, 0]] - x[edges[:, 1]], axis=1), longest


# --- derivatives


@pytest.mark.parametrize("solver", [Ipopt(), IpoptEdges()], ids=["directions", "edges"])
def test_derivatives_are_those_of_finite_differences(solver, rng):
    problem = random_problem(rng, directions=3, pins=2, vertices=12)
    nlp = callbacks(solver, problem)
    x = nlp.target.ravel() + 0.1 * rng.normal(size=nlp.target.size)
    gradient = central_difference(nlp.objective, x)
    assert nlp.gradient(x) == pytest.approx(gradient, rel=1e-5, abs=1e-5)
    expected = central_difference(nlp.constraints, x)
    jacobian = dense(nlp.jacobianstructure(), nlp.jacobian(x), expected.shape)
    np.testing.assert_allclose(jacobian, expected, atol=1e-6 * np.abs(expected).max())


@pytest.mark.parametrize("solver", [Ipopt(), IpoptEdges()], ids=["directions", "edges"])
def test_the_hessian_is_that_of_the_lagrangian(solver, rng):
    problem = random_problem(rng, directions=3, pins=2, vertices=12)
    nlp = callbacks(solver, problem)
    x = nlp.target.ravel()
    m = rng.normal(size=len(nlp.constraints(x)))

    def gradient(x):
        shape = (len(m), len(x))
        jacobian = dense(nlp.jacobianstructure(), nlp.jacobian(x), shape)
        return 0.7 * nlp.gradient(x) + jacobian.T @ m

    expected = np.tril(central_difference(gradient, x))
    hessian = dense(nlp.hessianstructure(), nlp.hessian(x, m, 0.7), expected.shape)
    np.testing.assert_allclose(hessian, expected, atol=1e-6 * np.abs(expected).max())


# --- edges


def test_a_triangle_with_equal_edges_shrinks_about_its_centre():
    target = np.column_stack([1.5 * EQUILATERAL, np.zeros(3)])
    problem = Problem(EQUILATERAL, [[0, 1, 2]], target, StretchLimits.exact(1.1))
    centre = target.mean(axis=0)
    expected = centre + 1.1 / 1.5 * (target - centre)
    np.testing.assert_allclose(solve(problem, IpoptEdges()).positions, expected, atol=1e-7)


def test_where_every_direction_is_an_edges_the_two_sets_are_one(rng):
    rest, elements = square_grid(3, 1.0, "uniform")
    steps = rest[elements] - rest[np.roll(elements, 1, axis=1)]
    angles = np.unique(np.round(np.arctan2(steps[..., 1], steps[..., 0]) % np.pi, 12))
    assert len(angles) == 3
    target = np.column_stack([1.3 * rest, 0.1 * rng.normal(size=len(rest))])
    limits = StretchLimits.sampled(angles, [1.05, 1.1, 1.15])
    problem = Problem(rest, elements, target, limits, pinned=[0])
    projection = solve(problem, "clarabel").positions
    np.testing.assert_allclose(solve(problem, IpoptEdges()).positions, projection, atol=1e-5)


@pytest.mark.parametrize("seed", range(5))
def test_edges_are_within_their_lengths_and_closer_than_the_projection(seed):
    problem = random_problem(np.random.default_rng(seed), directions=4, limit=0.05)
    solution = solve(problem, IpoptEdges())
    lengths, longest = edge_lengths(problem, solution.positions)
    assert solution.status == "solved for edge lengths"
    assert np.all(lengths <= longest * (1 + 1e-6))
    assert problem.violations(solution.positions).max() > 1e-3
    projection = solve(problem, "clarabel").positions
    assert problem.objective(solution.positions) <= problem.objective(projection) * (1 + 1e-6)


@pytest.mark.parametrize("lower", [0.7, 1.0])
def test_lower_bounds_keep_edges_from_shortening(lower, rng):
    rest, elements = square_grid(3, 1.0, "alternating")
    target = np.column_stack([rest * [1.5, 0.4], 0.01 * rng.normal(size=len(rest))])
    problem = Problem(rest, elements, target, StretchLimits.isotropic(1.1, 4))
    x = solve(problem, IpoptEdges(lower=lower)).positions
    lengths, longest = edge_lengths(problem, x)
    free = edge_lengths(problem, solve(problem, IpoptEdges()).positions)[0]
    assert np.min(free / longest) < 0.6
    assert np.all(lengths >= lower * longest / 1.1 * (1 - 1e-6))
    assert np.all(lengths <= longest * (1 + 1e-6))


def test_edges_of_no_limited_length_are_refused():
    problem = Problem(EQUILATERAL, [[0, 1, 2]], np.eye(3), StretchLimits.isotropic(1.1, 1))
    assert "no edge" in IpoptEdges().supports(problem)


def test_a_lower_length_above_the_upper_one_is_refused():
    problem = Problem(EQUILATERAL, [[0, 1, 2]], np.eye(3), StretchLimits.isotropic(0.8, 4))
    assert "above the upper" in IpoptEdges(lower=0.9).supports(problem)
    with pytest.raises(ValueError, match="0 to 1"):
        IpoptEdges(lower=1.1)


# --- limits on compression


def test_a_compressed_triangle_is_pushed_out_to_its_lower_bound():
    """One limited direction: the nearest point is along g, at length l."""
    rest = np.array([[0.0, 0.0], [1.0, 0.0], [0.2, 0.8]])
    target = np.column_stack([0.5 * rest, [0.0, 0.1, -0.1]])
    limits = StretchLimits.sampled([0.3], [1.1], lower=0.9)
    mass = np.array([1.0, 2.0, 5.0])
    problem = Problem(rest, [[0, 1, 2]], target, limits, mass=mass)
    g = problem.row_coefficients[0]
    y = g @ target
    step = np.outer(g / mass, y / np.linalg.norm(y)) / (g**2 @ (1 / mass))
    expected = target + step * (0.9 - np.linalg.norm(y))
    for solver in (Ipopt(), "gauss-seidel"):
        x = solve(problem, solver).positions
        np.testing.assert_allclose(x, expected, atol=1e-6)
