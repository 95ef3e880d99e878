"""A projection written down in other ways: the way back, and what is made of the answers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from scenarios.stress import Stress
from strainbench import Problem, Solution, Solver, StretchLimits, solve
from strainbench.document.writers import csv, markdown
from strainbench.solver.registry import find_solver
from strainbench.studies.sensitivity import Outcome, measure
from strainbench.studies.sensitivity.report import tally
from strainbench.studies.sensitivity.writings import AS_IT_IS, GROUPS, count, writings
from tests.cli.test_cli import strainbench
from tests.problems import random_problem

MACHINE = {
    "here": {"memory_gb": 1, "system": "Linux", "python": "3.11", "threads_per_solver": 1},
}


def by_corner(problem):
    """The same with a rest shape for each element."""
    return replace(problem, rest=problem.rest[problem.elements])


@pytest.mark.parametrize("change", [lambda p: p, by_corner], ids=["by vertex", "by corner"])
@pytest.mark.parametrize("per_element", [False, True])
def test_every_writing_is_the_same_problem(change, per_element):
    drawn = random_problem(np.random.default_rng(3), mass=True, pins=2, per_element=per_element)
    problem = change(drawn)
    ways = list(writings(problem, 2, seed=1))
    assert len(ways) == count(2)
    assert list(dict.fromkeys(way.group for way in ways)) == list(GROUPS)
    for way in ways:
        other, size = way.problem, way.problem.edge_length / problem.edge_length
        np.testing.assert_allclose(way.back(other.target), problem.target, atol=1e-12)
        assert other.objective(0 * other.target + other.target.mean(axis=0)) == pytest.approx(
            size**2 * problem.objective(0 * problem.target + problem.target.mean(axis=0))
        )
        worst = [np.sort(p.violations(p.target)) for p in (problem, other)]
        np.testing.assert_allclose(*worst, atol=1e-10)
        marked = np.zeros_like(problem.target)
        marked[problem.pinned] = 1
        here = np.zeros_like(problem.target)
        here[other.pinned] = 1
        if way.group == "orders":
            np.testing.assert_array_equal(way.back(here), marked)


def test_an_optimum_comes_back_to_the_same_place():
    problem = Stress(case="displaced", resolution=3).problem()
    x = solve(problem, "newton-ipm", 1e-9).positions
    for way in writings(problem, 1, seed=2):
        y = way.back(solve(way.problem, "newton-ipm", 1e-9).positions)
        assert np.abs(x - y).max() < 1e-5 * problem.edge_length, way.group


def test_the_same_seed_gives_the_same_writings():
    problem = Stress(resolution=3).problem()
    one, other = (list(writings(problem, 2, seed=5)) for _ in range(2))
    for a, b in zip(one, other, strict=True):
        np.testing.assert_array_equal(a.problem.target, b.problem.target)


class Ordered(Solver):
    """Sees in which order it is given the vertices, and where the origin is (nobody)"""

    name = "ordered"

    def solve(self, problem, state, *, tolerance, monitor, deadline):
        if problem.target[0, 0] > 500:
            raise ZeroDivisionError("too far")
        x = problem.target.copy()
        x[0] += 0.5 * problem.edge_length
        return Solution(x, "iteration limit: 7", 3 + (problem.target[0, 0] < 0))


@pytest.fixture(scope="module")
def found():
    problem = Stress(case="displaced", resolution=3, seed=4).problem()
    return measure([find_solver("none"), Ordered()], problem, 4)


def test_spreads_are_distances_between_answers_taken_back(found):
    assert found.methods == ["none", "ordered"]
    assert all(found.spread("none", group) < 1e-9 for group in GROUPS)
    assert found.spread("ordered", AS_IT_IS) == 0
    edge = found.problem.edge_length
    assert found.spread("ordered", "orders") == pytest.approx(np.sqrt(0.75) * edge)
    assert found.spread("ordered", "rotations") > 0.1 * edge
    assert found.spread("ordered", "units") < 1e-9


def test_what_a_solver_raises_is_an_outcome_of_its_own(found):
    trials = found.of("ordered", "translations")
    failed = [t for t in trials if t.certificate.outcome == "no answer"]
    assert all(t.solution.status == "ZeroDivisionError: too far" for t in failed)
    assert found.changes("ordered", "translations") == len(failed)


def test_the_tables_say_what_was_found(found):
    outcome = Outcome("a title", "strainbench ...", MACHINE, found)
    text = markdown(outcome.document())
    assert "| ordered | 0 | 9e-1 |" in text
    assert "| as it is | 0 | 0 | 3, 3, 3 |" in text
    assert "iteration limit: 7" not in text
    head, *lines = csv(outcome.trials()).splitlines()
    assert head.startswith("method,group,writing,outcome")
    assert len(lines) == 2 * count(4)


def test_tallies_begin_with_the_most_frequent():
    assert tally(["solved"] * 3) == "solved"
    assert tally(["a: 1", "b", "a: 2"]) == "2 a, 1 b"


def test_limits_of_another_kind_by_element_are_refused_in_a_line():
    problem = Stress(resolution=2).problem()
    limits = StretchLimits.sampled([0.0], np.full((len(problem.elements), 1), 1.1))
    other = Problem(problem.rest, problem.elements, problem.target, limits)
    kind = other.kind
    assert kind.bounds.ndim == 2
    with pytest.raises(ValueError, match="Sampled by element cannot be put in an order"):
        list(writings(replace(other, limits=kind), 1, 0))


def test_the_verb_writes_its_tables(tmp_path):
    words = ["stress", "--set", "resolution=3", "--frame", "1", "--solver", "gauss-seidel"]
    done = strainbench("sensitivity", *words, "--draws", "2", "--results", ".", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    names = {path.name for path in tmp_path.iterdir()}
    assert {"sensitivity.md", "sensitivity.csv", "machines.json"} <= names
    assert "gauss-seidel" in done.stdout
