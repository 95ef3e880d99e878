"""A plane with two axes, and what is drawn on it, as Vega-Lite specifications.

Data stand in their own units, names and frames in pixels (points for a paper), so that nothing is
left to chance: the whole chart is as wide as its target says.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from strainbench.report.charts.axes import Axis
from strainbench.report.charts.target import Target
from strainbench.report.charts.text import BOLD, FONT, HEIGHT, Box, Placed, wrapped
from strainbench.report.identity import Look, look

Spec = dict[str, Any]
SCHEMA = "https://vega.github.io/schema/vega-lite/v6.json"
INK, SOFT, LINES, FAINT = "#202124", "#5F6368", "#DADCE0", "#E8EAED"
BAND, FRONT = "#F1F3F4", "#9AA0A6"
CHOSEN = "chosen"
"""The parameter that names the method to be seen, all others dimmed; empty for all."""
DIMMED = 0.12
CROSS = "M-.8,-.8L.8,.8M-.8,.8L.8,-.8"


@dataclass
class Plane:
    """Two axes with room around them, and the layers drawn so far, the first at the back.

    Parameters
    ----------
    title : above, in bold; wrapped
    right : room beside the plane, for names
    rail : the height of the frame of failures above the plane
    """

    target: Target
    title: str
    x: Axis
    y: Axis
    right: float = 10.0
    rail: float = 0.0
    height: float = 0.0
    layers: list[Spec] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.height = self.height or self.target.sizes.height
        self.x = self.x.thinned(self.width, self.target.sizes.text)

    @staticmethod
    def room(target: Target, right: float = 10.0) -> float:
        """The width of a plane with so much room beside it."""
        return target.sizes.width - target.sizes.left - right

    @property
    def width(self) -> float:
        """Of the plane alone."""
        return self.room(self.target, self.right)

    @property
    def across(self) -> float:
        """The width of a rail, which goes on beside the plane."""
        return self.room(self.target)

    @property
    def box(self) -> Box:
        """The plane in its own pixels."""
        return Box(0, 0, self.width, self.height)

    def pixel(self, x: float, y: float) -> tuple[float, float]:
        """Where values stand."""
        return self.x.at(x) * self.width, (1 - self.y.at(y)) * self.height

    def holds(self, x: float, y: float) -> bool:
        """Whether values are on both axes."""
        return self.x.low <= x <= self.x.high and self.y.low <= y <= self.y.high

    def channels(self, x: str, y: str) -> Spec:
        """Of two fields on these axes."""
        size = self.target.sizes.title
        upright = self.y.channel(y, size)
        upright["axis"] |= {"title": None}
        return {"x": self.x.channel(x, size), "y": upright}

    def add(self, mark: Spec, rows: Iterable[Mapping[str, object]], encoding: Spec) -> None:
        """A layer; nothing without rows."""
        values = rows if isinstance(rows, list) else list(rows)  # layers may share one
        if values:
            self.layers.append({"data": {"values": values}, "mark": mark, "encoding": encoding})

    def dimmed(self) -> Spec:
        """The opacity of what belongs to a method, where a method can be chosen."""
        if not self.target.interactive:
            return {}
        test = f"{CHOSEN} === '' || datum.name === {CHOSEN} || datum.base === {CHOSEN}"
        return {"opacity": {"condition": {"test": test, "value": 1}, "value": DIMMED}}

    def box_layer(self, box: Box, colour: str) -> None:
        """A filled rectangle in pixels."""
        corners = {"x": box.left, "x2": box.right, "y": box.top, "y2": box.bottom}
        self.add({"type": "rect", "color": colour, **corners}, [{}], {})

    def texts(self, rows: Iterable[Mapping[str, object]], align: str = "left") -> None:
        """Rows of px, py, text, ink; and name, base where they belong to a method."""
        size = self.target.sizes.text
        mark = {"type": "text", "align": align, "baseline": "middle", "fontSize": size}
        encoding = {
            **PIXELS,
            "text": {"field": "text"},
            "color": {"field": "ink", "type": "nominal", "scale": None},
            **self.dimmed(),
        }
        self.add(mark, rows, encoding)

    def names(self, placed: Iterable[Placed]) -> None:
        """Names where they were placed, with leaders where they are moved."""
        rows, leaders = [], []
        for p in placed:
            mine = about(p.name.text)
            rows.append({"px": p.x, "py": p.y, "text": p.name.whole, **mine})
            if p.led:
                x, y = p.near
                ends = {"px": p.name.x, "py": p.name.y, "px2": x, "py2": y}
                leaders.append(ends | mine)
        self.leaders(leaders)
        self.texts(rows, "center")

    def leaders(self, rows: Iterable[Mapping[str, object]], dotted: bool = False) -> None:
        """Thin lines from px, py to px2, py2."""
        mark: Spec = {"type": "rule", "color": FRONT, "strokeWidth": 0.5 * self.target.sizes.line}
        if dotted:
            mark["strokeDash"] = [1, 2]
        self.add(mark, rows, {**PIXELS, **ENDS, **self.dimmed()})

    def crosses(self, rows: Iterable[Mapping[str, object]]) -> None:
        """A cross at px, py in a method's colour."""
        size = self.target.sizes
        mark = {"type": "point", "shape": CROSS, "size": 0.45 * size.text**2}
        mark |= {"strokeWidth": 1.2 * size.line, "opacity": 1, "fill": None}
        self.add(mark, rows, {**PIXELS, "stroke": raw("colour"), **self.dimmed()})

    def stair(self, points: Sequence[Mapping[str, Any]]) -> list[Box]:
        """Down at the first point, then from each on to the next, the last to the edge.

        What it covers is returned.
        """
        if not points:
            return []
        found = [self.pixel(p["seconds"], p["value"]) for p in points]
        path = [(found[0][0], 0.0)]
        for (x, y), (then, _) in zip(found, [*found[1:], (self.width, 0.0)], strict=True):
            path += [(x, y), (then, y)]
        rows = [{"px": x, "py": y, "order": k} for k, (x, y) in enumerate(path)]
        mark = {"type": "line", "color": FRONT, "strokeWidth": 0.8 * self.target.sizes.line}
        self.add(mark, rows, {**PIXELS, "order": {"field": "order", "type": "quantitative"}})
        return [
            Box(min(x, u) - 1, min(y, v) - 1, max(x, u) + 1, max(y, v) + 1)
            for (x, y), (u, v) in itertools.pairwise(path)
        ]

    def spec(self, params: Sequence[Spec] = ()) -> Spec:
        """All of it."""
        sizes = self.target.sizes
        lines = wrapped(self.title, (sizes.width - 6) / BOLD, sizes.title)
        above = self.rail + HEIGHT * sizes.title * len(lines) + 0.8 * sizes.title
        below = 2.2 * sizes.text + 1.7 * sizes.title
        self._titles(lines)
        chosen = [{"name": CHOSEN, "value": ""}] if self.target.interactive else []
        found = {
            "$schema": SCHEMA,
            "width": self.width,
            "height": self.height,
            "autosize": {"type": "none"},
            "padding": {"left": sizes.left, "right": self.right, "top": above, "bottom": below},
            "layer": self.layers,
            "config": config(self.target),
        }
        return found | ({"params": [*chosen, *params]} if chosen or params else {})

    def _titles(self, lines: Sequence[str]) -> None:
        """That above, in lines, and that of the upright axis."""
        sizes, line = self.target.sizes, HEIGHT * self.target.sizes.title
        left, bottom = 3 - sizes.left, -self.rail - 0.5 * sizes.title
        mark = {"type": "text", "color": INK, "fontSize": sizes.title}
        above: Spec = {"align": "left", "baseline": "bottom", "fontWeight": "bold"}
        rows = [{"px": left, "py": bottom - line * k, "text": t} for k, t in enumerate(lines[::-1])]
        text = {**PIXELS, "text": {"field": "text"}}
        self.add(mark | above, rows, text)
        turned: Spec = {"angle": -90, "align": "center", "baseline": "top"}
        upright = {"px": left, "py": self.height / 2, "text": self.y.title}
        self.add(mark | turned, [upright], text)


PIXELS: Spec = {
    "x": {"field": "px", "type": "quantitative", "scale": None, "axis": None},
    "y": {"field": "py", "type": "quantitative", "scale": None, "axis": None},
}
ENDS: Spec = {"x2": {"field": "px2"}, "y2": {"field": "py2"}}


def config(target: Target) -> Spec:
    """Fonts and colours of what is no method's."""
    sizes = target.sizes
    axis = {
        "labelFontSize": sizes.text,
        "titleFontSize": sizes.title,
        "titleFontWeight": "normal",
        "labelColor": INK,
        "titleColor": INK,
        "gridColor": FAINT,
        "gridWidth": 0.5 * sizes.line,
        "domainColor": FRONT,
        "tickColor": FRONT,
        "tickSize": 0.35 * sizes.text,
        "titlePadding": 0.5 * sizes.text,
    }
    return {
        "font": FONT,
        "background": "white",
        "axis": axis,
        "view": {"stroke": LINES},
        "rule": {"strokeWidth": 0.8 * sizes.line},
        "line": {"strokeWidth": sizes.line},
    }


def about(name: str, found: Look | None = None) -> Spec:
    """What tells a row's method, to choose it and to draw it; `found` if not by its name."""
    found = found or look(name)
    dash = list(found.dash) or [1, 0]
    return {
        "name": name,
        "base": found.base,
        "ink": found.ink,
        "colour": found.colour,
        "shape": found.shape,
        "dash": dash,
    }


def raw(name: str) -> Spec:
    """A channel whose values are taken as they are."""
    return {"field": name, "type": "nominal", "scale": None, "legend": None}
