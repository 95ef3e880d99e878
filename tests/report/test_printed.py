"""Table 1 in the paper's own shape: its numbers beside those of a folder."""

from __future__ import annotations

import json
from math import nan

import pytest

from strainbench.bench.columns import RUN_COLUMNS
from strainbench.bench.records import RUNS, append_rows
from strainbench.report import load_runs
from strainbench.report.measures import NO_ANSWER, OUT_OF_TIME
from strainbench.report.printed import PAPER_SECONDS, SIZES, STARRED, _marked, printed_tables
from tests.report.test_report import row


def cell(solver, resolution=10, limit=0.01, **others):
    scene = json.dumps({"limit": limit, "resolution": resolution, "step": 1 / 60})
    about = {"ie_seconds_mean": 0.01, "scenario_parameters": scene}
    return row(solver, resolution=resolution, limit=limit, **{**about, **others})


def by_method(table):
    limit, found = "", {}
    for first, method, *texts in table.texts():
        limit = first or limit
        found[method, limit] = texts
    return found


@pytest.fixture
def tables(tmp_path):
    def tables(*cells):
        append_rows(tmp_path / RUNS, RUN_COLUMNS, cells)
        return [by_method(table) for table in printed_tables(load_runs(tmp_path)).parts]

    return tables


def test_seconds_ratios_and_distances_stand_in_the_papers_shape(tables):
    seconds, ratios, away = tables(
        cell("none"),
        cell("none", resolution=20, ie_seconds_mean=0.04),
        cell("newton-ipm", solve_seconds_mean=0.02, distance_max=1e-6, reference_error_max=1e-9),
        cell("newton-ipm", resolution=20, solve_seconds_mean=0.06),
    )
    assert seconds["implicit Euler", ""] == ["0.0100", "0.0400", "", ""]
    assert seconds["newton-ipm", "1%"] == ["0.0200", "0.0600", "", ""]
    assert ratios["newton-ipm", "1%"] == ["2.00", "1.50", "", ""]
    assert away["newton-ipm", "1%"][0] == "0.0010"
    assert seconds["GS, paper", "1%"] == ["0.422", "7.18*", "54.7*", "100*"]
    assert seconds["NLP, paper", "10%"] == ["0.405", "27.0*", "-", "-"]
    assert ratios["SOCP, paper", "1%"] == ["6.35", "4.45", "3.57", "3.08"]


def test_marks_say_how_a_cell_ended(tables):
    seconds, _, away = tables(
        cell("none"),
        cell("gauss-seidel", outcome="violated", max_violation=3e-3, solve_seconds_mean=0.5),
        cell(
            *("ipopt-default",),
            **{"outcome": "no answer", "reason": "time limit", "steps_done": 0},
            solve_seconds_mean=nan,
        ),
    )
    assert seconds["gauss-seidel", "1%"][0] == "0.500*"
    assert away["gauss-seidel", "1%"][0] == "(by 3e-3)"
    assert seconds["ipopt-default", "1%"][0] == "-"


def test_steps_beyond_the_limits_are_starred_though_the_clock_ended_the_cell():
    ended = {"ending": OUT_OF_TIME, "done": 25}
    assert _marked({**ended, "astray": 4}, 0.5) == "0.500* (25)"
    assert _marked({**ended, "astray": 0}, 0.5) == "0.500 (25)"
    assert _marked({"ending": OUT_OF_TIME, "done": 0, "astray": 0}, 0.5) == "-"
    assert _marked({"ending": NO_ANSWER, "done": 11, "astray": 0}, 0.5) == "0.500 (11)"


def test_implicit_euler_is_the_mean_of_its_runs_which_no_limit_changes(tables):
    seconds, ratios, _ = tables(
        cell("none"),
        cell("none", limit=0.1, ie_seconds_mean=0.03),
        cell("newton-ipm", limit=0.1, solve_seconds_mean=0.02),
    )
    assert seconds["implicit Euler", ""][0] == "0.0200"
    assert ratios["newton-ipm", "10%"][0] == "1.00"


@pytest.mark.parametrize(
    "others",
    [
        [cell("clarabel")],
        [cell("none")],
        [cell("none", scenario="flag"), cell("clarabel", scenario="flag")],
        [cell("none", mode="replay"), cell("clarabel", mode="replay")],
        [cell("none"), cell("clarabel", steps_asked=7)],
    ],
)
def test_there_is_none_without_implicit_euler_beside_the_same_scene(tables, others):
    assert tables(*others) == []


def test_the_papers_numbers_are_as_long_as_its_sizes_and_stars_stand_at_numbers():
    assert all(len(values) == len(SIZES) for values in PAPER_SECONDS.values())
    for at, sizes in STARRED.items():
        assert all(PAPER_SECONDS[at][SIZES.index(n)] > 0 for n in sizes)
