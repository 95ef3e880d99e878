"""No certificate is contradicted by any solver's answer, on 50 random irregular problems.

Each problem goes to every third solver, so that each solver has 16 or 17 of them.
"""

from __future__ import annotations

import numpy as np
import pytest

from strainbench import certify, solve
from strainbench.discovery import find_solver, list_solvers
from strainbench.reference import reference_of
from tests.problems import random_problem

NAMES = [e.name for e in list_solvers() if not e.unavailable]


@pytest.mark.parametrize("seed", range(50))
def test_no_answer_contradicts_its_certificate(seed):
    problem = random_problem(np.random.default_rng([2022, seed]))
    reference = reference_of(problem)
    assert reference.infeasible is None
    for name in NAMES[seed % 3 :: 3]:
        solver = find_solver(name)
        if solver.supports(problem):  # it refuses such limits
            continue
        x = solve(problem, solver, time_limit=0.2).positions
        found = certify(problem, x, reference=reference)
        if found.outcome == "no answer":
            continue
        rounding = 1e-12 * max(found.objective, found.lower_bound)
        if found.max_violation == 0:
            assert found.objective >= reference.lower_bound - rounding, name
        x[problem.pinned] = problem.target[problem.pinned]
        apart = np.linalg.norm(x - reference.positions)
        assert apart - reference.error <= found.distance_bound * (1 + 1e-9), name
        assert found.relative_gap >= 0
