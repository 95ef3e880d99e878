"""On random problems of every kind nothing raises, and nothing false is said.

`pytest tests/referee/test_random_problems.py --problems 2000` checks so many, by default a few.
"""

from __future__ import annotations

import numpy as np
import pytest

from strainbench import certify, solve
from strainbench.referee.certificate import OUTCOMES
from strainbench.referee.reference import reference_of
from strainbench.solver.registry import find_solver, list_solvers
from tests.hard_problems import hard_problem

PROBLEMS, QUICK = 40, 4
CERTIFIED = ("newton-ipm", "clarabel")
LIMITS_ALONE = ("fast-projection", "gauss-seidel", "xpbd")
"""Their "solved" is of a point within the limits, the others' of the optimum."""
OTHERS = [e.name for e in list_solvers() if not e.unavailable and e.name not in CERTIFIED]
GAP = 1e-4
TIME_LIMIT = 0.2  # [s] a solve


def pytest_generate_tests(metafunc):
    if "seed" in metafunc.fixturenames:
        count = metafunc.config.getoption("problems")
        seeds = range(PROBLEMS if count is None else count)
        slow = [pytest.param(seed, marks=pytest.mark.slow) for seed in seeds[QUICK:]]
        metafunc.parametrize("seed", [*seeds[:QUICK], *slow])


def denied(problem, name, status, found):
    """Whether the referee denies what a solver says."""
    if status != "solved":
        return False
    optimum = problem.convex and not name.startswith(LIMITS_ALONE)
    return found.outcome not in (["optimal"] if optimum else ["optimal", "feasible"])


def falsehoods(problem, reference, answers):
    """What is false in what solvers and the referee say of (positions, status, certificate)."""
    for name, (_, status, found) in answers.items():
        if denied(problem, name, status, found):
            yield f"{name} says solved: {found.outcome}, {found.reason}"
        if found.outcome == "optimal" and not problem.convex:
            yield f"{name} is called optimal, of a problem that is not convex"
    if problem.convex:
        yield from contradictions(problem, reference, answers)


def contradictions(problem, reference, answers):
    """Bounds and certificates that another answer's objective disproves."""
    floor = problem.objective_floor
    feasible = [c.objective for _, _, c in answers.values() if c.max_violation == 0]
    best = min(feasible, default=np.inf)
    if not best >= reference.lower_bound * (1 - 1e-12):
        yield f"an objective of {best} below the bound {reference.lower_bound}"
    if reference.infeasible and feasible:
        yield f"{reference.infeasible}: but there are feasible positions"
    for name, (_, _, found) in answers.items():
        above = found.objective - best
        if found.outcome == "optimal" and above > GAP * max(best, floor) * (1 + 1e-9):
            yield f"{name} is called optimal, {above} above another's objective {best}"


@pytest.mark.timeout(300)  # a hundred times what any takes: nothing hangs
def test_nothing_raises_and_nothing_false_is_said(seed):
    problem = hard_problem(np.random.default_rng([2026, seed]))
    reference = reference_of(problem)
    guesses = {"target": problem.target, "nowhere": np.zeros_like(problem.target)}
    answers = {
        name: (x, "", certify(problem, x, reference=reference)) for name, x in guesses.items()
    }
    for name in (*CERTIFIED, OTHERS[seed % len(OTHERS)]):
        if find_solver(name).supports(problem):
            continue
        found = solve(problem, name, time_limit=TIME_LIMIT)
        certificate = certify(problem, found.positions, reference=reference)
        assert certificate.outcome in OUTCOMES
        answers[name] = found.positions, found.status, certificate
    assert not list(falsehoods(problem, reference, answers))


def test_violations_are_priced_by_the_cheapest_multipliers_known():
    """Two pins at their exact limit: multipliers grow without end, and price 1e-6 at a gap of 9%.

    The answer's own prove it to be optimal, and those of the reference's other solvers too.
    """
    problem = hard_problem(np.random.default_rng([2026, 707]))
    found = solve(problem, "dykstra-plain", time_limit=5.0)
    reference = reference_of(problem)
    (bound, norms), (cheaper_bound, cheaper_norms) = reference.duals
    assert cheaper_bound <= bound
    assert cheaper_norms.sum() <= norms.sum()
    certificate = certify(problem, found.positions, reference=reference)
    assert (found.status, certificate.outcome) == ("solved", "optimal")
    assert 0 < certificate.max_violation < 1e-6
    assert certificate.lower_bound == bound
