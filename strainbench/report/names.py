"""How cells are called in tables and charts: their mesh, their limit, their settings."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from pathlib import PurePath
from typing import Any

import pandas as pd

from strainbench import escape
from strainbench.bench.mode import replays, window
from strainbench.report.rows import Row

SPANNED = ("resolution", "limit")
"""Settings that have rows and columns of their own within a table."""
LEAST_DIGITS, MOST_DIGITS = 4, 17
HOW = {"tolerance": "tolerance {:g}", "steps_asked": "{:.0f} steps"}
"""Columns besides the settings by which the runs of one scene may differ, with their forms."""
MESH_FILE, CURVE_FILE = "path", "curve_file"
"""Settings that name files which stand in for the resolution, and for the limit."""


def settings(text: str) -> dict[str, Any]:
    """Settings from their JSON, which may be missing."""
    found: dict[str, Any] = json.loads(text or "{}")
    return found


def digits(texts: Iterable[str]) -> dict[str, int]:
    """For each setting, the significant digits that tell all its values in `texts` apart."""
    values: dict[str, set[float]] = {}
    for text in dict.fromkeys(texts):
        for key, value in settings(text).items():
            if isinstance(value, float):
                values.setdefault(key, set()).add(value)
    return {key: digits_of(numbers) for key, numbers in values.items()}


def digits_of(numbers: Iterable[float]) -> int:
    """The significant digits that tell numbers apart."""
    several = set(numbers)
    enough = (
        d for d in range(LEAST_DIGITS, MOST_DIGITS) if len(_rounded(several, d)) == len(several)
    )
    return next(enough, MOST_DIGITS)


def _rounded(numbers: Iterable[float], count: int) -> set[str]:
    return {f"{number:.{count}g}" for number in numbers}


def describe(
    text: str, without: Iterable[str] = (), precision: Mapping[str, int] | None = None
) -> str:
    """Settings from their JSON, on a line; `precision` has each one's digits, 4 if none."""
    known = precision or {}
    return ", ".join(
        f"{key} {value:.{known.get(key, LEAST_DIGITS)}g}"
        if isinstance(value, float)
        else escape.plain(f"{key} {value}")
        for key, value in settings(text).items()
        if key not in without and value != ""
    )


def played(row: Row) -> str:
    """Which steps of a scene a cell is about."""
    first, last = window(row["mode"], int(row["steps_asked"]))
    what = "replayed frames" if replays(row["mode"]) else "simulated steps"
    return f"{what} {first} to {last}"


def percent(limit: float) -> str:
    """A limit on strain; nothing for NaN."""
    return "" if pd.isna(limit) else f"{100 * limit:.10g}%"


def limit_name(parameters: str, limit: float) -> str:
    """The limit in percent, or the file of its curve."""
    curve = settings(parameters).get(CURVE_FILE)
    return PurePath(curve).name if curve else percent(limit)


def mesh_name(parameters: str, resolution: float, constraints: float, directions: str) -> str:
    """N×N for a square grid, else the file or resolution, with the number of elements if known."""
    elements = constraints / float(directions if directions.isdigit() else 1)
    count = f", {elements:.0f} elements" if elements % 1 == 0 else ""
    if file := settings(parameters).get(MESH_FILE):
        return PurePath(file).name + count
    if pd.isna(resolution):
        return count.removeprefix(", ") or "mesh"
    if count and elements != 2 * resolution**2:
        return f"resolution {resolution:.0f}{count}"
    return f"{resolution:.0f}×{resolution:.0f}"


def cells(mesh: str) -> str:
    """A mesh's name in running text."""
    return f"{mesh} cells" if "×" in mesh else mesh


def with_names(runs: pd.DataFrame) -> pd.DataFrame:
    """Runs with columns that say how they are called, and without numbers that mean nothing.

    `setting` is all that a table's title says, `exact` the same to the last digit; `mesh` and
    `bound` are its columns and rows; `apart` is what else tells runs of one scene apart.
    """
    texts = runs["scenario_parameters"]
    precision = digits(texts)
    sizes = runs.groupby(["scenario", "scenario_parameters"])["constraints"].transform("max")
    each = list(zip(texts, runs["resolution"], sizes, runs["directions"], strict=True))
    named = runs.assign(
        setting=[describe(text, SPANNED, precision) for text in texts],
        exact=[json.dumps(_unspanned(text), sort_keys=True) for text in texts],
        mesh=[mesh_name(text, n, size, str(m)) for text, n, size, m in each],
        bound=[limit_name(text, limit) for text, limit in zip(texts, runs["limit"], strict=True)],
        apart=apart(runs, {*SPANNED, MESH_FILE, CURVE_FILE}, HOW),
    )
    for file, number in ((MESH_FILE, "resolution"), (CURVE_FILE, "limit")):
        named[number] = runs[number].mask([bool(settings(text).get(file)) for text in texts])
    return named


def _unspanned(text: str) -> dict[str, Any]:
    return {k: v for k, v in settings(text).items() if k not in SPANNED}


def apart(
    runs: pd.DataFrame, without: Iterable[str], columns: Mapping[str, str] | None = None
) -> pd.Series:
    """What tells the runs of each scene apart, of their settings and of `columns` with forms."""
    words = pd.Series("", index=runs.index, dtype=object)
    precision = digits(runs["scenario_parameters"])
    for _, rows in runs.groupby("scenario"):
        texts = rows["scenario_parameters"]
        every = [settings(text) for text in texts.unique()]
        keys = dict.fromkeys(key for each in every for key in each)
        same = [k for k in keys if len({json.dumps(each.get(k)) for each in every}) == 1]
        parts = [[describe(text, {*without, *same}, precision)] for text in texts]
        for column, form in (columns or {}).items():
            if rows[column].nunique() > 1:
                for part, value in zip(parts, rows[column], strict=True):
                    part.append(form.format(value))
        words[rows.index] = [", ".join(filter(None, part)) for part in parts]
    return words
