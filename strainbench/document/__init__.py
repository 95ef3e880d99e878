"""Documents, whatever the format that they are written in: text, tables, lists, pictures, sections.

Texts are given as they are, whatever they hold: the writers escape them, each in its own way.
`strainbench.document.writers` has those of Markdown, LaTeX, CSV and terminal,
`strainbench.document.html` that of a page's parts.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pandas as pd


class Strong(str):
    """Text that stands out."""


class Faint(str):
    """A number that does not count, as what it is of went wrong."""


class Between(str):
    """From a lower number to a higher one, as texts."""

    low: str
    high: str

    @classmethod
    def of(cls, low: str, high: str) -> Between:
        """The two; nothing where there are none."""
        text = cls(f"{low} to {high}" if low else "")
        text.low, text.high = low, high
        return text


class Span(str):
    """What stands in place of several cells, from the first of them on."""

    width: int

    @classmethod
    def of(cls, text: str, width: int) -> Span:
        """Over `width` columns."""
        words = cls(text)
        words.width = width
        return words


class Code(str):
    """A command, or another line of code."""


class Prose(str):
    """Words of our own, never foreign ones, with `code`, **strong** and *emphasis* marked so."""


@dataclass(frozen=True)
class Column:
    """What stands above a column, and how its cells are shown.

    Parameters
    ----------
    unit : shown in brackets, such as s or mm
    form : of its numbers that are no whole ones: a format such as ".3g", or a function
    right : flushed right, as numbers are
    whole : never folded on a narrow terminal
    aside : says more of the column before
    above : stands above it and its neighbours of the same
    """

    name: str
    unit: str = ""
    form: str | Callable[[float], str] = ""
    right: bool = False
    whole: bool = False
    aside: bool = False
    above: str = ""

    @property
    def heading(self) -> str:
        """The name with its unit."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name

    def text(self, value: object, nothing: str) -> str:
        """A cell as it is shown; `nothing` stands for None and NaN."""
        if isinstance(value, str):
            return value
        if value is None or value != value:
            return nothing
        if not isinstance(value, float):
            return str(value)
        return self.form(value) if callable(self.form) else format(value, self.form)


@dataclass(frozen=True)
class Table:
    """Lines of values below a header.

    Parameters
    ----------
    header : a column, or its name alone
    lines : cells are text, numbers, or None; a `Span` is several. CSV has numbers with all their
        digits
    about : a paragraph above
    notes : a list below
    command : that made the table
    label : by which an article refers to it
    nothing : stands where there is no value
    """

    title: str
    header: Sequence[str | Column]
    lines: Sequence[Sequence[object]]
    about: str = ""
    notes: Sequence[str] = ()
    command: str = ""
    nothing: str = ""
    label: str = ""

    @classmethod
    def of(cls, frame: pd.DataFrame) -> Table:
        """A frame of pandas, for CSV."""
        lines = frame.astype(object).where(frame.notna(), None).itertuples(index=False, name=None)
        return cls("", list(frame.columns), list(lines))

    @property
    def columns(self) -> list[Column]:
        """The header, names as columns."""
        return [c if isinstance(c, Column) else Column(c) for c in self.header]

    @property
    def headings(self) -> list[str]:
        """The header as it is shown."""
        return [column.heading for column in self.columns]

    @property
    def cells(self) -> list[list[object]]:
        """The lines with a cell a column: what spans several stands in the first of them."""
        return [[cell for value in line for cell in _spread(value)] for line in self.lines]

    def texts(self) -> list[list[str]]:
        """The cells as they are shown."""
        return [
            [c.text(value, self.nothing) for c, value in zip(self.columns, line, strict=True)]
            for line in self.cells
        ]


def _spread(value: object) -> list[object]:
    return [value] + [""] * (value.width - 1 if isinstance(value, Span) else 0)


@dataclass(frozen=True)
class Items:
    """A list; `head` is said above."""

    lines: Sequence[str]
    head: str = ""


@dataclass(frozen=True)
class Picture:
    """A file; `about` is said where it cannot be shown."""

    path: Path
    about: str


@dataclass(frozen=True)
class Document:
    """A title and what stands below it; a document within another is a section."""

    title: str
    parts: Sequence[Part]


@dataclass(frozen=True)
class Heading:
    """A title at its level, 1 the highest."""

    text: str
    level: int


Part = str | Items | Picture | Table | Document
Block = str | Items | Picture | Table | Heading


def blocks(part: Part, level: int = 1) -> Iterator[Block]:
    """One after the other, titles as headings; what is empty is left out, with its title."""
    match part:
        case Document(title, parts):
            if inner := [block for p in parts for block in blocks(p, level + 1)]:
                yield Heading(title, level)
                yield from inner
        case Table() if part.lines:
            if part.title:
                yield Heading(part.title, level)
            yield from filter(None, (Code(part.command), part.about))
            yield part
            yield from blocks(Items(part.notes))
        case Items() if part.lines:
            yield from filter(None, [part.head])
            yield part
        case Picture() | str() if part:
            yield part
