"""Answers under lower bounds, beside each other by their objectives; those that violate apart."""

from __future__ import annotations

import json

import pandas as pd
import pytest

from strainbench.bench.columns import STEP_COLUMNS
from strainbench.document.writers import markdown
from strainbench.report import local

BEST = 2.0


def run(solver, **values):
    same = {"scenario": "square", "scenario_parameters": "{}", "scenario_source": "", "mesh": "6×6"}
    same |= {"mode": "replay", "steps_asked": 2, "violation_threshold": 1e-6}
    return same | {"bound": "1%", "apart": "", "cell": solver, "solver": solver} | values


def steps(solver, objectives, violation=0.0, **details):
    details = json.dumps({"kkt_residual": 1e-7, "best_known": BEST} | details)
    return [
        dict.fromkeys(STEP_COLUMNS, "")
        | {"cell": solver, "objective": f, "max_violation": violation, "iterations": 3}
        | {"details": details}
        for f in objectives
    ]


def lines(monkeypatch, runs, rows):
    frame = pd.DataFrame(rows).astype(str)
    monkeypatch.setattr(local, "newest_steps", lambda folder, runs: frame)
    return local.local_table(None, pd.DataFrame(runs))


def test_objectives_are_set_beside_the_least_that_is_known(monkeypatch):
    runs = [run("wild"), run("good"), run("saddle")]
    rows = [*steps("wild", [1.0, 1.0], 0.5), *steps("good", [2.2, 2.2], best_known=2.2)]
    table = lines(monkeypatch, runs, [*rows, *steps("saddle", [3.0, 3.0], kkt_residual=1e-5)])
    assert [line[1] for line in table.lines] == ["good", "saddle", "wild"]
    assert [line[3] for line in table.lines[:2]] == [pytest.approx(0.1), pytest.approx(0.5)]
    assert [line[4] for line in table.lines] == [1e-7, 1e-5, 1e-7]
    assert "(2.000000e+00) |  |" in markdown(table)


def test_other_candidates_or_fewer_of_them_are_not_compared(monkeypatch):
    rows = [*steps("one", [2.0, 2.0]), *steps("two", [2.0])]
    table = lines(monkeypatch, [run("one"), run("two")], rows)
    assert pd.isna([line[3] for line in table.lines]).tolist() == [True, False]
    loops = [run(name, mode="simulate") for name in ("one", "two")]
    assert pd.isna([line[3] for line in lines(monkeypatch, loops, rows).lines]).all()


def test_certified_answers_are_none_of_these(monkeypatch):
    rows = [{**step, "details": ""} for step in steps("one", [2.0])]
    assert not lines(monkeypatch, [run("one")], rows).lines
