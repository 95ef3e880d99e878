"""An axis of a map: a setting and its levels."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import ceil, log

from strainbench.bench.settings import split_values
from strainbench.options import shown

FACTOR = 1.3  # between two levels of a range, at most
MOST_LEVELS = 100
UNITS = {"step": "s", "resolution": "cells a side"}
VALID = "KEY=FROM..TO, as limit=0.01%..20% or step=1/240..1/5, or KEY=V1,V2,V3 is valid"


@dataclass(frozen=True)
class Axis:
    """A setting and its levels, the lowest first.

    Parameters
    ----------
    key : as in --set, of the scene or SOLVER.KEY
    words : the values as --set takes them
    shown : the values as people write them
    """

    key: str
    words: tuple[str, ...]
    shown: tuple[str, ...]

    @property
    def title(self) -> str:
        """The setting with its unit."""
        return f"{self.key} [{UNITS[self.key]}]" if self.key in UNITS else self.key

    def setting(self, level: int) -> str:
        """The words of --set for a level."""
        return f"{self.key}={self.words[level]}"


def parse_axis(option: str, text: str, factor: float = FACTOR) -> Axis:
    """The axis that a word of the command line gives.

    A range has levels a factor apart, from whole numbers to whole numbers if both ends are such.

    Raises
    ------
    ValueError
        One line that names the option and what is valid.
    """
    key, equals, values = text.partition("=")
    if not equals or not key or not values:
        raise ValueError(f"{option} {shown(text)}: {VALID}")
    first, dots, last = values.partition("..")
    words = split_values(values) if not dots else _range(option, text, first, last, factor)
    if len(set(words)) < 2:
        raise ValueError(f"{option} {shown(text)}: two values or more make an axis; {VALID}")
    plain = tuple(str(float(Fraction(w))) if "/" in w else w for w in dict.fromkeys(words))
    return Axis(key, plain, tuple(dict.fromkeys(words)))


def _range(option: str, text: str, first: str, last: str, factor: float) -> list[str]:
    """The levels of a range as people write them."""
    try:
        ends = [_number(word) for word in (first, last)]
    except (ValueError, ZeroDivisionError):
        ends = []
    if not ends or min(ends) <= 0 or ends[0] >= ends[1]:
        raise ValueError(f"{option} {shown(text)}: FROM and TO above 0, FROM below TO; {VALID}")
    count = ceil(log(ends[1] / ends[0]) / log(factor) - 1e-9) + 1
    if count > MOST_LEVELS:
        raise ValueError(f"{option} {shown(text)}: {count} levels; up to {MOST_LEVELS} is valid")
    inner = [ends[0] * (ends[1] / ends[0]) ** (i / (count - 1)) for i in range(1, count - 1)]
    return [first, *_written(inner, first, last), last]


def _number(word: str) -> float:
    """Of 5, 0.5, 0.5% or 1/60."""
    scale = 0.01 if word.endswith("%") else 1.0
    return scale * float(Fraction(word.removesuffix("%").strip()))


def _written(levels: Sequence[float], first: str, last: str) -> list[str]:
    """Levels in the form of both ends: percentages, fractions of 1, whole numbers; or 3 digits."""
    if first.endswith("%") and last.endswith("%"):
        return [f"{100 * level:.3g}%" for level in levels]
    if first.startswith("1/") and last.startswith("1/"):
        return [f"1/{round(1 / level)}" for level in levels]
    if all(re.fullmatch(r"\d+", word) for word in (first, last)):
        return [str(round(level)) for level in levels]
    return [f"{level:.3g}" for level in levels]
