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
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from strainbench.bench.cell import Cell
from strainbench.bench.court import POLL_SECONDS, Court
from strainbench.bench.ending import Ending
from strainbench.bench.failure import ended
from strainbench.bench.isolation import Running
from strainbench.bench.journal import keep_targets
from strainbench.bench.machine import describe_machine, fixed_threads
from strainbench.bench.mode import replays
from strainbench.bench.preload import STARTS, Nurseries
from strainbench.bench.process import Family, family
from strainbench.bench.recording import recorder
from strainbench.bench.records import latest_runs, mend, open_folder, remember_machine, write_cell
from strainbench.bench.rows import identity
from strainbench.files import locked
from strainbench.options import shown
from strainbench.progress import Observer as Observer
from strainbench.referee.reference import REFERENCE_SOLVER


@dataclass(frozen=True)
class Settings:
    """How to run, not what.

    Parameters
    ----------
    folder : the results folder
    jobs : cells at a time
    memory_limit_mb : resident size at which a cell's process is stopped
    rerun : run finished cells again
    processes : "fork" from one that has loaded the suite and the cell's solver, where the system
        can, or "spawn" a Python of its own
    """

    folder: Path
    jobs: int = 1
    memory_limit_mb: float = 8192.0
    rerun: bool = False
    processes: str = "fork"

    def __post_init__(self) -> None:
        if self.processes not in STARTS:
            raise ValueError(f"--processes {shown(self.processes)}: valid are {', '.join(STARTS)}")


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
        self.scratch = folder.resolve() / "running"
        self._machines: dict[int, str] = {}

    def _take_stock(self) -> None:
        """Mend what a dead run left, and see what has finished."""
        mend(self.settings.folder)
        self._finished = latest_runs(self.settings.folder)

    def is_finished(self, cell: Cell) -> bool:
        """Whether a row makes running `cell` needless.

        It does not if the solver or a worker was unavailable, if the cell was stopped at a time
        limit below the one given now, or if its projections were to be repeated less often.
        """
        row = self._finished.get(cell.key)
        if row is None or self.settings.rerun or int(row["repeats"] or 1) < cell.repeats:
            return False
        ending = Ending.of(row["reason"])
        if ending is Ending.TIME_LIMIT:
            return cell.time_limit is not None and cell.time_limit <= float(row["time_limit"])
        return ending is None or not ending.passing

    def run(self, cells: Sequence[Cell]) -> Summary:
        """Run what is not finished; KeyboardInterrupt passes through, with all results kept."""
        return self.run_batches([cells])

    def run_batches(self, batches: Iterable[Sequence[Cell]]) -> Summary:
        """The same of several; each is judged and written before the next is asked for."""
        begin = time.perf_counter()
        with locked(self.settings.folder):
            self._take_stock()
            shutil.rmtree(self.scratch, ignore_errors=True)
            with fixed_threads(1), family() as ours:  # the referee's
                self._nurseries = Nurseries(ours, self.scratch, self.settings.processes)
                court = Court(ours, self.scratch, self._settle)
                for cells in batches:
                    self._run(ours, cells, court)
            shutil.rmtree(self.scratch, ignore_errors=True)
        self.summary.wall = time.perf_counter() - begin
        return self.summary

    def _run(self, ours: Family, cells: Sequence[Cell], court: Court) -> None:
        wanted = [cell for cell in cells if not self.is_finished(cell)]
        for threads in {cell.threads for cell in wanted} - set(self._machines):
            self._machines[threads], facts = describe_machine(threads)
            remember_machine(self.settings.folder, self._machines[threads], facts)
        self.observer.planned(wanted, len(cells) - len(wanted))
        with court.in_session():
            missing = self._missing_recordings(wanted)
            self._play_all(ours, missing, self._keep_recording, court)
            self._play_all(ours, wanted, court.take, court)

    def _play_all(
        self,
        ours: Family,
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
                running.append(self._start(ours, cell))
            for item in [r for r in running if r.has_ended()]:
                running.remove(item)
                self.summary.start += item.start_seconds()
                self.summary.play += item.play_seconds()
                take(item)
            court.advance(not alone or not any(r.released is not None for r in running))
            for item in running:
                self.observer.stepped(item.cell, item.steps)
                if item.is_ready() and (court.idle or not alone):
                    item.release()
            time.sleep(POLL_SECONDS)

    def _start(self, ours: Family, cell: Cell) -> Running:
        recording = self._recording(cell) if replays(cell.mode) else None
        folder = self.scratch / f"{cell.key}-{cell.mode.replace(':', '-')}"
        with fixed_threads(cell.threads):
            limit, starter = self.settings.memory_limit_mb, self._nurseries.starter(cell)
            return Running.start(ours, cell, folder, recording, limit, starter=starter)

    def _cannot_start(self, cell: Cell) -> bool:
        """Whether a cell ends before it begins, as a row with the reason."""
        reason = ""
        if cell.solver.unavailable:
            reason = f"{Ending.UNAVAILABLE}: {cell.solver.unavailable}"
        elif replays(cell.mode) and not self._recording(cell).exists():
            reason = f"{Ending.UNRECORDED} with {REFERENCE_SOLVER}"
        if reason:
            row = identity(cell) | {"steps_done": 0, "outcome": "no answer", "reason": reason}
            self.write(cell, row, [])
        return bool(reason)

    def _recording(self, cell: Cell) -> Path:
        return self.settings.folder.resolve() / "recordings" / cell.recording_key

    def _missing_recordings(self, cells: Sequence[Cell]) -> list[Cell]:
        """The cells that record what replay cells will be fed, where that is not there yet."""
        fed = {cell.recording_key: cell for cell in cells if replays(cell.mode)}
        there = {key for key, cell in fed.items() if self._recording(cell).exists()}
        for key in there:
            keep_targets(self._recording(fed[key]))  # of an earlier version, with answers
        return [recorder(cell) for key, cell in fed.items() if key not in there]

    def _keep_recording(self, item: Running) -> None:
        if item.steps == item.cell.steps:
            keep_targets(item.folder)
            target = self._recording(item.cell)
            target.parent.mkdir(exist_ok=True)
            item.folder.rename(target)

    def _settle(
        self, item: Running, row: dict[str, object], steps: list[dict[str, object]]
    ) -> None:
        """Write down what the referee found of a cell, or why it found nothing."""
        row |= {"start_seconds": item.start_seconds(), **item.meter.columns()}
        self.summary.judging += float(str(row.get("judge_seconds", 0.0)))
        self.write(item.cell, row, steps)
        if failure := item.failure():
            self.observer.failed(item.cell, failure, item.printed())
        shutil.rmtree(item.folder, ignore_errors=True)

    def write(self, cell: Cell, row: dict[str, object], steps: Sequence[dict[str, object]]) -> None:
        """Append a cell's rows and tell the observer."""
        if "failure" not in row:  # it never began
            row |= ended(cell, str(row["reason"]), 0)
        row["finished_at"] = datetime.now(UTC).isoformat(timespec="seconds")
        row["machine"] = self._machines.get(cell.threads, "")
        write_cell(self.settings.folder, row, steps)
        self.summary.cells += 1
        self.observer.ended(cell, row)
