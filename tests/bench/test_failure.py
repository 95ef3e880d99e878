"""Each kind of failure is provoked, and found by the referee."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from strainbench.bench.columns import COUNTS, RUN_COLUMNS, STEP_COLUMNS, WORDS
from strainbench.bench.ending import Ending
from strainbench.bench.failure import ENDINGS, FAILURES, ORDER, Failure, of_reason, rises
from strainbench.bench.journal import GO
from strainbench.bench.judge import judge
from strainbench.bench.plan import plan
from strainbench.bench.play import play_cell
from strainbench.bench.records import latest_runs
from strainbench.bench.runner import Runner, Settings

pytestmark = [  # a cell's journal stays open until its process ends, which is this one
    pytest.mark.filterwarnings("ignore::ResourceWarning"),
    pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning"),
]
FAILING = str(Path(__file__).parents[1] / "failing.py")


def judged(tmp_path, solver, scene="stretch-square", steps=2, settings=(), **fields):
    """The row of a cell that was played here, and the failures of its projections."""
    words = ["resolution=4", *settings]
    cells = plan([scene], [FAILING], words, "simulate", steps, [1e-6], None)
    cell = replace(next(c for c in cells if c.solver.name == solver), **fields)
    tmp_path.mkdir(exist_ok=True)
    (tmp_path / GO).touch()
    play_cell(cell, tmp_path, None)
    row, steps = judge(cell, tmp_path, "")
    return row, [s["failure"] for s in steps]


FREE = {"scene": "sphere-drop", "steps": 4}
PROVOKED = [
    ("slack", {}, Failure.NOT_OPTIMAL, 1),
    ("slack", {"settings": ["slack.status=iteration limit"]}, Failure.ITERATION_LIMIT, 1),
    ("slack", {"settings": ["slack.status=QOCO_MAX_ITER"]}, Failure.ITERATION_LIMIT, 1),
    ("slack", {"settings": ["slack.status=user_limit"]}, Failure.TIME_LIMIT, 1),
    ("idle", {}, Failure.OVERSTRETCHED, 1),
    ("idle", {"settings": ["idle.status=solved"]}, Failure.FALSE_CLAIM, 1),
    ("turn", {}, Failure.INVERTED, 1),
    ("shift", FREE | {"settings": ["shift.up=1"]}, Failure.ENERGY, 2),
    ("shift", FREE | {"settings": ["shift.along=0.0002"]}, Failure.MOMENTUM, 1),
    ("late", {"steps": 4}, Failure.OVERSTRETCHED, 3),
]


@pytest.mark.parametrize(("solver", "how", "kind", "step"), PROVOKED)
def test_a_kind_is_provoked_and_found(tmp_path, solver, how, kind, step):
    row, _ = judged(tmp_path, solver, **how)
    assert (row["failure"], row["failure_step"]) == (kind, step)


def test_steps_have_their_own(tmp_path):
    _, kinds = judged(tmp_path, "late", steps=4)
    assert kinds == [Failure.NOT_OPTIMAL, Failure.NOT_OPTIMAL, *[Failure.OVERSTRETCHED] * 2]


def test_a_cell_with_patience_ends_soon_after_its_first_violation(tmp_path):
    row, kinds = judged(tmp_path / "a", "late", steps=40, patience=2)
    assert (row["outcome"], row["steps_done"], len(kinds)) == ("violated", 5, 5)
    assert row["reason"].startswith("ended early, after step 5 of 40; 3 of 5 projections: ")
    assert (row["failure"], row["failure_step"]) == (Failure.OVERSTRETCHED, 3)
    row, _ = judged(tmp_path / "b", "slack", steps=5, patience=2)
    assert (row["outcome"], row["steps_done"]) == ("feasible", 5)


def test_patience_is_part_of_what_a_cell_is():
    (cell,) = plan(["swing"], ["none"], [], "simulate", 9, [1e-6], None)
    assert replace(cell, patience=2).key not in (cell.key, replace(cell, patience=3).key)


def test_an_optimal_cell_has_none(tmp_path):
    settings = ["scale_x=0.9", "scale_y=0.9"]  # the candidate is the answer
    row, kinds = judged(tmp_path, "idle", settings=settings)
    assert row["outcome"] == "optimal"
    assert ([row[c] for c in FAILURES], kinds) == (["", ""], ["", ""])


def test_what_never_began_has_no_step(tmp_path):
    cells = plan(["swing"], ["none"], ["resolution=2"], "simulate", 1, [1e-6], None)
    missing = replace(cells[0].solver, unavailable="it is not installed")
    Runner(Settings(tmp_path)).run([replace(cells[0], solver=missing)])
    (row,) = latest_runs(tmp_path).values()
    assert (row["failure"], row["failure_step"]) == (Failure.UNAVAILABLE, "")


@pytest.mark.parametrize(
    ("reason", "kind"),
    [
        ("MemoryError (0 of 3 steps)", Failure.MEMORY),
        ("positions that are not finite; it says 'solved'", Failure.NOT_A_NUMBER),
        ("positions that are not finite; it says 'primal infeasible'", Failure.REFUSED),
        ("the simulation has left the finite numbers", Failure.NOT_A_NUMBER),
        ("ZeroDivisionError: by a solver", Failure.ERROR),
        ("positions of shape (3, 3), type float64", Failure.ERROR),
        *((str(ending), kind) for ending, kind in ENDINGS.items()),
    ],
)
def test_cells_without_an_answer(reason, kind):
    assert of_reason(reason) is kind


def test_every_ending_is_of_a_kind_and_every_kind_has_its_place():
    assert set(ENDINGS) == set(Ending)
    assert len(set(ORDER)) == len(Failure)
    assert set(FAILURES) <= set(RUN_COLUMNS)
    assert "failure" in STEP_COLUMNS
    assert {"failure"} <= WORDS
    assert {"failure_step"} <= COUNTS


def step(number, kinetic, gravity, work=0.0):
    energies = {"kinetic_energy": kinetic, "gravity_energy": gravity, "pin_work": work}
    rest = dict.fromkeys(("membrane_energy", "bending_energy", "contact_energy"), 0.0)
    return {"event": "step", "step": number, **energies, **rest}


def test_energy_rises_relative_to_what_moves_and_beyond_the_work_of_pins():
    swings = [step(1, 1.0, -1.0), step(2, 2.0, -2.0), step(3, 2.5, -2.0), step(4, 3.5, -2.0, 1.0)]
    assert rises(swings) == pytest.approx({2: 0.0, 3: 0.2, 4: 0.0})
    assert rises([step(1, float("nan"), 0.0)] * 2) == {}
