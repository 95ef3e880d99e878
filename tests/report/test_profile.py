"""Performance profiles, scores and growth from the committed field, and from numbers known."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from strainbench.report import load_runs
from strainbench.report.charts import Target, energy, growth, profiles, scores
from strainbench.report.charts.growth import slope
from strainbench.report.charts.profile import cases, paired, shifted_mean
from strainbench.report.identity import integrator_look
from strainbench.report.measures import measured
from strainbench.report.steps import newest_steps

RESULTS = Path(__file__).parents[2] / "results"
FIELD = Path(__file__).parent / "records/field"


@pytest.fixture(scope="module")
def field():
    runs = load_runs(FIELD)
    steps = newest_steps(FIELD, runs)
    return measured(runs, steps), steps


def test_a_projection_cut_off_or_not_optimal_is_unsolved(field):
    (found,) = cases(*field)
    assert found.said == "14 projections"
    solved = np.isfinite(found.seconds).sum()
    expected = {"newton-ipm": 14, "clarabel": 14, "cvxpy": 13, "gauss-seidel": 0}
    assert {name: solved[name] for name in expected} == expected
    assert found.ratios.min().min() == 1.0


def test_the_profile_names_who_never_solved_and_ends_at_its_share(field):
    (chart,) = profiles(*field, Target.PAPER)
    assert "gauss-seidel" in chart.caption
    assert "14 projections" in chart.caption
    lines = next(x["data"]["values"] for x in chart.spec["layer"] if x["mark"]["type"] == "line")
    ends = {row["name"]: row["y"] for row in lines}
    assert ends["newton-ipm"] == pytest.approx(100)
    assert ends["cvxpy"] == pytest.approx(100 * 13 / 14)


def test_a_method_that_missed_a_cell_is_left_out_by_name(field):
    runs, steps = field
    fewer = runs[~((runs["solver"] == "qoco") & (runs["resolution"] == 40))]
    (chart,) = profiles(fewer, steps, Target.PAGE)
    assert "Left out, as not run on every cell: qoco." in chart.caption


def test_one_method_has_no_profile(field):
    runs, steps = field
    assert profiles(runs[runs["solver"] == "clarabel"], steps, Target.PAGE) == []
    assert scores(runs[runs["solver"] == "clarabel"], steps) == []


def test_scores_show_what_depends_on_the_shift(field):
    (table,) = scores(*field)
    assert table.lines[0][:5] == ["newton-ipm", 100.0, 1.0, 1.0, 1.0]
    last = table.lines[-1]
    assert last[1] == 0
    assert last[2:] == [None] * 5
    by_name = {line[0]: line for line in table.lines}
    assert by_name["cvxpy"][6] == 13  # pairs


def test_means_and_pairs_of_known_numbers():
    seconds = pd.DataFrame({"a": [1.0, 4.0], "b": [3.0, 3.0]})
    assert shifted_mean(seconds, 0.0).tolist() == pytest.approx([2.0, 3.0])
    assert shifted_mean(seconds, 2.0)["a"] == pytest.approx(18**0.5 - 2)
    assert paired(seconds["b"], seconds["a"]) == (pytest.approx(1.5), 2)
    assert paired(seconds["b"], pd.Series([np.inf, 1.5])) == (pytest.approx(2.0), 1)
    assert paired(seconds["b"], pd.Series([np.inf, np.inf])) == (None, 0)


def test_growth_names_failures_and_methods_of_one_size(field):
    (chart,) = growth(field[0], Target.PAGE)
    assert "Measured at one size only: cvxpy," in chart.caption
    texts = [r.get("text", "") for layer in chart.spec["layer"] for r in layer["data"]["values"]]
    assert "cvxpy at 40×40 7/8 steps" in texts
    assert "newton-ipm, 1.2 (2 points)" in texts


def test_a_slope_needs_three_sizes():
    points = [{"x": 10.0**k, "y": 1e-3 * 10 ** (1.5 * k)} for k in (2, 3, 4)]
    assert slope(points, roomy=True) == ", slope 1.50"
    assert slope(points[:2], roomy=False) == " (1.5)"


def test_an_integrator_has_one_colour_and_what_blows_up_is_named():
    folder = RESULTS / "fig4"
    (chart,) = energy(folder, load_runs(folder), Target.PAPER)
    rows = [row for layer in chart.spec["layer"] for row in layer["data"]["values"]]
    text = " ".join(row["text"].replace("\u00a0", " ") for row in rows if "text" in row)
    assert "BAR, dt = 10 ms: blows up at 0.27 s" in text
    lines = next(x["data"]["values"] for x in chart.spec["layer"] if x["mark"]["type"] == "line")
    colours = {row["line"].split(",")[0]: row["colour"] for row in lines}
    assert colours["BAP"] == integrator_look("bap").colour
    assert colours["BAR-STABLE"] == integrator_look("bar-stable").colour
