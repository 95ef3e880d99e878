"""Specifications as pictures; as a program it draws the sheets that it is sent: JSON, a line each.

It loads nothing but what draws, so that a report can go on while it works.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any
from xml.etree import ElementTree

from strainbench import escape

ENDINGS = (".svg", ".pdf", ".png")
SVG = 'xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink"'
SHARP = 2.0  # pixels of a PNG for each of a chart
COLOURS = 255


@dataclass(frozen=True)
class Sheet:
    """Specifications side by side in rows of so many, and the files to write, a form each."""

    specs: Sequence[dict[str, Any]]
    paths: Sequence[str]
    columns: int

    def draw(self) -> None:
        """Write the files; nothing is fetched.

        Raises
        ------
        ValueError
            For a name with another ending.
        """
        import vl_convert

        if wrong := [path for path in self.paths if not path.endswith(ENDINGS)]:
            raise ValueError(f"{wrong[0]}: a name that ends in {', '.join(ENDINGS)} is valid")
        seen = [_seen(spec) for spec in self.specs]
        found = [vl_convert.vegalite_to_svg(spec, allowed_base_urls=[]) for spec in seen]
        svg = found[0] if len(found) == 1 else _together(found, self.columns)
        for path in map(Path, self.paths):
            if path.suffix == ".svg":
                path.write_text(svg, encoding="utf-8")
            elif path.suffix == ".pdf":
                path.write_bytes(vl_convert.svg_to_pdf(svg))
            else:
                _write_small(vl_convert.svg_to_png(svg, scale=SHARP), path)


@contextmanager
def drawn_beside(sheets: Sequence[Sheet]) -> Iterator[None]:
    """Draw in another process while something else is done; at the end all are there."""
    if not sheets:
        yield
        return
    program = [sys.executable, "-P", __file__]
    where = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    sent = "".join(json.dumps(vars(sheet)) + "\n" for sheet in sheets)
    with TemporaryFile() as given:
        given.write(sent.encode())
        given.seek(0)
        process = subprocess.Popen(program, env=where, stdin=given, stderr=subprocess.PIPE)
    try:
        yield
        _, said = process.communicate()
    except BaseException:
        process.kill()
        process.wait()
        raise
    if process.returncode:
        raise OSError(f"charts were not drawn: {said.decode(errors='replace').strip()}")


def _write_small(png: bytes, path: Path) -> None:
    """With so many colours that none is seen to be missing, in an eighth of the bytes."""
    from PIL import Image

    picture = Image.open(BytesIO(png)).convert("RGB")
    picture.quantize(COLOURS, dither=Image.Dither.NONE).save(path, optimize=True)


def _seen(part: Any) -> Any:
    """A specification without control characters, which would end the whole process."""
    match part:
        case str():
            return escape.seen(part)
        case list() | tuple():
            return [_seen(each) for each in part]
        case dict():
            return {_seen(key): _seen(value) for key, value in part.items()}
    return part


def _together(drawn: Sequence[str], columns: int) -> str:
    """Drawings in rows of so many, as one."""
    sizes = [ElementTree.fromstring(svg).attrib for svg in drawn]
    parts, top, across = [], 0.0, 0.0
    for first in range(0, len(drawn), columns):
        row = range(first, min(first + columns, len(drawn)))
        left = 0.0
        for k in row:
            own = re.sub(r"\bclip(?=\d)", f"clip{k}-", drawn[k])  # names are the whole picture's
            body = re.sub(r"^<svg [^>]*>|</svg>\s*$", "", own)  # an svg within is slow to draw
            parts.append(f'<g transform="translate({left:g},{top:g})">{body}</g>')
            left += float(sizes[k]["width"])
        across, top = max(across, left), top + max(float(sizes[k]["height"]) for k in row)
    size = f'width="{across:g}" height="{top:g}" viewBox="0 0 {across:g} {top:g}"'
    behind = f'<rect width="{across:g}" height="{top:g}" fill="white"/>'  # where rows end unevenly
    return f"<svg {SVG} {size}>{behind}{''.join(parts)}</svg>"


if __name__ == "__main__":
    for line in sys.stdin:
        Sheet(**json.loads(line)).draw()
