"""Who reaches the optimum first on each case: a scene, mode, limit and size."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import pandas as pd

from strainbench.report.measures import FEASIBLE, OPTIMAL
from strainbench.report.table import UNCONSTRAINED

CASE = ("scene", "mode", "bound", "mesh")
LEVEL = 1.2  # times the fastest: whoever takes less is level with it


def scene_names(runs: pd.DataFrame) -> list[str]:
    """Each row's scene, with what tells it from others of its folder, limit and size apart."""
    many = runs["threads"].nunique() > 1
    threads = [f"{n:.0f} threads" if many else "" for n in runs["threads"]]
    parts = zip(runs["scenario"], runs["apart"], threads, strict=True)
    return [", ".join(filter(None, words)) for words in parts]


@dataclass(frozen=True)
class Race:
    """One case: how it is called among the others, its rows, those optimal on every step ranked."""

    place: str
    rows: pd.DataFrame

    @property
    def ranked(self) -> pd.DataFrame:
        """The faster the earlier."""
        solved = self.rows[(self.rows["ending"] == OPTIMAL) & self.rows["time"].notna()]
        return solved.sort_values("time", kind="stable")

    @property
    def first(self) -> list[str]:
        """The fastest, with those that are level with it."""
        ranked = self.ranked
        best = ranked.iloc[0]
        level = (ranked["time"] < LEVEL * best["time"]) | (ranked["time_low"] <= best["time_high"])
        level.iloc[0] = True
        return list(ranked["solver"][level])

    @property
    def next(self) -> tuple[str, float]:
        """Who comes after the fastest, and in how many times its time; nobody at 0."""
        ranked = self.ranked
        if len(ranked) < 2:
            return "", 0.0
        best, second = ranked.iloc[0], ranked.iloc[1]
        return str(second["solver"]), float(second["time"] / best["time"])

    @property
    def nearest(self) -> pd.Series | None:
        """Of those within the limits, who is nearest to the optimum."""
        kept = self.rows[self.rows["ending"].isin((OPTIMAL, FEASIBLE))].dropna(
            subset=["distance_max"]
        )
        return None if kept.empty else kept.loc[kept["distance_max"].idxmin()]


def races(runs: pd.DataFrame) -> list[Race]:
    """Those of a folder: rows with `scene` and what `measured` adds, the smaller size first."""
    ran = runs[runs["solver"] != UNCONSTRAINED].sort_values(["resolution", "mesh"], kind="stable")
    apart = [name for name in CASE if ran[name].nunique() > 1] or ["mesh"]
    cases = ran.groupby(list(CASE), sort=False, dropna=False)
    return [Race(_place(rows.iloc[0], apart), rows) for _, rows in cases]


def _place(row: pd.Series, apart: Sequence[str]) -> str:
    """Such as 20×20, or what else tells the case from the others."""
    words = [f"{row[name]}" for name in ("mesh", "bound", "scene", "mode") if name in apart]
    return ", ".join(filter(None, words))
