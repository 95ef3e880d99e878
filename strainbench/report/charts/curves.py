"""Lines in a plane, each called by its name at the right, with a dotted leader."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

from strainbench.report.charts.axes import Axis
from strainbench.report.charts.bands import name_band, note
from strainbench.report.charts.canvas import BAND, Plane, Spec, raw
from strainbench.report.charts.rail import draw_rail, rail_height
from strainbench.report.charts.target import Target
from strainbench.report.charts.text import HEIGHT, Box, along, spread, width, wrapped

WHITE = "#FFFFFF"
SHARE = 0.42  # of a chart's width that names may have
GAP = 1.6  # between the plane and its names, in the text's size


@dataclass(frozen=True)
class Curve:
    """A line.

    Parameters
    ----------
    look : what `strainbench.report.charts.canvas.about` says of its method
    label : at its right end; none if empty
    points : x and y, whether the mark is filled, and what belongs to them; a point None is a gap
    """

    look: Spec
    label: str
    points: Sequence[Spec | None]

    @property
    def rows(self) -> list[Spec]:
        """The points with their look; those between two gaps are one part."""
        rows, part = [], 0
        for k, point in enumerate(self.points):
            if point is None:
                part += 1
                continue
            fill = self.look["colour"] if point.get("filled", True) else WHITE
            rows.append(
                self.look
                | point
                | {
                    "fill": fill,
                    "part": f"{self.look.get('line', self.look['name'])} {part}",
                    "order": k,
                }
            )
        return rows


def point(x: float, y: float, filled: bool = True, **more: object) -> Spec:
    """One of a curve."""
    return {"x": x, "y": y, "filled": filled, **more}


@dataclass(frozen=True)
class Curves:
    """What a chart of lines is made of.

    Parameters
    ----------
    marks : whether points are marked
    steps : whether the lines are stairs
    failures, head : see `strainbench.report.charts.rail`
    band : below this is nothing that the reference knows
    levels : values of y with a dotted line and its name
    tooltip : fields of the points and their titles
    """

    title: str
    x: Axis
    y: Axis
    curves: Sequence[Curve]
    marks: bool = True
    steps: bool = False
    failures: Sequence[Spec] = ()
    head: str = ""
    height: float = 0.0
    band: float = 0.0
    levels: Sequence[tuple[float, str]] = ()
    tooltip: Spec = field(default_factory=dict)

    def spec(self, target: Target) -> Spec:
        """For a place."""
        sizes = target.sizes
        room = min(SHARE * sizes.width, sizes.names) - GAP * sizes.text
        labels = [wrapped(c.label, room, sizes.text) for c in self.curves]
        widest = max((width(t, sizes.text) for lines in labels for t in lines), default=0.0)
        right = widest + (GAP + 0.4) * sizes.text
        apart = HEIGHT * sizes.text
        needed = apart * sum(map(len, labels))
        rail = rail_height(self.failures, self.head, target)
        height = max(self.height or sizes.height, needed)
        plane = Plane(target, self.title, self.x, self.y, right, rail, height)
        draw_rail(plane, self.failures, self.head)
        self._behind(plane)
        self._lines(plane)
        self._labels(plane, labels, apart)
        return plane.spec()

    def _lines(self, plane: Plane) -> None:
        sizes, rows = plane.target.sizes, [row for curve in self.curves for row in curve.rows]
        encoding = {**plane.channels("x", "y"), "stroke": raw("colour"), **plane.dimmed()}
        line: Spec = {"type": "line", "strokeWidth": sizes.line}
        if not all(plane.holds(row["x"], row["y"]) for row in rows):
            line["clip"] = True  # of each line by itself, which is slow to draw
        if self.steps:
            line["interpolate"] = "step-after"
        order = {"order": {"field": "order", "type": "quantitative"}}
        parts = {"detail": {"field": "part"}, "strokeDash": raw("dash")}
        plane.add(line, rows, {**encoding, **parts, **order})
        if self.marks:
            mark = {"type": "point", "size": 0.7 * sizes.mark, "opacity": 1, "clip": False}
            marked = [row for row in rows if row.get("marked", True)]
            look = {"shape": raw("shape"), "fill": raw("fill")}
            plane.add(mark, marked, {**encoding, **look, **self._tooltip(plane.target)})

    def _behind(self, plane: Plane) -> None:
        """The band and the levels, with their names where these cover nothing."""
        size, low, high = plane.target.sizes.text, self.y.low, self.y.high
        taken = list(self._covered(plane)) if self.band or self.levels else []
        if self.band and self.band > low:
            top = max(plane.pixel(self.x.low, min(self.band, high))[1], 0)
            plane.box_layer(Box(0, top, plane.width, plane.height), BAND)
            name_band(plane, plane.height - top, taken)
        for value, name in self.levels:
            if low < value < high:
                _, y = plane.pixel(self.x.low, value)
                plane.leaders([{"px": 0, "py": y, "px2": plane.width, "py2": y}], dotted=True)
                wide = width(name, size) + size
                ends = (plane.width - wide, 0.0)
                boxes = [Box(x, y - 1.3 * size, x + wide, y - 1) for x in ends]
                note(plane, name, boxes, taken)

    def _covered(self, plane: Plane) -> Iterator[Box]:
        """Boxes along the lines."""
        half = plane.target.sizes.mark**0.5 / 2 if self.marks else 1.0
        for curve in self.curves:
            found = [plane.pixel(row["x"], row["y"]) for row in curve.rows]
            yield from (Box.around(x, y, half) for x, y in found)
            for here, there in pairwise(found):
                yield from along(*here, *there)

    def _tooltip(self, target: Target) -> Spec:
        if not (target.interactive and self.tooltip):
            return {}
        shown = self.tooltip.items()
        fields = [{"field": key, "title": title, "type": "nominal"} for key, title in shown]
        return {"tooltip": fields}

    def _labels(self, plane: Plane, labels: Sequence[Sequence[str]], apart: float) -> None:
        """Names beside the plane, in the order of the lines' ends."""
        size = plane.target.sizes.text
        left, texts, leaders = plane.width + GAP * size, [], []
        named = [(c, lines) for c, lines in zip(self.curves, labels, strict=True) if c.label]
        ends = [self._end(plane, curve) for curve, _ in named]
        sizes = [apart * len(lines) for _, lines in named]
        middles = spread([y for _, y in ends], sizes, 0, plane.height)
        for (curve, lines), end, middle in zip(named, ends, middles, strict=True):
            for k, text in enumerate(lines):
                y = middle + apart * (k - (len(lines) - 1) / 2)
                texts.append(curve.look | {"px": left, "py": y, "text": text})
            near = {"px2": left - 0.3 * size, "py2": middle}
            leaders.append(curve.look | {"px": end[0], "py": end[1]} | near)
        plane.leaders(leaders, dotted=True)
        plane.texts(texts)

    def _end(self, plane: Plane, curve: Curve) -> tuple[float, float]:
        """Where a line ends, within the plane."""
        last = curve.rows[-1]
        x, y = plane.pixel(last["x"], last["y"])
        return min(max(x, 0), plane.width), min(max(y, 0), plane.height)
