"""The verb run: its words, and what is shown while cells run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from strainbench.cli.display import errors, progress, say
from strainbench.cli.interrupt import keeping
from strainbench.cli.options import (
    LOCAL,
    AllSolvers,
    CellSeconds,
    Debug,
    Duration,
    Folder,
    Frames,
    Jobs,
    ManyValues,
    Memory,
    Mode,
    Processes,
    Rerun,
    Scenarios,
    Scheduler,
    Start,
    StepsOrAll,
    Threads,
    Timings,
    Tolerances,
)
from strainbench.escape import plain, terminal
from strainbench.options import shown
from strainbench.progress import Observer, Work

if TYPE_CHECKING:
    from strainbench.bench.cell import Cell
    from strainbench.bench.runner import Settings, Summary


def run_cells(
    scenarios: Scenarios,
    solver: AllSolvers = None,
    set_: ManyValues = None,
    steps: StepsOrAll = None,
    duration: Duration = None,
    mode: Mode = "simulate",
    frames: Frames = None,
    start: Start = "cold",
    tolerance: Tolerances = "1e-6",
    time_limit: CellSeconds = None,
    memory_limit: Memory = None,
    jobs: Jobs = 1,
    threads: Threads = 1,
    repeats: Timings = 1,
    scheduler: Scheduler = None,
    processes: Processes = "fork",
    results: Folder = LOCAL / "run",
    rerun: Rerun = False,
    debug: Debug = False,
) -> None:
    """Run every combination of scenarios, settings and solvers; resumes by itself."""
    from strainbench.bench.machine import memory_share
    from strainbench.bench.mode import with_frames
    from strainbench.bench.plan import never_warm, plan
    from strainbench.bench.runner import Settings

    _check_words(scheduler, steps, duration, debug)
    solvers, tolerances, starts = solver or ["all"], _numbers(tolerance), start.split(",")
    mode = mode if frames is None else with_frames(mode, frames)
    how = (mode, steps, tolerances, time_limit, duration, starts, threads, repeats)
    cells = plan(scenarios, solvers, set_ or [], *how)
    if "cold" not in starts and (cold := never_warm(solvers)):
        say(f"left out, as they cannot start warm: {', '.join(cold)}")
    jobs = min(jobs, len(cells))
    memory = memory_limit or memory_share(jobs)
    run_here(cells, Settings(results, jobs, memory, rerun or debug, processes), scheduler, debug)


def _check_words(
    scheduler: str | None,
    steps: int | None,
    duration: float | None,
    debug: bool,
) -> None:
    """ValueError for words of `run` that are wrong, or do not go together."""
    if scheduler is not None and not scheduler.strip():
        raise ValueError("--scheduler '': an address such as tcp://host:8786 is valid")
    if debug and scheduler is not None:
        raise ValueError("--debug and --scheduler: one of them is valid, as workers keep prints")
    if steps is not None and duration is not None:
        raise ValueError(f"--steps {steps} and --duration {duration:g}: one of them is valid")


def run_here(
    cells: Sequence[Cell],
    settings: Settings,
    scheduler: str | None = None,
    debug: bool = False,
) -> None:
    """Run cells with a bar of progress, or have them run where a scheduler has workers."""
    from strainbench.bench.runner import Runner

    with Display(debug) as display, keeping(lambda: display.kept(len(cells))):
        if scheduler is not None:
            from strainbench.bench.cluster import run_on_cluster  # dask only where it is asked for

            run_on_cluster(scheduler, cells, settings, display)
            return
        summary = Runner(settings, display).run(cells)
    print_summary(summary, len(cells), settings.folder)


def _numbers(text: str) -> list[float]:
    try:
        return [float(word) for word in text.split(",")]
    except ValueError:
        raise ValueError(
            f"--tolerance {shown(text)}: a number, or several with commas, is valid"
        ) from None


class Display(Observer):
    """A progress bar over all steps, with what is running, and a line for each ended cell.

    Parameters
    ----------
    debug : end the run at the first cell that fails
    lines : whether there are such lines
    """

    def __init__(self, debug: bool = False, lines: bool = True) -> None:
        self.debug, self.lines = debug, lines
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
        if skipped and self.lines:
            say(f"{skipped} cells finished before; --rerun runs them again")
        self.progress.update(self.task, total=self.done + sum(c.steps for c in cells))

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
        if self.lines:
            say(f"{cell.title}: {time}, {row['outcome']}{reason}")
        self._show()

    def failed(self, cell: Work, reason: str, printed: str) -> None:
        """See the base class."""
        if self.debug:
            self.progress.stop()
            for line in printed.expandtabs().splitlines():
                indent = len(line) - len(line.lstrip(" "))
                errors.print(" " * indent, terminal(line), sep="")
            say(f"strainbench: stopped at {cell.title}: {reason}", errors)
            raise typer.Exit(1)

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
