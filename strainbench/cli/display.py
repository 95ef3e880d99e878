"""What the terminal shows: lines, and bars of progress."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from rich.console import Console

from strainbench.escape import plain, terminal
from strainbench.progress import Track, Work

if TYPE_CHECKING:
    from rich.progress import Progress

console = Console()
errors = Console(stderr=True, soft_wrap=True, highlight=False)


def say(line: object, on: Console = console) -> None:
    """Print a line as it is: what looks like markup in it is text."""
    on.print(terminal(line), soft_wrap=True)


def progress(of: str = "") -> Progress:
    """A progress bar with what is done, `of` what, and the time it takes."""
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        SpinnerColumn,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )

    unit = [TextColumn(of)] if of else []
    return Progress(
        SpinnerColumn(),
        TextColumn("{task.description}", markup=False),
        BarColumn(bar_width=24),
        MofNCompleteColumn(),
        *unit,
        TimeElapsedColumn(),
        TextColumn("gone,"),
        TimeRemainingColumn(),
        TextColumn("left"),
        console=console,
    )


@contextmanager
def tracking() -> Iterator[Track]:
    """A progress bar for whatever loops it is given."""
    with progress() as bar:
        yield lambda items, what, total: bar.track(items, total, description=what)


@contextmanager
def playing(cell: Work, frame: int) -> Iterator[Callable[[int], None]]:
    """What shows how many projections a scene, on one thread, has asked for before `frame`."""
    from strainbench.studies.threads import one_thread

    with one_thread(), progress() as bar:
        task = bar.add_task(plain(f"playing {cell.title}"), total=max(frame - 1, 1))
        yield lambda asked: bar.update(task, completed=asked - 1)
