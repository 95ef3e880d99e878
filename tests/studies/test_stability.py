"""The verb map runs cells along boundaries, resumes, and says the boundary in words."""

from __future__ import annotations

import csv
import re
from math import nan

import pytest

from strainbench.bench.columns import RUN_COLUMNS
from strainbench.bench.records import RUNS, STEPS, read_rows
from strainbench.cli.stability import parse_budget
from strainbench.report.freshness import age
from strainbench.studies.stability.axis import Axis
from strainbench.studies.stability.measure import Map, Spot
from strainbench.studies.stability.report import sentences
from tests.cli.test_cli import strainbench

GENTLE = """
from dataclasses import dataclass
from strainbench import Solution, Solver

@dataclass(frozen=True)
class Gentle(Solver):
    '''Answers the target below a limit of 5%, and nothing above (nobody).'''
    name = "gentle"

    def solve(self, problem, state, *, tolerance, monitor, deadline):
        x = problem.target.copy()
        return Solution(x * (float("nan") if problem.bounds.max() < 1.05 else 1), "solved", 0)
"""


@pytest.mark.slow
def test_a_map_is_made_and_goes_on(tmp_path):
    (tmp_path / "gentle.py").write_text(GENTLE)
    words = ["map", "stretch-square", "--solver", "./gentle.py", "--results", "out"]
    words += ["--x", "limit=2%..10%", "--y", "directions=2,4", "--steps", "1"]
    words += ["--set", "resolution=2", "--set", "scale_x=1", "--set", "scale_y=1"]
    out = strainbench(*words, cwd=tmp_path).stdout
    assert re.search(r"gentle holds from limit [56][.\d]*% on \(fails at [34][.\d]*%\)", out)
    rows = read_rows(tmp_path / "out" / RUNS, RUN_COLUMNS)
    with (tmp_path / "out" / "map.csv").open() as file:
        spots = list(csv.DictReader(file))
    assert {s["cell"] for s in spots} == {r["cell"] for r in rows}
    assert {s["outcome"] for s in spots} == {"optimal", "no answer"}
    assert 6 <= len(rows) <= 2 * 8
    told = (tmp_path / "out" / "map.md").read_text()
    assert "(✓)" in told
    shares = re.search(r"^\| gentle \| (\d+) \| (\d+) \|$", told, re.MULTILINE)
    assert shares
    assert abs(int(shares[1]) + int(shares[2]) - 100) <= 1
    assert (tmp_path / "out" / "map.png").read_bytes()[1:4] == b"PNG"
    assert (tmp_path / "out" / "map-gentle.pdf").read_bytes()[:4] == b"%PDF"
    whole = (tmp_path / "out" / "map.csv").read_bytes()
    for budget in ("20min", "0.001s"):  # what is there costs none
        again = strainbench(*words, "--budget", budget, cwd=tmp_path).stdout
        assert len(read_rows(tmp_path / "out" / RUNS, RUN_COLUMNS)) == len(rows)
        assert "gentle holds from limit" in again
        assert (tmp_path / "out" / "map.csv").read_bytes() == whole
    assert age(tmp_path / "out") == []
    for table in (RUNS, STEPS):
        (tmp_path / "out" / table).unlink()
    assert age(tmp_path / "out") == []


def spot(ending):
    return Spot("", ending, "", "", None, nan, 0.0, nan)


def test_a_level_that_was_only_touched_says_nothing():
    """Of what lies between the corners of a block; at a change it says between which cells."""
    axes = [Axis(key, tuple(map(str, range(5))), tuple(map(str, range(5)))) for key in "xy"]
    corners = {(i, j): spot("optimal" if i else "violated") for i in (0, 4) for j in (0, 4)}
    found = Map(*axes, {"a": corners | {(2, 2): spot("optimal")}}, open=1)
    assert sentences(found, "a") == ["So far: a holds from x 4 on (fails at 0) at y 0 to 4."]
    found.spots["a"] |= {(0, 2): spot("violated")}
    assert "So far: a holds from x 2 on (fails at 0) at y 2." in sentences(found, "a")


@pytest.mark.parametrize(("text", "seconds"), [("90s", 90), ("20min", 1200), ("1.5h", 5400)])
def test_budgets(text, seconds):
    assert parse_budget(text) == seconds


@pytest.mark.parametrize("text", ["", "20", "0s", "min", "-1s", "1d", "nan s"])
def test_budgets_that_are_none(text):
    with pytest.raises(ValueError, match=r"^--budget .* is valid"):
        parse_budget(text)
