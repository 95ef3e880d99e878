"""Total energy against time, one line a run."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pandas as pd
from pandas.api.typing import SeriesGroupBy

from strainbench.arrays import FloatArray
from strainbench.report.charts.axes import Axis, even_ticks
from strainbench.report.charts.canvas import Spec, about
from strainbench.report.charts.chart import Chart
from strainbench.report.charts.curves import Curve, Curves, point
from strainbench.report.charts.target import Target
from strainbench.report.charts.text import HELD
from strainbench.report.energy import energies
from strainbench.report.identity import integrator_look, look
from strainbench.report.names import settings
from strainbench.report.table import UNCONSTRAINED

LOW = 2.0  # times the loss of the runs that lose energy: how far below the start the axis goes
EDGE = 0.04  # of the axis, beyond the highest and the lowest
MOST = 400  # points of a line
HEAD = "energy beyond the plane:"
CAPTION = """\
Total energy after each step: kinetic, gravity, membrane, bending and contact energy together.
Rising energy is a sign of instability; a line that leaves the plane is named at the top."""


def energy(folder: Path, runs: pd.DataFrame, target: Target, least: float = 0.0) -> list[Chart]:
    """A chart a scene, mesh and limit of which at least `least` seconds were simulated."""
    table = energies(folder, runs).merge(
        runs[["cell", "integrator", "solver", "scenario_parameters"]], on="cell"
    )
    charts: list[Chart] = []
    for panel, rows in table.groupby("panel", sort=False):
        if rows["time"].max() >= least and rows["time"].gt(0).any():
            number = f"-{len(charts) + 1}" if charts else ""
            charts.append(_chart(f"energy{number}", str(panel), rows, target))
    return charts


def _chart(name: str, panel: str, rows: pd.DataFrame, target: Target) -> Chart:
    rows = rows.assign(energy=1000 * rows["energy"])
    low, high = _span(rows.groupby("cell")["energy"])
    x = Axis("time [s]", 0.0, float(rows["time"].max()), even_ticks(0, rows["time"].max()), False)
    y = Axis("total energy [mJ]", low, high, even_ticks(low, high), False)
    names, alike = _short(rows)
    curves, failures = [], []
    for found, line in _looks(rows):
        label = names[line["curve"].iloc[0]]
        beyond = line[line["energy"] > high]
        curves.append(
            Curve(found | {"line": label}, "" if len(beyond) else label, _points(line, (low, high)))
        )
        if len(beyond):
            text = f"{label}: blows up at {beyond['time'].iloc[0]:.2g} s"
            failures.append(found | {"text": text})
    spec = Curves(
        f"Total energy: {', '.join([panel, *alike])}",
        x,
        y,
        curves,
        marks=False,
        failures=failures,
        head=HEAD,
    ).spec(target)
    return Chart(name, panel, CAPTION.replace("\n", " "), spec)


def _short(rows: pd.DataFrame) -> tuple[dict[str, str], list[str]]:
    """What to call each run, without what all runs with limits share; and that."""
    limited = rows[rows["solver"] != UNCONSTRAINED]["curve"].unique()
    parts = [str(name).split(", ") for name in limited]
    alike = [p for p in (parts[0][1:] if len(parts) > 1 else []) if all(p in q for q in parts)]
    short = {
        str(name): ", ".join(p.replace(" ", HELD) for p in str(name).split(", ") if p not in alike)
        or str(name)
        for name in rows["curve"].unique()
    }
    return short, alike


def _span(energies_: SeriesGroupBy) -> tuple[float, float]:
    """Where the axis begins and ends: with all runs on it but those that blow up or fall away."""
    start, lowest = float(energies_.first().median()), float(energies_.min().median())
    drop = max(start - lowest, 1e-9)
    low = max(float(energies_.min().min()), start - LOW * drop)
    high = min(float(energies_.max().max()), start + drop)
    return low - EDGE * (high - low) - 1e-9, high + EDGE * (high - low) + 1e-9


def _points(line: pd.DataFrame, span: tuple[float, float]) -> list[Spec | None]:
    """At most MOST of a run's, evenly; a gap where it is out of the span."""
    kept = np.unique(np.linspace(0, len(line) - 1, min(len(line), MOST)).round().astype(int))
    times, values = (line[name].to_numpy(float)[kept] for name in ("time", "energy"))
    ends = [end for k in range(len(times) - 1) for end in _crossings(times, values, k, span)]
    found = sorted([*zip(times, values, strict=True), *ends])
    points = [point(t, e) if span[0] <= e <= span[1] else None for t, e in found]
    return points if any(points) else [point(times[-1], float(np.clip(values[-1], *span)))]


def _crossings(
    times: FloatArray, values: FloatArray, k: int, span: tuple[float, float]
) -> Iterator[tuple[float, float]]:
    """Where a run leaves or enters the span between one point and the next."""
    here, there = values[k : k + 2]
    for edge in span:
        if (here - edge) * (there - edge) < 0:
            yield times[k] + (times[k + 1] - times[k]) * (edge - here) / (there - here), edge


def _looks(rows: pd.DataFrame) -> Iterator[tuple[Spec, pd.DataFrame]]:
    """Each run with its look: its integrator's, or its method's where there is one integrator.

    Of runs with one integrator the one with the larger step is the darker.
    """
    rows = rows.assign(step=[settings(t).get("step", 0.0) for t in rows["scenario_parameters"]])
    limited = rows[rows["solver"] != UNCONSTRAINED]
    by_method = limited["integrator"].nunique() == 1 and limited["solver"].nunique() > 1
    for _, line in rows.groupby("cell", sort=False):
        run = line.iloc[0]
        if by_method or run["solver"] == UNCONSTRAINED:
            yield about(run["solver"], look(run["solver"])), line
            continue
        alike = limited[limited["integrator"] == run["integrator"]]["step"].unique()
        larger, others = int((alike > run["step"]).sum()), len(alike) - 1
        pale = larger / others if others else 0.0
        yield about(run["solver"], integrator_look(run["integrator"], pale)), line
