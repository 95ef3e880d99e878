"""A document as Markdown; a table as LaTeX, as CSV and on a terminal."""

from __future__ import annotations

import csv as csv_
import io
from collections.abc import Iterable

from rich import box
from rich.console import JustifyMethod
from rich.table import Table as Grid

from strainbench import escape
from strainbench.document import (
    Block,
    Code,
    Heading,
    Items,
    Part,
    Picture,
    Prose,
    Strong,
    Table,
    blocks,
)


def markdown(part: Part) -> str:
    """A document, or a part of one, as a file of Markdown."""
    return "\n\n".join(map(_block, blocks(part))) + "\n"


def _block(block: Block) -> str:
    match block:
        case Heading(text, level):
            return f"{'#' * level} {_inline(text)}"
        case Items(lines):
            return "\n".join(f"- {_inline(line)}" for line in lines)
        case Picture(path, about):
            return f"![{escape.markdown(about)}](<{path.as_posix()}>)"
        case Table():
            rules = ["---:" if column.right else "---" for column in block.columns]
            shown = (block.headings, *block.texts())
            header, *rows = ([_inline(text) for text in line] for line in shown)
            return "\n".join(f"| {' | '.join(row)} |" for row in (header, rules, *rows))
        case _:
            return _inline(block)


def _inline(text: str) -> str:
    match text:
        case Prose():
            return text
        case Code():
            return escape.code(text)
        case Strong():
            return f"**{escape.markdown(text)}**" if escape.plain(text) else ""
        case _:
            return escape.markdown(text)


def latex(tables: Iterable[Table]) -> str:
    """Tabulars, their titles as comments; columns that stand aside are left out."""
    return "\n\n".join(_tabular(table.only(lambda c: not c.aside)) for table in tables) + "\n"


def _tabular(table: Table) -> str:
    lines = (table.headings, *table.texts())
    header, *rows = (" & ".join(map(_latex, line)) + r" \\" for line in lines)
    above = [f"% {escape.plain(text)}" for text in (table.title, table.command) if text]
    sides = "".join("r" if column.right else "l" for column in table.columns)
    begin, end = rf"\begin{{tabular}}{{{sides}}}", r"\end{tabular}"
    return "\n".join([*above, begin, rf"{header} \hline", *rows, end])


def _latex(text: str) -> str:
    words = escape.latex(text)
    return rf"\textbf{{{words}}}" if isinstance(text, Strong) else words


def csv(table: Table) -> str:
    """One line a line, numbers with all their digits."""
    buffer = io.StringIO()
    writer = csv_.writer(buffer, lineterminator="\n")
    writer.writerows(map(escape.cell, line) for line in (table.headings, *table.lines))
    return buffer.getvalue()


def terminal(table: Table, look: box.Box = box.MARKDOWN) -> Grid:
    """For rich, the title above, the notes below."""
    caption = escape.terminal("; ".join(table.notes)) if table.notes else None
    title = escape.terminal(table.title) if table.title else None
    grid = Grid(title=title, caption=caption, title_style="bold", box=look)
    grid.pad_edge = look is box.MARKDOWN
    grid.title_justify = grid.caption_justify = "left"
    for column in table.columns:
        heading = escape.terminal(column.heading)
        side: JustifyMethod = "right" if column.right else "left"
        grid.add_column(heading, justify=side, no_wrap=column.whole, overflow="fold")
    for line in table.texts():
        grid.add_row(*map(escape.terminal, line))
    return grid
