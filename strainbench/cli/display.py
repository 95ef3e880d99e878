"""What the terminal shows: lines, progress, the end of a run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    SpinnerColumn,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

from strainbench.bench.runner import Summary
from strainbench.escape import plain, terminal
from strainbench.progress import Observer, Work

console = Console()
errors = Console(stderr=True, soft_wrap=True, highlight=False)


def say(line: object, on: Console = console) -> None:
    """Print a line as it is: what looks like markup in it is text."""
    on.print(terminal(line), soft_wrap=True)


def progress(of: str = "") -> Progress:
    """A progress bar with what is done, `of` what, and the time it takes."""
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


class Display(Observer):
    """A progress bar over all steps, with what is running, and a line for each ended cell."""

    def __init__(self) -> None:
        self.progress = progress("steps,")
        self.running: dict[str, int] = {}
        self.done = self.finished = 0

    def __enter__(self) -> Display:
        self.progress.start()
        self.task = self.progress.add_task("starting", total=None)
        return self

    def __exit__(self, *_: object) -> None:
        self.progress.stop()

    def planned(self, cells: Sequence[Work], skipped: int) -> None:
        """See the base class."""
        self.finished = skipped
        if skipped:
            say(f"{skipped} cells finished before; --rerun runs them again")
        self.progress.update(self.task, total=sum(c.steps for c in cells))

    def started(self, cell: Work) -> None:
        """See the base class."""
        self.running[cell.title] = 0
        self._show()

    def stepped(self, cell: Work, steps: int) -> None:
        """See the base class."""
        self.running[cell.title] = steps
        self._show()

    def ended(self, cell: Work, row: Mapping[str, object]) -> None:
        """See the base class."""
        self.running.pop(cell.title, None)
        self.done += cell.steps
        self.finished += 1
        seconds = row.get("solve_seconds_mean", "")
        time = f"{float(str(seconds)):.4f} s a solve" if seconds != "" else "no solve"
        reason = f": {row['reason']}" if row["reason"] else ""
        say(f"{cell.title}: {time}, {row['outcome']}{reason}")
        self._show()

    def waiting(self, what: str) -> None:
        """See the base class."""
        say(f"waiting for {what}")

    def _show(self) -> None:
        completed = self.done + sum(self.running.values())
        what = " | ".join(self.running) or "the referee"
        self.progress.update(self.task, completed=completed, description=plain(what))

    def kept(self, planned: int) -> str:
        """What an interrupted run leaves."""
        if not self.finished:
            return "; no cell had finished"
        finished = f"{self.finished} of {planned}"
        return f"; every finished cell is kept ({finished}), run the same again to go on"


def print_summary(summary: Summary, planned: int, results: Path) -> None:
    """Where the wall time of a run went."""
    if not summary.cells:
        say(f"nothing to run: all {planned} cells have finished; results in {results}")
        return
    say(
        f"{summary.cells} cells in {summary.wall:.1f} s: solvers and physics {summary.play:.1f} s, "
        f"processes' start {summary.start:.1f} s, suite overhead {100 * summary.overhead:.1f}% "
        f"of the wall time; the referee worked {summary.judging:.1f} s while processes started"
    )
    say(f"results in {results}")
