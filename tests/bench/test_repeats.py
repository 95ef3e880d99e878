"""Projections that are timed several times: each from the same state, judged once."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from strainbench.bench.columns import RUN_COLUMNS
from strainbench.bench.isolation import GRACE, Running
from strainbench.bench.journal import GO, only, read_events
from strainbench.bench.judge import judge
from strainbench.bench.load import Meter, Reading
from strainbench.bench.plan import plan
from strainbench.bench.play import play_cell
from strainbench.bench.process import Child
from strainbench.bench.records import RUNS, append_rows
from strainbench.bench.rows import identity
from strainbench.bench.runner import Runner, Settings

STATEFUL = '''
from dataclasses import dataclass
from typing import ClassVar
import json, os, pathlib
from strainbench import Solution, Solver

@dataclass(frozen=True)
class Stateful(Solver):
    """Remembers what it has seen, and says so"""

    name: ClassVar[str] = "stateful"
    fails_at: int = 0

    def prepare(self, problem):
        return []

    def solve(self, problem, state, *, tolerance, monitor, deadline):
        seen = pathlib.Path(os.environ["SEEN"])
        with seen.open("a") as file:
            file.write(json.dumps([len(state), float(problem.target.sum())]) + "\\n")
        calls = seen.read_text().count("\\n")
        state.append(problem.target)
        if self.fails_at and calls >= self.fails_at:
            raise RuntimeError("no more")
        return Solution(problem.target + len(state) * 1e-9, "solved", 1)
'''


@pytest.fixture
def stateful(tmp_path, monkeypatch):
    """A solver whose answers tell its state; and what it saw, call by call."""
    monkeypatch.setenv("SEEN", str(tmp_path / "seen"))
    (tmp_path / "stateful.py").write_text(STATEFUL)
    return str(tmp_path / "stateful.py")


def cell_of(solver, repeats, *settings, steps=3, time_limit=None):
    words = ["resolution=3", "limit=1%", *settings]
    return plan(["swing"], [solver], words, "simulate", steps, [1e-6], time_limit, repeats=repeats)[
        0
    ]


def played(cell, folder):
    """What becomes of a cell that is played in this process."""
    folder.mkdir()
    (folder / GO).touch()
    play_cell(cell, folder, None)
    return judge(cell, folder, "")


def seen(tmp_path):
    lines = (tmp_path / "seen").read_text().split("\n")[:-1]
    calls = [json.loads(line) for line in lines]
    return calls[1:]  # the first is the warm-up's


def test_each_repeat_starts_from_the_state_of_the_first_time(tmp_path, stateful):
    row, steps = played(cell_of(stateful, 3), tmp_path / "three")
    calls = seen(tmp_path)
    assert [state for state, _ in calls] == [0, 1, 2] * 3
    assert calls[3:6] == calls[6:] == calls[:3]  # the same candidates too
    assert row["repeats"] == 3
    assert [len(step["seconds_each"].split(" ")) for step in steps] == [3, 3, 3]


def test_answers_and_outcome_are_those_of_a_run_without(tmp_path, stateful):
    one, ones = played(cell_of(stateful, 1), tmp_path / "one")
    three, threes = played(cell_of(stateful, 3), tmp_path / "three")
    assert cell_of(stateful, 1).key == cell_of(stateful, 3).key
    for name in ("outcome", "reason", "max_violation", "distance_max", "projections", "steps_done"):
        assert one[name] == three[name], name
    assert [s["distance"] for s in ones] == [s["distance"] for s in threes]


def test_seconds_are_medians_and_quartiles_of_all_that_was_measured(tmp_path):
    row, steps = played(cell_of("gauss-seidel", 4), tmp_path / "four")
    events = read_events(tmp_path / "four")
    for number, step in enumerate(steps, start=1):
        first = only(events, "projection")[number - 1]["seconds"]
        again = [e["seconds"] for e in only(events, "again") if e["projection"] == number]
        assert list(map(float, step["seconds_each"].split(" "))) == [first, *again]
        expected = np.quantile([first, *again], [0.25, 0.5, 0.75])
        assert [step[f"seconds{q}"] for q in ("_low", "", "_high")] == pytest.approx(expected)
    assert row["solve_seconds_mean"] == pytest.approx(np.mean([s["seconds"] for s in steps]))
    firsts = [e["seconds"] for e in only(events, "projection")]
    physics = [e["ie_seconds"] for e in only(events, "step")]
    assert row["play_seconds"] == pytest.approx(sum(firsts) + sum(physics))


def test_a_run_without_repeats_has_its_columns_empty(tmp_path):
    row, steps = played(cell_of("gauss-seidel", 1), tmp_path / "one")
    assert row["repeats"] == 1
    assert all("seconds_each" not in step and step["seconds"] > 0 for step in steps)


def test_a_failure_in_a_repeat_leaves_the_answer_as_it_is(tmp_path, stateful):
    without, _ = played(cell_of(stateful, 1), tmp_path / "one")
    (tmp_path / "seen").unlink()
    words = "stateful.fails_at=6"  # warm-up, three steps, one repeat
    row, steps = played(cell_of(stateful, 3, words), tmp_path / "cut")
    assert row["outcome"] == without["outcome"]
    assert "1 of 3 repeats: RuntimeError: no more" in row["reason"]
    assert [len(str(s.get("seconds_each", "")).split(" ")) for s in steps] == [2, 1, 1]


def test_repeats_beyond_their_time_end_the_process_and_nothing_else(tmp_path, monkeypatch):
    cell = cell_of("gauss-seidel", 3, time_limit=1.0)
    running = Running(cell, tmp_path, Child(None, ""), 100.0)
    now = 1000.0
    monkeypatch.setattr("strainbench.bench.isolation.time.monotonic", lambda: now)
    running.events = [{"event": "repeating", "at": 990.0}]
    for begun, over in (
        (now - 2 * (1.0 + GRACE) + 0.1, False),
        (now - 2 * (1 + GRACE) - 0.1, True),
    ):
        running.seen = [(begun, begun)]
        assert running._repeats_over() is over


def test_a_row_with_fewer_repeats_does_not_count_for_more(tmp_path):
    cell = cell_of("gauss-seidel", 2)
    row = identity(cell) | {"outcome": "optimal", "reason": "", "steps_done": 3}
    append_rows(tmp_path / RUNS, RUN_COLUMNS, [row])
    runner = Runner(Settings(tmp_path))
    assert runner.is_finished(cell)
    assert runner.is_finished(replace(cell, repeats=1))
    assert not runner.is_finished(replace(cell, repeats=3))


def test_a_row_of_before_repeats_has_one(tmp_path):
    cell = cell_of("gauss-seidel", 1)
    row = identity(cell) | {"outcome": "optimal", "steps_done": 3, "repeats": ""}
    append_rows(tmp_path / RUNS, RUN_COLUMNS, [row])
    runner = Runner(Settings(tmp_path))
    assert runner.is_finished(cell)
    assert not runner.is_finished(replace(cell, repeats=2))


@pytest.mark.parametrize("repeats", [0, -1])
def test_less_than_one_repeat_is_refused(repeats):
    with pytest.raises(ValueError, match=r"--repeats .*: a whole number above 0 is valid"):
        cell_of("gauss-seidel", repeats)


# --- load


def reading(at, busy, own, stolen=0.0):
    return Reading(at, busy, stolen, own)


def test_load_is_what_others_did():
    meter = Meter(reading(10.0, 500.0, 1.0, 2.0), reading(12.0, 504.4, 3.0, 2.5))
    assert meter.columns() == {"load": 1.2, "stolen_seconds": 0.5}


def test_nothing_is_said_of_moments_or_of_systems_that_do_not_tell():
    assert Meter(reading(10.0, 500.0, 1.0), reading(10.1, 501.0, 1.0)).columns() == {}
    assert Meter().columns() == {}
    none = Meter(reading(10.0, 500.0, 1.0, None), reading(12.0, 504.0, 3.0, None))
    assert none.columns() == {"load": 1.0}


def test_a_process_that_is_gone_is_no_longer_looked_at():
    import os
    import subprocess

    meter = Meter()
    meter.look(os.getpid())
    last = meter.last
    with subprocess.Popen(["true"]) as gone:
        pass
    meter.look(gone.pid)
    meter.look(None)
    assert meter.last is last
    assert last.own > 0
    assert last.busy > 0
