"""A map of one method, as a chart: a colour and a sign an outcome, run and inferred cells apart."""

from __future__ import annotations

from typing import Any

from strainbench.report.charts import Chart, Target
from strainbench.report.charts.canvas import CROSS, INK, SCHEMA, SOFT
from strainbench.report.charts.text import FONT
from strainbench.report.measures import (
    FEASIBLE,
    NO_ANSWER,
    OPTIMAL,
    OUT_OF_TIME,
    VIOLATED,
    duration,
)
from strainbench.studies.stability.measure import Map

FILLS = {
    OPTIMAL: "#17604F",
    FEASIBLE: "#F2D492",
    VIOLATED: "#FFFFFF",
    OUT_OF_TIME: "#E8EAED",
    NO_ANSWER: "#BDC1C6",
}
FAILS = "#A8281B"
INFERRED = 0.45  # opacity
LARGEST = 42.0  # pixels of a cell
CAPTION = (
    "Dark: optimal on every step. Light: within the limits, not optimal. Crossed: limits violated; "
    "pale grey: out of time; grey: no answer. Faint cells were not run: those around them agree."
)


def map_chart(found: Map, method: str, target: Target) -> Chart:
    """The chart of one method."""
    sizes, (columns, rows) = target.sizes, found.shape
    cell = min(LARGEST, (sizes.width - sizes.left) / columns)
    axis = {"labelFontSize": sizes.text, "titleFontSize": sizes.title, "labelOverlap": "greedy"}
    axis |= {"labelFont": FONT, "titleFont": FONT, "ticks": False, "domain": False}
    x: dict[str, Any] = {"field": "x", "type": "ordinal", "scale": {"domain": found.x.shown}}
    y: dict[str, Any] = {"field": "y", "type": "ordinal", "scale": {"domain": found.y.shown[::-1]}}
    x["axis"] = axis | {"title": found.x.title, "labelAngle": -45}
    y["axis"] = axis | {"title": found.y.title}
    colours = {"domain": list(FILLS), "range": list(FILLS.values())}
    mark = {"type": "rect", "stroke": "#DADCE0", "strokeWidth": 0.5, "tooltip": {"content": "data"}}
    run = {"condition": {"test": "datum.run", "value": 1}, "value": INFERRED}
    fill = {"field": "ending", "type": "nominal", "scale": colours, "legend": None}
    crosses = {"type": "point", "shape": CROSS, "stroke": FAILS, "size": 0.25 * cell * cell}
    spec = {
        "$schema": SCHEMA,
        "title": {"text": method, "font": FONT, "fontSize": sizes.title, "color": INK},
        "width": cell * columns,
        "height": cell * rows,
        "background": "white",
        "config": {"axis": {"labelColor": SOFT, "titleColor": INK}, "view": {"stroke": None}},
        "data": {"values": _values(found, method)},
        "layer": [
            {"mark": mark, "encoding": {"x": x, "y": y, "fill": fill, "opacity": run}},
            {
                "transform": [{"filter": f"datum.ending === '{VIOLATED}'"}],
                "mark": crosses,
                "encoding": {"x": x, "y": y, "opacity": run},
            },
        ],
    }
    name = f"map-{method}"
    return Chart(name, f"{method}: outcomes over {found.x.key} and {found.y.key}", CAPTION, spec)


def _values(found: Map, method: str) -> list[dict[str, object]]:
    spots = found.spots[method]
    values = []
    for (i, j), ending in sorted(found.endings(method).items()):
        spot = spots.get((i, j))
        value: dict[str, object] = {
            "x": found.x.shown[i],
            "y": found.y.shown[j],
            "ending": ending,
            "run": spot is not None,
        }
        if spot:
            time = duration(spot.seconds) if spot.seconds == spot.seconds else ""
            value |= {"time": time, "why": spot.why, "failure": spot.failure}
            value |= {"fails in step": spot.step, "cell": spot.cell}
        values.append(value)
    return values
