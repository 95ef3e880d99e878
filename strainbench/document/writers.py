"""A document as Markdown; a table as CSV, on a terminal and, from `latex`, in an article."""

from __future__ import annotations

import csv as csv_
import io

from rich import box
from rich.console import JustifyMethod
from rich.table import Table as Grid

from strainbench import escape
from strainbench.document import (
    Block,
    Code,
    Faint,
    Heading,
    Items,
    Part,
    Picture,
    Prose,
    Strong,
    Table,
    blocks,
)
from strainbench.document.latex import latex

__all__ = ["csv", "latex", "markdown", "terminal"]


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
        case Faint():
            return f"({escape.markdown(text)})" if escape.plain(text) else ""
        case _:
            return escape.markdown(text)


def csv(table: Table) -> str:
    """One line a line, numbers with all their digits."""
    buffer = io.StringIO()
    writer = csv_.writer(buffer, lineterminator="\n")
    writer.writerow(map(escape.cell, table.headings))
    writer.writerows(map(escape.cell, line) for line in table.cells)
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
