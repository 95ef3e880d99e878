"""`run --debug`: the traceback and the prints of the first cell that fails."""

from __future__ import annotations

import csv

import pytest

from tests.command import command

FALLS = '''
from dataclasses import dataclass
from strainbench import Solution, Solver

@dataclass(frozen=True)
class Falls(Solver):
    """Falls over where it is meant (nobody)."""
    name = "falls"
    def solve(self, problem, state, **_):
        if len(problem.elements) > 8:
            print("seen [red]here[/red]", problem.vertices)
            return self.inner(problem)
        return Solution(problem.target.copy(), "solved", 0)
    def inner(self, problem):
        return problem.target[10**6]
'''


@pytest.fixture
def run(monkeypatch, capsys, tmp_path):
    (tmp_path / "falls.py").write_text(FALLS)
    monkeypatch.chdir(tmp_path)

    def with_words(*words):
        small = ["--set", "resolution=3", "--steps", "1", "--results", "r"]
        return command(monkeypatch, capsys, "run", "stretch-square", *small, *words)

    return with_words


def test_the_first_failure_is_shown_and_ends_the_run(run, tmp_path):
    for _ in range(2):  # finished or not
        done = run("--solver", "./falls.py", "--debug")
        assert done.returncode == 1
        assert "\nseen [red]here[/red] 16\n" in "\n" + done.stderr
        assert "    return problem.target[10**6]" in done.stderr
        assert "falls.py" in done.stderr
        assert done.stderr.count("Traceback") == 1
        last = done.stderr.strip().splitlines()[-1]
        assert last.startswith("strainbench: stopped at stretch-square 3 at 1%, falls: IndexError")
    rows = list(csv.DictReader((tmp_path / "r/runs.csv").read_text().splitlines()))
    assert len(rows) == 2


def test_what_does_not_fail_runs_on_and_without_the_word_so_does_the_rest(run):
    done = run("--solver", "none", "--debug")
    assert (done.returncode, "Traceback" in done.stderr) == (0, False)
    done = run("--solver", "./falls.py", "--rerun")
    assert (done.returncode, "Traceback" in done.stderr) == (0, False)
