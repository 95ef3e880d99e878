"""Speed against accuracy: seconds a projection, distance from the certified optimum."""

from __future__ import annotations

from pathlib import Path
from textwrap import wrap
from typing import Any

import matplotlib as mpl
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from strainbench import escape
from strainbench.report.table import groups

COLOURS = ("#0072B2", "#E69F00", "#009E73", "#D55E00", "#CC79A7", "#56B4E9", "#000000", "#999933")
"""Okabe and Ito's set for the colour-blind, its yellow darkened to be seen on white."""
MARKERS = "osD^vP*X<>hp"
LEGEND_INCHES = 2.2
FLOOR_MM = 1e-6
"""Distances below are drawn here: the reference itself is not known better."""


RESOLVED: dict[str, Any] = {"color": "#777777", "linestyle": "--", "linewidth": 1}
"""The line below which distances are from the reference, not provably from the optimum."""


def styles(solvers: list[str]) -> dict[str, dict[str, Any]]:
    """One colour and marker a solver; no two of the first 24 share both."""
    return {
        name: {"color": COLOURS[i % len(COLOURS)], "marker": MARKERS[i % len(MARKERS)]}
        for i, name in enumerate(solvers)
    }


def speed_accuracy(runs: pd.DataFrame, stem: Path) -> list[Path]:
    """One panel a resolution and limit of the first table; writes `stem`.svg and .png.

    Replayed rows are preferred where there are any: all solvers had the same input.
    """
    replayed = runs[runs["mode"] == "replay"]
    group = next(iter(groups(replayed if len(replayed) else runs)))
    runs = group.runs
    panels = list(runs.groupby(["limit", "resolution"]))
    limits = sorted(runs["limit"].unique())
    resolutions = sorted(runs["resolution"].unique())
    style = styles(list(dict.fromkeys(runs["solver"])))
    width = LEGEND_INCHES + 3.4 * len(resolutions)
    height = max(1.2 + 2.9 * len(limits), 1.0 + 0.2 * len(style))
    figure = Figure(figsize=(width, height), layout="constrained")
    axes = figure.subplots(len(limits), len(resolutions), sharex=True, sharey=True, squeeze=False)
    known = 1000 * runs["distance_max"].dropna().clip(lower=FLOOR_MM / 1000)
    top = 30 * known.max() if len(known) else 1.0
    for (limit, resolution), rows in panels:
        ax = axes[limits.index(limit), resolutions.index(resolution)]
        _panel(ax, rows, style, top)
        ax.set_title(f"{resolution:.0f}×{resolution:.0f} cells, {100 * limit:g}% limit", size=10)
    for row in axes:
        row[0].set_ylabel("distance to optimum [mm]")
    for ax in axes[-1]:
        ax.set_xlabel("seconds a projection")
    room = int(13 * (width - 2 * LEGEND_INCHES))  # in characters, beside the legend if centred
    figure.suptitle("\n".join(map(escape.chart, wrap(group.title, max(room, 40)))), size=11)
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
    """The points of one resolution and limit; failures in a band at the top."""
    ax.set_xscale("log")
    ax.set_yscale("log")
    ax.grid(visible=True, which="major", color="#dddddd", linewidth=0.6)
    ax.axhspan(top / 4, top * 4, color="#eeeeee", zorder=0)
    ax.set_ylim(FLOOR_MM / 3, top * 4)
    ax.text(0.02, 0.985, "no answer", transform=ax.transAxes, va="top", size=8, color="#555555")
    resolved = 1000 * rows["reference_error_max"].max()
    if resolved > FLOOR_MM:
        ax.axhline(resolved, **RESOLVED)
    for _, row in rows.iterrows():
        answered = row["outcome"] != "no answer"
        seconds = row["solve_seconds_mean"]
        if pd.isna(seconds):
            seconds = 1e-6  # nothing was solved: at the left edge of the band
        ax.plot(
            max(seconds, 1e-6),
            max(1000 * row["distance_max"], FLOOR_MM) if answered else top,
            linestyle="none",
            markersize=8,
            markeredgewidth=1.4,
            fillstyle="full" if row["outcome"] in ("optimal", "feasible") else "none",
            **style[row["solver"]],
        )


def _legend(style: dict[str, dict[str, Any]]) -> list[Line2D]:
    handles = [
        Line2D([], [], linestyle="none", markersize=8, label=escape.chart(name), **s)
        for name, s in style.items()
    ]
    for label, fill in (("within the limits", "full"), ("violates them", "none")):
        handles.append(
            Line2D(
                [],
                [],
                linestyle="none",
                marker="o",
                color="#777777",
                fillstyle=fill,
                markersize=8,
                label=label,
            )
        )
    handles.append(Line2D([], [], label="reference certified to", **RESOLVED))
    return handles
