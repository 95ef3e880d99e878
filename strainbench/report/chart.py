"""Speed against accuracy: seconds a projection, distance from the certified optimum."""

from __future__ import annotations

from pathlib import Path
from textwrap import wrap
from typing import Any

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from strainbench import escape
from strainbench.report.names import cells
from strainbench.report.table import Group, groups

COLOURS = ("#0072B2", "#E69F00", "#009E73", "#D55E00", "#CC79A7", "#56B4E9", "#000000", "#999933")
"""Okabe and Ito's set for the colour-blind, its yellow darkened to be seen on white."""
MARKERS = "osD^vP*X<>hp"
LEGEND_INCHES = 2.2
FLOOR_MM = 1e-6
"""Distances below are drawn here: the reference itself is not known better."""


BAND = 4.0
"""The band of those without an answer begins at its middle over this, and ends at times this."""
SPREAD = 4.0  # from the fastest solve to those that solved nothing, and to the panel's edges


RESOLVED: dict[str, Any] = {"color": "#777777", "linestyle": "--", "linewidth": 1}
"""The line below which distances are from the reference, not provably from the optimum."""


CERTIFIED: dict[str, Any] = {"color": "#777777", "marker": "|", "linestyle": "none"}
"""In the legend, the line from least to largest distance that a cell's own reference leaves."""


def styles(solvers: list[str]) -> dict[str, dict[str, Any]]:
    """One colour and marker a solver; no two of the first 24 share both."""
    return {
        name: {"color": COLOURS[i % len(COLOURS)], "marker": MARKERS[i % len(MARKERS)]}
        for i, name in enumerate(solvers)
    }


def speed_accuracy(runs: pd.DataFrame, stem: Path) -> list[Path]:
    """A figure a table, replayed ones first: in these all solvers had the same input.

    Writes `stem`.svg and .png, then `stem`-2 and so on; a solver looks the same in all of them.
    """
    style = styles(list(dict.fromkeys(runs["solver"])))
    ordered = sorted(groups(runs), key=lambda group: group.runs["mode"].iloc[0] != "replay")
    paths = []
    for number, group in enumerate(ordered, start=1):
        name = stem.name if number == 1 else f"{stem.name}-{number}"
        paths += _draw_group(group, style, stem.with_name(name))
    return paths


def _draw_group(group: Group, style: dict[str, dict[str, Any]], stem: Path) -> list[Path]:
    """One panel a mesh and limit."""
    runs, limits, meshes = group.runs, group.limits, group.meshes
    style = {solver: style[solver] for solver in dict.fromkeys(runs["solver"])}
    width = LEGEND_INCHES + 3.4 * len(meshes)
    height = max(1.2 + 2.9 * len(limits), 1.0 + 0.2 * len(style))
    figure = Figure(figsize=(width, height), layout="constrained")
    axes = figure.subplots(len(limits), len(meshes), sharex=True, sharey=True, squeeze=False)
    known = 1000 * runs["distance_max"].replace(np.inf, np.nan).clip(lower=FLOOR_MM / 1000)
    top = 30 * known.max() if known.notna().any() else 1.0
    seconds = runs["solve_seconds_mean"].fillna(
        np.fmin(runs["solve_seconds_mean"].min(), 1.0) / SPREAD
    )
    runs = runs.assign(seconds=seconds)
    axes[0, 0].set_xlim(seconds.min() / SPREAD, seconds.max() * SPREAD)
    for (limit, mesh), rows in runs.groupby(["bound", "mesh"], sort=False):
        ax = axes[limits.index(limit), meshes.index(mesh)]
        _panel(ax, rows, style, top)
        title = f"{cells(mesh)}, {limit} limit" if limit else cells(mesh)
        ax.set_title(escape.chart(title), size=10)
    for row in axes:
        row[0].set_ylabel("distance to optimum [mm]")
    for ax in axes[-1]:
        ax.set_xlabel("seconds a projection")
    room = int(12 * (width - LEGEND_INCHES - 0.8))  # in characters, beside the legend
    figure.suptitle(
        "\n".join(map(escape.chart, wrap(group.title, room))), size=10, x=0.01, ha="left"
    )
    figure.legend(handles=_legend(style), loc="outside right upper", frameon=False, fontsize=9)
    return save(figure, stem)


def save(figure: Figure, stem: Path) -> list[Path]:
    """Write `stem`.svg, with text as text, and `stem`.png."""
    paths = [stem.with_suffix(".svg"), stem.with_suffix(".png")]
    with mpl.rc_context({"svg.fonttype": "none", "svg.hashsalt": "strainbench"}):
        figure.savefig(paths[0], metadata={"Date": None})
        figure.savefig(paths[1], dpi=150)
    return paths


def _panel(ax: Axes, rows: pd.DataFrame, style: dict[str, dict[str, Any]], top: float) -> None:
    """The points of one mesh and limit; failures in a band with its middle at `top` [mm]."""
    ax.set_xscale("log")
    ax.set_yscale("log")
    ax.grid(visible=True, which="major", color="#dddddd", linewidth=0.6)
    ax.axhspan(top / BAND, top * BAND, color="#eeeeee", zorder=0)
    ax.set_ylim(FLOOR_MM / 3, top * BAND)
    ax.text(0.02, 0.985, "no answer", transform=ax.transAxes, va="top", size=8, color="#555555")
    for _, row in rows.iterrows():
        answered = row["outcome"] != "no answer"
        seen = min(max(1000 * row["distance_max"], FLOOR_MM), top / BAND)  # it may be infinite
        look = style[row["solver"]]
        ax.plot(
            row["seconds"],
            seen if answered else top,
            linestyle="none",
            markersize=8,
            markeredgewidth=1.4,
            fillstyle="full" if row["outcome"] in ("optimal", "feasible") else "none",
            **look,
        )
        if answered:
            draw_certified(ax, row["seconds"], row, look["color"])
    unknown = rows[rows["distance_max"].isna() & (rows["outcome"] != "no answer")]
    if len(unknown):
        names = wrap(f"no distance known: {', '.join(unknown['solver'])}", 48)
        ax.text(
            0.02,
            0.02,
            "\n".join(map(escape.chart, names)),
            transform=ax.transAxes,
            size=7,
            color="#555555",
        )


def draw_certified(ax: Axes, x: float, row: pd.Series, colour: str) -> None:
    """The distances to the optimum that are left open, as the reference is not the optimum."""
    distance, error = 1000 * row["distance_max"], 1000 * row["reference_error_max"]
    if np.isfinite(distance) and 0 < error < np.inf:
        ends = np.maximum([distance - error, distance + error], FLOOR_MM)
        ax.vlines(x, *ends, color=colour, linewidth=1, alpha=0.6)


def _legend(style: dict[str, dict[str, Any]]) -> list[Line2D]:
    mark: dict[str, Any] = {"linestyle": "none", "markersize": 8}
    handles = [
        Line2D([], [], label=escape.chart(name), **mark, **look) for name, look in style.items()
    ]
    for label, fill in (("within the limits", "full"), ("violates them", "none")):
        handles.append(
            Line2D([], [], label=label, marker="o", color="#777777", fillstyle=fill, **mark)
        )
    handles.append(Line2D([], [], label="reference certified to", markersize=11, **CERTIFIED))
    return handles
