"""Who reaches the optimum first on each case: a scene, mode, limit and size."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import pandas as pd

from strainbench.escape import plain
from strainbench.report.measures import FEASIBLE, OPTIMAL
from strainbench.report.names import CURVE_FILE, MESH_FILE, SPANNED, apart
from strainbench.report.table import UNCONSTRAINED

READ = ("solver", "ending", "why", "time", "time_low", "time_high", "time_limit", "distance_max")
"""Columns that races are about."""
CASE = ("scene", "mode", "bound", "aim", "mesh")
SHOWN = ("scene", "mesh", "bound", "solver", "machine")
"""Columns with words that are foreign, or may be."""
LEVEL = 1.2  # times the fastest: whoever takes less is level with it


def with_cases(runs: pd.DataFrame) -> pd.DataFrame:
    """Runs with `scene` and its settings that tell it from others of its folder, and `aim`, the
    tolerance; foreign words as they are shown."""
    settings = apart(runs, {*SPANNED, MESH_FILE, CURVE_FILE}, {"steps_asked": "{:.0f} steps"})
    many = runs["threads"].nunique() > 1
    threads = [f"{n:.0f} threads" if many else "" for n in runs["threads"]]
    parts = zip(runs["scenario"], settings, threads, strict=True)
    named = runs.assign(
        scene=[", ".join(filter(None, words)) for words in parts],
        aim=[f"tolerance {value:g}".replace("e-0", "e-") for value in runs["tolerance"]],
    )
    return named.assign(**{name: named[name].map(plain) for name in SHOWN})


@dataclass(frozen=True)
class Race:
    """One case: how it is called among the others, its rows, those optimal on every step ranked."""

    place: str
    rows: pd.DataFrame

    @cached_property
    def ranked(self) -> pd.DataFrame:
        """The faster the earlier."""
        solved = self.rows[(self.rows["ending"] == OPTIMAL) & self.rows["time"].notna()]
        return solved.sort_values("time", kind="stable")

    @cached_property
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
    ran = runs[[*READ, *CASE, "resolution"]].sort_values(["resolution", "mesh"], kind="stable")
    ran = ran[ran["solver"] != UNCONSTRAINED]
    apart = [name for name in CASE if ran[name].nunique() > 1] or ["mesh"]
    cases = ran.groupby(list(CASE), sort=False, dropna=False)
    return [Race(_place(rows.iloc[0], apart), rows[list(READ)]) for _, rows in cases]


def _place(row: pd.Series, apart: Sequence[str]) -> str:
    """Such as 20×20, or what else tells the case from the others."""
    words = [f"{row[name]}" for name in ("mesh", "bound", "scene", "mode", "aim") if name in apart]
    return ", ".join(filter(None, words))
