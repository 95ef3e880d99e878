"""Scales with their ticks."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from math import ceil, floor, log10
from typing import Any

from strainbench.report.charts.target import Target
from strainbench.report.charts.text import width
from strainbench.report.measures import TIME
from strainbench.report.numbers import power

Spec = dict[str, Any]
MINUS = "\u2212"
LENGTHS = ((1000.0, "m"), (10.0, "cm"), (0.1, "mm"), (1e-4, "µm"), (1e-6, "nm"))
"""Units of ticks, from how many mm on; a tenth of a unit is still said in it."""


@dataclass(frozen=True)
class Axis:
    """A scale with its ticks.

    Parameters
    ----------
    title : with its unit, if the ticks have none
    ticks : values and how they are shown
    """

    title: str
    low: float
    high: float
    ticks: Mapping[float, str]
    log: bool = True

    def at(self, value: float) -> float:
        """From 0 at the low end to 1 at the high end."""
        low, high, here = (log10(v) if self.log else v for v in (self.low, self.high, value))
        return (here - low) / (high - low)

    def thinned(self, room: float, size: float) -> Axis:
        """Without those ticks whose text would touch that of one before, in `room` pixels."""
        kept: dict[float, str] = {}
        free = float("-inf")
        for value, text in sorted(self.ticks.items()):
            half = (width(text, size) + 0.5 * size) / 2
            if room * self.at(value) - half >= free:
                kept[value] = text
                free = room * self.at(value) + half
        return replace(self, ticks=kept)

    def channel(self, name: str, size: float) -> Spec:
        """Of a field on this axis; labels stand no closer than `size` allows."""
        scale: Spec = {"domain": [self.low, self.high], "nice": False, "zero": False}
        if self.log:
            scale["type"] = "log"
        shown = list(self.ticks)
        labels = ", ".join(repr(self.ticks[value]) for value in shown)
        axis = {
            "title": self.title,
            "values": shown,
            "labelExpr": f"[{labels}][indexof({shown}, datum.value)]",
            "labelOverlap": False,
            "titleFontSize": size,
        }
        return {"field": name, "type": "quantitative", "scale": scale, "axis": axis}


def decades(
    title: str, values: Iterable[float], label: Callable[[float], str], most: int = 12
) -> Axis:
    """A logarithmic axis around positive values, at decades where two are there."""
    known = [v for v in values if 0 < v < float("inf")] or [1.0]
    low, high = min(known) / 1.8, max(known) * 1.8
    first, last = ceil(log10(low)), floor(log10(high))
    if first < last:
        step = ceil((last - first + 1) / most)
        shown = [float(f"1e{k}") for k in range(first, last + 1, step)]
    else:
        low, high = low / 1.5, high * 1.5
        between = range(floor(log10(low)), ceil(log10(high)) + 1)
        shown = [v for k in between for v in (float(f"{m}e{k}") for m in (1, 2, 5))]
    return Axis(title, low, high, {v: label(v) for v in shown if low <= v <= high})


def time_axis(title: str, seconds: Iterable[float], target: Target) -> Axis:
    """Of times, with ticks in s, ms, µs."""
    return decades(title, seconds, time_tick, 8 if target.sizes.width > 300 else 5)


def time_tick(seconds: float) -> str:
    """A power of ten of seconds."""
    size, name = next((u for u in TIME if seconds >= 0.99 * u[0]), TIME[-1])
    return f"{seconds / size:g} {name}"


def length_tick(mm: float) -> str:
    """A power of ten of mm."""
    units = {"m": 1000.0, "cm": 10.0, "mm": 1.0, "µm": 1e-3, "nm": 1e-6}
    _, name = next((u for u in LENGTHS if mm >= 0.99 * u[0]), LENGTHS[-1])
    return f"{mm / units[name]:.3g} {name}"


def power_tick(value: float) -> str:
    """A power of ten."""
    return f"{value:g}" if 1 <= value <= 100 else power(value)


def even_ticks(low: float, high: float, most: int = 6) -> dict[float, str]:
    """Round values between two ends, at most so many."""
    step = next(s for s in _round_steps(low, high) if (high - low) / s < most)
    first, last = ceil(low / step - 1e-9), floor(high / step + 1e-9)
    return {k * step: f"{k * step:.6g}".replace("-", MINUS) for k in range(first, last + 1)}


def _round_steps(low: float, high: float) -> Iterator[float]:
    """1, 2 and 5 times powers of ten, from small to large."""
    power_ = floor(log10(high - low)) - 1
    yield from (float(f"{m}e{power_ + k}") for k in range(3) for m in (1, 2, 5))


def count_tick(value: float) -> str:
    """A power of ten, thousands as k."""
    return (
        f"{value / 1e6:g}M"
        if value >= 1e6
        else f"{value / 1e3:g}k"
        if value >= 1e3
        else f"{value:g}"
    )
