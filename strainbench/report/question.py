"""An accuracy and a budget of time, from the words of a command line: 0.1mm, 1e-4gap, 20ms."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite

from strainbench.options import shown
from strainbench.report.measures import digits

DISTANCE, GAP, VIOLATION = "distance_max", "relative_gap_max", "max_violation"
NOUNS = {DISTANCE: "distance", GAP: "gap", VIOLATION: "violation"}
"""Columns of runs.csv that an accuracy may be about, and what they are called."""
METRES = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "nm": 1e-9}
SECONDS = {"s": 1.0, "ms": 1e-3, "us": 1e-6}
PURE = {"gap": GAP, "violation": VIOLATION}
TIME = "seconds"
NAMES = {"um": "µm", "us": "µs"}
MICRO = str.maketrans("µμ", "uu")  # the two signs that keyboards have
FORM = re.compile(r"\s*(\d*\.?\d+(?:[eE][+-]?\d+)?)\s*([a-zA-Zµμ]*)\s*")
TO = "mm, um, nm, cm or m, gap or violation right behind it is valid: 0.1mm, 1e-4gap, 1e-6violation"
WITHIN = "s, ms or us right behind it is valid: 20ms"
PER = ("projection", "step")


@dataclass(frozen=True)
class Bound:
    """At most so much of a column, and how it is shown.

    Parameters
    ----------
    most : in SI units
    size, unit : of what it is shown in
    """

    column: str
    most: float
    size: float
    unit: str

    def text(self, value: float) -> str:
        """A value in the bound's unit, to two digits; small numbers without a unit as powers."""
        if self.unit in PURE:
            return f"{value:.1e}".replace("e-0", "e-")
        return digits(value / self.size)

    def __str__(self) -> str:
        number = f"{self.most / self.size:.6g}"
        return f"a {self.unit} of {number}" if self.unit in PURE else f"{number} {self.unit}"

    @property
    def noun(self) -> str:
        """What it bounds, in a word."""
        return NOUNS.get(self.column, "time")


@dataclass(frozen=True)
class Question:
    """Which method reaches `accuracy` within `budget` a projection, or a step?"""

    accuracy: Bound
    budget: Bound
    per: str

    @classmethod
    def read(cls, to: str, within: str, per: str) -> Question:
        """ValueError names the word that means nothing, and what is valid."""
        if per not in PER:
            raise ValueError(f"--per {shown(per)}: valid are {', '.join(PER)}")
        return cls(_accuracy(to), _read("--within", within, SECONDS, TIME, WITHIN), per)

    def __str__(self) -> str:
        of = " of the optimum" if self.accuracy.column == DISTANCE else ""
        return f"{self.accuracy}{of}, within {self.budget} a {self.per}"


def _accuracy(text: str) -> Bound:
    pure = dict.fromkeys(PURE, 1.0)
    bound = _read("--to", text, METRES | pure, DISTANCE, TO)
    return Bound(PURE.get(bound.unit, DISTANCE), bound.most, bound.size, bound.unit)


def _read(option: str, text: str, units: Mapping[str, float], column: str, valid: str) -> Bound:
    found = FORM.fullmatch(text)
    number, unit = found.groups() if found else ("0", "")
    unit = unit.translate(MICRO)
    most = float(number) * units.get(unit, 0.0)
    if not (isfinite(most) and most > 0):
        raise ValueError(f"{option} {shown(text)}: a number above 0 with {valid}")
    return Bound(column, most, units[unit], NAMES.get(unit, unit))
