"""Runs whose folder is in use, full, interrupted or taken away: a line, and the next completes."""

from __future__ import annotations

import resource
import shutil
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest

from strainbench.bench.columns import RUN_COLUMNS, STEP_COLUMNS
from strainbench.bench.plan import plan
from strainbench.bench.records import (
    RUNS,
    STEPS,
    DiskError,
    RecordsError,
    latest_runs,
    read_rows,
    write_rows,
)
from strainbench.bench.runner import Observer, Runner, Settings
from strainbench.files import locked
from strainbench.studies.convergence.measure import converge
from tests.bench.test_records import run_row

SWING = ["run", "swing", "--set", "resolution=2", "--steps", "1", "--results", "results"]
PATIENT = """
import time
from pathlib import Path
from strainbench import Solution, Solver
class Patient(Solver):
    "Waits (nobody)"
    name = "patient"
    def solve(self, problem, state, **_):
        while not Path({go!r}).exists():
            time.sleep(0.05)
        return Solution(problem.target.copy(), "solved", 1)
"""


def command(*words):
    return [sys.executable, "-m", "strainbench", *words]


def strainbench(cwd, *words, **options):
    return subprocess.run(
        command(*words),
        cwd=cwd,
        capture_output=True,
        text=True,
        check=False,
        timeout=240,
        **options,
    )


def cells():
    return plan(["swing"], ["none"], ["resolution=2"], "simulate", 2, [1e-6], None)


@pytest.mark.slow
def test_the_second_run_says_who_holds_the_folder_and_the_first_goes_on(tmp_path):
    go, results = tmp_path / "go", tmp_path / "results"
    (tmp_path / "patient.py").write_text(PATIENT.format(go=str(go)))
    words = [*SWING, "--solver", "patient.py"]
    with subprocess.Popen(command(*words), cwd=tmp_path, stdout=subprocess.DEVNULL) as first:
        try:
            while not (results / "running").exists() and first.poll() is None:
                time.sleep(0.05)
            second = strainbench(tmp_path, *words)
            reading = strainbench(tmp_path, "report", "--results", "results")
        finally:
            go.touch()
        assert first.wait(timeout=240) == 0
    assert second.returncode == 2
    assert f"in use by process {first.pid} on {socket.gethostname()}" in second.stderr
    assert len(second.stderr.splitlines()) == 1
    assert "holds no results" in reading.stderr
    (row,) = read_rows(results / RUNS, RUN_COLUMNS)
    assert row["steps_done"] == "1"
    assert "without a word" not in row["reason"]
    assert sorted(f.name for f in results.iterdir() if f.name.startswith(".")) == [".lock"]


@pytest.mark.slow
def test_a_full_disk_ends_a_run_with_a_line_and_the_next_completes(tmp_path):
    runs = tmp_path / "results" / RUNS
    runs.parent.mkdir()
    before = [run_row(str(k), reason="x" * 2000) for k in range(1200)]
    write_rows(runs, RUN_COLUMNS, before)
    content = runs.read_bytes()

    def fill():
        limit = len(content) + 10  # far beyond any other file of a run
        resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))

    words = [*SWING, "--solver", "none"]
    full = strainbench(tmp_path, *words, preexec_fn=fill)
    assert full.returncode == 1
    assert "runs.csv: File too large" in full.stderr
    assert len(full.stderr.splitlines()) == 1
    assert runs.read_bytes() == content
    assert read_rows(runs.with_name(STEPS), STEP_COLUMNS) == []
    assert strainbench(tmp_path, *words).returncode == 0
    assert len(latest_runs(runs.parent)) == len(before) + 1


@pytest.mark.slow
@pytest.mark.parametrize("moment", ["started", "stepped"])
def test_a_folder_that_is_removed_ends_the_run(tmp_path, moment):
    folder = tmp_path / "results"

    class Remove(Observer):
        gone = False

        def remove(self, *_):
            if not self.gone:
                shutil.rmtree(folder)
                self.gone = True

    observer = Remove()
    setattr(observer, moment, observer.remove)
    with pytest.raises(DiskError) as caught:
        Runner(Settings(folder), observer).run(cells())
    assert len(str(caught.value).splitlines()) == 1
    assert not (folder / RUNS).exists()
    Runner(Settings(folder)).run(cells())
    assert len(read_rows(folder / RUNS, RUN_COLUMNS)) == 1
    assert len(read_rows(folder / STEPS, STEP_COLUMNS)) == 2


@pytest.mark.slow
def test_an_interrupt_as_a_row_is_written_neither_doubles_nor_loses_it(tmp_path):
    class Interrupt(Observer):
        def ended(self, cell, row):
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        Runner(Settings(tmp_path), Interrupt()).run(cells())
    assert len(read_rows(tmp_path / RUNS, RUN_COLUMNS)) == 1
    assert len(read_rows(tmp_path / STEPS, STEP_COLUMNS)) == 2
    assert Runner(Settings(tmp_path)).run(cells()).cells == 0


def test_convergence_is_not_written_beside_another_run(tmp_path):
    following = converge([], None, 1, tmp_path, 1.0)
    with locked(tmp_path), pytest.raises(RecordsError, match="is in use by process"):
        next(following)


def test_a_report_that_cannot_be_written_is_a_line_and_status_1(tmp_path):
    write_rows(tmp_path / RUNS, RUN_COLUMNS, [run_row(scenario_parameters="{}", details_mean="{}")])
    (tmp_path / "table1.csv").mkdir()
    done = strainbench(tmp_path, "report", "--results", str(tmp_path))
    assert done.returncode == 1
    assert f"{tmp_path / 'table1.csv'}: Is a directory" in done.stderr
    assert len(done.stderr.splitlines()) == 1


def test_our_text_files_name_their_encoding():
    names = ("bench/records.py", "files.py")
    sources = [Path(__file__).parents[1] / "strainbench" / name for name in names]
    for line in (line for s in sources for line in s.read_text(encoding="utf-8").splitlines()):
        assert "write_text(" not in line or "encoding" in line
        assert "read_text(" not in line or "encoding" in line
