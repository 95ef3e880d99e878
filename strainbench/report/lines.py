"""What tables say of a cell: its outcome, its time, and the accuracy reached."""

from __future__ import annotations

from collections.abc import Iterator
from math import isfinite

import numpy as np
import pandas as pd

from strainbench.bench.failure import Failure
from strainbench.document import Between, Column, Faint, Strong
from strainbench.report.measures import (
    COUNT,
    ENDINGS,
    FEASIBLE,
    OPTIMAL,
    OUT_OF_TIME,
    SIGNS,
    distance_of,
    seconds_text,
)
from strainbench.report.numbers import power
from strainbench.report.rows import Row, rows_of

MEASURES: tuple[str | Column, ...] = (
    "outcome",
    Column("time", "ms", right=True),
    Column("quartiles", "ms", aside=True),
    Column("mean", "ms", right=True),
    *(Column(name, right=True) for name in ("violation", "gap")),
    Column("distance", "mm", right=True),
    Column("iterations", right=True),
)
"""What is said of each cell."""
MANY = 1000  # iterations, of which fractions say nothing
TELLING = frozenset(
    {
        *(Failure.FALSE_CLAIM, Failure.ITERATION_LIMIT, Failure.INVERTED),
        *(Failure.ENERGY, Failure.MOMENTUM, Failure.DRIFTS),
    }
)
"""Kinds of failure that say more than how a cell ended."""


def ranked(cells: pd.DataFrame) -> pd.DataFrame:
    """By outcome, then by time; where no median is known, by the mean."""
    order = cells["ending"].map(ENDINGS.index)
    times = cells["time"].fillna(cells["solve_seconds_mean"])
    return cells.iloc[np.lexsort((times, order))]


def marked(cells: pd.DataFrame) -> Iterator[tuple[Row, list[str]]]:
    """Ranked cells, with their method and MEASURES; the fastest stands out, if it is optimal."""
    for place, row in enumerate(rows_of(cells)):
        method, (ending, time, *others) = row["solver"], measures_of(row)
        if place == 0 and row["ending"] == OPTIMAL:
            method, time = Strong(method), Strong(time)
        yield row, [method, ending, time, *others]


def measures_of(row: Row) -> list[str]:
    """The entries of MEASURES; numbers that do not count are faint."""
    texts = [
        *time_of(row),
        milliseconds(row["solve_seconds_mean"]),
        *accuracy_of(row),
        iterations_of(row),
    ]
    return [ending_text(row), *(texts if row["ending"] in COUNT else map(Faint, texts))]


def time_of(row: Row) -> tuple[str, str]:
    """Median and quartiles in ms; no quartiles of one projection."""
    low, high = (milliseconds(row[name]) for name in ("time_low", "time_high"))
    return milliseconds(row["time"]), Between.of(low, high) if row["time_count"] > 1 else ""


def accuracy_of(row: Row) -> tuple[str, str, str]:
    """Violation, relative gap, distance in mm; nothing of an answer that is not known."""
    violation, gap = row["max_violation"], row["relative_gap_max"]
    if not isfinite(violation):
        return "", "", ""
    return power(violation), power(gap) if isfinite(gap) else "local", distance_of(row)


def iterations_of(row: Row) -> str:
    """Their mean over all steps."""
    mean = row["iterations_mean"]
    return (f"{mean:.0f}" if mean >= MANY else f"{mean:.4g}") if isfinite(mean) else ""


def milliseconds(seconds: float) -> str:
    """Two significant digits, in ms."""
    return seconds_text(1000 * seconds)


def ending_text(row: Row) -> str:
    """How a cell ended, its sign before the words."""
    ending = row["ending"]
    words = {FEASIBLE: "within the limits", OUT_OF_TIME: f"out of time, {row['why']}"}
    more = f"; {row['failure']}" if row["failure"] in TELLING else ""
    return f"{SIGNS[ending]} {words.get(ending, row['why'] or ending)}{more}"
