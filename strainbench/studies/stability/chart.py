"""A map of one method, as a chart: a colour and a sign an outcome, run and inferred cells apart."""

from __future__ import annotations

from collections import Counter
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
KEY = {
    OPTIMAL: "optimal on every step",
    FEASIBLE: "within the limits, not optimal",
    VIOLATED: "limits violated",
    OUT_OF_TIME: "out of time",
    NO_ANSWER: "no answer",
}
NOT_RUN = "faint: not run, as those around it agree"
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
    levels = zip((found.x, found.y), _often_run(found), strict=True)
    shown = [[axis_.shown[level] for level in often] for axis_, often in levels]
    x: dict[str, Any] = {"field": "x", "type": "ordinal", "scale": {"domain": found.x.shown}}
    y: dict[str, Any] = {"field": "y", "type": "ordinal", "scale": {"domain": found.y.shown[::-1]}}
    x["axis"] = axis | {"title": found.x.title, "labelAngle": -45, "values": shown[0]}
    y["axis"] = axis | {"title": found.y.title, "values": shown[1]}
    spec = {
        "title": {"text": method, "font": FONT, "fontSize": sizes.title, "color": INK},
        "width": cell * columns,
        "height": cell * rows,
        "config": {"axis": {"labelColor": SOFT, "titleColor": INK}, "view": {"stroke": None}},
        **_cells(_values(found, method), x, y, cell),
    }
    name = f"map-{method}"
    return Chart(name, f"{method}: outcomes over {found.x.key} and {found.y.key}", CAPTION, spec)


def key_chart(found: Map, target: Target) -> Chart:
    """What the cells of the maps on a sheet mean."""
    seen = {ending for method in found.spots for ending in found.endings(method).values()}
    words = [(ending, word, True) for ending, word in KEY.items() if ending in seen]
    words += [(next(e for e in KEY if e in seen), NOT_RUN, False)] if seen else []
    values = [{"ending": e, "word": word, "run": run, "x": ""} for e, word, run in words]
    size = target.sizes.text
    y = {"field": "word", "type": "ordinal", "sort": None, "axis": None}
    text = {"type": "text", "align": "left", "dx": size, "fontSize": size, "font": FONT}
    drawn = _cells(values, {"field": "x", "type": "ordinal", "axis": None}, y, size)
    drawn["layer"].append(
        {
            "mark": text | {"color": INK},
            "encoding": {"y": y, "text": {"field": "word"}},
        }
    )
    sized = {"width": size, "height": 1.6 * size * len(values)}
    config = {"config": {"view": {"stroke": None}}}
    return Chart("map-key", "What the cells mean", CAPTION, sized | config | drawn)


def _cells(
    values: list[dict[str, object]], x: dict[str, Any], y: dict[str, Any], size: float
) -> dict[str, Any]:
    """Rectangles of outcomes, crosses on those where limits are violated."""
    colours = {"domain": list(FILLS), "range": list(FILLS.values())}
    mark = {"type": "rect", "stroke": "#DADCE0", "strokeWidth": 0.5, "tooltip": {"content": "data"}}
    run = {"condition": {"test": "datum.run", "value": 1}, "value": INFERRED}
    fill = {"field": "ending", "type": "nominal", "scale": colours, "legend": None}
    crosses = {"type": "point", "shape": CROSS, "stroke": FAILS, "size": 0.25 * size * size}
    crosses["strokeWidth"] = min(2.0, size / 12)
    return {
        "$schema": SCHEMA,
        "background": "white",
        "data": {"values": values},
        "layer": [
            {"mark": mark, "encoding": {"x": x, "y": y, "fill": fill, "opacity": run}},
            {
                "transform": [{"filter": f"datum.ending === '{VIOLATED}'"}],
                "mark": crosses,
                "encoding": {"x": x, "y": y, "opacity": run},
            },
        ],
    }


def _often_run(found: Map) -> list[list[int]]:
    """On either axis the levels with at least half as many cells as that with most."""
    spots = [at for method in found.spots for at in found.spots[method]]
    often = []
    for axis in (0, 1):
        counts = Counter(at[axis] for at in spots)
        most = max(counts.values(), default=0)
        often.append([level for level in sorted(counts) if 2 * counts[level] >= most])
    return often


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
