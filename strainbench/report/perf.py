"""What pytest-benchmark measured, as a report: its JSON, with the certificate that each row has."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import isfinite, nan
from pathlib import Path
from typing import Any

from strainbench.document import Column, Document, Part, Prose, Strong, Table
from strainbench.document.writers import csv, markdown
from strainbench.files import RecordsError
from strainbench.report.charts.axes import time_axis
from strainbench.report.charts.canvas import CROSS, SCHEMA, config, raw
from strainbench.report.charts.chart import Chart, draw_sheet
from strainbench.report.charts.target import Target
from strainbench.report.identity import look
from strainbench.report.measures import (
    COUNT,
    ENDINGS,
    OPTIMAL,
    SIGNS,
    digits,
    distance_text,
)
from strainbench.report.numbers import power

STATS = ("median", "q1", "q3", "rounds")
ABOUT = Prose("""\
✓ optimal, ○ within the limits, ✗ neither. Times are medians with quartiles over rounds; violation,
gap and distance are the referee's, `<` where the distance is below what the reference is certified
to.""")
VALID = "the JSON that pytest --benchmark-json writes is valid"


@dataclass(frozen=True)
class Timing:
    """One benchmark; what its certificate does not say is NaN."""

    group: str
    method: str
    median: float
    low: float
    high: float
    rounds: int
    facts: Mapping[str, Any] = field(default_factory=dict)

    @property
    def outcome(self) -> str:
        """As the referee has it; "" where nobody asked it."""
        return str(self.facts.get("outcome", ""))

    @property
    def sign(self) -> str:
        """Of the outcome."""
        return SIGNS.get(self.outcome, "")

    def number(self, name: str) -> float:
        """A number of the certificate."""
        value = self.facts.get(name)
        return float(value) if isinstance(value, int | float) else nan

    @property
    def rank(self) -> tuple[int, float]:
        """The better outcome first, then the faster."""
        known = self.outcome in ENDINGS
        return ENDINGS.index(self.outcome) if known else len(ENDINGS), self.median

    def line(self) -> list[object]:
        """Of the table, in ms and mm."""
        low, median, high = (digits(1e3 * s) for s in (self.low, self.median, self.high))
        violation, gap = self.number("max_violation"), self.number("relative_gap")
        distance, error = (1e3 * self.number(n) for n in ("distance", "reference_error"))
        return [
            self.sign,
            Strong(self.method) if self.outcome == OPTIMAL else self.method,
            median,
            f"{low}-{high}",
            power(violation) if isfinite(violation) else "",
            power(gap) if isfinite(gap) else "",
            distance_text(distance, error) if isfinite(distance) else "",
        ]


def read_perf(path: Path) -> list[Timing]:
    """The benchmarks of a file.

    Raises
    ------
    RecordsError
        If it is not one of pytest-benchmark's, or has none.
    """
    try:
        found = json.loads(path.read_text(encoding="utf-8"))["benchmarks"]
        timings = [_timing(entry) for entry in found]
    except OSError as error:
        raise RecordsError(f"{path}: {error.strerror}") from None
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
        raise RecordsError(f"{path}: no file of pytest-benchmark's; {VALID}") from None
    if not timings:
        raise RecordsError(f"{path}: no benchmark was run; {VALID}")
    return sorted(timings, key=lambda t: t.rank)


def _timing(entry: Mapping[str, Any]) -> Timing:
    facts = dict(entry.get("extra_info", {}))
    median, low, high, rounds = (float(entry["stats"][name]) for name in STATS)
    method = str(facts.get("solver", entry["name"]))
    return Timing(str(entry.get("group") or ""), method, median, low, high, int(rounds), facts)


def by_group(timings: Sequence[Timing]) -> dict[str, list[Timing]]:
    """In the order of their names."""
    groups: dict[str, list[Timing]] = {}
    for timing in sorted(timings, key=lambda t: t.group):
        groups.setdefault(timing.group, []).append(timing)
    return groups


def tables(timings: Sequence[Timing]) -> list[Table]:
    """One a group."""
    numbers = ("ms", "quartiles", "violation", "gap", "mm")
    header: list[str | Column] = ["", "method"]
    header += [Column(name, right=True, whole=True) for name in numbers]
    return [
        Table(group, header, [t.line() for t in rows], notes=[_rounds(rows)])
        for group, rows in by_group(timings).items()
    ]


def _rounds(rows: Sequence[Timing]) -> str:
    fewest, most = (f({t.rounds for t in rows}) for f in (min, max))
    return f"{fewest if fewest == most else f'{fewest} to {most}'} rounds each"


def cells(timings: Sequence[Timing]) -> Table:
    """A line a benchmark, numbers in SI units."""
    facts = ("max_violation", "relative_gap", "distance", "reference_error")
    header = ("group", "method", "outcome", "seconds", "seconds_low", "seconds_high", "rounds")
    lines = [
        [
            *(t.group, t.method, t.outcome, t.median, t.low, t.high, t.rounds),
            *(value if isfinite(value := t.number(name)) else "" for name in facts),
        ]
        for t in timings
    ]
    return Table("", (*header, *facts), lines)


def write_perf(path: Path) -> list[Path]:
    """Write the same beside the file: .md, .csv, .svg."""
    timings = read_perf(path)
    parts: list[Part] = [ABOUT, *tables(timings)]
    written = [path.with_suffix(ending) for ending in (".md", ".csv", ".svg")]
    written[0].write_text(markdown(Document("Projections, timed", parts)), encoding="utf-8")
    written[1].write_text(csv(cells(timings)), encoding="utf-8")
    draw_sheet(charts(timings), written[2:], columns=2)
    return written


def charts(timings: Sequence[Timing]) -> list[Chart]:
    """One a group: medians with quartiles, the fastest on top; a cross is no answer that counts."""
    return [
        Chart(f"perf-{k}", group, ABOUT, _spec(group, rows))
        for k, (group, rows) in enumerate(by_group(timings).items(), start=1)
    ]


def _spec(group: str, rows: Sequence[Timing]) -> dict[str, Any]:
    values = [_mark(t) for t in sorted(rows, key=lambda t: t.median)]
    sizes = Target.PAGE.sizes
    width = sizes.width - sizes.names
    known = [seconds for t in rows for seconds in (t.low, t.high)]
    axis = time_axis("a projection", known, Target.PAGE).thinned(width, sizes.text)
    low, median = (axis.channel(name, sizes.title) for name in ("low", "median"))
    y = {"field": "method", "type": "nominal", "sort": None, "title": None}
    bar = {"x": low, "x2": {"field": "high"}, "y": y, "color": raw("colour")}
    point = {"x": median, "y": y, "stroke": raw("colour")}
    point |= {"fill": raw("fill"), "shape": raw("shape")}
    return {
        "$schema": SCHEMA,
        "title": {"text": group, "fontSize": sizes.title, "anchor": "start"},
        "width": width,
        "height": {"step": 1.6 * sizes.text},
        "data": {"values": values},
        "layer": [
            {"mark": {"type": "rule"}, "encoding": bar},
            {"mark": {"type": "point", "size": sizes.mark, "opacity": 1}, "encoding": point},
        ],
        "config": config(Target.PAGE),
    }


def _mark(timing: Timing) -> dict[str, object]:
    """Filled if optimal, hollow if within the limits, else a cross."""
    found, outcome = look(timing.method), timing.outcome
    counts = outcome in COUNT or not outcome
    return {
        "method": timing.method,
        **{k: getattr(timing, k) for k in ("low", "median", "high")},
        "colour": found.colour,
        "fill": found.colour if outcome != "feasible" else "white",
        "shape": found.shape if counts else CROSS,
    }
