"""The command line as a person meets it: exit status and one clear line."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time

import pytest

from strainbench.bench.columns import RUN_COLUMNS, STEP_COLUMNS
from strainbench.bench.records import RUNS, STEPS, append_rows, read_rows
from tests.bench.test_records import run_row

RUN = ["run", "swing", "--solver", "none", "--set", "resolution=2", "--steps", "1"]


def strainbench(*words, cwd):
    return subprocess.run(
        [sys.executable, "-m", "strainbench", *words],
        cwd=cwd,
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
    )


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (["run", "swim"], "no scenario called 'swim'; valid are"),
        (["run", "swing", "--solver", "mosek"], "no solver called 'mosek'; valid are"),
        (["run", "swing", "--set", "resolutoin=10"], "no setting 'resolutoin'; valid are"),
        (["run", "swing", "--set", "resolution=ten"], "the value must be int"),
        (["run", "swing", "--set", "limit=1.01"], "a strain between 0 and 1 is valid"),
        (["run", "swing", "--set", "integrator=rk4"], "integrator is 'rk4': valid are sap"),
        (["run", "swing", "--mode", "both"], "--mode both: valid are simulate, replay"),
        (["run", "swing", "--steps", "0"], "--steps 0"),
        (["run", "swing", "--steps", "3", "--duration", "1"], "one of them is valid"),
        (["run", "swing", "--jobs", "0"], "--jobs 0"),
        (["run", "swing", "--tolerance", "tight"], "--tolerance tight"),
        (["run", "swing", "--solver", "./nowhere.py"], "./nowhere.py: no such file"),
        (["list", "papers"], "list papers: valid are solvers, scenarios"),
        (["report", "--results", "nowhere"], "nowhere holds no results"),
        (["frobnicate"], "No such command 'frobnicate'"),
        (["run"], "Missing argument"),
        (["run", "swing", "--frob"], "No such option: --frob"),
    ],
)
def test_a_wrong_word_is_one_line_and_exit_2(words, line, tmp_path):
    done = strainbench(*words, cwd=tmp_path)
    assert done.returncode == 2
    assert line in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1
    assert "Traceback" not in done.stdout


def test_a_solvers_failure_is_data_and_exit_0(tmp_path):
    (tmp_path / "bad.py").write_text(
        "from strainbench import Solver\n"
        "class Bad(Solver):\n"
        "    'Fails (nobody)'\n"
        "    name = 'bad'\n"
        "    def solve(self, problem, state, **_): raise ValueError('by design')\n"
    )
    done = strainbench(*RUN[:2], "--solver", "bad.py", *RUN[4:], cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "ValueError: by design" in done.stdout


def test_damaged_records_stop_a_run_and_stay(tmp_path):
    folder = tmp_path / "results"
    assert strainbench(*RUN, "--results", str(folder), cwd=tmp_path).returncode == 0
    path = folder / RUNS
    header, row = path.read_text(encoding="utf-8").splitlines()
    damaged = f"{header}\n{row},one field more\n"
    path.write_text(damaged, encoding="utf-8")
    for verb in (RUN, ["report"]):
        done = strainbench(*verb, "--results", str(folder), cwd=tmp_path)
        assert done.returncode == 2
        assert "runs.csv, record 2" in done.stderr
        assert path.read_text(encoding="utf-8") == damaged


def test_an_unfinished_last_line_is_left_out_by_a_report_and_cut_away_by_a_run(tmp_path):
    folder = tmp_path / "results"
    folder.mkdir()
    append_rows(folder / RUNS, RUN_COLUMNS, [run_row("a"), run_row("b")])
    unfinished = (folder / RUNS).read_text(encoding="utf-8")[:-5]
    (folder / RUNS).write_text(unfinished, encoding="utf-8")
    done = strainbench("compare", str(folder), str(folder), cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert done.stderr == f"{folder / RUNS}: its last line is unfinished and left out\n"
    assert (folder / RUNS).read_text(encoding="utf-8") == unfinished
    done = strainbench(*RUN, "--results", str(folder), cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    words = "its last line was unfinished and is cut away"
    assert (done.stdout + done.stderr).replace("\n", "").count(words) == 1
    assert [row["cell"] for row in read_rows(folder / RUNS, RUN_COLUMNS)][:-1] == ["a"]


def test_a_folder_that_cannot_be_written_to(tmp_path):
    (tmp_path / "file").write_text("")
    done = strainbench(*RUN, "--results", "file/results", cwd=tmp_path)
    assert done.returncode == 2
    assert "cannot be written to" in done.stderr


WAITING = """
import time
from dataclasses import dataclass
from pathlib import Path
from strainbench import Solution, Solver

@dataclass(frozen=True)
class Waits(Solver):
    '''Waits for a file (nobody).'''
    name = "waits"

    def solve(self, problem, state, *, tolerance, monitor, deadline):
        while len(problem.elements) > 8 and not Path("come").exists():
            time.sleep(0.01)
        return Solution(problem.target.copy(), "solved", 0)
"""


@pytest.mark.parametrize(("sent", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_an_interrupt_says_what_is_kept_and_the_run_resumes(tmp_path, sent, status):
    (tmp_path / "waits.py").write_text(WAITING)
    words = ["run", "stretch-square", "--set", "resolution=3", "--steps", "1"]
    words += ["--solver", "none", "--solver", "./waits.py"]
    command = [sys.executable, "-m", "strainbench", *words]
    runs = tmp_path / "results/local/run" / RUNS
    with subprocess.Popen(
        command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        try:
            deadline = time.monotonic() + 90
            while not runs.exists() and time.monotonic() < deadline:
                time.sleep(0.1)
            process.send_signal(sent)
            _, stderr = process.communicate(timeout=60)
        finally:
            process.kill()
    assert process.returncode == status
    assert "interrupted; every finished cell is kept" in stderr
    assert [row["solver"] for row in read_rows(runs, RUN_COLUMNS)] == ["none"]
    (tmp_path / "come").touch()
    done = strainbench(*words, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "1 cells finished before" in done.stdout
    assert [row["solver"] for row in read_rows(runs, RUN_COLUMNS)] == ["none", "waits"]


def test_list_names_solvers_and_scenarios(tmp_path):
    done = strainbench("list", cwd=tmp_path)
    assert done.returncode == 0
    for word in ("clarabel", "gauss-seidel", "swing", "Thomaszewski"):
        assert word in done.stdout


def test_answers_under_lower_bounds_are_reported_as_local(tmp_path):
    pytest.importorskip("cyipopt", reason="ipopt is an optional extra")
    words = "--set resolution=2 --set limit=10% --set compression=10% --steps 1 --results out"
    solvers = ["--solver", "ipopt,gauss-seidel,clarabel"]
    done = strainbench("run", "stretch-square", *solvers, *words.split(), cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    local, reached = read_rows(tmp_path / "out" / STEPS, STEP_COLUMNS)
    for step in (local, reached):
        assert (step["outcome"], step["relative_gap"]) == ("feasible", "")
    residuals = [json.loads(step["details"])["kkt_residual"] for step in (local, reached)]
    assert residuals[0] < 1e-4 < residuals[1]
    assert strainbench("report", "--results", "out", cwd=tmp_path).returncode == 0
    table = (tmp_path / "out" / "table1.md").read_text()
    for words in ("| 0 | local |", "at best a local optimum", "it has no form for lower bounds"):
        assert words in table
