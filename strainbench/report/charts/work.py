"""Work against precision: the time of a projection, and what is certified of its answer."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import isfinite
from typing import Any

import pandas as pd

from strainbench.bench.mode import replays
from strainbench.report.charts.axes import Axis, decades, length_tick, power_tick, time_axis
from strainbench.report.charts.bands import QUESTION, name_band, question, unknown_band
from strainbench.report.charts.canvas import SOFT, Plane, about, raw
from strainbench.report.charts.chart import Chart
from strainbench.report.charts.rail import HEAD, draw_rail, rail_height, why_failed
from strainbench.report.charts.target import Target
from strainbench.report.charts.text import Box, Name, Placed, place
from strainbench.report.measures import COUNT, OPTIMAL, duration, length
from strainbench.report.names import CURVE_FILE, MESH_FILE, SPANNED, apart, cells, digits_of, played
from strainbench.report.numbers import power
from strainbench.report.rows import Row, rows_of
from strainbench.report.table import UNCONSTRAINED

FIGURE = ["scenario", "mode", "exact", "steps_asked", "threads"]
"""What the panels of a figure share; they have their axes in common."""
PANEL = ["mesh", "bound"]
USED = [
    *(*FIGURE, *PANEL, "cell", "solver", "tolerance", "limit", "resolution", "setting"),
    *("ending", "done", "why", "time", "time_low", "time_high"),
    *("distance_bound_max", "max_violation", "reference_error_max"),
]
FLOOR = 1e-9
"""Less, in mm or relative, is drawn at the lower edge, with an arrow and its value."""


@dataclass(frozen=True)
class Accuracy:
    """A measure of what an answer is worth, the less the better.

    Parameters
    ----------
    column, scale : in runs.csv, and what it is multiplied by
    """

    title: str
    column: str
    scale: float = 1.0

    def of(self, runs: pd.DataFrame) -> pd.Series:
        """Of each run."""
        return self.scale * runs[self.column]

    def text(self, value: float) -> str:
        """With its unit."""
        return power(value) if self.scale == 1.0 else length(value)


ACCURACIES = {
    "distance": Accuracy("distance to the optimum, worst step", "distance_max", 1000.0),
    "gap": Accuracy("relative gap, worst step", "relative_gap_max"),
    "violation": Accuracy("largest violation, worst step", "max_violation"),
}
CAPTION = """\
Time: median over the projections with active constraints, bars from the first to the third
quartile. Filled: optimal on every step; hollow: within the limits, not optimal. Stair: what no
method beats in both. Grey: below the largest error of the references."""
EMPTY = ("no method has an answer that counts", "no certified optimum to measure from")


def work_precision(runs: pd.DataFrame, target: Target, against: str = "distance") -> list[Chart]:
    """A chart a scene, setting, mesh and limit: a line a method over its tolerances.

    Parameters
    ----------
    runs : as `strainbench.report.measures.measured` returns them
    against : one of ACCURACIES
    """
    accuracy = ACCURACIES[against]
    methods = runs[runs["solver"] != UNCONSTRAINED]
    named = {"accuracy": accuracy.of(methods), "label": labels(methods)}
    methods = methods[USED].assign(**named)
    replays_first = methods.sort_values("mode", key=lambda m: ~m.map(replays), kind="stable")
    charts: list[Chart] = []
    stem = "speed-accuracy" if against == "distance" else f"speed-{against}"
    figures = replays_first.groupby(FIGURE, sort=False, dropna=False)
    for k, (_, figure) in enumerate(figures, start=1):
        together = f"{stem}-{k}" if k > 1 else stem
        panels = _panels(figure, target, accuracy)
        tallest = max(panel.rail() for panel in panels)
        for panel in panels:
            number = f"-{len(charts) + 1}" if charts else ""
            rail = tallest if target is Target.PAGE else panel.rail()
            charts.append(panel.chart(stem + number, together, rail))
    return charts


def labels(runs: pd.DataFrame) -> list[str]:
    """What sets a scene's settings, mode and threads apart from those of the others."""
    settings = apart(runs, {*SPANNED, MESH_FILE, CURVE_FILE}, {"steps_asked": "{:.0f} steps"})
    several = [name for name in ("mode", "threads") if runs[name].nunique() > 1]
    words = {"mode": "{}", "threads": "{:.0f} threads"}
    more = runs[several].to_dict("records")
    return [
        ", ".join(filter(None, [text, *(words[n].format(run[n]) for n in several)]))
        for text, run in zip(settings, more, strict=True)
    ]


@dataclass(frozen=True)
class Panel:
    """The cells of one mesh and limit, as records; `rail` is that of all panels beside it."""

    runs: Sequence[Row]
    target: Target
    accuracy: Accuracy
    x: Axis
    y: Axis

    @property
    def title(self) -> str:
        """Scene, mesh, limit, and what else sets it apart."""
        run = self.runs[0]
        limit = f"{run['bound']} limit" if run["bound"] else ""
        return ", ".join(filter(None, (run["scenario"], cells(run["mesh"]), limit, run["label"])))

    @cached_property
    def counted(self) -> list[Row]:
        """Cells with a point, those that did not know their accuracy left out."""
        kept = [run for run in self.runs if run["ending"] in COUNT]
        return [run for run in kept if run["time"] == run["time"] and isfinite(run["accuracy"])]

    @cached_property
    def failures(self) -> list[dict[str, Any]]:
        """What stands in the rail: each method that failed, where it did, why."""
        failed: dict[str, list[Row]] = {}
        for run in self.runs:
            if run["ending"] not in COUNT:
                failed.setdefault(run["solver"], []).append(run)
        several = len({run["tolerance"] for run in self.runs}) > 1
        entries = []
        for solver, rows in failed.items():
            text = f"{solver} {', '.join(_why(run, several) for run in rows)}"
            entries.append(about(solver) | {"text": text, "cell": rows[0]["cell"]})
        return entries

    def rail(self) -> float:
        """How high its rail is."""
        return rail_height(self.failures, HEAD, self.target)

    def chart(self, name: str, figure: str, rail: float) -> Chart:
        """All of it."""
        empty = not self.counted
        y = replace(self.y, title="", ticks={}) if empty else self.y
        height = 3 * self.target.sizes.text if empty else 0.0
        plane = Plane(self.target, self.title, self.x, y, rail=rail, height=height)
        if empty:
            said = EMPTY[any(run["ending"] in COUNT for run in self.runs)]
            middle = {"px": plane.width / 2, "py": height / 2, "ink": SOFT, "text": said}
            plane.texts([middle], "center")
        if self.target.interactive:
            question(plane)
        errors = (run["reference_error_max"] for run in self.runs)
        band = unknown_band(plane, errors) if self.accuracy.scale != 1.0 else 0.0
        draw_rail(plane, self.failures, HEAD)
        self._draw_points(plane, band)
        params = [{"name": QUESTION, "value": None}] if self.target.interactive else []
        return Chart(name, self.title, self._caption(), plane.spec(params), figure)

    def _draw_points(self, plane: Plane, band: float) -> None:
        points = [_point(run, self.accuracy, self.y.low) for run in self.counted]
        points.sort(key=lambda p: (p["seconds"], p["value"]))
        stair = plane.stair(front(points))
        channels = plane.channels("seconds", "value")
        of_method = {"stroke": raw("colour"), **plane.dimmed()}
        if self.target.interactive:
            of_method["tooltip"] = TOOLTIP
        ends = channels | {"x": channels["x"] | {"field": "low"}, "x2": {"field": "high"}}
        line = {"type": "line", "strokeWidth": self.target.sizes.line}
        order = {"order": {"field": "tolerance", "type": "quantitative"}}
        dash = {"strokeDash": raw("dash"), "detail": {"field": "name"}}
        plane.add(line, points, {**channels, **of_method, **dash, **order})
        plane.add({"type": "rule"}, points, {**ends, **of_method})
        mark = {"type": "point", "size": self.target.sizes.mark, "opacity": 1}
        look = {"shape": raw("shape"), "fill": raw("fill")}
        plane.add(mark, points, {**channels, **of_method, **look})
        taken = [*stair, *covered(plane, points)]
        if band:
            taken += name_band(plane, band, taken)
        plane.names(place_names(plane, points, taken))

    def _caption(self) -> str:
        run, several = self.runs[0], {run["tolerance"] for run in self.runs}
        precision = digits_of(several)
        tolerances = ", ".join(f"{t:.{precision}g}" for t in sorted(several, reverse=True))
        said = f"{played(run).capitalize()}, tolerance {tolerances}"
        more = [run["setting"]] if run["setting"] else []
        kept = [run for run in self.runs if run["ending"] in COUNT]
        lost = dict.fromkeys(run["solver"] for run in kept if run not in self.counted)
        if lost:
            more.append(f"not drawn, as nothing is known of time or accuracy: {', '.join(lost)}")
        return f"{CAPTION} {'; '.join([said, *more])}.".replace("\n", " ")


TOOLTIP = [
    {"field": key, "type": "nominal", "title": title}
    for key, title in {
        "name": "method",
        "outcome": "outcome",
        "time": "time a projection",
        "quartiles": "quartiles",
        "accuracy": "accuracy",
        "certified": "certified at most",
        "violation": "violation",
        "at": "tolerance",
    }.items()
]


def _why(run: Row, several: bool) -> str:
    """In the rail, beside the name."""
    why = why_failed(run)
    return f"at {run['tolerance']:g} {why}" if several else why


def _point(run: Row, accuracy: Accuracy, lowest: float) -> dict[str, Any]:
    """A cell's point, with all that hovering shows."""
    found = about(run["solver"])
    value = float(run["accuracy"])
    return found | {
        "cell": run["cell"],
        "tolerance": -run["tolerance"],
        "seconds": run["time"],
        "low": run["time_low"],
        "high": run["time_high"],
        "value": max(value, lowest),
        "below": accuracy.text(value) if value < lowest else "",
        "fill": found["colour"] if run["ending"] == OPTIMAL else "#FFFFFF",
        "outcome": run["ending"],
        "time": duration(run["time"]),
        "quartiles": f"{duration(run['time_low'])} to {duration(run['time_high'])}",
        "accuracy": accuracy.text(value),
        "certified": length(1000 * run["distance_bound_max"]),
        "violation": power(run["max_violation"]),
        "at": f"{run['tolerance']:g}",
    }


def front(points: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """Of points in the order of their times, those that no other beats in both."""
    kept: list[dict[str, Any]] = []
    for point in points:
        if not kept or point["value"] < kept[-1]["value"]:
            kept.append(point)
    return kept


def covered(plane: Plane, points: Sequence[dict[str, Any]]) -> list[Box]:
    """By marks and bars."""
    half, boxes = plane.target.sizes.mark**0.5 / 2, []
    for p in points:
        x, y = plane.pixel(p["seconds"], p["value"])
        left, _ = plane.pixel(p["low"], p["value"])
        right, _ = plane.pixel(p["high"], p["value"])
        boxes += [Box.around(x, y, half), Box(left, y - 1, right, y + 1)]
    return boxes


def place_names(
    plane: Plane, points: Sequence[dict[str, Any]], taken: Iterable[Box]
) -> list[Placed]:
    """A name a method, beside its most accurate point, clear of what is there."""
    half = plane.target.sizes.mark**0.5 / 2
    named: dict[str, dict[str, Any]] = {}
    for p in sorted(points, key=lambda p: -p["value"]):
        named[p["name"]] = p
    names = [
        Name(name, *plane.pixel(p["seconds"], p["value"]), f" ↓ {p['below']}" if p["below"] else "")
        for name, p in named.items()
    ]
    return place(names, taken, plane.box, plane.target.sizes.text, half)


def _panels(figure: pd.DataFrame, target: Target, accuracy: Accuracy) -> list[Panel]:
    """Those of one figure, with the same axes."""
    counted = figure[figure["ending"].isin(COUNT)]
    times = [v for name in ("time", "time_low", "time_high") for v in counted[name]]
    x = time_axis("time a projection, median and quartiles", times, target)
    values = [v for v in counted["accuracy"] if v > FLOOR]
    tick = power_tick if accuracy.scale == 1.0 else length_tick
    if accuracy.scale != 1.0:
        values += [1000 * v for v in figure["reference_error_max"] if v > 0]
    y = decades(accuracy.title, values, tick, int(target.sizes.height / 2.2 / target.sizes.text))
    groups: dict[tuple[object, ...], list[Row]] = {}
    for row in rows_of(figure.sort_values(["limit", "resolution", "mesh"], kind="stable")):
        groups.setdefault(tuple(row[name] for name in PANEL), []).append(row)
    return [Panel(rows, target, accuracy, x, y) for rows in groups.values()]
