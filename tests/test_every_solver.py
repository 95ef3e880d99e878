"""The contract that every solver keeps; new solvers are found by themselves."""

from __future__ import annotations

import pytest

from strainbench.plugins import UnavailableError
from strainbench.solver.registry import find_solver, list_solvers
from strainbench.solver.solver import run_solver, warm_twin
from strainbench.studies.contract import CLAUSES, NotApplicableError, promise_of
from strainbench.studies.contract import warm as warm_clauses

NAMES = [e.name for e in list_solvers() if not e.unavailable]
WARM = [c for c in CLAUSES if c.__module__ == warm_clauses.__name__]
CAN_START_WARM = [
    n for n in NAMES if find_solver(n).name == n and find_solver(n).starts_warm is not None
]
"""As they are by default: the variants start in the same way."""
CASES = [
    (name, clause) for clause in CLAUSES for name in (CAN_START_WARM if clause in WARM else NAMES)
]


def available(name):
    try:
        return find_solver(name)
    except UnavailableError as error:
        pytest.skip(str(error))


@pytest.mark.parametrize(("name", "clause"), CASES, ids=lambda v: getattr(v, "__name__", v))
def test_the_contract(name, clause):
    solver = available(name)
    try:
        assert clause(solver, promise_of(solver))
    except NotApplicableError as reason:
        pytest.skip(f"{name}: {reason}")


@pytest.mark.parametrize("name", NAMES)
def test_a_label_is_a_name(name):
    assert available(name).label == name


def test_the_interior_point_gains_though_the_first_frames_are_hardly_stretched():
    """A warm start from one of them is worse than none, and must not spoil those after it."""
    frames = warm_clauses.frames()
    cold = find_solver("newton-ipm")
    totals = []
    for solver in (cold, warm_twin(cold)):
        state = solver.prepare(frames[0][0])
        counts = [run_solver(solver, frame, state, 1e-6).iterations for frame, _ in frames]
        totals.append(sum(counts[6:]))
    assert totals[1] < totals[0]


@pytest.mark.parametrize("name", CAN_START_WARM)
def test_a_warm_twin_is_found_by_its_name(name):
    twin = find_solver(f"{name}-warm")
    assert twin == warm_twin(available(name))
    assert twin.label not in NAMES
