"""Workers that are killed and replaced, a scheduler that is lost, cells that share no cores."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path

import pytest

from strainbench.bench import cluster as home
from strainbench.bench.cluster import run_elsewhere, run_on_cluster
from strainbench.bench.plan import plan
from strainbench.bench.records import latest_runs
from strainbench.bench.runner import Observer, Settings
from tests.processes import left_running, mark_what_starts

PATIENCE = 120.0  # [s] for dask to start
WAITS = """
import time
from dataclasses import dataclass
from pathlib import Path
from strainbench import Solution, Solver

@dataclass(frozen=True)
class Waits(Solver):
    '''Says that it has begun, and waits until it may go on (nobody).'''
    name = "waits"

    def solve(self, problem, state, *, tolerance, monitor, deadline):
        here = Path(__file__).parent
        if len(problem.elements) > 8:
            (here / "begun").touch()
            while not (here / "go").exists():
                time.sleep(0.01)
        return Solution(problem.target.copy(), "solved", 0)
"""


def cells(folder):
    (folder / "waits.py").write_text(WAITS)
    solvers = [str(folder / "waits.py")]
    return plan(["stretch-square"], solvers, ["resolution=3"], "simulate", 1, [1e-6], None)


def await_(condition):
    until = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < until
        time.sleep(0.05)


@contextmanager
def dask(folder, role, *words):
    """A scheduler or a worker in a process of its own."""
    command = [sys.executable, "-m", f"distributed.cli.dask_{role}", *words]
    with (folder / f"{role}.log").open("ab") as log:
        process = subprocess.Popen(command, cwd=folder, stdout=log, stderr=log)
    with process:
        try:
            yield process
        finally:
            process.kill()


@pytest.fixture
def token(monkeypatch):
    return mark_what_starts(monkeypatch)


@pytest.fixture
def scheduler(tmp_path, token):
    facts = tmp_path / "scheduler.json"
    words = ["--port", "0", "--no-dashboard", "--scheduler-file", str(facts)]
    with dask(tmp_path, "scheduler", *words) as process:
        await_(lambda: facts.exists() and facts.read_text().endswith("}"))
        yield process, json.loads(facts.read_text())["address"]


@contextmanager
def worker(folder, address):
    with dask(folder, "worker", "--nthreads", "1", "--no-nanny", "--no-dashboard", address) as it:
        yield it


@pytest.mark.slow
def test_a_worker_killed_in_a_cell_is_replaced_and_the_cell_run_there(tmp_path, scheduler, token):
    _, address = scheduler
    wanted, counts = cells(tmp_path), []

    def run():
        counts.append(run_on_cluster(address, wanted, Settings(tmp_path / "out"), Observer()))

    runs = threading.Thread(target=run)
    with worker(tmp_path, address) as first:
        runs.start()
        await_((tmp_path / "begun").exists)
        os.kill(first.pid, signal.SIGKILL)
        first.wait()
    (tmp_path / "go").touch()
    with worker(tmp_path, address):
        runs.join(PATIENCE)
    rows = latest_runs(tmp_path / "out")
    assert counts == [1]
    assert set(rows) == {cell.key for cell in wanted}
    assert {row["outcome"] for row in rows.values()} == {"violated"}
    assert not [line for line in left_running(token, 10.0) if "strainbench.bench.cluster" in line]


@pytest.mark.slow
def test_a_lost_scheduler_is_a_line_and_no_row(tmp_path, scheduler, monkeypatch):
    monkeypatch.setenv("DASK_DISTRIBUTED__COMM__TIMEOUTS__CONNECT", "5s")
    process, address = scheduler
    wanted, said = cells(tmp_path), []

    def run():
        with pytest.raises(OSError, match=re.escape("it was lost; every cell")) as error:
            run_on_cluster(address, wanted, Settings(tmp_path / "out"), Observer())
        said.append(error.value.filename)

    runs = threading.Thread(target=run)
    with worker(tmp_path, address):
        runs.start()
        await_((tmp_path / "begun").exists)
        process.kill()
        runs.join(PATIENCE)
    assert said == [f"--scheduler {address}"]
    (tmp_path / "go").touch()
    assert not home.Runner(Settings(tmp_path / "out")).is_finished(wanted[0])


def test_a_worker_of_several_threads_has_one_cell_at_a_time(tmp_path, monkeypatch):
    running, most = [0], [0]

    class Process:
        def __init__(self, command, **_):
            (home.Path(command[-1]) / "results").write_bytes(home.pickle.dumps(([], [], {})))

        def __enter__(self):
            running[0] += 1
            most[0] = max(most[0], running[0])
            return self

        def __exit__(self, *_):
            running[0] -= 1

        def wait(self):
            time.sleep(0.02)
            return 0

    monkeypatch.setattr(home.subprocess, "Popen", Process)
    with ThreadPoolExecutor(4) as threads:
        found = list(threads.map(run_elsewhere, cells(tmp_path) * 8, [Settings(tmp_path)] * 8))
    assert len(found) == 8
    assert most == [1]


@pytest.mark.slow
def test_the_script_for_slurm_on_a_cluster_of_this_machine(tmp_path):
    script = Path(__file__).parents[2] / "docs" / "howto" / "cluster.py"
    run = [sys.executable, "-m", "strainbench", "run", "stretch-square", "--solver", "none"]
    words = ["--set", "resolution=2", "--steps", "1", "--results", "out"]
    command = [sys.executable, str(script), "local", *run, *words]
    subprocess.run(command, cwd=tmp_path, check=True, timeout=PATIENCE)
    assert len(latest_runs(tmp_path / "out")) == 1
