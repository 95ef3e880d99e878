"""The cone program: its points, its products of blocks, its optimality conditions."""

from __future__ import annotations

import numpy as np
import pytest

from strainbench import Problem, StretchLimits
from strainbench.problem.conic import ConicForm
from tests.problems import random_problem


def exact(problem, bound=1.05, weft=None):
    limits = StretchLimits.exact(bound, weft)
    return Problem(
        problem.rest, problem.elements, problem.target, limits, problem.pinned, problem.mass
    )


def slack(form, problem, x):
    """The blocks s of the point x."""
    u = (x - problem.target)[problem.free].ravel() / form.unit
    return (form.constants(problem) - form.A @ u).reshape(form.count, form.length)


def moved_freely(problem, rng):
    x = problem.target.copy()
    x[problem.free] += rng.normal(size=(len(problem.free), 3))
    return x


def matrices(form, blocks, triangle):
    """(count, order, order) of the blocks, by the definition of their order."""
    k = form.order
    pairs = [
        (i, j) for j in range(k) for i in (range(j + 1) if triangle == "upper" else range(j, k))
    ]
    S = np.zeros((form.count, k, k))
    for (i, j), entries in zip(pairs, blocks.T, strict=True):
        S[:, i, j] = S[:, j, i] = entries / (1 if i == j else np.sqrt(2))
    return S


@pytest.mark.parametrize("scaling", [None, 16.0])
def test_second_order_blocks_hold_bound_and_stretched_direction(rng, scaling):
    problem = random_problem(rng, pins=2)
    form, x = ConicForm(problem, scaling), moved_freely(problem, rng)
    blocks = slack(form, problem, x)
    assert blocks[:, 0] == pytest.approx(problem.bounds)
    assert blocks[:, 1:] == pytest.approx(problem.G @ x)


@pytest.mark.parametrize("triangle", ["upper", "lower"])
@pytest.mark.parametrize("weft", [None, 1.3])
def test_semidefinite_blocks_are_as_large_as_the_stretch_allows(rng, triangle, weft):
    problem = exact(random_problem(rng, pins=2), weft=weft)
    form, x = ConicForm(problem, 16.0, triangle), moved_freely(problem, rng)
    S = matrices(form, slack(form, problem, x), triangle)
    least = np.linalg.eigvalsh(S)[:, 0]
    assert least == pytest.approx(problem.bounds - problem.stretches(x))


def test_the_objective_is_the_problems_own_but_for_its_factor(rng):
    problem = random_problem(rng, mass=True)
    form, x = ConicForm(problem, 16.0), moved_freely(problem, rng)
    u = (x - problem.target)[problem.free].ravel() / form.unit
    assert 0.5 * u @ form.P @ u == pytest.approx(form.scale * problem.objective(x))
    assert form.positions(problem, u) == pytest.approx(x)


@pytest.mark.parametrize("limits", ["sampled", "exact"])
def test_multipliers_pull_as_the_duals_do(rng, limits):
    """A' z is the gradient of <z, s>: the same force as G' Y in the problem's own units."""
    problem = random_problem(rng, mass=True)
    problem = exact(problem) if limits == "exact" else problem
    form = ConicForm(problem, 16.0)
    duals = rng.normal(size=form.length * form.count)
    pull = (problem.G.T @ form.multipliers(duals))[problem.free]
    assert form.scale * form.unit * pull.ravel() == pytest.approx(form.A.T @ duals)
