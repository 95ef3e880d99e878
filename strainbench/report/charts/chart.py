"""A chart, and how it becomes a file."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree


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


ENDINGS = (".svg", ".pdf", ".png")
SVG = "http://www.w3.org/2000/svg"
SHARP = 2.0  # pixels of a PNG for each of a chart


def draw(chart: Chart, path: Path) -> None:
    """Write an SVG, a PDF with its fonts, or a PNG, by the ending; nothing is fetched.

    Raises
    ------
    ValueError
        For a name with another ending.
    """
    draw_sheet([chart], path)


def draw_sheet(charts: Sequence[Chart], path: Path, columns: int = 3) -> None:
    """Write several charts as one picture, side by side in rows; see `draw`."""
    import vl_convert

    if path.suffix not in ENDINGS:
        raise ValueError(f"{path}: a name that ends in {', '.join(ENDINGS)} is valid")
    found = [vl_convert.vegalite_to_svg(chart.spec, allowed_base_urls=[]) for chart in charts]
    svg = found[0] if len(found) == 1 else _together(found, columns)
    match path.suffix:
        case ".svg":
            path.write_text(svg, encoding="utf-8")
        case ".pdf":
            path.write_bytes(vl_convert.svg_to_pdf(svg))
        case ".png":
            path.write_bytes(vl_convert.svg_to_png(svg, scale=SHARP))


def _together(drawn: Sequence[str], columns: int) -> str:
    """Drawings in rows of so many, as one."""
    sizes = [ElementTree.fromstring(svg).attrib for svg in drawn]
    parts, top, across = [], 0.0, 0.0
    for first in range(0, len(drawn), columns):
        row = range(first, min(first + columns, len(drawn)))
        left = 0.0
        for k in row:
            own = re.sub(r"\bclip(?=\d)", f"clip{k}-", drawn[k])  # names are the whole picture's
            parts.append(own.replace("<svg ", f'<svg x="{left:g}" y="{top:g}" ', 1))
            left += float(sizes[k]["width"])
        across, top = max(across, left), top + max(float(sizes[k]["height"]) for k in row)
    size = f'width="{across:g}" height="{top:g}" viewBox="0 0 {across:g} {top:g}"'
    return f'<svg xmlns="{SVG}" {size}>{"".join(parts)}</svg>'
