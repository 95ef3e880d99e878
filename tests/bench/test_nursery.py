"""Processes forked from one that has loaded what they need are as those that load it themselves."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import psutil
import pytest

from strainbench.bench.cell import Cell, PluginRef
from strainbench.bench.machine import fixed_threads
from strainbench.bench.nursery import CAN_FORK, LOST, Nursery, untouched_mb
from strainbench.bench.plan import plan
from strainbench.bench.preload import Nurseries, load_solver, load_suite
from strainbench.bench.process import MARK, OUTPUT, family, spawned
from strainbench.bench.records import latest_runs
from strainbench.bench.runner import Runner, Settings
from strainbench.scenario.registry import find_scenario
from strainbench.solver.registry import find_solver

pytestmark = pytest.mark.skipif(not CAN_FORK, reason="nurseries are for Linux")


@pytest.fixture(autouse=True)
def _one_thread():
    with fixed_threads(1):
        yield


def nothing():
    """Load nothing."""


def loaded(name, value):
    """Load something."""
    os.environ[name] = value


def with_thread():
    """Load what starts a thread."""
    threading.Thread(target=time.sleep, args=(600,), daemon=True).start()


def failing():
    """Load what fails."""
    raise ImportError("no licence")


def hanging():
    """Load what hangs."""
    time.sleep(600)


def facts(path):
    """Write down what a process is."""
    drawn = [np.random.rand(), random.random()]  # noqa: NPY002
    words = [os.getsid(0) == os.getpid(), os.environ.get("LOADED"), os.environ[MARK], *drawn]
    print("printed")
    os.system("echo by another")
    path.write_text(repr([*words, len(threading.enumerate())]))


def ended(how):
    """End oddly."""
    if how == "raises":
        raise ValueError("no")
    if how == "exits":
        sys.exit(7)
    if how == "at once":
        os._exit(3)
    os.kill(os.getpid(), signal.SIGSEGV)


def sleeping(path):
    """Say so, and sleep."""
    path.touch()
    time.sleep(600)


def code_of(child, seconds=60.0):
    """Its exit code, once it has ended."""
    until = time.monotonic() + seconds
    while (code := child.exit_code) is None and time.monotonic() < until:
        time.sleep(0.01)
    return code


def made(path):
    """A folder, once it is there."""
    path.mkdir()
    return path


def waited_for(path, seconds=60.0):
    """A file, once something is in its place."""
    until = time.monotonic() + seconds
    while not path.exists() and time.monotonic() < until:
        time.sleep(0.01)
    return path


@pytest.mark.parametrize("deep", [False, True], ids=["nursery", "nursery-within"])
def test_a_fork_is_as_a_process_of_its_own(tmp_path, deep):
    with family() as ours:
        nursery = Nursery.planted(ours, tmp_path / "n", loaded, "LOADED", "once")
        if deep:
            nursery = Nursery.planted(ours, tmp_path / "m", nothing, within=nursery)
        found = []
        for name in "ab":
            folder = made(tmp_path / name)
            child = ours.start(facts, (folder / "facts",), folder, nursery.forked)
            assert code_of(child) == 0
            assert sorted((folder / OUTPUT).read_text().split("\n")) == [
                "",
                "by another",
                "printed",
            ]
            leads, known, mark, *drawn, threads = eval((folder / "facts").read_text())
            assert (leads, known, mark, threads) == (True, "once", child.mark, 1)
            found += drawn
        assert len(set(found)) == 4


@pytest.mark.parametrize(
    ("how", "code"), [("raises", 1), ("exits", 7), ("at once", 3), ("signal", -signal.SIGSEGV)]
)
def test_how_a_fork_ends_is_known(tmp_path, how, code):
    with family() as ours:
        nursery = Nursery.planted(ours, tmp_path / "n", nothing)
        child = ours.start(ended, (how,), made(tmp_path / "a"), nursery.forked)
        assert code_of(child) == code
        if how == "raises":
            assert "ValueError: no" in (tmp_path / "a" / OUTPUT).read_text()


@pytest.mark.parametrize("load", [with_thread, failing])
def test_where_a_nursery_is_unfit_processes_start_on_their_own(tmp_path, load):
    with family() as ours:
        nursery = Nursery.planted(ours, tmp_path / "n", load)
        within = Nursery.planted(ours, tmp_path / "m", nothing, within=nursery)
        for name, starter in (("a", nursery.forked), ("b", within.forked)):
            folder = made(tmp_path / name)
            child = ours.start(facts, (folder / "facts",), folder, starter)
            assert code_of(child) == 0
            assert eval((folder / "facts").read_text())[2] == child.mark
        assert nursery.unfit == {with_thread: "it has 2 threads"}.get(
            load, "ImportError: no licence"
        )


def test_a_fork_is_seen_by_its_mark_and_stopped_with_what_it_started(tmp_path):
    with family() as ours:
        nursery = Nursery.planted(ours, tmp_path / "n", nothing)
        children = [
            ours.start(
                sleeping, (tmp_path / name / "began",), made(tmp_path / name), nursery.forked
            )
            for name in "ab"
        ]
        for name, child in zip("ab", children, strict=True):
            waited_for(tmp_path / name / "began")
            assert psutil.Process(child.process.pid).environ()[MARK] == child.mark
        children[0].stop()
        assert [child.exit_code for child in children] == [-signal.SIGKILL, None]
    assert children[1].exit_code == -signal.SIGKILL
    assert not psutil.pid_exists(children[1].process.pid)


def test_a_fork_of_a_nursery_that_hangs_is_stopped(tmp_path):
    with family() as ours:
        nursery = Nursery.planted(ours, tmp_path / "n", hanging)
        child = ours.start(facts, (tmp_path / "facts",), made(tmp_path / "a"), nursery.forked)
        assert child.exit_code is None
        child.stop()
        assert child.exit_code == -signal.SIGKILL


def test_a_fork_whose_nursery_dies_goes_on(tmp_path):
    with family() as ours:
        nursery = Nursery.planted(ours, tmp_path / "n", nothing)
        folder = made(tmp_path / "a")
        child = ours.start(sleeping, (folder / "began",), folder, nursery.forked)
        waited_for(folder / "began")
        nursery.child.process.kill()
        code_of(nursery.child)
        assert child.exit_code is None
        os.kill(child.process.pid, signal.SIGTERM)
        assert code_of(child) == LOST
        late = ours.start(sleeping, (folder / "late",), made(tmp_path / "b"), nursery.forked)
        assert code_of(late) == -signal.SIGKILL


@pytest.mark.slow
def test_what_is_imported_when_it_is_used_is_loaded_beforehand():
    names = ["clarabel", "cvxpy", "linearized-qp", "qoco"]
    done = subprocess.run(
        [sys.executable, "-c", LOADING, *names], capture_output=True, text=True, check=True
    )
    wanted = {"numba", "scipy.sparse", "clarabel", "cvxpy", "osqp", "qoco"}
    assert wanted <= set(done.stdout.split())


LOADING = """
import sys
from strainbench.bench.preload import load_solver, load_suite
load_suite()
for name in sys.argv[1:]:
    load_solver(name)
print(*sys.modules)
"""


def peak(path):
    """What a cell says of its memory."""
    from strainbench.bench.play import _peak_memory_mb

    load_suite()
    load_solver("newton-ipm")
    path.write_text(str(_peak_memory_mb() + untouched_mb()))


def test_a_forked_cell_s_memory_is_that_of_one_that_loads_all_by_itself(tmp_path):
    with family() as ours:
        suite = Nursery.planted(ours, tmp_path / "n", load_suite)
        nursery = Nursery.planted(ours, tmp_path / "m", load_solver, "newton-ipm", within=suite)
        for name, starter in (("fork", nursery.forked), ("spawn", spawned)):
            folder = made(tmp_path / name)
            assert code_of(ours.start(peak, (folder / "mb",), folder, starter)) == 0
        forked, alone = (float((tmp_path / n / "mb").read_text()) for n in ("fork", "spawn"))
        assert nursery.unfit == ""
        assert forked == pytest.approx(alone, rel=0.1)


def test_a_nursery_that_died_is_planted_anew(tmp_path):
    solver, scene = PluginRef.of(find_solver("none")), PluginRef.of(find_scenario("swing")())
    cell = Cell(scene, solver, "simulate", 1, 1e-6)
    with family() as ours:
        nurseries = Nurseries(ours, tmp_path, "fork")
        first = nurseries.starter(cell).__self__
        assert nurseries.starter(cell).__self__ is first
        first.child.process.kill()
        code_of(first.child)
        assert nurseries.starter(cell).__self__ is not first
        assert Nurseries(ours, tmp_path / "b", "spawn").starter(cell) is spawned


def test_batches_share_what_is_loaded(tmp_path, monkeypatch):
    planted = []
    plant = Nursery.planted.__func__

    def counting(cls, family, folder, load, *args, **within):
        planted.append(load)
        return plant(cls, family, folder, load, *args, **within)

    monkeypatch.setattr(Nursery, "planted", classmethod(counting))
    settings = ["resolution=2"]
    cells = plan(["stretch-square"], ["none"], settings, "simulate", 1, [1e-6, 1e-7], None)
    seen = []

    def batches():
        for cell in cells:
            yield [cell]
            seen.append(latest_runs(tmp_path)[cell.key]["outcome"])

    assert Runner(Settings(tmp_path)).run_batches(batches()).cells == 2
    assert seen == ["violated", "violated"]
    assert planted == [load_suite, load_solver]
