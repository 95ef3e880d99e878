"""Running cells: each in a process of its own, watched, stopped at its limits, then judged.

The cells run `jobs` at a time; the referee works in one more process, on the frames of the cells
that have ended, with one job only while no cell's clock runs: beside one it made times 5 to 11%
longer. Rows are appended as they come, so an interrupted run loses only what was running, and the
next one resumes.
"""

from __future__ import annotations

import shutil
import time
from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from dataclasses import dataclass
from datetime import UTC, datetime
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from pebble import ProcessPool

from strainbench.cell import Cell
from strainbench.folder import locked, uninterrupted
from strainbench.frame import recorder
from strainbench.isolation import Running
from strainbench.judge import identity, judge
from strainbench.machine import describe_machine, fixed_threads
from strainbench.records import latest_runs, mend, open_folder, remember_machine, write_cell
from strainbench.reference import REFERENCE_SOLVER

POLL_SECONDS = 0.02


@dataclass(frozen=True)
class Settings:
    """How to run, not what.

    Parameters
    ----------
    folder : the results folder
    jobs : cells at a time
    threads : in each solver's BLAS, OpenMP, numba and rayon
    memory_limit_mb : resident size at which a cell's process is stopped
    rerun : run finished cells again
    """

    folder: Path
    jobs: int = 1
    threads: int = 1
    memory_limit_mb: float = 8192.0
    rerun: bool = False


class Observer:
    """What a progress display may listen to."""

    def planned(self, cells: Sequence[Cell], skipped: int) -> None:
        """These cells will run, and so many had finished before."""

    def started(self, cell: Cell) -> None:
        """A cell's process was started."""

    def stepped(self, cell: Cell, steps: int) -> None:
        """A running cell has done so many steps."""

    def ended(self, cell: Cell, row: dict[str, object]) -> None:
        """A cell's row was written."""


@dataclass
class Summary:
    """Where the wall time of a run went [s].

    `overhead` is what is neither solver nor physics nor the processes' start, as a share of the
    wall time; the referee is in it while the next cell waits for it.
    """

    jobs: int
    cells: int = 0
    wall: float = 0.0
    start: float = 0.0
    play: float = 0.0
    judging: float = 0.0

    @property
    def overhead(self) -> float:
        """Between 0 and 1."""
        return max(0.0, 1 - (self.start + self.play) / self.jobs / self.wall) if self.wall else 0.0


class Runner:
    """Runs cells into one results folder.

    Raises
    ------
    RecordsError
        If the folder cannot be written to, is in use, or holds damaged records.
    """

    def __init__(self, settings: Settings, observer: Observer | None = None) -> None:
        self.settings = settings
        self.observer = observer or Observer()
        self.summary = Summary(settings.jobs)
        folder = settings.folder
        open_folder(folder)
        with locked(folder):
            self._take_stock()
        self._scratch = folder / "running"
        self._machine = ""

    def _take_stock(self) -> None:
        """Mend what a dead run left, and see what has finished."""
        mend(self.settings.folder)
        self._finished = latest_runs(self.settings.folder)

    def is_finished(self, cell: Cell) -> bool:
        """Whether a row makes running `cell` needless.

        It does not if the solver was unavailable or if the cell was stopped at a time limit
        below the one given now.
        """
        row = self._finished.get(cell.key)
        if row is None or self.settings.rerun or row["reason"].startswith("unavailable"):
            return False
        if row["reason"].startswith("time limit"):
            return cell.time_limit is not None and cell.time_limit <= float(row["time_limit"])
        return True

    def run(self, cells: Sequence[Cell]) -> Summary:
        """Run what is not finished; KeyboardInterrupt passes through, with all results kept."""
        with locked(self.settings.folder):
            self._take_stock()
            return self._run(cells)

    def _run(self, cells: Sequence[Cell]) -> Summary:
        begin = time.perf_counter()
        wanted = [cell for cell in cells if not self.is_finished(cell)]
        self._machine, facts = describe_machine(self.settings.threads)
        remember_machine(self.settings.folder, self._machine, facts)
        self.observer.planned(wanted, len(cells) - len(wanted))
        shutil.rmtree(self._scratch, ignore_errors=True)
        spawn = get_context("spawn")
        with (
            fixed_threads(self.settings.threads),
            ProcessPool(self.settings.jobs, max_tasks=1, context=spawn) as pool,
            ProcessPool(1, context=spawn) as referee,
        ):
            court = Court(self, referee)
            try:
                missing = self._missing_recordings(wanted)
                self._play_all(pool, missing, self._keep_recording, court)
                self._play_all(pool, wanted, court.take, court)
            except BaseException:
                pool.stop()
                raise
            finally:
                court.close()
        shutil.rmtree(self._scratch, ignore_errors=True)
        self.summary.wall = time.perf_counter() - begin
        return self.summary

    def _play_all(
        self,
        pool: ProcessPool,
        cells: Sequence[Cell],
        take: Callable[[Running], None],
        court: Court,
    ) -> None:
        """Run the cells, `jobs` at a time, and hand each to `take` when it has ended.

        With one job, the referee works only while no clock runs: while a process starts.
        """
        alone = self.settings.jobs == 1
        waiting, running = deque(cells), list[Running]()
        while waiting or running:
            while waiting and len(running) < self.settings.jobs:
                cell = waiting.popleft()
                if self._cannot_start(cell):
                    continue
                self.observer.started(cell)
                running.append(self._start(pool, cell))
            for item in [r for r in running if r.has_ended()]:
                running.remove(item)
                self.summary.start += item.start_seconds()
                self.summary.play += item.play_seconds()
                take(item)
            court.advance(not alone or not any(r.released for r in running))
            for item in running:
                self.observer.stepped(item.cell, item.steps)
                if item.is_ready() and (court.idle or not alone):
                    item.release()
            time.sleep(POLL_SECONDS)

    def _start(self, pool: ProcessPool, cell: Cell) -> Running:
        recording = self._recording(cell) if cell.mode == "replay" else None
        folder = self._scratch / f"{cell.key}-{cell.mode}"
        return Running.start(pool, cell, folder, recording, self.settings.memory_limit_mb)

    def _cannot_start(self, cell: Cell) -> bool:
        """Whether a cell ends before it begins, as a row with the reason."""
        reason = ""
        if cell.solver.unavailable:
            reason = f"unavailable: {cell.solver.unavailable}"
        elif cell.mode == "replay" and not self._recording(cell).exists():
            reason = f"the frames to replay could not be recorded with {REFERENCE_SOLVER}"
        if reason:
            row = identity(cell) | {"steps_done": 0, "outcome": "no answer", "reason": reason}
            self.write(cell, row, [])
        return bool(reason)

    def _recording(self, cell: Cell) -> Path:
        return self.settings.folder / "recordings" / cell.recording_key

    def _missing_recordings(self, cells: Sequence[Cell]) -> list[Cell]:
        """The cells that record what replay cells will be fed, where that is not there yet."""
        missing = {
            cell.recording_key: recorder(cell)
            for cell in cells
            if cell.mode == "replay" and not self._recording(cell).exists()
        }
        return list(missing.values())

    def _keep_recording(self, item: Running) -> None:
        if item.steps == item.cell.steps:
            target = self._recording(item.cell)
            target.parent.mkdir(exist_ok=True)
            item.folder.rename(target)

    def write(self, cell: Cell, row: dict[str, object], steps: Sequence[dict[str, object]]) -> None:
        """Append a cell's rows and tell the observer."""
        row["finished_at"] = datetime.now(UTC).isoformat(timespec="seconds")
        row["machine"] = self._machine
        write_cell(self.settings.folder, row, steps)
        self.summary.cells += 1
        self.observer.ended(cell, row)


class Court:
    """The referee's process and the cases before it, one at a time."""

    def __init__(self, runner: Runner, pool: ProcessPool) -> None:
        self._runner, self._pool = runner, pool
        self._waiting: deque[Running] = deque()
        self._open: tuple[Running, Future[Any]] | None = None

    @property
    def idle(self) -> bool:
        """Whether no case is left."""
        return not self._waiting and self._open is None

    def take(self, item: Running) -> None:
        """A cell that has ended becomes a case."""
        self._waiting.append(item)

    def advance(self, may_open: bool) -> None:
        """Write down the open case if it is decided; open the next one if that is allowed."""
        if self._open and self._open[1].done():
            with uninterrupted():  # a case is settled once
                decided, self._open = self._open, None
                self._settle(*decided)
        if self._waiting and self._open is None and may_open:
            item = self._waiting.popleft()
            folder = self._runner.settings.folder
            cache = folder / "references" if item.cell.mode == "replay" else None
            case = self._pool.schedule(judge, args=(item.cell, item.folder, item.ending, cache))
            self._open = item, case

    def close(self) -> None:
        """Decide what is left."""
        while not self.idle:
            self.advance(True)
            time.sleep(POLL_SECONDS)

    def _settle(self, item: Running, case: Future[Any]) -> None:
        row, steps = case.result()
        row["start_seconds"] = item.start_seconds()
        self._runner.summary.judging += float(row["judge_seconds"])
        self._runner.write(item.cell, row, steps)
        shutil.rmtree(item.folder, ignore_errors=True)
