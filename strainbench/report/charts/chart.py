"""A chart, and how it becomes a file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from strainbench.report.drawing import Sheet


@dataclass(frozen=True)
class Chart:
    """A specification with its words.

    Parameters
    ----------
    name : of its file, and of its place on a page
    title : stands above it as well
    caption : how to read it, and what is not drawn
    figure : the file of those beside which it stands, as they have their axes in common
    """

    name: str
    title: str
    caption: str
    spec: dict[str, Any]
    figure: str = ""


def draw(chart: Chart, path: Path) -> None:
    """Write an SVG, a PDF with its fonts, or a PNG, by the ending; nothing is fetched.

    Raises
    ------
    ValueError
        For a name with another ending.
    """
    draw_sheet([chart], [path])


def draw_sheet(charts: Sequence[Chart], paths: Sequence[Path], columns: int = 3) -> None:
    """Write several charts as one picture, side by side in rows, in each form; see `draw`."""
    sheet(charts, paths, columns).draw()


def sheet(charts: Sequence[Chart], paths: Sequence[Path], columns: int) -> Sheet:
    """The same, to be drawn later."""
    return Sheet([chart.spec for chart in charts], [str(path) for path in paths], columns)
