"""Total energy against time (Tang et al. 2022, Figs. 4 and 5)."""

from __future__ import annotations

import json
from pathlib import Path

import pandas as pd
from matplotlib.figure import Figure

from strainbench import escape
from strainbench.records import STEP_COLUMNS, latest_steps
from strainbench.report.chart import COLOURS, save
from strainbench.report.table import UNCONSTRAINED

PARTS = [
    "kinetic_energy",
    "gravity_energy",
    "membrane_energy",
    "bending_energy",
    "contact_energy",
]
DASHES = ("-", "--", "-.", ":", (0, (5, 1, 1, 1, 1, 1)))
TABLE = """# Total energy

After each step. Energy above that of the first steps is a sign of instability; a run that comes to
rest has a small range in its last quarter.

| scene | run | steps | time [s] | first [mJ] | highest | last | range in the last quarter |
| --- | --- | --- | --- | --- | --- | --- | --- |"""
LOW = 2.0  # the axis shows energies down to this many times the lowest of the runs that lose energy


def energies(folder: Path, runs: pd.DataFrame) -> pd.DataFrame:
    """Total energy of every step of the simulated runs, in the order of the runs.

    Columns: cell, panel and curve (what tells its panel and its curve from others), time [s],
    energy [J].
    """
    steps = pd.DataFrame(latest_steps(folder), columns=list(STEP_COLUMNS))
    for column in ("step", "time", *PARTS):
        steps[column] = pd.to_numeric(steps[column].replace("nan", ""))
    steps = steps.dropna(subset=["time", "kinetic_energy"]).drop_duplicates(
        ["cell", "step"], keep="last"
    )
    names = {row["cell"]: _names(row) for _, row in runs.iterrows() if row["mode"] == "simulate"}
    order = {cell: k for k, cell in enumerate(names)}
    steps = steps[steps["cell"].isin(names)]
    steps = steps.assign(order=steps["cell"].map(order)).sort_values(["order", "step"])
    steps["panel"] = [names[cell][0] for cell in steps["cell"]]
    steps["curve"] = [names[cell][1] for cell in steps["cell"]]
    steps["energy"] = steps[PARTS].sum(axis=1)
    return steps[["cell", "panel", "curve", "time", "energy"]]


def _names(row: pd.Series) -> tuple[str, str]:
    """Panel and curve of a run: the scheme's name, IE where nothing is limited."""
    settings = json.loads(row["scenario_parameters"])
    alone = row["solver"] == UNCONSTRAINED
    scheme = "IE" if alone and row["integrator"] == "sap" else row["integrator"].upper()
    solver = "" if alone else f", {row['solver']}"
    panel = f"{row['scenario']}, {row['resolution']:.0f} cells, {100 * row['limit']:g}% limit"
    return panel, f"{scheme}{solver}, dt = {1000 * settings.get('step', 0):.3g} ms"


def energy_markdown(folder: Path, runs: pd.DataFrame) -> str:
    """A table of each run's energies, or nothing without energies."""
    lines = []
    for _, run in energies(folder, runs).groupby("cell", sort=False):
        energy = 1000 * run["energy"].to_numpy()
        late = energy[-max(2, len(energy) // 4) :]
        values = (energy[0], energy.max(), energy[-1], late.max() - late.min())
        first, end = run.iloc[0], run["time"].max()
        numbers = " | ".join(f"{v:.4g}" for v in (end, *values))
        words = " | ".join(escape.markdown(first[k]) for k in ("panel", "curve"))
        lines.append(f"| {words} | {len(run)} | {numbers} |")
    return "\n".join([TABLE, *lines]) + "\n" if lines else ""


def draw_energy(folder: Path, runs: pd.DataFrame) -> list[Path]:
    """energy.svg and .png, one panel a scene, resolution and limit; nothing without energies."""
    table = energies(folder, runs)
    if table.empty:
        return []
    panels = list(dict.fromkeys(table["panel"]))
    curves = list(dict.fromkeys(table["curve"]))
    figure = Figure(figsize=(9.5, 0.6 + 3.2 * len(panels)), layout="constrained")
    for ax, panel in zip(figure.subplots(len(panels), squeeze=False)[:, 0], panels, strict=True):
        shown = table[table["panel"] == panel]
        for k, curve in enumerate(curves):
            line = shown[shown["curve"] == curve]
            ax.plot(
                line["time"],
                1000 * line["energy"],
                color=COLOURS[k % len(COLOURS)],
                linestyle=DASHES[k // len(COLOURS) % len(DASHES)],
                linewidth=1.4,
                label=escape.chart(curve),
            )
        start = 1000 * float(shown.groupby("cell")["energy"].first().max())
        lowest = 1000 * float(shown.groupby("cell")["energy"].min().median())
        ax.set_ylim(LOW * min(lowest, start - 1e-9), start + abs(lowest - start))
        ax.set_title(escape.chart(panel), size=10)
        ax.set_xlabel("time [s]")
        ax.set_ylabel("total energy [mJ]")
        ax.grid(visible=True, color="#dddddd", linewidth=0.6)
    handles, labels = figure.axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside right upper", frameon=False, fontsize=9)
    return save(figure, folder / "energy")
