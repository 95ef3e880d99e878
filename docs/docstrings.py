"""Docstrings as this project writes them, for Griffe.

A line "tolerance : the largest violation to aim for." under Parameters or Attributes has text where
numpydoc has a type. Types are in the annotations, so all of it becomes the description. And in
formulas x* is no emphasis, <Y, x> no HTML, and ||x|| no empty cell of a table.
"""

from __future__ import annotations

import re
from typing import Any

import griffe

SECTION = re.compile(
    r"^(Parameters|Attributes)\n-+\n((?:[ ]*\S.*\n?|\n(?=[ ]{4}))+)(\n(?!\w+\n-)(?=\S))?",
    re.MULTILINE,
)
ENTRY = re.compile(r"^(\w[\w, ]*?)(?: : (.*))?$\n?((?:(?:[ ]{4}.*)?\n)*)", re.MULTILINE)
TABLE = re.compile(r"^[|] .*", re.MULTILINE)
ESCAPED = {"*": r"\*", "<": "&lt;"}
FORMULA = re.compile(r"(^[ ]{4}.*|^>>>.*|`[^`]*`)|(?<=[\w)])\*|<(?=[A-Za-z])", re.MULTILINE)


def as_numpydoc(text: str) -> str:
    """A docstring whose entries are a name, and below it everything that is said of it."""
    text = TABLE.sub(lambda found: found[0].replace("||", r"\|\|"), text)
    escaped = FORMULA.sub(lambda found: found[1] or ESCAPED[found[0]], text)
    return SECTION.sub(lambda found: _section(*found.groups()), escaped)


def _section(title: str, body: str, prose: str | None) -> str:
    """What follows a section without a heading gets one, or it would be taken for an entry."""
    entries = ENTRY.sub(lambda found: _entry(found[1], found[2] or "", found[3]), body + "\n")
    notes = "" if prose is None else "\nNotes\n-----\n"
    return f"{title}\n{'-' * len(title)}\n{entries}{notes}"


def _entry(names: str, first: str, rest: str) -> str:
    """`first` goes on in `rest`, or is a shape, after which a new sentence begins."""
    following = rest.strip()
    stop = ". " if following[:1].isupper() and first[-1:] not in ".;:" else " "
    said = f"    {first}{stop if first and following else ''}{rest.lstrip()}".rstrip()
    return "".join(f"{name}\n{said}\n" for name in names.split(", "))


class Prose(griffe.Extension):
    """Reads every docstring so."""

    def on_object(self, *, obj: griffe.Object, **_: Any) -> None:
        """Called once for each module, class, function and attribute."""
        if obj.docstring:
            obj.docstring.value = as_numpydoc(obj.docstring.value)
