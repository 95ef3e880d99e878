"""Convergence on one frame: tables and curves against time and against iterations."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from strainbench import escape
from strainbench.bench.columns import WORDS
from strainbench.bench.ending import Ending
from strainbench.bench.records import RecordsError, read_machines, read_rows
from strainbench.document import Column, Document, Items, Part, Prose, Table
from strainbench.document.writers import markdown
from strainbench.report.chart import FLOOR_MM, RESOLVED, save, styles
from strainbench.report.machine import machine_section
from strainbench.report.numbers import power
from strainbench.studies.convergence.measure import CANDIDATE, COLUMNS, CONVERGENCE

LEVELS = (1e-2, 1e-4, 1e-6)
PANELS = (
    ("max_violation", "largest violation", 1e-10),
    ("relative_gap", "relative gap", 1e-12),
    ("distance_mm", "distance to optimum [mm]", FLOOR_MM),
)
"""Measure, its name on the axis, and the value at which anything smaller is drawn."""
AXES = (("seconds", "seconds"), ("iterations", "iterations"))
ABOVE = 10.0  # the axes end at this many times the candidate's own measure
EXPLANATION = """\
Each method's iterates or answers, measured by the referee: a value is reached at the first of them
from which on all are at most that. Methods marked ° show no iterates: these are whole runs at ever
tighter tolerances, their seconds and iterations those of one such run. Seconds are on the
solver's clock, set-up apart; the clock stands still while an iterate is kept. The gap is relative
to the certified optimum, violations priced in. Never: not even at the tightest tolerance, where the
method ended by itself. Not within: the budget, which is for all of a method's runs together, ended
first, and what it cut off is not counted. `-`: the method was stopped, or stopped, for the reason
given below."""


def load_convergence(folder: Path) -> pd.DataFrame:
    """All samples, numbers as numbers, distances in mm too.

    Raises
    ------
    RecordsError
        If there are none, or they are damaged.
    """
    rows = read_rows(folder / CONVERGENCE, COLUMNS)
    if not rows:
        raise RecordsError(f"{folder} holds no {CONVERGENCE}")
    table = pd.DataFrame(rows)
    for column in table.columns.difference(list(WORDS)):
        table[column] = pd.to_numeric(table[column])
    return table.assign(distance_mm=1000 * table["distance"])


def methods(table: pd.DataFrame) -> Iterator[tuple[str, pd.DataFrame]]:
    """Each solver's label, with ° where it was sampled by tolerances, and its samples."""
    for solver, rows in table.groupby("solver", sort=False):
        if solver != CANDIDATE:
            by_answer = rows["sampled_by"].iloc[0] == "tolerances"
            yield f"{solver}{'°' if by_answer else ''}", rows


def reached(rows: pd.DataFrame, measure: str, level: float) -> pd.Series | None:
    """The sample from which on the measure is at most `level`, or None."""
    above = ~(rows[measure] <= level)
    after = rows[~above[::-1].cummax()[::-1]]
    return None if after.empty else after.iloc[0]


def unreached(rows: pd.DataFrame) -> str:
    """Why a solver's samples do not reach a level: its budget, itself, or what stopped it."""
    first = rows.iloc[0]
    if Ending.of(first["ending"]) is Ending.TIME_LIMIT:
        return f"not within {first['time_limit']:g} s"
    return "never" if first["ending"].startswith("it says") else "-"


def write_convergence(folder: Path) -> list[Path]:
    """Write convergence.md, .svg and .png; return their paths."""
    table = load_convergence(folder)
    text = folder / "convergence.md"
    text.write_text(markdown(as_document(table, read_machines(folder))), encoding="utf-8")
    return [text, *draw_convergence(table, folder / "convergence")]


def as_document(table: pd.DataFrame, machines: Mapping[str, Mapping[str, object]]) -> Document:
    """Seconds and iterations to reach each level of gap and violation."""
    first = table.iloc[0]
    sizes = f"{first['variables']:.0f} variables, {first['constraints']:.0f} constraints. "
    endings = [f"{name}: {rows.ending.iloc[0]}" for name, rows in methods(table)]
    parts: list[Part] = [
        Prose(sizes + EXPLANATION.replace("\n", " ")),
        _table(table, "relative_gap", "relative gap"),
        _table(table, "max_violation", "violation"),
        Document("How each ended", [Items(endings)]),
        machine_section(machines),
    ]
    return Document(f"Convergence: {_title(first)}", parts)


def _title(sample: pd.Series) -> str:
    return f"{sample['scenario']}, projection {sample['frame']:.0f}"


def _table(table: pd.DataFrame, measure: str, name: str) -> Table:
    """A line a method: seconds and iterations to each level, and the least that it reached."""
    columns = [c for level in LEVELS for c in (Column(power(level), "s"), "iterations")]
    lines = []
    for label, rows in methods(table):
        efforts = [text for level in LEVELS for text in _effort(rows, measure, level)]
        lines.append([label, *efforts, rows[measure].iloc[-1]])
    header = ["method", *columns, Column("at the end", form=power)]
    return Table(f"To reach a {name}", header, lines, nothing="-")


def _effort(rows: pd.DataFrame, measure: str, level: float) -> list[str]:
    """Seconds and iterations to a level."""
    sample = reached(rows, measure, level)
    if sample is None:
        return [unreached(rows), ""]
    return [f"{sample['seconds']:.2g}", f"{sample['iterations']:.0f}"]


def draw_convergence(table: pd.DataFrame, stem: Path) -> list[Path]:
    """Rows violation, gap, distance; columns seconds, iterations."""
    drawn = [(n, rows) for n, rows in methods(table) if rows["seconds"].notna().any()]
    if not drawn:
        return []
    style = styles([name for name, _ in drawn])
    figure = Figure(figsize=(11.5, 10.5), layout="constrained")
    axes = figure.subplots(len(PANELS), len(AXES), sharex="col", sharey="row")
    start = table[table["solver"] == CANDIDATE].iloc[0]
    limits = {
        "relative_gap": start["reference_gap"],
        "distance_mm": 1000 * start["reference_error"],
    }
    for row, (measure, name, floor) in zip(axes, PANELS, strict=True):
        for ax, (against, _) in zip(row, AXES, strict=True):
            for label, rows in drawn:
                _curve(ax, rows, against, measure, floor, style[label], label.endswith("°"))
            _frame(ax, start[measure], limits.get(measure, 0.0))
        lowest = np.fmax(table[measure].min(), floor)
        row[0].set_ylim(lowest / 3, ABOVE * np.fmax(start[measure], lowest))
        row[0].set_ylabel(name)
    for ax, (_, name) in zip(axes[-1], AXES, strict=True):
        ax.set_xlabel(name)
    figure.suptitle(escape.chart(_title(start)), size=11)
    handles = [
        Line2D([], [], label=escape.chart(n), **_line(n.endswith("°")), **style[n])
        for n, _ in drawn
    ]
    handles.append(Line2D([], [], label="the candidate itself", **ITSELF))
    handles.append(Line2D([], [], label="reference certified to", **RESOLVED))
    handles.append(Line2D([], [], linestyle="none", label="° answers at tolerances"))
    figure.legend(handles=handles, loc="outside right upper", frameon=False, fontsize=9)
    return save(figure, stem)


ITSELF: dict[str, Any] = {"color": "#777777", "linestyle": ":", "linewidth": 1}


def _line(by_answer: bool) -> dict[str, Any]:
    """Full for iterates, dashed with hollow markers for answers at tolerances."""
    return {
        "linestyle": (0, (4, 2)) if by_answer else "-",
        "fillstyle": "none" if by_answer else "full",
        "linewidth": 1.3,
        "markersize": 6,
    }


def _curve(
    ax: Axes,
    rows: pd.DataFrame,
    against: str,
    measure: str,
    floor: float,
    style: dict[str, Any],
    by_answer: bool,
) -> None:
    """One method in one panel; values below the floor are drawn there."""
    x = rows[against].clip(lower=1 if against == "iterations" else 1e-6)
    every = None if by_answer else 0.08  # of the panel's diagonal between two markers
    ax.plot(x, rows[measure].clip(lower=floor), markevery=every, **_line(by_answer), **style)


def _frame(ax: Axes, start: float, resolved: float) -> None:
    """Axes, and the lines that do not depend on a method."""
    ax.set_xscale("log")
    ax.set_yscale("log")
    ax.grid(visible=True, which="major", color="#dddddd", linewidth=0.6)
    ax.axhline(start, **ITSELF)
    if 0 < resolved < float("inf"):
        ax.axhline(resolved, **RESOLVED)
