"""Every way in which a solver can fail ends as one honest row; runs resume."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import psutil
import pytest

from strainbench.bench import isolation, judge
from strainbench.bench.columns import STEP_COLUMNS
from strainbench.bench.plan import from_file, plan
from strainbench.bench.process import Child
from strainbench.bench.records import STEPS, latest_runs, read_rows
from strainbench.bench.runner import Observer, Runner, Settings
from tests.processes import left_running, mark_what_starts

MISBEHAVING = str(Path(__file__).parents[1] / "misbehaving.py")
WAYWARD = str(Path(__file__).parents[1] / "wayward.py")
SMALL = ["resolution=3", "limit=0.01%"]


LATE = {"hang-load", "hang-warm-up", "hang-supports"}  # each waits for a limit


def run(
    folder,
    solvers,
    *,
    scene="swing",
    mode="simulate",
    steps=3,
    time_limit=2.0,
    observer=None,
    only=(),
    **settings,
):
    cells = plan([scene], solvers, SMALL, mode, steps, [1e-6], time_limit)
    cells = [cell for cell in cells if not only or cell.solver.name in only]
    options = {"memory_limit_mb": 400.0, **settings}
    summary = Runner(Settings(folder, **options), observer).run(cells)
    return summary, {row["solver"]: row for row in latest_runs(folder).values()}


@pytest.fixture(scope="module")
def rows(tmp_path_factory):
    names = [s.name for s in from_file(MISBEHAVING) if s.name not in LATE]
    folder = tmp_path_factory.mktemp("results")
    only = [*names, "none"]
    with pytest.MonkeyPatch.context() as patch:
        token = mark_what_starts(patch)
        found = run(folder, [MISBEHAVING, "none"], scene="stretch-square", only=only, jobs=2)[1]
    assert not left_running(token)
    return found


FAILURES = {
    "crash": "crashed: its process ended with exit code -6 (SIGABRT)",
    "segfault": "crashed: its process ended with exit code -11 (SIGSEGV)",
    "exit-0": "crashed: its process ended with exit code 0 (without a word)",
    "exit-3": "crashed: its process ended with exit code 3",
    "alarm": "crashed: its process ended with exit code -14 (SIGALRM)",
    "sys-exit": "SystemExit: enough",
    "interrupt": "KeyboardInterrupt",
    "no-memory": "MemoryError",
    "recursion": "RecursionError: maximum recursion depth",
    "strange": "Unspeakable: what it says cannot be shown (0 of 3 steps)",
    "surrogate": "ValueError: cannot open (0 of 3 steps)",
    "raise": "ZeroDivisionError: by a solver",
    "raise-prepare": "ZeroDivisionError: by a set-up",
    "raise-supports": "ZeroDivisionError: by a question",
    "raise-load": "ZeroDivisionError: by a maker",
    "closes-output": "ValueError: unheard",
    "reads-input": "EOFError",
    "hang": "time limit of 2 s (2 of 3 steps)",
    "deaf": "time limit of 2 s (0 of 3 steps)",
    "hang-prepare": "time limit of 2 s (0 of 3 steps)",
    "nan": "positions that are not finite; it says 'solved' (0 of 3 steps)",
    "shape": "positions of shape (15, 3), type float64",
    "single": "positions of shape (16, 3), type float32",
    "complex": "positions of shape (16, 3), type complex128",
    "no-positions": "positions of shape (), type object",
    "nothing": "nothing returned NoneType, not a Solution",
    "text-details": "details['x'] is 'text': a number is valid",
    "array-details": "details['x'] is array([1., 1.]): a number is valid",
    "list-details": "details is [1]: a dict of numbers is valid",
    "large-details": "details['x'] is a int",
    "text-iterations": "iterations is 'many': a number is valid",
    "negative-iterations": "iterations is -1: a whole number from 0 on is valid",
    "mute": "a status that cannot be written (ValueError)",
    "hoard": "memory limit of 400 MB (",
    "children-hoard": "memory limit of 400 MB, with what it started",
    "refuse": "unsupported: it takes none",
    "vandal": "ValueError: assignment destination is read-only",
    "removes-folder": "its journal was removed or cut while it ran",
    "junk": "the journal is damaged at line",
    "slow-clock": "the clock was tampered with: it says",
    "false-claim": "the clock was tampered with: solves of 0.00 s by its account took",
}
KINDS = {
    "crash": "crashed",
    "exit-0": "crashed",
    "no-memory": "memory",
    "hoard": "memory",
    "children-hoard": "memory",
    "nan": "not a number",
    "refuse": "refused",
    "hang": "time limit",
    "hang-prepare": "time limit",
    "raise": "error",
    "shape": "error",
    "junk": "false records",
    "false-claim": "false records",
}
HARMLESS = [
    "lie",
    "long-status",
    "odd-status",
    "leaves-thread",
    "hangs-at-exit",
    "leaves-child",
    "forks",
    "shouts",
    "wanders",
    "stops-clock",
]


@pytest.mark.slow
@pytest.mark.parametrize("solver", FAILURES)
def test_a_failure_is_a_row_with_its_reason(rows, solver):
    assert rows[solver]["outcome"] == "no answer"
    assert FAILURES[solver] in rows[solver]["reason"]


@pytest.mark.slow
@pytest.mark.parametrize("solver", KINDS)
def test_a_failure_is_of_a_kind_and_begins_in_a_step(rows, solver):
    assert rows[solver]["failure"] == KINDS[solver]
    first = {"hang": "3", "refuse": "", "false-claim": "3"}.get(solver, "1")
    assert rows[solver]["failure_step"] == first


@pytest.mark.slow
@pytest.mark.parametrize("solver", HARMLESS)
def test_what_does_not_touch_the_answer_is_judged_like_any(rows, solver):
    assert rows[solver]["outcome"] == rows["none"]["outcome"] == "violated"
    assert rows[solver]["steps_done"] == "3"
    assert rows[solver]["max_violation"] == rows["none"]["max_violation"]
    assert float(rows[solver]["solve_seconds_mean"]) > 0


@pytest.mark.slow
def test_every_misbehaviour_has_its_own_row(rows):
    assert set(rows) == {*FAILURES, *HARMLESS, "huge", "none"}
    assert rows["huge"]["outcome"] in ("violated", "no answer")  # as the referee finds


@pytest.mark.slow
def test_before_the_clock_starts_limits_follow_the_time_limit(tmp_path, monkeypatch):
    monkeypatch.setattr(isolation, "WARM_UP_LIMIT", 4.0)
    monkeypatch.setattr(isolation, "START_LIMIT", 30.0)
    _, found = run(tmp_path, [MISBEHAVING], only=LATE, time_limit=5.0, jobs=3)
    for solver in ("hang-warm-up", "hang-supports"):
        expected = "hung for 5 s in its warm-up, before its first projection (0 of 3 steps)"
        assert found[solver]["reason"] == expected
    assert "hung for 30 s as it was loaded" in found["hang-load"]["reason"]


def test_steps_before_a_failure_are_kept(rows):
    assert rows["hang"]["steps_done"] == "2"
    assert float(rows["hang"]["max_principal_stretch"]) > 1


FOUND_OUT = ("says solved and is not", "over-stretched")


def test_a_lie_is_found_out(rows):
    assert rows["lie"]["outcome"] == rows["none"]["outcome"] == "violated"
    assert float(rows["lie"]["max_violation"]) > 1e-3
    assert (rows["lie"]["failure"], rows["none"]["failure"]) == FOUND_OUT
    assert float(rows["lie"]["solve_seconds_mean"]) > 0  # the suite's clock, not the solver's


def test_finished_cells_are_not_run_again_unless_asked(tmp_path):
    class Count(Observer):
        seen = 0

        def started(self, cell):
            Count.seen += 1

    run(tmp_path, ["none"], observer=Count())
    run(tmp_path, ["none"], observer=Count())
    assert Count.seen == 1
    run(tmp_path, ["none"], observer=Count(), rerun=True)
    assert Count.seen == 2
    assert len(read_rows(tmp_path / STEPS, STEP_COLUMNS)) == 2 * 3


def test_a_cell_cut_off_by_time_runs_again_with_more_of_it(tmp_path):
    assert (
        run(tmp_path, [MISBEHAVING], only=["hang", "lie"], time_limit=0.3)[1]["hang"]["outcome"]
        == "no answer"
    )
    cells = [
        cell
        for cell in plan(["swing"], [MISBEHAVING], SMALL, "simulate", 3, [1e-6], 0.3)
        if cell.solver.name in ("hang", "lie")
    ]
    runner = Runner(Settings(tmp_path))
    assert all(runner.is_finished(cell) for cell in cells)
    longer = [replace(cell, time_limit=5.0) for cell in cells]
    assert [c.solver.name for c in longer if not runner.is_finished(c)] == ["hang"]


def test_replay_feeds_every_solver_the_same_candidates(tmp_path):
    _, found = run(tmp_path, ["clarabel", "none"], mode="replay", time_limit=None)
    assert found["clarabel"]["outcome"] == "optimal"
    steps = read_rows(tmp_path / STEPS, STEP_COLUMNS)
    by_cell = {key: [s for s in steps if s["cell"] == key] for key in {s["cell"] for s in steps}}
    bounds = [[s["lower_bound"] for s in rows] for rows in by_cell.values()]
    assert len(bounds) == 2
    assert bounds[0] == bounds[1]
    kept = {p.name for p in tmp_path.rglob("*") if p.is_file()}  # no answers to be read from
    assert kept >= {"targets.bin"}
    assert not any(name == "frames.bin" or name.endswith(".npz") for name in kept)


def test_some_frames_are_those_of_the_whole_replay(tmp_path):
    for mode, steps in (("replay", 3), ("replay:2-3", None)):
        run(tmp_path, ["none"], mode=mode, steps=steps, time_limit=None)
    steps = read_rows(tmp_path / STEPS, STEP_COLUMNS)
    whole, part = (
        [(s["step"], s["objective"], s["distance"]) for s in steps if s["cell"] == key]
        for key in dict.fromkeys(s["cell"] for s in steps)
    )
    assert [step for step, *_ in part] == ["2", "3"]
    assert part == whole[1:]


def test_an_interrupt_keeps_what_is_finished(tmp_path):
    class Interrupt(Observer):
        def ended(self, cell, row):
            if cell.solver.name == "none":
                raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run(tmp_path, ["none", "clarabel"], observer=Interrupt())
    assert next(row["solver"] for row in latest_runs(tmp_path).values()) == "none"
    _, found = run(tmp_path, ["none", "clarabel"])
    assert set(found) == {"none", "clarabel"}


@pytest.mark.slow
def test_a_failing_referee_is_a_row_and_the_next_case_has_another(tmp_path, monkeypatch):
    monkeypatch.setattr(judge, "JUDGE_LIMIT", 20.0)
    failures = {
        "exit": "SystemExit: enough",
        "end": "its process ended with exit code 0 (without a word)",
        "kill": "its process ended with exit code -9 (SIGKILL)",
        "raise": "ZeroDivisionError: by a scene",
        "hang": "hung on projection 1, beyond its limit of 20 s for one",
    }
    settings = ["resolution=2", f"how={','.join(failures)},well"]
    cells = plan([WAYWARD], ["none"], settings, "simulate", 2, [1e-6], None)
    Runner(Settings(tmp_path)).run(cells)
    rows = {json.loads(r["scenario_parameters"])["how"]: r for r in latest_runs(tmp_path).values()}
    for how, reason in failures.items():
        assert rows[how]["outcome"] == "no answer"
        assert rows[how]["reason"] == f"the referee failed: {reason} (2 of 2 steps)"
        assert float(rows[how]["solve_seconds_mean"]) > 0
        assert (rows[how]["steps_done"], rows[how]["iterations_mean"]) == ("2", "0.0")
    assert rows["well"]["outcome"] == "violated"
    steps = read_rows(tmp_path / STEPS, STEP_COLUMNS)
    assert [s["outcome"] for s in steps] == ["no answer"] * 10 + ["violated"] * 2
    assert all(float(s["seconds"]) > 0 for s in steps)
    runner = Runner(Settings(tmp_path))
    assert all(runner.is_finished(cell) for cell in cells)


def test_the_summary_accounts_for_the_wall_time(tmp_path):
    summary, _ = run(tmp_path, ["clarabel"])
    assert summary.cells == 1
    assert 0 < summary.play < summary.wall
    assert 0 < summary.start < summary.wall
    assert 0 <= summary.overhead < 1


def test_a_cell_that_has_not_begun_has_no_memory(tmp_path):
    """Its nursery has not forked it yet: what other cells hold is not its own."""
    (cell,) = plan(["swing"], ["none"], SMALL, "simulate", 1, [1e-6], None)
    waiting = SimpleNamespace(pid=None, poll=lambda: None, stdin=None)
    item = isolation.Running(cell, tmp_path, Child(waiting, "mark"), memory_limit_mb=0.0)
    with subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE) as other:
        assert psutil.Process(other.pid).memory_info().rss > 0
        assert not item.has_ended()
        other.kill()
