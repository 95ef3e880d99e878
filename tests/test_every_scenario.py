"""The contract that every scenario keeps; new scenarios are found by themselves."""

from __future__ import annotations

from dataclasses import replace
from itertools import islice

import numpy as np
import pytest

from strainbench.scenario.registry import find_scenario, list_scenarios

NAMES = [e.name for e in list_scenarios()]


RESOLUTIONS = {"finger": 1}
"""Where 4 cells a side are not the first small mesh: each tetrahedron of a finger is halved."""


@pytest.fixture(params=NAMES)
def scene(request):
    return find_scenario(request.param)(resolution=RESOLUTIONS.get(request.param, 4))


def test_docstring_names_scene_and_paper(scene):
    assert scene.__doc__.split("\n")[0].rstrip(".").endswith(")")


def candidates(scene, steps):
    """What the scene asks to project when nothing is."""
    seen = []
    list(islice(scene.play(lambda target: seen.append(target) or target), steps))
    return seen


def test_a_scene_that_moves_starts_within_its_limits(scene):
    if np.array_equal(*candidates(scene, 2)[:2]):
        pytest.skip("it does not move: one projection, again and again")
    problem = scene.problem()
    assert not np.any(problem.violations(problem.target))


def test_resolution_is_cells_a_side(scene):
    finer = replace(scene, resolution=2 * scene.resolution)
    elements = scene.problem().elements
    assert len(finer.problem().elements) == 2 ** (elements.shape[1] - 1) * len(elements)


def test_every_step_asks_for_a_projection_and_converges(scene):
    seen = []

    def project(target):
        seen.append(target)
        return target

    reports = list(islice(scene.play(project), 3))
    assert len(seen) >= 3
    assert all(r.newton_converged for r in reports)
    assert all(np.all(np.isfinite(t)) for t in seen)


def test_playing_twice_gives_the_same_candidates(scene):
    first, second = candidates(scene, 3), candidates(scene, 3)
    assert all(np.array_equal(a, b) for a, b in zip(first, second, strict=True))


@pytest.mark.parametrize(
    ("key", "value"), [("resolution", 0), ("limit", -0.01), ("limit", 1.01), ("directions", 0)]
)
def test_wrong_values_are_named(scene, key, value):
    with pytest.raises(ValueError, match=f"{key} is {value}"):
        replace(scene, **{key: value})
