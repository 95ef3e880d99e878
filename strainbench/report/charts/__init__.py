"""Charts, each specified once in Vega-Lite, drawn for a page, a phone and a paper."""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from strainbench.report.charts.chart import Chart, draw, draw_sheet
from strainbench.report.charts.convergence import convergence
from strainbench.report.charts.energy import energy
from strainbench.report.charts.growth import growth
from strainbench.report.charts.profile import profiles, scores
from strainbench.report.charts.sweep import sweep
from strainbench.report.charts.target import Target
from strainbench.report.charts.work import work_precision

__all__ = [
    "Chart",
    "Target",
    "convergence",
    "draw",
    "draw_charts",
    "draw_sheet",
    "energy",
    "growth",
    "profiles",
    "scores",
    "sweep",
    "work_precision",
]
ENDINGS = (".svg", ".png")


def draw_charts(folder: Path, runs: pd.DataFrame, steps: pd.DataFrame) -> list[Path]:
    """Write speed-accuracy, profile, growth, energy and sweep-<setting> as SVG and PNG.

    Scenes of which there are several have a file each, `-2` and so on; their meshes and limits
    stand beside each other.

    Parameters
    ----------
    runs : as `strainbench.report.measures.measured` returns them
    steps : as `strainbench.report.steps.newest_steps` does
    """
    sheets = {
        **_by_figure(work_precision(runs, Target.PAGE)),
        **{chart.name: [chart] for chart in profiles(runs, steps, Target.PAGE)},
        **{chart.name: [chart] for chart in growth(runs, Target.PAGE)},
        "energy": energy(folder, runs, Target.PAGE),
        **{f"sweep-{key}": charts for key, charts in sweep(runs, Target.PAGE).items()},
    }
    written = []
    for name, charts in sheets.items():
        if charts:
            paths = [folder / (name + ending) for ending in ENDINGS]
            draw_sheet(charts, paths, columns=2)
            written += paths
    return written


def _by_figure(charts: list[Chart]) -> dict[str, list[Chart]]:
    """Charts that have their axes in common, by the name of their file."""
    figures: dict[str, list[Chart]] = {}
    for chart in charts:
        figures.setdefault(chart.figure, []).append(chart)
    return figures
