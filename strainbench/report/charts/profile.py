"""Performance profiles (Dolan and More 2002), and scores beside them.

A case is a projection with active constraints where frames are replayed, so that all methods have
the same ones; elsewhere it is a whole cell. What counts is the time to the optimum: of a method's
tolerances the fastest one at which its answer is optimal. All else is unsolved, for ever.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pandas as pd

from strainbench.bench.mode import replays
from strainbench.document import Column, Prose, Table
from strainbench.report.charts.axes import Axis
from strainbench.report.charts.canvas import about
from strainbench.report.charts.chart import Chart
from strainbench.report.charts.curves import Curve, Curves, point
from strainbench.report.charts.target import Target
from strainbench.report.measures import OPTIMAL, digits, duration, numbers, projections
from strainbench.report.table import UNCONSTRAINED

CELL = ["scenario", "scenario_parameters", "steps_asked"]
RATIOS = (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000)
SHIFTS = (0.1, 1.0, 10.0)  # times the scale of the data
CAPTION = """\
The share of {cases} that a method solves to the optimum within so many times the time of the
fastest one. What is not optimal, or not within the time limit, is unsolved and never comes; the
numbers behind the names are the per cent solved within the span that is shown."""
ABOUT = """\
Shifted geometric means of the time to the optimum over {cases}, as ratios to the least one: a case
unsolved counts as {penalty}. The shift {shift} is the median over the cases of the fastest method's
time; a tenth and ten times of it show how much depends on it. Paired: the geometric mean of the
ratios to {best}, over the cases that both solved, and their number. `-`: never solved."""


@dataclass(frozen=True)
class Cases:
    """Seconds to the optimum, infinite where it was not reached.

    Parameters
    ----------
    seconds : a row a case, a column a method
    limits : the time limit of each case, NaN without one
    unit : what a case is
    absent : methods that did not run on all cells, and are left out
    """

    seconds: pd.DataFrame
    limits: pd.Series
    unit: str
    about: str
    absent: tuple[str, ...] = ()

    @property
    def said(self) -> str:
        """How many of what."""
        return f"{len(self.seconds)} {self.unit}" + ("s" if len(self.seconds) != 1 else "")

    @property
    def fastest(self) -> pd.Series:
        """Of each case; infinite where nobody solved it."""
        return self.seconds.min(axis=1)

    @property
    def ratios(self) -> pd.DataFrame:
        """To the fastest of each case."""
        ratios = self.seconds.div(self.fastest.replace(np.inf, np.nan), axis=0)
        return ratios.fillna(np.inf)


def cases(runs: pd.DataFrame, steps: pd.DataFrame) -> Iterator[Cases]:
    """Those of replayed and of simulated cells, a number of threads each.

    Parameters
    ----------
    runs : as `strainbench.report.measures.measured` returns them
    steps : as `strainbench.report.steps.newest_steps` does
    """
    runs = runs[runs["solver"] != UNCONSTRAINED]
    runs = runs.assign(where=runs.groupby(CELL, sort=False, dropna=False).ngroup())
    several = runs["threads"].nunique() > 1
    for (mode, threads), rows in runs.groupby(["mode", "threads"], sort=False):
        kept, absent = _on_all_cells(rows)
        if kept["solver"].nunique() < 2:
            continue
        replayed = replays(str(mode))
        timed = _by_projection(kept, steps) if replayed else _by_cell(kept)
        table = timed.pivot_table(
            index=["where", "step", "projection"], columns="solver", values="seconds", aggfunc="min"
        )
        table = table.reindex(columns=list(dict.fromkeys(kept["solver"]))).fillna(np.inf)
        limits = kept.groupby("where")["time_limit"].max()
        limits = pd.Series(limits.reindex(table.index.get_level_values("where")).to_numpy())
        if len(table):
            frames = str(mode).partition(":")[2]
            words = ["replayed" if replayed else "simulated", *[f"frames {frames}"] * bool(frames)]
            words += [f"{threads:.0f} threads"] * several
            unit = "projection" if replayed else "cell"
            yield Cases(table, limits.set_axis(table.index), unit, ", ".join(words), absent)


def _on_all_cells(runs: pd.DataFrame) -> tuple[pd.DataFrame, tuple[str, ...]]:
    """Methods that ran on every cell, or all methods on the cells that all of them ran on."""
    counts = runs.groupby("solver", sort=False)["where"].nunique()
    whole = counts.index[counts == runs["where"].nunique()]
    if len(whole) >= 2:
        absent = tuple(str(name) for name in counts.index if name not in whole)
        return runs[runs["solver"].isin(whole)], absent
    methods = runs.groupby("where")["solver"].nunique()
    return runs[runs["where"].isin(methods.index[methods == len(counts)])], ()


def _by_projection(runs: pd.DataFrame, steps: pd.DataFrame) -> pd.DataFrame:
    """A row a method and projection that had something to do."""
    had = projections(numbers(steps)).merge(runs[["cell", "solver", "where"]], on="cell")
    had["seconds"] = had["seconds"].where(had["outcome"] == OPTIMAL, np.inf)
    return had[["solver", "where", "step", "projection", "seconds"]]


def _by_cell(runs: pd.DataFrame) -> pd.DataFrame:
    """A row a method and cell."""
    seconds = runs["time"].where(runs["ending"] == OPTIMAL, np.inf).fillna(np.inf)
    return runs[["solver", "where"]].assign(step=0, projection=0, seconds=seconds)


def profiles(runs: pd.DataFrame, steps: pd.DataFrame, target: Target) -> list[Chart]:
    """A chart for what was replayed, and one for what was simulated."""
    return [
        _profile(found, f"profile-{k}" if k > 1 else "profile", target)
        for k, found in enumerate(cases(runs, steps), start=1)
        if np.isfinite(found.fastest).any()
    ]


def _profile(found: Cases, name: str, target: Target) -> Chart:
    ratios = found.ratios
    largest = ratios.replace(np.inf, np.nan).max().max()
    high = next((r for r in RATIOS[1:] if r >= 1.02 * largest), RATIOS[-1])
    ticks = {float(r): f"{r}×" for r in RATIOS if r <= high}
    x = Axis("time over the fastest method's, at most", 1.0, float(high), ticks)
    y = Axis("solved to the optimum [%]", 0, 100, {v: str(v) for v in range(0, 101, 25)}, log=False)
    solved = np.isfinite(ratios).mean().mul(100)
    order = sorted(ratios, key=lambda m: (-solved[m], _mean_log(ratios[m])))
    curves = [_curve(str(m), ratios[m].to_numpy(), float(high)) for m in order if solved[m] > 0]
    title = "How often, within what factor of the fastest"
    caption = CAPTION.format(cases=f"{found.said}, {found.about},").replace("\n", " ")
    never = [str(m) for m in order if solved[m] == 0]
    caption += f" Never solved: {', '.join(never)}." if never else ""
    if found.absent:
        caption += f" Left out, as not run on every cell: {', '.join(found.absent)}."
    spec = Curves(title, x, y, curves, marks=False, steps=True).spec(target)
    return Chart(name, title, caption, spec)


def _mean_log(ratios: pd.Series) -> float:
    known = ratios[np.isfinite(ratios)]
    return float(np.log(known).mean()) if len(known) else np.inf


def _curve(method: str, ratios: np.ndarray, high: float) -> Curve:
    """A stair from 1 to the end."""
    known = np.sort(ratios[np.isfinite(ratios)])
    share = 100.0 / len(ratios)
    within = known[known <= high]
    at = [1.0, *within, high]
    heights = [np.sum(known <= 1.0) * share, *(share * np.arange(1, len(within) + 1))]
    heights.append(len(within) * share)
    points = [point(float(x), float(y)) for x, y in zip(at, heights, strict=True)]
    return Curve(about(method), f"{method} {heights[-1]:.0f}", points)


def scores(runs: pd.DataFrame, steps: pd.DataFrame) -> list[Table]:
    """A table beside each profile."""
    found = cases(runs, steps)
    return [_scores(each) for each in found if np.isfinite(each.fastest).any()]


def _scores(found: Cases) -> Table:
    """A line a method, the least mean first."""
    seconds, known = found.seconds, found.fastest[np.isfinite(found.fastest)]
    shift = float(known.median())
    finite = seconds.to_numpy()[np.isfinite(seconds.to_numpy())]
    limits = found.limits.fillna(10 * finite.max())
    charged = seconds.where(np.isfinite(seconds), limits, axis=0)
    means = [shifted_mean(charged, scale * shift) for scale in SHIFTS]
    relative = [mean / mean.min() for mean in means]
    solved = np.isfinite(seconds).sum()
    order = sorted(seconds, key=lambda m: (solved[m] == 0, relative[1][m]))
    best = order[0]
    lines = []
    for method in order:
        share = 100 * solved[method] / len(seconds)
        if not solved[method]:
            lines.append([method, share, *(None,) * 5])
            continue
        ratio, count = paired(seconds[method], seconds[best])
        lines.append([method, share, *(float(r[method]) for r in relative), ratio, count])
    header = [
        Column("method", whole=True),
        Column("solved", "%", ".0f", right=True),
        *(Column(f"shift {duration(s * shift)}", "", digits, right=True) for s in SHIFTS),
        Column("paired", "", digits, right=True),
        Column("pairs", right=True),
    ]
    limited = "its time limit" if found.limits.notna().all() else "ten times the longest time"
    words = {"cases": found.said, "penalty": limited, "shift": duration(shift), "best": best}
    about_ = ABOUT.format(**words).replace("\n", " ")
    return Table(f"Score ({found.about})", header, lines, Prose(about_), nothing="-")


def shifted_mean(seconds: pd.DataFrame, shift: float) -> pd.Series:
    """exp(mean(log(t + shift))) - shift of each column."""
    mean = np.exp(np.log(seconds + shift).mean()) - shift
    return pd.Series(mean, index=seconds.columns)


def paired(seconds: pd.Series, other: pd.Series) -> tuple[float | None, int]:
    """Geometric mean of ratios over the cases that both solved, and how many these are."""
    both = np.isfinite(seconds) & np.isfinite(other)
    if not both.any():
        return None, 0
    return float(np.exp(np.log(seconds[both] / other[both]).mean())), int(both.sum())
