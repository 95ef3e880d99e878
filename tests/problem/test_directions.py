"""Isotropic limits with 1 to 36 directions, and bounds by element, through the whole of it."""

from __future__ import annotations

import numpy as np
import pytest

from strainbench import Problem, StretchLimits, certify, solve
from strainbench.bench.plan import plan
from strainbench.bench.records import latest_runs
from strainbench.bench.runner import Runner, Settings
from strainbench.problem.grid import square_grid

MOST = [1, 2, 3, 4, 8, 17, 18, 36]


def stretched(limits):
    """Eight triangles pulled by 30% and 10%."""
    rest, elements = square_grid(2, 1.0, "alternating")
    target = np.column_stack([1.3 * rest[:, 0], 1.1 * rest[:, 1], 0.1 * rest[:, 0] * rest[:, 1]])
    return Problem(rest, elements, target, limits, pinned=np.array([0]))


@pytest.mark.parametrize("directions", MOST)
@pytest.mark.parametrize("solver", ["clarabel", "gauss-seidel"])
def test_one_to_36_directions_are_met(solver, directions):
    problem = stretched(StretchLimits.isotropic(1.05, directions))
    assert problem.constraints == 8 * directions
    found = certify(problem, solve(problem, solver=solver).positions)
    assert found.outcome in ("optimal", "feasible")
    assert found.active_constraints > 0


def test_more_directions_allow_less():
    objectives = [
        problem.objective(solve(problem, solver="clarabel").positions)
        for problem in (stretched(StretchLimits.isotropic(1.05, m)) for m in (1, 2, 4, 8, 16, 32))
    ]
    assert np.all(np.diff(objectives) > -1e-9)  # each set of samples holds the one before
    assert objectives[-1] > 1.1 * objectives[0]


def test_bounds_by_element_hold_for_each_element():
    angles = np.deg2rad([0.0, 45.0, 90.0])
    bounds = np.linspace(1.02, 1.2, 8)[:, None] * np.ones(3)
    problem = stretched(StretchLimits.sampled(angles, bounds))
    x = solve(problem, solver="clarabel").positions
    assert certify(problem, x).outcome == "optimal"
    stretches = problem.stretches(x).reshape(8, 3).max(axis=1)
    assert np.all(stretches < bounds[:, 0] + 1e-6)
    assert stretches[-1] > bounds[0, 0] + 0.01  # the loosest uses what the tightest may not


def test_one_to_36_directions_from_the_command_lines_words(tmp_path):
    words = ["resolution=3", "directions=1,2,5,36"]
    cells = plan(["stretch-square"], ["clarabel"], words, "simulate", 1, [1e-6], None)
    Runner(Settings(tmp_path, jobs=2)).run(cells)
    rows = latest_runs(tmp_path).values()
    assert {r["directions"]: int(r["constraints"]) for r in rows} == {
        str(m): 18 * m for m in (1, 2, 5, 36)
    }
    assert {r["outcome"] for r in rows} == {"optimal"}
