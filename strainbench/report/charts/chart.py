"""A chart, and how it becomes a file."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any


@dataclass(frozen=True)
class Chart:
    """A specification with its words.

    Parameters
    ----------
    name : of its file, and of its place on a page
    title : stands above it as well
    caption : how to read it, and what is not drawn
    """

    name: str
    title: str
    caption: str
    spec: dict[str, Any]


def draw(chart: Chart, path: Path) -> None:
    """Write an SVG, a PDF with its fonts, or a PNG, by the ending; nothing is fetched.

    Raises
    ------
    ValueError
        For a name with another ending.
    """
    import vl_convert

    offline: dict[str, Any] = {"allowed_base_urls": []}
    match path.suffix:
        case ".svg":
            path.write_text(vl_convert.vegalite_to_svg(chart.spec, **offline), encoding="utf-8")
        case ".pdf":
            path.write_bytes(vl_convert.vegalite_to_pdf(chart.spec, **offline))
        case ".png":
            path.write_bytes(vl_convert.vegalite_to_png(chart.spec, scale=2.0, **offline))
        case _:
            raise ValueError(f"{path}: a name that ends in .svg, .pdf, .png is valid")
