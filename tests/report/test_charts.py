"""Charts: everything is drawn or named, nothing overlaps, each is as wide as its place."""

from __future__ import annotations

import random
import re
from itertools import combinations
from pathlib import Path
from xml.etree import ElementTree

import pandas as pd
import pytest
from matplotlib import get_data_path

from strainbench.report import load_runs
from strainbench.report.charts import Chart, Target, draw, work_precision
from strainbench.report.charts.axes import decades, length_tick, time_tick
from strainbench.report.charts.text import Box, Name, place, spread, width, wrapped
from strainbench.report.measures import measured
from strainbench.report.steps import newest_steps

FIELD = Path(__file__).parent / "records/field"


@pytest.fixture(scope="module")
def field():
    runs = load_runs(FIELD)
    return measured(runs, newest_steps(FIELD, runs))


def words(path):
    return " ".join(ElementTree.parse(path).getroot().itertext())


@pytest.mark.parametrize("target", Target)
def test_a_chart_is_as_wide_as_its_place_and_names_every_method(field, tmp_path, target):
    charts = work_precision(field, target)
    assert [c.title for c in charts] == [f"swing, {n}×{n} cells, 1% limit" for n in (20, 40)]
    draw(charts[1], tmp_path / "chart.svg")
    drawn = ElementTree.parse(tmp_path / "chart.svg").getroot()
    assert float(drawn.get("width")) == pytest.approx(target.sizes.width)
    methods = set(field[field["resolution"] == 40]["solver"]) - {"none"}
    text = words(tmp_path / "chart.svg")
    assert all(name in text for name in methods)
    assert "cvxpy 7/8 steps" in text
    assert "ipopt-edges by 3e-2" in text


@pytest.mark.parametrize(("suffix", "start"), [(".pdf", b"%PDF"), (".png", b"\x89PNG")])
def test_a_chart_is_drawn_in_each_form(field, tmp_path, suffix, start):
    path = tmp_path / f"chart{suffix}"
    draw(work_precision(field, Target.PAPER)[0], path)
    assert path.read_bytes().startswith(start)
    if suffix == ".pdf":
        assert b"LiberationSans" in path.read_bytes()


def test_another_form_is_one_clear_line(field, tmp_path):
    with pytest.raises(ValueError, match=r"ends in \.svg, \.pdf, \.png is valid"):
        draw(work_precision(field, Target.PAPER)[0], tmp_path / "chart.gif")


@pytest.mark.parametrize("against", ["distance", "gap", "violation"])
def test_a_failed_cell_is_no_point_and_each_other_one_is(field, against):
    charts = work_precision(field, Target.PAGE, against)
    for chart, (_, rows) in zip(charts, field.groupby("resolution"), strict=True):
        counted = rows[rows["ending"].isin(["optimal", "feasible"])]
        layers = [layer for layer in chart.spec["layer"] if "shape" in layer["encoding"]]
        cells = [row["cell"] for layer in layers for row in layer["data"]["values"]]
        assert sorted(cells) == sorted(counted["cell"])


def test_tolerances_make_a_line_and_not_a_chart_each(field):
    looser = field.assign(tolerance=1e-3, cell=field["cell"] + "x")
    looser["distance_max"] *= 30
    looser["solve_seconds_median"] /= 2
    both = pd.concat([field, looser], ignore_index=True)
    charts = work_precision(both, Target.PAGE)
    assert len(charts) == 2
    assert "tolerance 0.001, 1e-06" in charts[0].caption
    assert any("at 1e-06 by 3e-2" in str(layer["data"]) for layer in charts[0].spec["layer"])


def test_names_do_not_overlap_each_other_or_a_mark():
    random.seed(3)
    plane, size = Box(0, 0, 500, 400), 12
    points = [(random.uniform(0, 500), random.uniform(0, 400)) for _ in range(20)]
    marks = [Box.around(x, y, 4) for x, y in points]
    names = [Name("gauss-seidel"[: 4 + k % 8], x, y) for k, (x, y) in enumerate(points)]
    placed = place(names, marks, plane, size, 4)
    for one, other in combinations([p.box for p in placed], 2):
        assert one.shared(other) == 0
    for p in placed:
        assert p.box.beyond(plane) == pytest.approx(0)
        assert all(p.box.shared(mark) == 0 for mark in marks)


def test_spread_names_keep_their_order_and_their_distance():
    found = spread([5.0, 5.0, 90.0, 4.0], [10] * 4, 0, 100)
    assert sorted(found) == pytest.approx([found[3], found[0], found[1], 90.0])
    assert min(found) >= 5
    assert found[1] - found[0] == pytest.approx(10)


def test_text_is_as_wide_as_helvetica_sets_it():
    metrics = Path(get_data_path(), "fonts/pdfcorefonts/Helvetica.afm").read_text()
    known = dict(re.findall(r"C (\d+) ; WX (\d+)", metrics))
    for code in range(32, 127):
        close = {39: 191, 96: 333}  # there curly quotes
        wide = close.get(code, int(known[str(code)]))
        assert width(chr(code), 1000) == wide, chr(code)
    assert wrapped("one two three", width("one two", 10), 10) == ["one two", "three"]


def test_ticks_have_units():
    axis = decades("t", [2e-5, 3.0], time_tick)
    assert list(axis.ticks.values()) == ["100 µs", "1 ms", "10 ms", "100 ms", "1 s"]
    assert [length_tick(10.0**k) for k in (-6, -4, -3, -1, 0, 1, 2)] == [
        *("1 nm", "0.1 µm", "1 µm", "0.1 mm", "1 mm", "1 cm", "10 cm")
    ]


def test_control_characters_in_a_name_do_not_end_the_process(tmp_path):
    mark = {"mark": "text", "data": {"values": [{"name": "a\x00\x1b[31m  b\u202e"}]}}
    encoding = {"text": {"field": "name", "type": "nominal"}}
    draw(Chart("c", "", "", {**mark, "encoding": encoding}), tmp_path / "c.svg")
    assert "a" in words(tmp_path / "c.svg")
