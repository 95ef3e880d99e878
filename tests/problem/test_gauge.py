"""How long limits let a vector become, and what the frames of one mesh share."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest

from strainbench import Problem, StretchLimits
from strainbench.problem.reach import gauge
from tests.problems import random_problem

SHARED = ("G", "edge_length", "free", "held", "bounds", "weights", "row_coefficients", "_reach")


def by_every_basis(directions, bounds, vectors):
    """sum_j |c_j| b_j is least at coefficients of as many directions as there are dimensions."""
    least = np.full(len(vectors), np.inf)
    for chosen in map(list, combinations(range(len(directions)), directions.shape[1])):
        basis = directions[chosen].T
        if abs(np.linalg.det(basis)) > 1e-9:
            c = np.linalg.solve(basis, vectors.T).T
            least = np.minimum(least, np.abs(c) @ bounds[chosen])
    return least


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("seed", range(40))
def test_the_gauge_is_the_least_over_every_basis(dim, seed):
    rng = np.random.default_rng([dim, seed])
    directions = rng.normal(size=(rng.integers(1, 9), dim))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    bounds = 10 ** rng.uniform(-1, 1, len(directions)) ** rng.choice([1, 4])
    vectors = rng.normal(size=(15, dim))
    found = gauge(directions, bounds, vectors)
    assert found == pytest.approx(by_every_basis(directions, bounds, vectors), rel=1e-12)


@pytest.mark.parametrize("dim", [2, 3])
def test_directions_in_a_plane_bound_nothing_outside_it(dim):
    directions = np.eye(dim)[[0, 0]]
    assert np.all(np.isinf(gauge(directions, np.ones(2), np.eye(dim))))


def test_a_measured_curve_bounds_edges_as_each_of_its_elements_does():
    """The edge of two elements with other bounds is as long as the stricter one lets it be."""
    rest = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    target = np.column_stack([rest, np.zeros(4)])
    angles = np.pi * np.arange(180) / 180
    limits = StretchLimits.sampled(angles, np.repeat([[1.2], [1.1]], 180, axis=1))
    edges, lengths = Problem(rest, [[0, 1, 2], [0, 2, 3]], target, limits).longest_edges()
    longest = {tuple(edge): length for edge, length in zip(edges.tolist(), lengths, strict=True)}
    expected = {(0, 1): 1.2, (1, 2): 1.2, (2, 3): 1.1, (0, 3): 1.1, (0, 2): 1.1 * np.sqrt(2)}
    assert longest == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("name", SHARED)
@pytest.mark.parametrize("first", ["mesh", "frame", "frame of a frame"])
def test_frames_share_what_is_computed_once_a_mesh(name, first):
    mesh = random_problem(np.random.default_rng(4), pins=2)
    frame = mesh.with_target(1.1 * mesh.target)
    second = frame.with_target(1.2 * mesh.target)
    asked = {"mesh": mesh, "frame": frame, "frame of a frame": second}[first]
    value = getattr(asked, name)
    later = mesh.with_target(1.3 * mesh.target)
    assert all(getattr(problem, name) is value for problem in (mesh, frame, second, later))


@pytest.mark.parametrize("name", ["bounds", "_reach"])
def test_tightened_limits_share_no_bounds(name):
    mesh = random_problem(np.random.default_rng(4), pins=2)
    before = getattr(mesh, name).copy()
    tighter = mesh.tightened(1e-3)
    assert np.all(getattr(tighter, name) <= before)
    assert np.any(getattr(tighter, name) < before)
    assert np.array_equal(getattr(mesh, name), before)
