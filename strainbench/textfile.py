"""Text files as people have them: with byte-order marks, any ends of lines, odd comments."""

from __future__ import annotations

import codecs
from pathlib import Path


def read_lines(path: str | Path) -> list[str]:
    """The lines of a file in UTF-8, or UTF-16 with its mark, without marks and ends of lines.

    What is not UTF-8 becomes U+FFFD: numbers and keywords are ASCII in every encoding that
    people's comments and names are in, and a mark within a number makes it none.
    """
    file = Path(path)
    with file.open("rb") as stream:
        wide = stream.read(2) in (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
    text = file.read_text(encoding="utf-16" if wide else "utf-8-sig", errors="replace")
    return text.split("\n")  # universal newlines; splitlines would split at form feeds, too
