"""Total energy against time (Tang et al. 2022, Figs. 4 and 5)."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pandas as pd

from strainbench.arrays import FloatArray
from strainbench.document import Column, Prose, Table
from strainbench.report.measures import OUT_OF_TIME, STUCK
from strainbench.report.names import CURVE_FILE, MESH_FILE, SPANNED, apart, cells, digits, settings
from strainbench.report.rows import Row, rows_of
from strainbench.report.steps import newest_steps
from strainbench.report.table import UNCONSTRAINED

PARTS = [
    "kinetic_energy",
    "gravity_energy",
    "membrane_energy",
    "bending_energy",
    "contact_energy",
]
IN_NAMES = {*SPANNED, MESH_FILE, CURVE_FILE, "step", "integrator"}
"""Settings that panels and curves are called by anyway."""
EXPLANATION = """\
After each step. Energy above that of the first steps is a sign of instability; a run that comes to
rest has a small range in its last quarter. Rises: the sum of all of them. Fluctuation: root mean
square of the second difference. Turns: how often the energy begins to rise, or to fall."""
NUMBERS = {"time": "s", "first": "mJ", "highest": "", "last": "", "range in the last quarter": ""}
UNSTEADY = {"rises": "", "fluctuation": ""}
"""Columns with their units, and further ones."""
ENDED = "ended after"  # in the names of runs without an answer to the end


def energies(folder: Path, runs: pd.DataFrame) -> pd.DataFrame:
    """Total energy of every step of the simulated runs, in the order of the runs.

    A step that the clock cut off is none, nor is one of a motion that is stuck. Columns: cell,
    panel and curve (what tells its panel and its curve from others), time [s], energy [J].
    """
    simulated = runs[runs["mode"] == "simulate"]
    steps = newest_steps(folder, simulated)[["cell", "step", "time", *PARTS]].copy()
    for column in ("step", "time", *PARTS):
        steps[column] = pd.to_numeric(steps[column].replace("nan", ""))
    steps = steps.dropna(subset=["time", "kinetic_energy"]).drop_duplicates(
        ["cell", "step"], keep="last"
    )
    early = (simulated["ending"] == OUT_OF_TIME) | (simulated["why"] == STUCK)
    last = simulated[early].set_index("cell")["done"]
    steps = steps[steps["step"] <= steps["cell"].map(last).fillna(np.inf)]
    names = _names(simulated)
    steps = steps.assign(order=steps["cell"].map({c: k for k, c in enumerate(names.index)}))
    steps = steps.sort_values(["order", "step"]).join(names, on="cell")
    steps["energy"] = steps[PARTS].sum(axis=1)
    return steps[["cell", "panel", "curve", "time", "energy"]]


def _names(runs: pd.DataFrame) -> pd.DataFrame:
    """Panel and curve of each cell: the scheme's name, IE where nothing is limited."""
    precision = digits(runs["scenario_parameters"])
    settings_apart = apart(runs, IN_NAMES)
    names = [
        {"cell": row["cell"], "panel": _panel(row), "curve": _curve(row, precision, others)}
        for row, others in zip(rows_of(runs), settings_apart, strict=True)
    ]
    table = pd.DataFrame(names, columns=["cell", "panel", "curve"])
    alike = table.duplicated(["panel", "curve"], keep=False).to_numpy()
    more = [
        f", {row['steps_asked']:.0f} steps, tolerance {row['tolerance']:g}" for row in rows_of(runs)
    ]
    table["curve"] += np.where(alike, more, "").astype(object)
    table["curve"] += [ended(row) for row in rows_of(runs)]
    return table.set_index("cell")


def _panel(row: Row) -> str:
    limit = f"{row['bound']} limit" if row["bound"] else ""
    return ", ".join(filter(None, (row["scenario"], cells(row["mesh"]), limit)))


def _curve(row: Row, precision: Mapping[str, int], others: str) -> str:
    alone = row["solver"] == UNCONSTRAINED
    scheme = "IE" if alone and row["integrator"] == "sap" else row["integrator"].upper()
    step = settings(row["scenario_parameters"]).get("step")
    length = f"dt = {1000 * step:.{precision.get('step', 3)}g} ms" if step else ""
    return (
        ", ".join(filter(None, (scheme, "" if alone else row["solver"], length, others)))
        or UNCONSTRAINED
    )


def ended(row: Row) -> str:
    """That a run ended early, and when; such a curve ends in a cross."""
    early = row["done"] < row["steps_asked"]
    return f", {ENDED} {row['done']:.0f} of {row['steps_asked']:.0f} steps" if early else ""


def energy_table(folder: Path, runs: pd.DataFrame) -> Table:
    """A line a run; none without energies."""
    lines = []
    for _, run in energies(folder, runs).groupby("cell", sort=False):
        energy, first = 1000 * run["energy"].to_numpy(), run.iloc[0]
        late = energy[-max(2, len(energy) // 4) :]
        values = (energy[0], energy.max(), energy[-1], late.max() - late.min())
        about = [first["panel"], first["curve"], len(run), run["time"].max()]
        lines.append([*about, *values, *unsteadiness(energy)])
    numbers = [Column(name, unit, ".4g") for name, unit in (NUMBERS | UNSTEADY).items()]
    header: list[str | Column] = ["scene", "run", "steps", *numbers, "turns"]
    return Table("Total energy", header, lines, Prose(EXPLANATION))


def unsteadiness(energy: FloatArray) -> tuple[float, float, int]:
    """The sum of all rises, the root mean square of second differences, the number of turns.

    >>> unsteadiness(np.array([3.0, 1.0, 2.0, 0.0]))[::2]
    (1.0, 2)
    """
    change = np.diff(energy)
    rough = np.sqrt(np.mean(np.diff(change) ** 2)) if len(change) > 1 else 0.0
    signs = np.sign(change[change != 0])
    return float(change.clip(min=0).sum()), float(rough), int(np.sum(signs[1:] != signs[:-1]))
