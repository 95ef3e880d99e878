"""Every way in which a solver can fail ends as one honest row; runs resume."""

from __future__ import annotations

from pathlib import Path

import pytest

from strainbench.plan import plan
from strainbench.records import STEP_COLUMNS, STEPS, latest_runs, read_rows
from strainbench.runner import Observer, Runner, Settings

MISBEHAVING = str(Path(__file__).with_name("misbehaving.py"))
SMALL = ["resolution=3", "limit=0.01%"]


def run(folder, solvers, *, mode="simulate", steps=3, time_limit=2.0, observer=None, **settings):
    cells = plan(["swing"], solvers, SMALL, mode, steps, [1e-6], time_limit)
    options = {"memory_limit_mb": 400.0, **settings}
    summary = Runner(Settings(folder, **options), observer).run(cells)
    return summary, {row["solver"]: row for row in latest_runs(folder).values()}


@pytest.fixture(scope="module")
def rows(tmp_path_factory):
    return run(tmp_path_factory.mktemp("results"), [MISBEHAVING, "none"], jobs=2)[1]


@pytest.mark.parametrize(
    ("solver", "reason"),
    [
        ("crash", "crashed: its process ended with exit code"),
        ("hang", "time limit of 2 s (2 of 3 steps)"),
        ("nan", "positions that are not finite; it says 'solved' (0 of 3 steps)"),
        ("raise", "ZeroDivisionError: by a solver"),
        ("shape", "positions of shape"),
        ("nothing", "nothing returned NoneType, not a Solution"),
        ("hoard", "memory limit of 400 MB"),
        ("refuse", "unsupported: it takes none"),
        ("vandal", "ValueError: assignment destination is read-only"),
    ],
)
def test_a_failure_is_a_row_with_its_reason(rows, solver, reason):
    assert rows[solver]["outcome"] == "no answer"
    assert reason in rows[solver]["reason"]


def test_steps_before_a_failure_are_kept(rows):
    assert rows["hang"]["steps_done"] == "2"
    assert float(rows["hang"]["max_principal_stretch"]) > 1


def test_a_lie_is_found_out(rows):
    assert rows["lie"]["outcome"] == rows["none"]["outcome"] == "violated"
    assert float(rows["lie"]["max_violation"]) > 1e-3
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
    assert run(tmp_path, [MISBEHAVING], time_limit=0.3)[1]["hang"]["outcome"] == "no answer"
    cells = plan(["swing"], [MISBEHAVING], SMALL, "simulate", 3, [1e-6], 0.3)
    runner = Runner(Settings(tmp_path))
    assert all(runner.is_finished(cell) for cell in cells)
    longer = plan(["swing"], [MISBEHAVING], SMALL, "simulate", 3, [1e-6], 5.0)
    assert [c.solver.name for c in longer if not runner.is_finished(c)] == ["hang"]


def test_replay_feeds_every_solver_the_same_candidates(tmp_path):
    _, found = run(tmp_path, ["clarabel", "none"], mode="replay", time_limit=None)
    assert found["clarabel"]["outcome"] == "optimal"
    steps = read_rows(tmp_path / STEPS, STEP_COLUMNS)
    by_cell = {key: [s for s in steps if s["cell"] == key] for key in {s["cell"] for s in steps}}
    bounds = [[s["lower_bound"] for s in rows] for rows in by_cell.values()]
    assert len(bounds) == 2
    assert bounds[0] == bounds[1]


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


def test_the_summary_accounts_for_the_wall_time(tmp_path):
    summary, _ = run(tmp_path, ["clarabel"])
    assert summary.cells == 1
    assert 0 < summary.play < summary.wall
    assert 0 < summary.start < summary.wall
    assert 0 <= summary.overhead < 1
