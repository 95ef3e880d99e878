"""What `strainbench map` found in a folder, as the page's script draws it."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Mapping, Sequence
from fractions import Fraction
from math import isclose
from pathlib import Path

import pandas as pd

from strainbench.report.measures import SIGNS
from strainbench.report.names import settings

FILE = "map.csv"
READ = ("method", "x", "y", "outcome", "why", "cell")
Row = Mapping[str, str]


def map_of(folder: Path, runs: pd.DataFrame) -> dict[str, object]:
    """Axes with their levels from low to high, and what each method did where it was run; nothing
    where no map was drawn, or none of the cells that are shown."""
    shown = set(runs["cell"])
    rows = [row for row in _read(folder / FILE) if row["cell"] in shown]
    if not rows:
        return {}
    levels = {axis: _levels(row[axis] for row in rows) for axis in "xy"}
    spots: dict[str, list[list[object]]] = {}
    for row in rows:
        place = [levels[axis].index(row[axis]) for axis in "xy"]
        said = [row["outcome"], row["why"], row["cell"]]
        spots.setdefault(row["method"], []).append([*place, *said])
    names = {axis: _setting(rows, runs, axis) for axis in "xy"}
    return {"names": names, "levels": levels, "spots": spots}


def _read(path: Path) -> list[Row]:
    """Its rows with an outcome that we know."""
    if not path.exists():
        return []
    with path.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    known = [row for row in rows if all(row.get(name) is not None for name in READ)]
    return [row for row in known if row["outcome"] in SIGNS]


def _levels(words: Iterable[str]) -> list[str]:
    return sorted(dict.fromkeys(words), key=number)


def number(word: str) -> float:
    """Of 5, 0.5, 0.5% or 1/60, and infinity of a word."""
    scale = 0.01 if word.endswith("%") else 1.0
    try:
        return scale * float(Fraction(word.removesuffix("%").strip()))
    except (ValueError, ZeroDivisionError):
        return float("inf")


def _setting(rows: Sequence[Row], runs: pd.DataFrame, axis: str) -> str:
    """The setting that an axis is: that whose values in the records are its levels."""
    texts = runs.set_index("cell")[["solver_parameters", "scenario_parameters"]].to_dict("index")
    found = [(row[axis], _settings(texts[row["cell"]].values())) for row in rows]
    keys = [key for key in found[0][1] if all(_is(own.get(key), word) for word, own in found)]
    return keys[-1] if keys else axis


def _settings(texts: Iterable[str]) -> dict[str, object]:
    return {key: value for text in texts for key, value in settings(text).items()}


def _is(value: object, word: str) -> bool:
    if isinstance(value, int | float) and number(word) != float("inf"):
        return isclose(value, number(word), rel_tol=1e-6)
    return str(value) == word
