"""Charts, each specified once in Vega-Lite, drawn for a page, a phone and a paper."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cache, partial
from itertools import islice
from pathlib import Path

import pandas as pd

from strainbench.document import Table
from strainbench.report.charts.chart import Chart, draw, draw_sheet, sheet
from strainbench.report.charts.convergence import convergence
from strainbench.report.charts.energy import energy
from strainbench.report.charts.growth import growth
from strainbench.report.charts.profile import profiles, scores
from strainbench.report.charts.sweep import sweep
from strainbench.report.charts.target import Target
from strainbench.report.charts.work import work_precision
from strainbench.report.drawing import Sheet
from strainbench.report.energy import energy_table
from strainbench.report.sweep import sweep_tables

__all__ = [
    "Chart",
    "Makers",
    "Target",
    "chart_sheets",
    "convergence",
    "draw",
    "draw_sheet",
    "energy",
    "growth",
    "profiles",
    "scores",
    "sweep",
    "work_precision",
]
ENDINGS = (".svg", ".png")
MOST = 8  # charts of a kind in files: each takes a third of a second


@dataclass(frozen=True)
class Makers:
    """What makes the charts of a results folder, each kind once for a target, and the tables of
    which there are many lines: files and page share them."""

    speed: Callable[[Target, str], list[Chart]]
    profile: Callable[[Target], list[Chart]]
    growth: Callable[[Target], list[Chart]]
    sweep: Callable[[Target], dict[str, list[Chart]]]
    energy: Callable[[Target, float], list[Chart]]
    swept: Callable[[], list[Table]]
    energies: Callable[[], Table]

    @classmethod
    def of(cls, folder: Path, runs: pd.DataFrame, steps: pd.DataFrame) -> Makers:
        """Rows as `strainbench.report.measures.measured` returns them, projections as
        `strainbench.report.steps.newest_steps` does."""
        return cls(
            cache(partial(work_precision, runs)),
            cache(partial(profiles, runs, steps)),
            cache(partial(growth, runs)),
            cache(partial(sweep, runs)),
            cache(partial(energy, folder, runs)),
            cache(partial(sweep_tables, runs)),
            cache(partial(energy_table, folder, runs)),
        )


def chart_sheets(folder: Path, make: Makers) -> list[Sheet]:
    """Sheets of speed-accuracy, profile, growth, energy and sweep-<setting>, as SVG and PNG.

    Scenes of which there are several have a file each, `-2` and so on; their meshes and limits
    stand beside each other. Of each kind the first MOST charts have files; the page has all.
    """
    page = Target.PAGE
    named = {
        **_by_figure(make.speed(page, "distance")),
        **{chart.name: [chart] for chart in make.profile(page)},
        **{chart.name: [chart] for chart in make.growth(page)[:MOST]},
        "energy": make.energy(page, 0.0)[:MOST],
        **{f"sweep-{key}": charts[:MOST] for key, charts in make.sweep(page).items()},
    }
    return [
        sheet(charts, [folder / (name + ending) for ending in ENDINGS], 2)
        for name, charts in named.items()
        if charts
    ]


def _by_figure(charts: Iterable[Chart]) -> dict[str, list[Chart]]:
    """Charts that have their axes in common, by the name of their file."""
    figures: dict[str, list[Chart]] = {}
    for chart in islice(charts, MOST):
        figures.setdefault(chart.figure, []).append(chart)
    return figures
