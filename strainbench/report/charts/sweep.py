"""Time, accuracy and true stretch against one setting of a scene."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from strainbench.report.charts.axes import Axis, decades, length_tick, percent_tick, time_tick
from strainbench.report.charts.canvas import Spec, about
from strainbench.report.charts.chart import Chart
from strainbench.report.charts.curves import Curve, Curves, point
from strainbench.report.charts.rail import HEAD, why_failed
from strainbench.report.charts.target import Target
from strainbench.report.measures import COUNT, OPTIMAL, duration
from strainbench.report.names import cells as cells_of
from strainbench.report.names import percent
from strainbench.report.rows import Row, rows_of
from strainbench.report.sweep import beyond, differs, sweeps

SPAN = 8.0  # between the least and the largest value, from which on an axis is logarithmic
CAPTION = """\
Filled: optimal on every step; hollow: within the limits, not optimal. A line is broken where its
method failed, which is named at the top. Times are medians over the projections with active
constraints."""
TOOLTIP = {"name": "method", "shown": "value", "outcome": "outcome", "said": "time a projection"}


USED = [
    *("cell", "scenario", "scenario_parameters", "mode", "tolerance", "steps_asked", "steps_done"),
    *("solver", "mesh", "bound", "limit", "ending", "done", "why", "time"),
    *("distance_max", "max_principal_stretch"),
]
"""Columns that the charts are of: rows of all are slow to take apart."""


@dataclass(frozen=True)
class Measure:
    """What is drawn against the setting; anything below `floor` is drawn there."""

    title: str
    of: Callable[[pd.DataFrame], pd.Series]
    tick: Callable[[float], str]
    floor: float


MEASURES = {
    "time": Measure("time a projection", lambda rows: rows["time"], time_tick, 1e-9),
    "distance": Measure(
        "distance to the optimum", lambda rows: 1000 * rows["distance_max"], length_tick, 1e-6
    ),
    "stretch": Measure(
        "largest stretch beyond the limit", lambda rows: 100 * beyond(rows), percent_tick, 1e-7
    ),
}


def sweep(runs: pd.DataFrame, target: Target) -> dict[str, list[Chart]]:
    """For each setting that takes three values or more, charts of each measure, a line of cells
    that differ in nothing else each.

    Parameters
    ----------
    runs : as `strainbench.report.measures.measured` returns them
    """
    return {key: list(_charts(key, rows, target)) for key, rows in sweeps(runs[USED]).items()}


def _charts(key: str, rows: pd.DataFrame, target: Target) -> Iterator[Chart]:
    for _, line in rows.groupby("line", sort=False):
        number = f"-{line['line'].iloc[0] + 1}" if rows["line"].nunique() > 1 else ""
        title = ", ".join([line["scenario"].iloc[0], *_size(line), *differs(line.iloc[0], rows)])
        for name, measure in MEASURES.items():
            values = measure.of(line).replace(np.inf, np.nan).clip(lower=measure.floor)
            line_ = line.assign(y=values.where(line["ending"].isin(COUNT)))
            if line_["y"].notna().any():
                yield _chart(f"sweep-{key}-{name}{number}", title, key, line_, measure, target)


def _size(line: pd.DataFrame) -> list[str]:
    """Mesh and limit, where there is one."""
    (first, *more), (bound, *bounds) = line["mesh"].unique(), line["bound"].unique()
    return ([] if more else [cells_of(first)]) + ([] if bounds or not bound else [f"{bound} limit"])


def _chart(
    name: str, title: str, key: str, line: pd.DataFrame, measure: Measure, target: Target
) -> Chart:
    curves = [
        Curve(about(solver), solver, points)
        for solver, cells in _by_solver(rows_of(line)).items()
        if any(points := _points(cells))
    ]
    most = int(target.sizes.height / 2.2 / target.sizes.text)
    y = decades(measure.title, line["y"].dropna(), measure.tick, most)
    title = f"{title}: {measure.title} against {key}"
    drawn = Curves(
        title,
        _across(key, line),
        y,
        curves,
        failures=_failures(key, line),
        head=HEAD,
        tooltip=TOOLTIP,
    )
    return Chart(name, title, CAPTION.replace("\n", " "), drawn.spec(target))


def _by_solver(runs: Iterable[Row]) -> dict[str, list[Row]]:
    """In the order in which they come."""
    found: dict[str, list[Row]] = {}
    for run in runs:
        found.setdefault(str(run["solver"]), []).append(run)
    return found


def _points(cells: Iterable[Row]) -> list[Spec | None]:
    """A gap where nothing counts."""
    return [
        None
        if pd.isna(run["y"])
        else point(
            run["value"],
            run["y"],
            run["ending"] == OPTIMAL,
            cell=run["cell"],
            shown=run["shown"],
            outcome=run["ending"],
            said=duration(run["time"]),
        )
        for run in cells
    ]


def _across(key: str, line: pd.DataFrame) -> Axis:
    """The setting's values; words beyond the numbers."""
    values = line.drop_duplicates("value")
    ticks = {
        v: _shown(key, v, str(s)) for v, s in zip(values["value"], values["shown"], strict=True)
    }
    low, high = min(ticks), max(ticks)
    if low > 0 and high > SPAN * low:
        return Axis(key, low / 1.3, high * 1.3, ticks)
    room = 0.08 * (high - low)
    return Axis(key, low - room, high + room, ticks, log=False)


def _shown(key: str, value: float, shown: str) -> str:
    """A limit in per cent."""
    return percent(value) if key == "limit" else shown


def _failures(key: str, line: pd.DataFrame) -> list[dict[str, Any]]:
    failed = line[~line["ending"].isin(COUNT)]
    entries = []
    for solver, cells in _by_solver(rows_of(failed)).items():
        whys = [
            f"at {_shown(key, run['value'], str(run['shown']))}: {why_failed(run)}" for run in cells
        ]
        entries.append(about(solver) | {"text": f"{solver} {', '.join(whys)}"})
    return entries
