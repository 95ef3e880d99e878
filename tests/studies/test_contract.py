"""The contract's clauses find what is broken, and say it."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np
import pytest

from strainbench import Solution, Solver
from strainbench.solver.registry import find_solver
from strainbench.studies.contract import OPTIMAL, Promise, Verdict, check, clauses
from strainbench.studies.contract.solving import BrokenError, NotApplicableError
from tests.command import command
from tests.test_readme import CONTRIBUTING, blocks

HEAD = """
from dataclasses import dataclass
import numpy as np
from strainbench import Solution, Solver
"""
GOOD = find_solver("newton-ipm")


class Wrapped(Solver):
    """The interior point, and something else (nobody)."""

    name = "wrapped"

    def prepare(self, problem):
        return GOOD.prepare(problem)

    def solve(self, problem, state, **given):
        return self.spoilt(problem, GOOD.solve(problem, state, **given), given)

    def spoilt(self, problem, solution, given):
        return solution


def spoiling(change):
    """A class of solvers whose right answers are changed."""
    members = {"spoilt": lambda self, *words: change(*words), "__doc__": Wrapped.__doc__}
    return type("Spoilt", (Wrapped,), members)()


def with_positions(change):
    def spoilt(problem, solution, given):
        x = solution.positions.copy()
        change(problem, x)
        return Solution(x, solution.status, solution.iterations, solution.multipliers)

    return spoiling(spoilt)


def move_pins(problem, x):
    x[problem.pinned] += 1e-3


def stretch(problem, x):
    x[problem.free] *= 1.5


def towards_an_axis(problem, x):
    x[problem.free] += [1e-3, 0, 0]


def doubled(problem, solution, given):
    return Solution(solution.positions, "solved", 1, 2 * solution.multipliers)


def backwards(problem, solution, given):
    for k in (3, 2):
        given["monitor"](solution.positions, iterations=k)
    return solution


@pytest.mark.parametrize(
    ("clause", "solver", "words"),
    [
        (clauses.projects_a_triangle, with_positions(towards_an_axis), "known in closed form"),
        (clauses.stays_within_the_limits, with_positions(stretch), "violated, violation"),
        (clauses.claims_what_it_reaches, with_positions(stretch), "it says 'solved' with a viol"),
        (clauses.leaves_what_is_within, with_positions(towards_an_axis), "moves a target"),
        (clauses.moves_with_the_target, with_positions(towards_an_axis), "turned and shifted"),
        (clauses.keeps_pins_and_problem, with_positions(move_pins), "moves a pin by 1.0e-03 m"),
        (clauses.has_stationary_multipliers, spoiling(doubled), "of the largest force"),
        (clauses.agrees_with_another, with_positions(towards_an_axis), "edges from Clarabel's"),
        (clauses.shows_its_iterates, spoiling(backwards), "which do not rise"),
        (
            clauses.keeps_pins_and_problem,
            spoiling(lambda p, s, g: Solution(s.positions[:2], "solved", 1)),
            "positions of shape (2, 3)",
        ),
        (
            clauses.keeps_pins_and_problem,
            spoiling(lambda p, s, g: Solution(s.positions, "solved", 1.5)),
            "iterations is 1.5: a whole number",
        ),
    ],
)
def test_what_is_broken_is_said(clause, solver, words):
    with pytest.raises(BrokenError, match=re.escape(words)):
        clause(solver, OPTIMAL)


@pytest.mark.parametrize("promise", [Promise(), OPTIMAL])
def test_a_right_solver_breaks_nothing(promise):
    verdicts = [found.verdict for found in check(spoiling(lambda p, s, g: s), promise)]
    assert Verdict.BROKEN not in verdicts
    assert verdicts.count(Verdict.KEPT) >= 8


def test_a_clause_that_says_nothing_of_a_solver_is_not_broken():
    with pytest.raises(NotApplicableError):
        clauses.agrees_with_another(GOOD, Promise())


def test_what_is_not_come_to_counts_as_broken():
    found = list(check(GOOD, OPTIMAL, budget=-1.0))
    assert {f.verdict for f in found} == {Verdict.BROKEN}
    assert "not come to" in found[0].words


def test_the_example_of_the_documentation_is_told_what_it_is_not(monkeypatch, capsys, tmp_path):
    (tmp_path / "mine.py").write_text(blocks(CONTRIBUTING, "python")[0])
    done = command(monkeypatch, capsys, "check", tmp_path / "mine.py", width=500)
    assert done.returncode == 1
    assert "closed form: without masses" in done.stdout
    assert "Pins stay where they are, and the problem as it is: 4 pins" in done.stdout


RAISES = '''
@dataclass(frozen=True)
class Mine(Solver):
    """No method"""
    name = "mine"
    def solve(self, problem, state, **_):
        print("should not be seen")
        raise KeyError("[red]colour[/red]")
'''


def test_a_solver_that_raises_is_told_where(monkeypatch, capsys, tmp_path):
    (tmp_path / "mine.py").write_text(HEAD + RAISES)
    done = command(monkeypatch, capsys, "check", tmp_path / "mine.py", width=500)
    assert done.returncode == 1
    assert "it raises KeyError: '[red]colour[/red]' (line 12)" in done.stdout
    assert "should not be seen" not in done.stdout
    assert "'No method': \"method (paper)\" is valid" in done.stdout


def test_a_solver_of_ours_by_name(monkeypatch, capsys):
    done = command(monkeypatch, capsys, "check", "clarabel", width=500)
    assert done.returncode == 0
    assert "clarabel, held to: projection" in done.stdout
    assert " 0 broken" in done.stdout


@dataclass(frozen=True)
class NotFinite(Solver):
    """Nowhere (nobody)."""

    name = "nowhere"

    def solve(self, problem, state, **_):
        return Solution(np.full_like(problem.target, np.nan), "lost", 0)


def test_an_answer_that_is_none_breaks_what_it_must():
    broken = [f for f in check(NotFinite(), Promise()) if f.verdict is Verdict.BROKEN]
    assert len(broken) >= 4
    assert all("nan" not in f.words for f in broken[:1])
