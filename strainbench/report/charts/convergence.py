"""What the iterates of each method are worth, and when it had them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from strainbench.bench.ending import GAP, VIOLATION
from strainbench.report.charts.axes import (
    Axis,
    count_tick,
    decades,
    length_tick,
    power_tick,
    time_axis,
)
from strainbench.report.charts.canvas import Spec, about
from strainbench.report.charts.chart import Chart
from strainbench.report.charts.curves import Curve, Curves, point
from strainbench.report.charts.target import Target
from strainbench.report.measures import cause
from strainbench.report.table import UNCONSTRAINED

MARKS = 11  # a line has at most
ABOVE = 10.0  # an axis ends at this many times the candidate's own measure
HEAD = "without a sample:"
SHORTEST = 1e-6  # seconds
CAPTION = """\
One projection. Filled from the first answer on that is optimal by the referee. °: whole runs at
ever tighter tolerances, each with its own seconds and iterations; others: iterates of one run. What
the time limit cut off is no answer, and not drawn. Grey: below the reference's own error; dotted
across: the candidate itself."""


@dataclass(frozen=True)
class Measure:
    """What is measured of an answer; anything below `floor` is drawn there."""

    column: str
    title: str
    floor: float
    known: str = ""


MEASURES = {
    "violation": Measure("max_violation", "largest violation", 1e-10),
    "gap": Measure("relative_gap", "relative gap", 1e-12, "reference_gap"),
    "distance": Measure("distance_mm", "distance to the optimum", 1e-6, "reference_error_mm"),
}
EFFORTS = {"seconds": "time within one projection", "iterations": "iterations"}


def convergence(table: pd.DataFrame, target: Target) -> list[Chart]:
    """A chart a frame, measure and effort.

    Parameters
    ----------
    table : rows of convergence.csv, numbers as numbers, with `distance_mm`
    """
    table = table.assign(reference_error_mm=1000 * table["reference_error"])
    frames = list(table.groupby("problem", sort=False))
    charts = []
    for _, rows in frames:
        more = f"-{rows['frame'].iloc[0]:.0f}" if len(frames) > 1 else ""
        for measure in MEASURES:
            for effort in EFFORTS:
                name = f"convergence-{measure}-{effort}{more}"
                charts += _chart(name, rows, MEASURES[measure], effort, target)
    return charts


def _chart(
    name: str, table: pd.DataFrame, measure: Measure, effort: str, target: Target
) -> list[Chart]:
    """None without a sample."""
    curves = []
    known = table[table[measure.column].notna() & table[effort].notna()]
    for solver, rows in known[known["solver"] != UNCONSTRAINED].groupby("solver", sort=False):
        points = _points(rows, measure, effort)
        curves.append(Curve(about(str(solver)), f"{solver}{_sign(rows)}", points))
    if not curves:
        return []
    start = table[table["solver"] == UNCONSTRAINED].iloc[0]
    title = f"Convergence: {start['scenario']}, projection {start['frame']:.0f}"
    x, y = _axes(curves, measure, effort, start[measure.column], target)
    band = float(start[measure.known]) if measure.known else 0.0
    levels = [(float(start[measure.column]), "the candidate itself")]
    drawn = Curves(
        title,
        x,
        y,
        curves,
        band=band if np.isfinite(band) else 0,
        levels=levels,
        failures=_failures(table, set(known["solver"])),
        head=HEAD,
    )
    return [Chart(name, title, CAPTION.replace("\n", " "), drawn.spec(target))]


def _sign(rows: pd.DataFrame) -> str:
    """° for a method that shows no iterates."""
    return "°" if rows["sampled_by"].iloc[0] == "tolerances" else ""


def _failures(table: pd.DataFrame, drawn: set[str]) -> list[Spec]:
    """Each method without a sample, and why."""
    methods = table[table["solver"] != UNCONSTRAINED].groupby("solver", sort=False)
    return [
        about(str(solver)) | {"text": f"{solver}{_sign(rows)}: {cause(rows['ending'].iloc[0])}"}
        for solver, rows in methods
        if solver not in drawn
    ]


def _axes(
    curves: Sequence[Curve], measure: Measure, effort: str, start: float, target: Target
) -> tuple[Axis, Axis]:
    every = [p for curve in curves for p in curve.points if p]
    efforts, values = ([p[key] for p in every] for key in ("x", "y"))
    most = int(target.sizes.height / 2.2 / target.sizes.text)
    tick = length_tick if measure.column == "distance_mm" else power_tick
    values = [v for v in values if not start > 0 or v <= ABOVE * start]
    y = decades(measure.title, [*values, *([start] if start > 0 else [])], tick, most)
    if effort == "seconds":
        return time_axis(EFFORTS[effort], efforts, target), y
    return decades(EFFORTS[effort], efforts, count_tick), y


def _points(rows: pd.DataFrame, measure: Measure, effort: str) -> list[Spec]:
    """A line's points, MARKS of them marked, evenly along it."""
    optimal = (rows["max_violation"] <= VIOLATION) & (rows["relative_gap"] <= GAP)
    filled = optimal[::-1].cummin()[::-1]
    marked = set(np.linspace(0, len(rows) - 1, min(len(rows), MARKS)).round().astype(int))
    least = SHORTEST if effort == "seconds" else 1
    return [
        point(
            max(float(row[effort]), least),
            max(float(row[measure.column]), measure.floor),
            bool(full),
            marked=k in marked,
        )
        for k, ((_, row), full) in enumerate(zip(rows.iterrows(), filled, strict=True))
    ]
