"""The one form of G for compiled loops, against the sparse matrix."""

from __future__ import annotations

import numpy as np
import pytest

from strainbench import StretchLimits
from strainbench.problem.leverage import Leverage, Pairs
from strainbench.problem.rows import Rows, gather, spread
from tests.problems import random_problem, stretched_cube


def problem_of(kind, rng):
    if kind == "volume":
        return stretched_cube(StretchLimits.exact(1.05, dim=3))
    return random_problem(rng, directions=3, pins=2, mass=True, exact=kind == "exact")


@pytest.mark.parametrize("kind", ["sampled", "exact", "volume"])
def test_products_are_those_of_the_sparse_matrix(kind, rng):
    problem = problem_of(kind, rng)
    G, x = Rows.of(problem), rng.normal(size=problem.target.shape)
    y, back = np.empty((problem.constraints, len(G.axes), 3)), np.zeros_like(x)
    for i in range(problem.constraints):
        gather(G, i, x, y[i])
        spread(G, G.coefficients, i, y[i], back)
    np.testing.assert_allclose(y.reshape(-1, 3), problem.G @ x, atol=1e-12 * np.abs(y).max())
    np.testing.assert_allclose(back, problem.G.T @ (problem.G @ x), atol=1e-12 * np.abs(back).max())


def test_material_axes_are_the_columns_of_the_deformation_gradient(rng):
    problem = problem_of("sampled", rng)
    G, F = Rows.of_axes(problem), problem.deformation_gradients(problem.target)
    y = np.empty((len(G.axes), 3))
    for e in range(len(problem.elements)):
        gather(G, e, problem.target, y)
        np.testing.assert_allclose(y.T, F[e], atol=1e-12 * np.abs(F).max())


@pytest.mark.parametrize("kind", ["sampled", "exact", "volume"])
def test_leverage_is_the_largest_that_free_vertices_have(kind, rng):
    problem = problem_of(kind, rng)
    found, G = Leverage.of(problem), problem.G[:, problem.free].toarray()
    weighted = G / problem.weights[problem.free]
    m = problem.rows // problem.constraints
    blocks = [slice(i * m, (i + 1) * m) for i in range(problem.constraints)]
    expected = [np.linalg.eigvalsh(weighted[b] @ G[b].T)[-1] for b in blocks]
    np.testing.assert_allclose(found.total, expected, rtol=1e-9)
    np.testing.assert_allclose(found.steps, 1 / np.array(expected), rtol=1e-9)


def test_a_constraint_between_pins_has_no_leverage(rng):
    problem = random_problem(rng, pins=0)
    pinned = type(problem)(
        problem.rest, problem.elements, problem.target, problem.limits, problem.elements[0]
    )
    found = Leverage.of(pinned)
    assert found.total[0] == found.steps[0] == 0


def test_pairs_are_the_lower_triangle(rng):
    problem = problem_of("sampled", rng)
    pairs = Pairs(problem, problem.row_vertices, problem.row_coefficients)
    w, G = rng.normal(size=problem.rows), problem.G[:, problem.free].toarray()
    lower = np.zeros((len(problem.free),) * 2)
    lower[pairs.rows, pairs.columns] = pairs.products @ w
    np.testing.assert_allclose(lower, np.tril(G.T @ (w[:, None] * G)), atol=1e-9)
    assert np.array_equal(pairs.rows[pairs.diagonal], pairs.columns[pairs.diagonal])
