"""Runs that are ended at random moments: nothing false is left, nothing runs on."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from collections import Counter

import numpy as np
import pytest

from strainbench.bench.columns import RUN_COLUMNS, STEP_COLUMNS
from strainbench.bench.process import family, spawned
from strainbench.bench.records import RUNS, STEPS, read_rows
from strainbench.files import HOLDER
from tests.processes import left_running, mark_what_starts

WORDS = ["run", "stretch-square", "--solver", "./busy.py", "--steps", "3", "--results", "out"]
CELLS = 4  # a round
BUSY = """
import subprocess, time
from dataclasses import dataclass
from strainbench import Solution, Solver

@dataclass(frozen=True)
class Busy(Solver):
    '''Works, holds on to its interpreter, and has others work for it (nobody).'''
    name = "busy"

    def solve(self, problem, state, *, tolerance, monitor, deadline):
        if len(problem.elements) > 8:
            subprocess.Popen(["sleep", "600"], start_new_session=True)
            sum(range(10**7))
        return Solution(problem.target.copy(), "solved", 0)
"""


def start(folder, rounds):
    limits = ",".join(f"{k}%" for k in range(1, CELLS * rounds + 1))
    command = [sys.executable, "-m", "strainbench", *WORDS]
    command += ["--set", "resolution=3", "--set", f"limit={limits}"]
    with (folder / "output.txt").open("ab") as output:
        return subprocess.Popen(command, cwd=folder, stdout=output, stderr=output)


def holds(run, folder):
    """Whether a run has begun: before, Python itself ends it, in its own words."""
    try:
        holder = (folder / HOLDER).read_text(encoding="utf-8")
    except FileNotFoundError:  # not yet, or no longer
        holder = ""
    return run.poll() is not None or f"process {run.pid} " in holder


def check_rows(folder):
    """Every row is whole, of its own cell, and true."""
    rows = read_rows(folder / "out" / RUNS, RUN_COLUMNS)
    assert max(Counter(row["cell"] for row in rows).values(), default=0) <= 1
    for row in rows:
        assert (row["steps_done"], row["projections"]) == ("3", "3")
        assert row["outcome"] == "violated", row["reason"]
    steps = Counter(s["cell"] for s in read_rows(folder / "out" / STEPS, STEP_COLUMNS))
    assert all(steps[row["cell"]] % 3 == 0 for row in rows)
    return len(rows)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("sent", "status"),
    [(signal.SIGKILL, -signal.SIGKILL), (signal.SIGTERM, 143), (signal.SIGINT, 130)],
    ids=["kill", "terminate", "interrupt"],
)
def test_a_run_ended_at_a_random_moment(tmp_path, monkeypatch, pytestconfig, sent, status):
    (tmp_path / "busy.py").write_text(BUSY)
    rng, token = np.random.default_rng(sent), mark_what_starts(monkeypatch)
    rounds = pytestconfig.getoption("kills")
    for number in range(1, rounds + 1):
        with start(tmp_path, number) as run:
            patience = time.monotonic() + 90
            while not holds(run, tmp_path / "out") and time.monotonic() < patience:
                time.sleep(0.01)
            time.sleep(rng.uniform(0, 10))
            run.send_signal(sent)
            assert run.wait(60) in {0, status}
        assert not left_running(token, 5.0), f"round {number}"
        check_rows(tmp_path)
    with start(tmp_path, rounds) as run:
        assert run.wait(1000) == 0
    assert check_rows(tmp_path) == CELLS * rounds
    assert not left_running(token)


def test_what_a_process_starts_ends_with_the_family(tmp_path, monkeypatch):
    token = mark_what_starts(monkeypatch)
    with family() as ours:
        child = ours.start(_start_and_stay, (tmp_path / "started",), tmp_path, spawned)
        patience = time.monotonic() + 60
        while not (tmp_path / "started").exists() and time.monotonic() < patience:
            time.sleep(0.01)
        assert ["sleep", "600"] in left_running(token)
    assert child.exit_code == -signal.SIGKILL
    assert not left_running(token)


def _start_and_stay(path):
    subprocess.Popen(["sleep", "600"], start_new_session=True)
    path.touch()
    time.sleep(600)
