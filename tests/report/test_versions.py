"""Numbers are shown under the name of the code that made them, and of no other."""

from __future__ import annotations

import json
import sys

import pytest

from strainbench.bench.columns import RUN_COLUMNS
from strainbench.bench.machine import PACKAGES, describe_machine, installed
from strainbench.bench.plan import plan
from strainbench.bench.records import RUNS, append_rows, remember_machine
from strainbench.bench.rows import identity
from strainbench.report import load_runs, versions
from strainbench.report.table import older
from strainbench.report.versions import UNKNOWN, shown_runs

SOLVER = """\
from dataclasses import dataclass
from strainbench import Solution, Solver

@dataclass(frozen=True)
class Mine(Solver):
    name = "mine"
    sweeps: int = 3

    def solve(self, problem, state, *, tolerance, monitor, deadline):
        return Solution({answer}, "solved", 1)
"""


@pytest.fixture
def mine(tmp_path):
    path = tmp_path / "code" / "mine.py"
    path.parent.mkdir()
    path.write_text(SOLVER.format(answer="problem.target"))
    return path


def measure(folder, *solvers, seconds, **changes):
    """Rows as a run would write them, with seconds that tell them apart."""
    cells = plan(
        ["swing"], [str(s) for s in solvers], ["resolution=2"], "simulate", 1, [1e-6], None
    )
    rows = [identity(c) | {"solve_seconds_mean": seconds, "machine": "m"} | changes for c in cells]
    append_rows(folder / RUNS, RUN_COLUMNS, rows)


def shown(folder):
    return [(r["solver"], r["solve_seconds_mean"], r["older"]) for r in shown_runs(folder)]


def test_what_is_installed_is_shown_and_nothing_is_said(tmp_path, mine):
    remember_machine(tmp_path, "m", describe_machine(1)[1])
    measure(tmp_path, mine, "none", seconds=1)
    assert shown(tmp_path) == [("mine", "1", ""), ("none", "1", "")]
    assert older(load_runs(tmp_path)) == []


def test_edited_run_set_back_and_run_again_shows_the_file_as_it_is(tmp_path, mine):
    text = mine.read_text()
    measure(tmp_path, mine, seconds=1)
    mine.write_text(text.replace("problem.target", "0 * problem.target"))
    measure(tmp_path, mine, seconds=2)
    assert shown(tmp_path) == [("mine", "2", "")]
    mine.write_text(text)  # and nothing is run again: its cell has finished
    assert shown(tmp_path) == [("mine", "1", "")]


def test_an_older_row_alone_is_shown_and_said_to_be_older(tmp_path, mine):
    measure(tmp_path, mine, seconds=1)
    mine.write_text(mine.read_text() + "# edited\n")
    assert shown(tmp_path) == [("mine", "1", f"with {mine} before its latest edit")]
    (line,) = older(load_runs(tmp_path))
    assert line == f"1 of 1 cells were measured with {mine} before its latest edit"


def test_a_plug_in_that_lies_beside_its_rows_is_theirs_wherever_they_are(tmp_path, mine):
    measure(tmp_path, mine, seconds=1)
    mine.rename(tmp_path / mine.name)
    assert shown(tmp_path) == [("mine", "1", "")]
    (tmp_path / mine.name).write_text("# another\n")
    assert shown(tmp_path) == [("mine", "1", f"with {mine} before its latest edit")]


def test_a_file_that_is_gone_is_said_to_be(tmp_path, mine):
    measure(tmp_path, mine, seconds=1)
    mine.unlink()
    assert shown(tmp_path) == [("mine", "1", f"with {mine}, which is gone")]


def test_two_files_with_one_name_are_told_apart(tmp_path, mine):
    other = tmp_path / "other" / "mine.py"
    other.parent.mkdir()
    other.write_text(mine.read_text() + "# of somebody else\n")
    measure(tmp_path, mine, seconds=1)
    measure(tmp_path, other, "none", seconds=2)
    assert shown(tmp_path) == [
        ("mine (code/mine.py)", "1", ""),
        ("mine (other/mine.py)", "2", ""),
        ("none", "2", ""),
    ]


def test_rows_of_another_suite_or_of_before_sources_were_kept_are_older(tmp_path):
    measure(tmp_path, "none", seconds=1, suite="0123456789abcdef")
    assert shown(tmp_path) == [("none", "1", UNKNOWN)]
    measure(tmp_path, "none", seconds=2, content="", suite="", threads="", cell="other")
    assert shown(tmp_path) == [("none", "1", UNKNOWN)]
    measure(tmp_path, "none", seconds=3)
    assert shown(tmp_path) == [("none", "3", "")]


def test_packages_that_have_changed_are_named(tmp_path):
    facts = describe_machine(1)[1]
    remember_machine(tmp_path, "m", facts | {"packages": installed(PACKAGES) | {"numpy": "1.0"}})
    measure(tmp_path, "none", seconds=1)
    ((_, _, older),) = shown(tmp_path)
    assert older == f"with numpy 1.0 (now {installed(['numpy'])['numpy']})"


def test_packages_that_only_one_of_two_places_has_make_nothing_older(tmp_path):
    here = installed(PACKAGES)
    there = here | {"numpy": "not installed", "no such package": "1.0"}
    remember_machine(tmp_path, "m", describe_machine(1)[1] | {"packages": there})
    measure(tmp_path, "none", seconds=1)
    assert shown(tmp_path) == [("none", "1", "")]


def test_other_settings_are_other_rows(tmp_path, mine):
    measure(tmp_path, mine, seconds=1)
    parameters = json.dumps({"sweeps": 4})
    measure(tmp_path, mine, seconds=2, cell="b", solver_parameters=parameters)
    assert [seconds for _, seconds, _ in shown(tmp_path)] == ["1", "2"]


def test_a_solver_that_is_unavailable_has_no_source_to_be_older(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "clarabel", None)
    monkeypatch.delitem(sys.modules, "solvers.clarabel", raising=False)
    measure(tmp_path, "clarabel", seconds="", outcome="no answer", reason="unavailable: needs it")
    assert shown(tmp_path) == [("clarabel", "", "")]


def test_what_is_installed_is_looked_up_once_for_rows_that_ask_alike(tmp_path, monkeypatch):
    asked = []
    monkeypatch.setattr(versions, "content_of", lambda *words: asked.append(words) or "other")
    for k in range(5):
        measure(tmp_path, "none", seconds=k, cell=str(k), tolerance=10.0**-k)
    shown_runs(tmp_path)
    assert len(asked) == len(set(asked)) == 2  # the scene and the solver
