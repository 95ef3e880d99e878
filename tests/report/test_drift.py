"""A cell that is feasible and leaves the closed loop of an optimal one is told so."""

from __future__ import annotations

import pandas as pd

from strainbench.bench.columns import STEP_COLUMNS
from strainbench.report.drift import with_drift

TAME = "feasible, not optimal"


def run(cell, outcome, failure="", step="", **values):
    same = {"mode": "simulate", "scenario": "swing", "scenario_parameters": "{}", "steps_asked": 3}
    found = {"cell": cell, "outcome": outcome, "failure": failure, "failure_step": step}
    return same | found | values


def steps(**heights):
    rows = [
        dict.fromkeys(STEP_COLUMNS, "") | {"cell": cell, "step": str(k), "gravity_energy": str(e)}
        for cell, energies in heights.items()
        for k, e in enumerate(energies, start=1)
    ]
    return pd.DataFrame(rows)


def kinds(runs, rows):
    table = with_drift(pd.DataFrame(runs).replace({"failure_step": {"": float("nan")}}), rows)
    return list(zip(table["failure"], table["failure_step"].fillna(0), strict=True))


HEIGHTS = steps(best=[0, -1, -2], near=[0, -1.05, -2.05], far=[0, -1.05, -2.5])


def test_what_leaves_the_reference_drifts_since_that_step():
    runs = [run("near", "feasible", TAME, 1.0), run("far", "feasible", TAME, 1.0)]
    found = kinds([run("best", "optimal"), *runs], HEIGHTS)
    assert found == [("", 0), (TAME, 1), ("drifts", 3)]


def test_without_a_reference_or_with_a_worse_failure_nothing_is_said():
    tame = run("far", "feasible", TAME, 1.0)
    assert kinds([tame], HEIGHTS) == [(TAME, 1)]
    other = run("best", "optimal", scenario_parameters='{"limit": 1}')
    assert kinds([tame, other], HEIGHTS) == [(TAME, 1), ("", 0)]
    worse = run("far", "violated", "over-stretched", 2.0)
    assert kinds([run("best", "optimal"), worse], HEIGHTS)[1] == ("over-stretched", 2)
