"""Answers under lower bounds, which no certificate ranks: their objectives beside each other."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pandas as pd

from strainbench.bench.mode import replays
from strainbench.bench.rows import LOCAL
from strainbench.document import Column, Faint, Prose, Table
from strainbench.report.measures import numbers
from strainbench.report.rows import rows_of
from strainbench.report.steps import newest_steps
from strainbench.report.table import scene

EXPLANATION = """\
Objectives are sums over the projections. They are comparable where all methods had the same
candidates: in a replay, or a single projection. *Above*: relative to the least that is known of an
answer within the limits, the referee's own included. KKT residuals and violations are the worst;
at a residual of 0 an answer is a local optimum or a saddle. In brackets: not within the limits."""
HEADER: tuple[str | Column, ...] = (
    *("scene", "method", Column("objective", form=".6e", right=True)),
    *(Column(name, form=".1e", right=True) for name in ("above", "KKT residual", "violation")),
    Column("iterations", form=".0f", right=True),
)
NUMBERS = ["objective", *LOCAL, "max_violation", "iterations"]
ALIKE = ["scenario", "scenario_parameters", "scenario_source", "mode", "steps_asked"]


def local_table(folder: Path, runs: pd.DataFrame) -> Table:
    """A line for each cell whose problems have lower bounds; none in other folders."""
    found = _cells(folder, runs)
    lines = [
        line
        for _, same in found.groupby(ALIKE, sort=False, dropna=False)
        for line in _lines(same.sort_values("objective", kind="stable"))
    ]
    return Table("Local optima", HEADER, lines, Prose(EXPLANATION))


def _cells(folder: Path, runs: pd.DataFrame) -> pd.DataFrame:
    """The runs with NUMBERS of their projections, where the referee judged these as local."""
    steps = numbers(newest_steps(folder, runs))
    told = steps["details"].map(lambda text: json.loads(text) if text else {})
    local = steps.assign(**{name: told.map(lambda d, n=name: d.get(n, np.nan)) for name in LOCAL})
    by_cell = local.dropna(subset=list(LOCAL)).groupby("cell")[NUMBERS]
    sums, worst = by_cell.sum(), by_cell.max()
    values = sums.assign(**{name: worst[name] for name in ("kkt_residual", "max_violation")})
    values["projected"] = by_cell.size()
    others = [c for c in runs.columns if c not in values.columns]
    return runs[others].join(values, on="cell", how="inner")


def _lines(same: pd.DataFrame) -> list[list[object]]:
    """Of cells of one scene; those within the limits first."""
    within = same["max_violation"] <= same["violation_threshold"]
    whole = same["projected"] == same["projected"].max()
    fed = same["mode"].map(replays) | (same["projected"].max() == 1)
    counts = within & whole & fed
    best = min(same.loc[counts, "objective"].min(), same.loc[counts, "best_known"].min())
    above = (same["objective"] / best - 1).where(counts) if best > 0 else np.nan * within
    lines = same.assign(above=above, within=within).sort_values(
        "within", ascending=False, kind="stable"
    )
    return [
        [
            scene(row),
            row["solver"],
            row["objective"] if row["within"] else Faint(f"{row['objective']:.6e}"),
            *(row[name] for name in ("above", "kkt_residual", "max_violation", "iterations")),
        ]
        for row in rows_of(lines)
    ]
