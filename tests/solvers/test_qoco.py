"""What is known of QOCO: its iterations depend on what does not change the problem."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("qoco", reason="qoco is an optional extra")

from solvers.newton_ipm import NewtonIPM
from solvers.qoco import Qoco
from strainbench import Problem, StretchLimits
from strainbench.problem.grid import square_grid
from strainbench.solver.solver import run_solver
from tests.problems import moved, renumbered, rotation

CELLS, SIDE = 10, 0.5


def same_problems():
    """A stretched sheet, in four other orders of vertices, and turned in four ways."""
    rng = np.random.default_rng(1)
    rest, elements = square_grid(CELLS, SIDE, "alternating")
    placed = np.column_stack([rest[:, 0], np.zeros(len(rest)), rest[:, 1]])
    target = placed * [1.03, 1, 1.02] + 0.002 * rng.normal(size=placed.shape)
    pinned = np.array([0, CELLS * (CELLS + 1)])
    target[pinned] = placed[pinned]
    problem = Problem(rest, elements, target, StretchLimits.isotropic(1.01), pinned)
    orders = [renumbered(problem, rng.permutation(problem.vertices)) for _ in range(4)]
    return [problem, *orders, *(moved(problem, rotation(rng), np.zeros(3)) for _ in range(4))]


def iterations(solver):
    return [
        run_solver(solver, problem, solver.prepare(problem), 1e-6).iterations
        for problem in same_problems()
    ]


def test_iterations_depend_on_the_order_of_vertices_and_on_rotation():
    counts = iterations(Qoco())
    assert max(counts) > 1.5 * min(counts)


def test_those_of_newton_ipm_do_not():
    counts = iterations(NewtonIPM())
    assert max(counts) - min(counts) <= 1
