"""No certificate is contradicted by any solver's answer, on random irregular problems.

Each of 50 problems goes to every third solver, so that each solver has 16 or 17 of them.
`pytest tests/referee/test_certificates.py --problems 200` checks 200 of them with all solvers, and
prints what became of the answers, and with `--tally FILE` writes it; `make certificates` does that.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from strainbench import certify, solve
from strainbench.bench.records import read_machines
from strainbench.referee.reference import reference_of
from strainbench.report.provenance import made_with_this_code
from strainbench.solver.registry import find_solver, list_solvers
from tests.problems import random_problem
from tests.tally import TIME_LIMIT, Tally

NAMES = [e.name for e in list_solvers() if not e.unavailable]
PROBLEMS = 50
VIOLATION, GAP = 1e-6, 1e-4  # of an optimum, the referee's defaults
EXACT_SHARE = 5  # one problem in so many has exact limits


def pytest_generate_tests(metafunc):
    if "seed" in metafunc.fixturenames:
        count = metafunc.config.getoption("problems")
        metafunc.parametrize("seed", range(PROBLEMS if count is None else count))


def contradictions(name, problem, reference, x, found):
    """How an answer, or the reference, proves its certificate wrong."""
    rounding = 1e-12 * max(found.objective, found.lower_bound)
    if found.max_violation == 0 and found.objective < reference.lower_bound - rounding:
        yield f"{name}: objective {found.objective} below the bound {reference.lower_bound}"
    apart = np.linalg.norm(x - reference.positions)
    if not apart - reference.error <= found.distance_bound * (1 + 1e-9):
        yield f"{name}: {apart} m from the reference, at most {found.distance_bound} m by the bound"
    if not found.relative_gap >= 0:
        yield f"{name}: a relative gap of {found.relative_gap}"
    if found.outcome == "optimal":
        violation = problem.violations(x).max()
        above = found.objective - problem.objective(reference.positions)
        scale = max(reference.lower_bound, problem.objective_floor)
        if not (violation <= VIOLATION and above <= GAP * scale + rounding):
            yield f"{name}: called optimal, violated by {violation}, {above} above the reference"


def between(answers):
    """How any two answers contradict each other's distance bounds; no reference is asked."""
    if not answers:
        return
    closest = min(answers, key=lambda name: answers[name][1])
    y, radius = answers[closest]
    for name, (x, bound) in answers.items():
        apart = np.linalg.norm(x - y)
        if not apart <= (bound + radius) * (1 + 1e-9):
            yield f"{name} and {closest}: {apart} m apart, at most {bound + radius} m by the bounds"


def test_no_answer_contradicts_its_certificate(seed, pytestconfig, tally):
    some = pytestconfig.getoption("problems") is None
    exact = seed % EXACT_SHARE == EXACT_SHARE - 1
    problem = random_problem(np.random.default_rng([2022, seed]), exact=exact)
    reference = reference_of(problem)
    assert reference.infeasible is None
    answers, wrong = {}, []
    for name in NAMES[seed % 3 :: 3] if some else NAMES:
        solver = find_solver(name)
        if solver.supports(problem):  # it refuses such limits
            tally.refused(name)
            continue
        solution = solve(problem, solver, time_limit=TIME_LIMIT)
        found = certify(problem, solution.positions, reference=reference)
        tally.answer(name, solution.status, found)
        if found.outcome == "no answer":
            continue
        x = solution.positions.copy()
        x[problem.pinned] = problem.target[problem.pinned]
        wrong += contradictions(name, problem, reference, x, found)
        answers[name] = x, found.distance_bound
    wrong += between(answers)
    tally.problem([f"problem {seed}, {w}" for w in wrong])
    assert not wrong


def test_a_wrong_certificate_is_found():
    """The check itself: bounds made too small, or a lower bound too large, contradict answers."""
    problem = random_problem(np.random.default_rng([2022, 0]))
    reference = reference_of(problem)
    x = problem.target + 0.1
    x[problem.pinned] = problem.target[problem.pinned]
    found = certify(problem, x, reference=reference)
    assert not list(contradictions("right", problem, reference, x, found))
    near = replace(found, distance_bound=0.5 * np.linalg.norm(x - reference.positions))
    assert len(list(contradictions("near", problem, reference, x, near))) == 1
    best = certify(problem, reference.positions, reference=reference)
    high = replace(reference, lower_bound=1.01 * best.objective)
    assert len(list(contradictions("high", problem, high, reference.positions, best))) == 1
    praised = replace(found, outcome="optimal")
    assert len(list(contradictions("praised", problem, reference, x, praised))) == 1
    assert not list(between({"a": (x, found.distance_bound), "b": (reference.positions, 1.0)}))
    assert list(between({"a": (x, 1e-9), "b": (reference.positions, 1e-9)}))


def test_the_tally_counts_and_is_written(tmp_path):
    problem = random_problem(np.random.default_rng([2022, 1]))
    found = certify(problem, problem.target)
    counts = Tally()
    counts.answer("liar", "solved", found)
    counts.answer("liar", "iteration limit", found)
    counts.refused("proud")
    counts.problem(["problem 0, a: wrong"])
    lines = list(counts.lines())
    assert lines[:2] == [
        "1 problems, 2 solvers: 1 of 2 certificates contradicted",
        "problem 0, a: wrong",
    ]
    assert [line.split() for line in lines[3:]] == [
        ["liar", "0", "0", "2", "0", "1", "0"],
        ["proud", "0", "0", "0", "0", "0", "1"],
    ]
    written = tmp_path / "tally.md"
    counts.write(written)
    assert "\n".join(lines) in written.read_text()
    assert made_with_this_code(read_machines(written.parent))
