"""Closed loops beside the step that is constrained whole."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from scenarios.swing import Swing
from strainbench.bench.plan import plan
from strainbench.cli.studies import as_decimals
from strainbench.report.charts import Target
from strainbench.studies.step import measure, tables, write_distances
from strainbench.studies.step.measure import (
    Distance,
    Motion,
    certifier,
    play,
    reference_of,
    residuals,
)
from strainbench.studies.step.report import charts, distances, order


def cells(scene="swing", solvers=("newton-ipm",), *settings, duration=0.3):
    words = ["resolution=4", *settings]
    return plan([scene], list(solvers), words, "simulate", None, [1e-6], None, duration)


@pytest.fixture(scope="module")
def rows():
    asked = "norm=mass,unweighted", "step=0.0333333333,0.0166666667"
    return list(measure(cells("swing", ["newton-ipm", "gauss-seidel"], *asked)))


def by(rows, solver, norm):
    return [r.largest_mm for r in sorted(rows, key=lambda r: -r.step) if same(r, solver, norm)]


def same(row, solver, norm):
    return (row.solver, row.norm) == (solver, norm)


@pytest.mark.parametrize("solver", ["newton-ipm", "gauss-seidel"])
def test_in_the_mass_norm_loops_approach_the_constrained_motion(rows, solver):
    first, second = by(rows, solver, "mass")
    assert second < 0.7 * first


@pytest.mark.parametrize("solver", ["newton-ipm", "gauss-seidel"])
def test_in_the_norm_as_printed_they_do_not(rows, solver):
    first, second = by(rows, solver, "unweighted")
    assert second > 0.9 * first
    assert second > 4 * by(rows, solver, "mass")[1]


def test_the_reference_is_certified_from_positions_alone(rows):
    assert max(row.reference_residual for row in rows) < 1e-3
    assert min(row.step_residual for row in rows) > 0.03


def test_a_residual_is_small_at_a_constrained_step_and_not_beside_it():
    scene = reference_of(Swing(resolution=4))
    motion = play(scene, "none", cells()[0])
    residual = certifier(scene)
    before, last, x = motion.positions[-3:]
    assert residual(0.3, before, last, x) < 1e-3
    off = x.copy()
    off[7] += [0.0, 1e-3, 0.0]
    assert residual(0.3, before, last, off) > 0.05


def test_of_a_motion_that_has_hardly_begun_there_is_no_residual():
    scene = Swing(resolution=3)
    assert residuals(scene, Motion([scene.sheet()[2]])) == []


def test_the_distance_grows_from_the_first_step(rows):
    for row in rows:
        assert row.steps == len(row.over_time) == round(0.3 / row.step)
        assert max(row.over_time) == row.largest_mm >= row.mean_mm
        assert row.over_time[-1] == row.last_mm


def made(step, largest, note=""):
    values = {"steps": 3, "mean_mm": largest / 2, "last_mm": largest, "note": note}
    about = {"scene": "s", "solver": "none", "norm": "mass", "integrator": "sap"}
    residual = {"step_residual": 0.1, "reference_residual": 1e-7}
    return Distance(**about, **residual, step=step, largest_mm=largest, **values)


def test_an_order_is_a_slope():
    halves = {h: made(h, 1000 * h) for h in (0.1, 0.05, 0.025)}
    assert order(halves) == pytest.approx(1)
    assert order({h: halves[h] for h in (0.1, 0.05)}) is None
    assert order(halves | {0.1: made(0.1, 5.0, "no answer")}) is None


def test_what_ended_a_motion_is_a_note():
    table = distances("s", [made(1 / 60, 1.0, "the solver ended it in step 4: tired")])
    assert table.notes == ["none [mass], step 1/60 s: the solver ended it in step 4: tired"]


def test_tables_charts_and_csv_are_written(rows, tmp_path):
    paths = write_distances(rows, "strainbench step", tmp_path)
    assert [p.name for p in paths] == ["step.md", "step.csv", "times.csv", "step.svg"]
    text = paths[0].read_text()
    assert "1/30 s [mm]" in text
    assert "strainbench step" in text
    table = pd.read_csv(paths[1])
    assert list(table["solver"]) == [row.solver for row in rows]
    times = pd.read_csv(paths[2])
    finest = [row for row in rows if row.step < 0.02]
    assert len(times) == sum(len(row.over_time) for row in finest)
    longest = times.groupby("method")["distance_mm"].max()
    assert np.sort(longest) == pytest.approx(np.sort([r.largest_mm for r in finest]), abs=1e-4)
    assert paths[3].read_text().startswith("<svg")
    assert len(tables(rows)) == 2


def test_all_points_are_in_the_chart(rows):
    against_steps, over_time = charts(rows, Target.PAGE)
    assert {round(x) for x in drawn(against_steps)} == {30, 60}
    assert max(drawn(over_time)) == pytest.approx(0.3)


def drawn(chart):
    """x of all points."""
    layers = (layer["data"]["values"] for layer in chart.spec["layer"])
    return [value["x"] for values in layers for value in values if "part" in value]


@pytest.mark.parametrize(
    ("asked", "reason"),
    [
        (("stretch-square", ["newton-ipm"]), "--duration|no time"),
        (("swing", ["none"], "directions=exact"), "integrator constrained: directions exact"),
    ],
)
def test_what_cannot_be_compared_is_one_line(asked, reason):
    with pytest.raises(ValueError, match=reason):
        list(measure(cells(*asked)))


def test_fractions_are_steps_too():
    assert as_decimals("step=1/4,0.5,1/8") == "step=0.25,0.5,0.125"
    assert as_decimals("curve_file=./a/1/2.csv") == "curve_file=./a/1/2.csv"
    assert as_decimals("step=1/0") == "step=1/0"
