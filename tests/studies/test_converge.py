"""Convergence on one frame: what is kept of whom, and what becomes of it."""

from __future__ import annotations

import time
from xml.etree import ElementTree

import numpy as np
import pandas as pd
import pytest

from strainbench import Solution, Solver, solve
from strainbench.bench.plan import plan_scene
from strainbench.bench.recording import record, recorder
from strainbench.bench.records import RecordsError
from strainbench.solver.solver import Clock
from strainbench.studies.convergence.measure import CONVERGENCE, converge
from strainbench.studies.convergence.report import (
    load_convergence,
    methods,
    reached,
    unreached,
    write_convergence,
)
from strainbench.studies.convergence.trace import tolerances
from tests.cli.test_cli import strainbench
from tests.problems import random_problem

SOLVERS = """
import os, time
import numpy as np
from strainbench import Solution, Solver

class Slow(Solver):
    "Halves the way to a point, hanging at the end (nobody)"
    name = "slow"
    def solve(self, problem, state, *, tolerance, monitor, deadline):
        x = problem.target.copy()
        for k in range(1, 2001):
            x[problem.free] *= 1 - 1e-3
            monitor(x)
        if tolerance < 1 and len(x) > 9:  # not in the warm-up
            time.sleep(60)
        return Solution(x, "solved", 2000)

class Answers(Solver):
    "The target, moved by the tolerance (nobody)"
    name = "answers"
    def solve(self, problem, state, *, tolerance, monitor, deadline):
        x = problem.target.copy()
        x[problem.free] += min(tolerance, 1)
        return Solution(x, f"at {tolerance:g}", 7)

class Crash(Solver):
    "Ends its process (nobody)"
    name = "crash"
    def solve(self, problem, state, *, tolerance, monitor, deadline):
        if len(problem.target) > 9:
            os._exit(3)
        return Solution(problem.target.copy(), "solved", 1)

class Refuse(Solver):
    "Takes nothing (nobody)"
    name = "refuse"
    def supports(self, problem): return "on principle"
    def solve(self, problem, state, **_): raise AssertionError

class Lost(Solver):
    "No answer (nobody)"
    name = "lost"
    def solve(self, problem, state, **_):
        return Solution(np.full_like(problem.target, np.nan), "lost", 1)
"""


def samples_of(table, solver):
    return dict(iter(table.groupby("solver")))[solver]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    base = tmp_path_factory.mktemp("converge")
    path = base / "solvers.py"
    path.write_text(SOLVERS)
    words = ["clarabel,gauss-seidel,none", str(path)]
    cells = plan_scene("swing", words, ["resolution=3"], 1, 1e-4, time_limit=3.0)
    problem = record(recorder(cells[0]), 4)
    list(converge(cells, problem, 4, base / "results", 4096))
    return base / "results"


@pytest.fixture(scope="module")
def table(folder):
    return load_convergence(folder)


def test_answers_are_kept_where_no_iterates_are_shown(table):
    rows = samples_of(table, "answers")
    assert rows["sampled_by"].unique() == ["tolerances"]
    assert rows["tolerance"].tolist() == pytest.approx(tolerances(1e-4))
    assert rows["status"].iloc[-1] == "at 0.0001"
    assert rows["ending"].unique() == ["it says 'at 0.0001'"]


def test_iterates_are_kept_where_they_are_shown_and_what_a_killed_process_had(table):
    rows = samples_of(table, "slow")
    assert rows["sampled_by"].unique() == ["iterates"]
    counts = rows["iterations"].tolist()
    assert counts[:20] == list(range(1, 21))
    assert 30 < len(counts) < 100
    assert np.all(np.diff(counts) > 0)
    assert rows["seconds"].is_monotonic_increasing
    assert rows["ending"].iloc[0] == "time limit of 3 s"
    sweeps = samples_of(table, "gauss-seidel")["iterations"].tolist()
    assert sweeps[:3] == [1, 2, 4]  # those that it shows


def test_the_referee_measures_what_was_kept(table):
    best = samples_of(table, "clarabel").iloc[-1]
    assert best["relative_gap"] < 1e-4
    assert best["distance"] < 1e-5
    assert best["max_violation"] < 1e-6
    first, last = samples_of(table, "gauss-seidel").iloc[[0, -1]].to_dict("records")
    assert last["max_violation"] < 1e-4 < first["max_violation"]
    start = samples_of(table, "none").iloc[0]
    assert start["iterations"] == 0
    assert start["max_violation"] > 1e-2


@pytest.mark.parametrize(
    ("solver", "ending"),
    [
        ("crash", "crashed: its process ended with exit code 3"),
        ("refuse", "unsupported: on principle"),
        ("lost", "it says 'lost'"),
    ],
)
def test_a_failure_is_a_row_with_its_reason(table, solver, ending):
    rows = samples_of(table, solver)
    assert rows["relative_gap"].isna().all()
    assert rows["ending"].iloc[0] == ending


def test_tables_and_chart(folder, table):
    paths = write_convergence(folder)
    assert [p.suffix for p in paths] == [".md", ".svg", ".png"]
    text = paths[0].read_text()
    names = [name for name, _ in methods(table)]
    assert "clarabel°" in names
    assert "gauss-seidel" in names
    chart = "".join(ElementTree.parse(paths[1]).getroot().itertext())
    for name in names:
        assert text.count(f"| {name} |") == 2
        assert name in chart
    assert "refuse°: refuses the problem" in chart
    for line in ("refuse°: unsupported: on principle", "slow: time limit of 3 s"):
        assert f"- {line}" in text


def test_another_frame_is_refused_and_another_solver_is_added(folder, tmp_path):
    def run(frame, *words):
        cells = plan_scene("swing", ["clarabel"], ["resolution=3", *words], 1, 1e-2, 5.0)
        return list(converge(cells, record(recorder(cells[0]), frame), frame, folder, 4096))

    before = (folder / CONVERGENCE).read_text()
    with pytest.raises(RecordsError, match="is about another frame"):
        run(3)
    assert (folder / CONVERGENCE).read_text() == before
    run(4, "clarabel.scaling=2")
    run(4, "clarabel.scaling=2")
    table = load_convergence(folder)
    again = samples_of(table, "clarabel[scaling=2]")
    assert again["tolerance"].tolist() == pytest.approx(tolerances(1e-2))
    assert len(samples_of(table, "slow")) > 30


def test_reached_is_for_good():
    gaps = [1.0, 1e-3, 1e-1, 1e-3, float("nan"), 1e-3, 1e-5, 1e-5]
    rows = pd.DataFrame({"relative_gap": gaps, "iterations": range(1, 9)})
    found = [reached(rows, "relative_gap", level) for level in (1e-2, 1e-4, 1e-6)]
    assert [None if f is None else f.iterations for f in found] == [6, 7, None]


def test_tolerances_end_where_asked():
    assert tolerances(1e-8)[-1] == 1e-8
    assert len(tolerances(1e-8)) == 11
    assert tolerances(3e-1)[-2:] == [1.0, 3e-1]
    assert tolerances(1e3) == [1e3]


def test_a_watch_costs_the_solver_no_time_and_counts_for_it(rng):
    class Fixed(Solver):
        """Three iterates, one of them not shown (nobody)"""

        name = "fixed"

        def solve(self, problem, state, *, tolerance, monitor, deadline):
            monitor(problem.target)
            monitor(problem.target, iterations=3)
            return Solution(problem.target, "solved", 3)

    seen = []

    def watch(seconds, iterations, positions, multipliers):
        seen.append((seconds, iterations))
        time.sleep(0.2)

    solution = solve(random_problem(rng), Fixed(), watch=watch)
    assert [k for _, k in seen] == [1, 3]
    assert seen[0][0] <= seen[1][0] < 0.2
    assert solution.seconds < 0.2


def test_counting_goes_on_from_what_a_solver_tells():
    seen = []
    clock = Clock(watch=lambda seconds, k, x, y: seen.append(k))
    clock.monitor(np.zeros(3))
    clock.monitor(np.zeros(3), iterations=10)
    clock.monitor(np.zeros(3))
    assert seen == [1, 10, 11]


def test_the_command_line(tmp_path):
    words = ["converge", "swing", "--solver", "gauss-seidel", "--set", "resolution=2"]
    done = strainbench(*words, "--frame", "2", "--results", "here", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "gauss-seidel: it says 'solved'" in done.stdout
    assert (tmp_path / "here/convergence.png").stat().st_size > 0
    done = strainbench(*words, "--frame", "1", "--results", "here", cwd=tmp_path)
    assert done.returncode == 2
    assert "is about another frame (swing 2 at 1%, projection 2)" in done.stderr


def test_several_projections_stand_in_one_folder(tmp_path):
    words = ["converge", "swing", "--solver", "gauss-seidel", "--set", "resolution=2"]
    done = strainbench(*words, "--frame", "2,4", "--results", "here", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "gauss-seidel, projection 4: it says 'solved'" in done.stdout
    table = load_convergence(tmp_path / "here")
    assert sorted(table["frame"].unique()) == [2, 4]
    assert table[table["frame"] == 2]["solver"].nunique() == 2
    text = (tmp_path / "here/convergence.md").read_text()
    assert "# Convergence: swing 2 at 1%, projections 2, 4" in text
    assert "medians over the projections" in text
    drawn = "".join(ElementTree.parse(tmp_path / "here/convergence.svg").getroot().itertext())
    assert "projection 2" in drawn
    assert "projection 4" in drawn


def test_a_folder_without_samples(tmp_path):
    with pytest.raises(RecordsError, match=r"holds no convergence\.csv"):
        load_convergence(tmp_path)


@pytest.mark.parametrize(
    ("ending", "words"),
    [("time limit of 20 s", "not within 20 s"), ("it says 'x'", "never"), ("crashed: ...", "-")],
)
def test_an_unreached_level_says_why(ending, words):
    assert unreached(pd.DataFrame([{"ending": ending, "time_limit": 20.0}])) == words


LATE = """
import time
from strainbench import Solution, Solver

class Late(Solver):
    "Two tenths of a second a run, what it has at the deadline (nobody)"
    name = "late"
    def solve(self, problem, state, *, tolerance, monitor, deadline):
        if len(problem.target) < 10:  # the warm-up
            return Solution(problem.target.copy(), "solved", 1)
        while tolerance < 1 and not deadline.passed:
            time.sleep(0.01)
        time.sleep(0.05)
        x = problem.target.copy()
        x[problem.free] *= 3.0 if deadline.passed else 1.0
        return Solution(x, "cut off" if deadline.passed else "solved", 1)
"""


def test_what_a_budget_cut_off_is_no_sample(tmp_path):
    path = tmp_path / "late.py"
    path.write_text(LATE)
    cells = plan_scene("swing", [str(path)], ["resolution=3"], 1, 1e-4, time_limit=2.0)
    list(converge(cells, record(recorder(cells[0]), 1), 1, tmp_path / "results", 4096))
    rows = samples_of(load_convergence(tmp_path / "results"), "late")
    assert rows["status"].unique() == ["solved"]
    assert rows["tolerance"].tolist() == [100.0, 10.0, 1.0]
    assert rows["ending"].unique() == ["time limit of 2 s"]
