"""Time and accuracy against one setting of a scene (Tang et al. 2022, section 5.1)."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle

from strainbench import escape
from strainbench.document import Column, Table
from strainbench.report.chart import CERTIFIED, FLOOR_MM, draw_certified, save, styles
from strainbench.report.lines import MEASURES, marked, ranked
from strainbench.report.names import describe, digits, digits_of, settings
from strainbench.report.table import UNCONSTRAINED

FEWEST = 3  # values of a setting that make a sweep
APART = 1.6  # times the largest number: where a chart has the words among the values
PANELS = (
    "seconds a projection",
    "distance to optimum [mm]",
    "largest principal stretch\nbeyond the limit",
)
LINE = ["scenario", "rest", "mode", "tolerance", "steps"]
POINT: dict[str, Any] = {"markersize": 5, "linewidth": 1.2}
ROOM = 24  # characters of all ticks beside each other
BAND = 0.15  # of a panel's height
FLOOR = 1e-9  # of stretch beyond the limit: less is drawn here
BEYOND = """\
`beyond`: the largest principal stretch of any triangle less 1 + limit. Sampled directions let the
true stretch go further between them; `exact` limits the principal stretch itself."""


def sweeps(runs: pd.DataFrame) -> dict[str, pd.DataFrame]:
    """For each setting of a scene with at least three numbers, the rows by its value.

    Words among the values, such as exact directions, come last: `value` is a place beyond all
    numbers, `shown` the word. Rows of one `line` differ in nothing but the value and the solver.
    """
    parameters = [settings(text) for text in runs["scenario_parameters"]]
    found = {}
    for key in dict.fromkeys(k for p in parameters for k in p):
        values = pd.Series([p.get(key) for p in parameters], runs.index, dtype=object)
        numbers = {v for v in values if isinstance(v, int | float) and not isinstance(v, bool)}
        if len(numbers) >= FEWEST:
            words = values.map(lambda v: isinstance(v, str))
            rows = runs.assign(value=pd.to_numeric(values.mask(words, APART * max(numbers))))
            precision = digits_of(numbers)
            rows["shown"] = [f"{v:.{precision}g}" if v in numbers else str(v) for v in values]
            rest = [{k: v for k, v in p.items() if k != key} for p in parameters]
            rows["rest"] = [json.dumps(r, sort_keys=True) for r in rest]
            rows["steps"] = 0 if key == "step" else runs["steps_asked"]  # step sizes: of a duration
            rows["line"] = rows.groupby(LINE, sort=False, dropna=False).ngroup()
            rows = rows[(rows["solver"] != UNCONSTRAINED) & rows["value"].notna()]
            rows = rows[rows.groupby("line")["value"].transform("nunique") >= FEWEST]
            if len(rows):
                found[key] = rows.sort_values("value", kind="stable")
    return found


def beyond(rows: pd.DataFrame) -> pd.Series:
    """How far the largest principal stretch goes beyond 1 + limit; 0 where it does not."""
    return (rows["max_principal_stretch"] - (1 + rows["limit"])).clip(lower=0)


def beyond_text(row: pd.Series) -> str:
    """The same of one cell."""
    return "" if pd.isna(row["beyond"]) else f"{row['beyond']:.2g}"


def sweep_tables(runs: pd.DataFrame) -> list[Table]:
    """A table for each sweep: a line a value and solver."""
    return [
        _table(key, group, rows)
        for key, rows in sweeps(runs).items()
        for _, group in rows.assign(beyond=beyond(rows)).groupby("line", sort=False)
    ]


def _table(key: str, group: pd.DataFrame, rows: pd.DataFrame) -> Table:
    """That of one line among the rows of its sweep."""
    first = group.iloc[0]
    rest = describe(first["rest"], (), digits(rows["rest"]))
    about = ", ".join(filter(None, (first["mode"], rest, *_how(first, rows))))
    lines = [
        [row["shown"], *texts, beyond_text(row)]
        for _, at in group.groupby("value")
        for row, texts in marked(ranked(at))
    ]
    header: list[str | Column] = [key, "method", *MEASURES, "beyond"]
    return Table(f"{first['scenario']} against {key} ({about})", header, lines)


def draw_sweeps(folder: Path, runs: pd.DataFrame) -> list[Path]:
    """sweep-<setting>.svg and .png: seconds, distance, true stretch against each setting."""
    paths = []
    for key, rows in sweeps(runs).items():
        figure = Figure(figsize=(13, 3.6), layout="constrained")
        axes = figure.subplots(1, 3)
        lines = list(rows.groupby(["solver", "line"], sort=False))
        style = styles([f"{solver} {line}" for (solver, line), _ in lines])
        for ax, name in zip(axes, PANELS, strict=True):
            _axes(ax, rows, key, name)
        handles = []
        for number, ((solver, line), cells) in enumerate(lines, start=1):
            look = style[f"{solver} {line}"]
            _draw_line(axes, cells, look, 1 - BAND * number / (1 + len(lines)))
            label = escape.chart(", ".join([solver, *_differs(cells.iloc[0], rows)]))
            handles.append(Line2D([], [], label=label, **POINT, **look))
        if (rows["outcome"] == "no answer").any():
            for ax in axes:
                _band(ax)
        if (rows["outcome"] == "violated").any():
            hollow: dict[str, Any] = {
                "label": "violates the limits",
                "marker": "o",
                "color": "#777777",
            }
            handles.append(Line2D([], [], linestyle="none", fillstyle="none", **hollow, **POINT))
        certified = {"label": "reference certified to", **POINT, **CERTIFIED, "markersize": 10}
        handles.append(Line2D([], [], **certified))
        figure.legend(handles=handles, loc="outside right upper", frameon=False, fontsize=8)
        paths += save(figure, folder / f"sweep-{key}")
    return paths


def _axes(ax: Axes, rows: pd.DataFrame, key: str, name: str) -> None:
    """Scales, ticks at the values, labels."""
    ax.set_yscale("log")
    if rows["value"].min() > 0 and rows["value"].max() > 8 * rows["value"].min():
        ax.set_xscale("log")
    ticks = rows.drop_duplicates("value")
    crowded = ticks["shown"].str.len().sum() > ROOM
    slant: dict[str, Any] = {"rotation": 40, "ha": "right", "rotation_mode": "anchor"}
    ax.set_xticks(
        ticks["value"],
        [escape.chart(v) for v in ticks["shown"]],
        size=8,
        **(slant if crowded else {}),
    )
    ax.xaxis.minorticks_off()
    everywhere = ax.get_xaxis_transform()  # so that all panels have the same values
    ax.plot(ticks["value"], [0.5] * len(ticks), alpha=0, transform=everywhere)
    ax.set_xlabel(key)
    ax.set_ylabel(name)
    ax.grid(visible=True, color="#dddddd", linewidth=0.6)


def _draw_line(
    axes: Sequence[Axes], cells: pd.DataFrame, look: dict[str, Any], height: float
) -> None:
    """One method in the three panels: in the band, at `height`, where it has no answer, the line
    broken there; hollow where it violates the limits."""
    value, outcome = cells["value"], cells["outcome"]
    measures = (
        cells["solve_seconds_mean"],
        (1000 * cells["distance_max"]).clip(lower=FLOOR_MM),
        beyond(cells).clip(lower=FLOOR),
    )
    point = {**POINT, **look, "linestyle": "none"}
    for _, row in cells[outcome != "no answer"].iterrows():
        draw_certified(axes[1], row["value"], row, look["color"])
    for ax, measure in zip(axes, measures, strict=True):
        known = measure.replace(np.inf, np.nan).mask(outcome == "no answer")
        ax.plot(value, known, color=look["color"], linewidth=1.2)
        ax.plot(value, known.mask(outcome == "violated"), **point)
        ax.plot(value, known.where(outcome == "violated"), **point, fillstyle="none")
        failed = value[outcome == "no answer"]
        across = ax.get_xaxis_transform()
        ax.plot(failed, [height] * len(failed), **point, fillstyle="none", transform=across)


def _band(ax: Axes) -> None:
    """The upper part of a panel, for cells without an answer."""
    bottom, top = ax.get_ylim()
    ax.set_ylim(bottom, top * (top / bottom) ** (BAND / (1 - BAND)))
    across: dict[str, Any] = {"color": "#eeeeee", "zorder": 0, "transform": ax.transAxes}
    ax.add_patch(Rectangle((0, 1 - BAND), 1, BAND, **across))
    ax.text(0.02, 0.98, "no answer", transform=ax.transAxes, va="top", size=8, color="#555555")


def _how(row: pd.Series, rows: pd.DataFrame) -> list[str]:
    """What of its tolerance and steps sets a line apart from the others of its sweep."""
    tolerance = [f"tolerance {row['tolerance']:g}"] if rows["tolerance"].nunique() > 1 else []
    return tolerance + ([f"{row['steps']:.0f} steps"] if rows["steps"].nunique() > 1 else [])


def _differs(row: pd.Series, rows: pd.DataFrame) -> list[str]:
    """The same of all that may set it apart."""
    words = [row[name] for name in ("scenario", "mode") if rows[name].nunique() > 1]
    every = [settings(text) for text in rows["rest"].unique()]
    same = [k for k in settings(row["rest"]) if len({json.dumps(e.get(k)) for e in every}) == 1]
    words.append(describe(row["rest"], same, digits(rows["rest"])))
    return [word for word in (*words, *_how(row, rows)) if word]
