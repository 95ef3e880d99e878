"""The verb explain: the story of one cell that failed."""

from __future__ import annotations

from typing import Annotated

import typer

from strainbench.cli.display import console, say
from strainbench.cli.options import LOCAL, Folder, Memory, PicturesFolder

CellWord = Annotated[
    str | None,
    typer.Argument(
        metavar="[CELL]",
        help="its number, the beginning of its key, or its method; nothing lists those that failed",
    ),
]


def explain_cell(
    cell: CellWord = None,
    results: Folder = LOCAL / "run",
    memory_limit: Memory = None,
    output: PicturesFolder = LOCAL / "explain",
) -> None:
    """Tell why a cell is not optimal: what, where, since when; with a picture and the frame."""
    from rich import box

    from strainbench.bench.machine import memory_share
    from strainbench.document.writers import terminal
    from strainbench.studies.explain import choose, explain, listed

    if cell is None:
        console.print(terminal(listed(results), box.SIMPLE_HEAD))
        return
    story = explain(choose(results, cell), results, output, memory_limit or memory_share(1))
    say(" ".join(story.sentences))
    for command in story.commands:
        say(f"$ {command}")
    for path in story.paths:
        say(f"wrote {path}")
