"""What a cell's records come to: time over projections that had something to do, how it ended."""

from __future__ import annotations

from math import isnan, nan
from pathlib import Path

import pandas as pd
import pytest

from strainbench.report import load_runs
from strainbench.report.measures import (
    Finish,
    digits,
    distance_text,
    duration,
    every_time,
    finish,
    length,
    measured,
    numbers,
    timing,
)
from strainbench.report.steps import newest_steps

FIELD = Path(__file__).parent / "records/field"


def steps(*rows):
    columns = ["step", "outcome", "status", "seconds", "active_constraints"]
    return pd.DataFrame(rows, columns=columns)


def run(outcome, reason="", done=3, violation=0.031):
    row = {"outcome": outcome, "reason": reason, "steps_done": done, "steps_asked": 3}
    return pd.Series(row | {"max_violation": violation})


FREE = (1, "optimal", "solved", 0.001, 0)
FIRST, SECOND = (2, "optimal", "solved", 0.1, 5), (3, "optimal", "solved", 0.2, 9)
CUT, OWN = (3, "violated", "user_limit", 2.0, 9), (2, "violated", "solved", 0.1, 9)


def test_a_free_frame_does_not_make_a_method_fast():
    assert timing(steps(FREE, FIRST, SECOND)) == pytest.approx((0.15, 0.125, 0.175, 2))


def test_a_cloth_that_cannot_move_on_makes_no_method_fast():
    """Its candidates are what the last projection left, which takes no time to project."""
    still = (3, "feasible", "solved", 0.001, 9)
    found = steps(FREE, FIRST, still).assign(
        newton_iterations=[4.0, 23.0, 0.0], newton_converged=["True", "False", "False"]
    )
    assert timing(found).median == pytest.approx(0.1)
    assert finish(run("feasible"), found) == Finish("no answer", 2, 3, "its motion is stuck")


def test_without_anything_to_project_there_is_no_time():
    nothing = timing(steps(FREE))
    assert isnan(nothing.median)
    assert nothing.n == 0


@pytest.mark.parametrize(
    ("row", "rows", "expected"),
    [
        (run("optimal"), (FREE, FIRST, SECOND), Finish("optimal", 3, 3)),
        (run("violated"), (FREE, FIRST, CUT), Finish("out of time", 2, 3, "2 of 3")),
        (run("violated"), (FREE, OWN, CUT), Finish("violated", 3, 3, "violates by 3e-2")),
        (  # SCS ends with this word at a limit of time, too
            run("no answer", "time limit of 9 s (1 of 3 steps)", 1),
            (FREE, (2, "violated", "optimal_inaccurate", 9.0, 9)),
            Finish("out of time", 1, 3, "1 of 3"),
        ),
        (
            run("no answer", "time limit of 9 s (2 of 3 steps)", 2),
            (FREE, OWN, CUT),
            Finish("out of time", 2, 3, "2 of 3, 1 violated", 1),
        ),
        (
            run("no answer", "time limit of 9 s (1 of 3 steps)", 1),
            (FREE,),
            Finish("out of time", 1, 3, "1 of 3"),
        ),
        (
            run("no answer", "time limit of 9 s (1 of 3 steps); it says 'time limit'", 1),
            (FREE, (2, "no answer", "time limit", 9.0, 9)),
            Finish("out of time", 1, 3, "1 of 3"),
        ),
        *(  # an answer that the clock left is none, whatever it is worth, and whoever says so
            (
                run("no answer", "time limit of 9 s (1 of 3 steps); it says 'x'", 1),
                (FREE, (2, outcome, status, 9.0, 9)),
                Finish("out of time", 1, 3, "1 of 3"),
            )
            for outcome, status in (("optimal", "time limit"), ("violated", "MaxTime"))
        ),
        (run("no answer", "unavailable: x", 0), (), Finish("no answer", 0, 3, "not installed")),
        (
            run("no answer", "positions that are not finite; it says 'a' (1 of 3 steps)", 1),
            (FREE,),
            Finish("no answer", 1, 3, "not finite"),
        ),
    ],
)
def test_what_the_clock_cut_off_is_out_of_time_and_no_violation(row, rows, expected):
    assert finish(row, steps(*rows)) == expected


def test_records_say_who_ran_out_of_time():
    runs = load_runs(FIELD)
    steps = newest_steps(FIELD, runs)
    runs = measured(runs, steps).set_index("cell")
    late = runs[runs["reason"].str.startswith("time limit")]
    assert len(late)
    assert set(late["ending"]) == {"out of time"}
    assert (late["done"] <= late["steps_done"]).all()
    assert [why.split(",")[0] for why in late["why"]] == [f"{n} of 8" for n in late["done"]]
    for cell in runs.index[runs["solver"] == "newton-ipm"]:
        own = numbers(steps[steps["cell"] == cell])
        had = own.loc[own["active_constraints"] > 0, "seconds"]
        assert runs.loc[cell, "time"] == pytest.approx(had.median())
        assert runs.loc[cell, "time_count"] == len(had) == 7


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (digits(0.002006), "0.0020"),
        (digits(0.0996), "0.10"),
        (digits(1312.0), "1300"),
        (digits(99.7), "100"),
        (duration(0.011), "11 ms"),
        (duration(0.9996), "1.0 s"),
        (duration(8.4e-4), "840 µs"),
        (length(13.2), "1.3 cm"),
        (length(2.0e-3), "2.0 µm"),
        (length(3e-9), "0.0030 nm"),
        (distance_text(0.001, 0.0027), "<0.0027"),
        (distance_text(0.0048, 0.0027), "0.0048"),
        (distance_text(nan, 0.0027), ""),
    ],
)
def test_numbers_have_two_significant_digits(text, expected):
    assert text == expected


def test_repeats_count_as_often_as_they_were_measured():
    rows = steps((1, "optimal", "solved", 0.2, 5)).assign(seconds_each="0.1 0.2 0.4")
    assert timing(rows)[:3] == pytest.approx((0.2, 0.15, 0.3))
    assert every_time(rows) == [[0.1, 0.2, 0.4]]
