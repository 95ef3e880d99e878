"""Numbers of claims, from the folders of results that hold them."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path

import numpy as np
import pandas as pd

from strainbench.bench.records import RUNS
from strainbench.report.energy import energies
from strainbench.report.names import settings
from strainbench.report.runs import load_runs
from strainbench.report.steps import newest_steps


class NotThereError(Exception):
    """Says which numbers are missing."""


class Evidence:
    """The rows of folders below `root`, with the settings of scenes as columns."""

    def __init__(self, root: Path) -> None:
        self.root = root
        self.read = lru_cache(maxsize=None)(self._read)

    def _read(self, folder: str) -> pd.DataFrame:
        if not (self.root / folder / RUNS).exists():
            raise NotThereError(f"{folder} holds no results")
        runs = load_runs(self.root / folder)
        of_scene = pd.DataFrame([settings(t) for t in runs["scenario_parameters"]], runs.index)
        return runs.assign(**of_scene[of_scene.columns.difference(runs.columns)])

    def table(self, folder: str, name: str) -> pd.DataFrame:
        """A CSV file of a study."""
        file = self.root / folder / name
        if not file.exists():
            raise NotThereError(f"{folder} holds no {name}")
        return pd.read_csv(file)

    def cells(self, folder: str, **wanted: object) -> pd.DataFrame:
        """The cells of a folder with these values in these columns, tuples for one of several.

        Raises
        ------
        NotThereError
            Where there is none.
        """
        runs = self.read(folder)
        for column, value in wanted.items():
            known = runs[column] if column in runs else pd.Series(np.nan, runs.index)
            several = value if isinstance(value, tuple) else (value,)
            runs = runs[[any(_same(v, one) for one in several) for v in known]]
        if runs.empty:
            what = ", ".join(f"{key} {value}" for key, value in wanted.items())
            raise NotThereError(f"{folder} holds no cell with {what}")
        return runs

    def one(self, folder: str, **wanted: object) -> pd.Series:
        """The newest of such cells."""
        return self.cells(folder, **wanted).iloc[-1]

    def ratio(
        self, folder: str, column: str, over: Mapping[str, object], **wanted: object
    ) -> float:
        """A column of one cell divided by that of the one with the values `over`."""
        upper = self.one(folder, **wanted)[column]
        return float(upper / self.one(folder, **{**wanted, **over})[column])

    def steps(self, folder: str, cells: pd.DataFrame, column: str) -> pd.Series:
        """A column of the steps of cells, where it has numbers."""
        steps = newest_steps(self.root / folder, cells)
        return pd.to_numeric(steps[column].replace("nan", "")).dropna()

    def energy(self, folder: str, **wanted: object) -> pd.DataFrame:
        """Times [s] and total energies [mJ] of a cell."""
        cells = self.cells(folder, **wanted)
        found = energies(self.root / folder, cells)
        found = found[found["cell"] == cells["cell"].iloc[-1]]
        return found.assign(energy=1000 * found["energy"])[["time", "energy"]]

    def energy_at(self, folder: str, time: float, **wanted: object) -> float:
        """Total energy [mJ] at the step that ends nearest to `time` [s].

        Raises
        ------
        NotThereError
            Where the cell does not come so far.
        """
        curve = self.energy(folder, **wanted)
        nearest = curve.iloc[(curve["time"] - time).abs().argsort().iloc[:1]]
        if curve.empty or abs(nearest["time"].iloc[0] - time) > 0.02:
            raise NotThereError(f"{folder} holds no energy at {time:g} s")
        return float(nearest["energy"].iloc[0])


def _same(found: object, wanted: object) -> bool:
    if isinstance(wanted, float | int) and isinstance(found, float | int | np.number):
        return bool(abs(float(found) - wanted) <= 1e-9 * max(1.0, abs(wanted)))
    return str(found) == str(wanted)
