"""Charts, each specified once in Vega-Lite, drawn for a page, a phone and a paper."""

from __future__ import annotations

from strainbench.report.charts.chart import Chart, draw
from strainbench.report.charts.target import Target
from strainbench.report.charts.work import work_precision

__all__ = ["Chart", "Target", "draw", "work_precision"]
