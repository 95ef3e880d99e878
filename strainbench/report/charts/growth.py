"""How time grows with the size of the problem."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import pandas as pd

from strainbench.report.charts.axes import count_tick, decades, time_axis
from strainbench.report.charts.canvas import Spec, about
from strainbench.report.charts.chart import Chart
from strainbench.report.charts.curves import Curve, Curves, point
from strainbench.report.charts.rail import why_failed
from strainbench.report.charts.target import Target
from strainbench.report.charts.work import FIGURE, labels
from strainbench.report.measures import COUNT, OPTIMAL, duration
from strainbench.report.names import cells, percent
from strainbench.report.rows import Row, rows_of
from strainbench.report.table import UNCONSTRAINED

SCENE = [*FIGURE, "bound", "tolerance"]
HEAD = "violates the limits (by), or out of time (steps done):"
FEWEST = 3  # sizes that make a slope
CAPTION = """\
Time: median over the projections with active constraints. Filled: optimal on every step; hollow:
within the limits, not optimal. Behind the names the slope of the line fitted to all sizes measured;
two points, in brackets, give a hint and no more."""
TOOLTIP = {"name": "method", "mesh": "mesh", "x": "unknowns", "time": "time a projection"}


def growth(runs: pd.DataFrame, target: Target) -> list[Chart]:
    """A chart a scene, setting and limit of which at least two sizes were measured.

    Parameters
    ----------
    runs : as `strainbench.report.measures.measured` returns them
    """
    methods = runs[(runs["solver"] != UNCONSTRAINED) & runs["variables"].notna()]
    methods = methods.assign(label=labels(methods)).sort_values("variables", kind="stable")
    charts: list[Chart] = []
    sizes = methods.groupby(SCENE, dropna=False)["variables"].transform("nunique")
    for _, rows in methods[sizes > 1].groupby(SCENE, sort=False, dropna=False):
        curves, alone = _curves(rows, target)
        if curves:
            number = f"-{len(charts) + 1}" if charts else ""
            charts.append(_chart(rows, curves, alone, f"growth{number}", target))
    return charts


def _curves(rows: pd.DataFrame, target: Target) -> tuple[list[Curve], list[str]]:
    """A line a method with two sizes or more; the names of those with one."""
    found, alone = [], []
    counted = rows[rows["ending"].isin(COUNT) & rows["time"].notna()]
    for solver, cells_ in counted.groupby("solver", sort=False):
        if cells_["variables"].nunique() < 2:
            alone.append(str(solver))
            continue
        points = [_point(run) for run in rows_of(cells_)]
        found.append(
            Curve(about(str(solver)), f"{solver}{slope(points, target is Target.PAGE)}", points)
        )
    return found, alone


def _point(run: Row) -> Spec:
    more = {"cell": run["cell"], "mesh": run["mesh"], "time": duration(run["time"])}
    return point(run["variables"], run["time"], run["ending"] == OPTIMAL, **more)


def slope(points: Sequence[Spec], roomy: bool) -> str:
    """Of log time against log unknowns, after a name: in words, or in brackets where of two."""
    x, y = (np.log([p[key] for p in points]) for key in ("x", "y"))
    fitted = float(np.polyfit(x, y, 1)[0])
    if len(set(x)) < FEWEST:
        return f", {fitted:.1f} (2 points)" if roomy else f" ({fitted:.1f})"
    return f", slope {fitted:.2f}" if roomy else f" {fitted:.2f}"


def _failures(rows: pd.DataFrame) -> Iterator[dict[str, Any]]:
    failed = rows[~rows["ending"].isin(COUNT)]
    for solver, cells_ in failed.groupby("solver", sort=False):
        whys = [f"at {run['mesh']} {why_failed(run)}" for run in rows_of(cells_)]
        yield about(str(solver)) | {"text": f"{solver} {', '.join(whys)}"}


def _chart(
    rows: pd.DataFrame, curves: Sequence[Curve], alone: Sequence[str], name: str, target: Target
) -> Chart:
    run = rows.iloc[0]
    every = [p for curve in curves for p in curve.points if p]
    x = decades("unknowns", [p["x"] for p in every], count_tick)
    y = time_axis("time a projection", [p["y"] for p in every], target)
    limit = f"{percent(run['limit']) or run['bound']} limit" if run["bound"] else ""
    about_ = ", ".join(filter(None, (run["scenario"], limit, run["label"])))
    meshes = ", ".join(dict.fromkeys(cells(mesh) for mesh in rows["mesh"]))
    title = f"How time grows with size: {about_}"
    caption = f"{CAPTION} Sizes: {meshes}.".replace("\n", " ")
    caption += f" Measured at one size only: {', '.join(alone)}." if alone else ""
    failures = list(_failures(rows))
    drawn = Curves(title, x, y, curves, failures=failures, head=HEAD, tooltip=TOOLTIP)
    return Chart(name, title, caption, drawn.spec(target))
