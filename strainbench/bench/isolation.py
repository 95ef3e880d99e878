"""A cell's process, watched from outside: its steps, its time, its memory, its clock."""

from __future__ import annotations

import signal
import time
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import psutil

from strainbench.bench.cell import Cell
from strainbench.bench.ending import Ending
from strainbench.bench.journal import EVENTS, GO, read_journal
from strainbench.bench.load import Meter
from strainbench.bench.play import Task, play_cell
from strainbench.bench.process import OUTPUT, Child, Family, Starter, spawned
from strainbench.files import content_of

START_LIMIT = 180.0  # [s] to import the suite and plug-ins and to build the problem, cold disks
WARM_UP_LIMIT = 20.0  # [s] at least, compilation apart; the time limit where that is longer
GRACE = 2.0  # [s] after the time limit in which a solver may stop by itself
EXIT_GRACE = 2.0  # [s] from a cell's last word to the end of its process
FAMILY_SECONDS = 0.25  # [s] between two looks at the memory of what a cell has started
BEFORE = "before its first projection"
CLOCK_SLACK = 3.0  # [s] by which a line of a journal may come late on a busy machine


@dataclass
class Running:
    """One cell in a process of its own.

    Attributes
    ----------
    steps : time steps done so far
    seen : for each event when it was not there yet, and when it was, by the clock here [s]
    released : when its clock was allowed to start, or None
    ending : once ended, why it was ended from outside, or ""
    meter : of what else the machine does while the cell's clock runs
    """

    cell: Cell
    folder: Path
    child: Child
    memory_limit_mb: float
    scheduled: float = field(default_factory=time.monotonic)
    events: list[dict[str, Any]] = field(default_factory=list)
    seen: list[tuple[float, float]] = field(default_factory=list)
    steps: int = 0
    released: float | None = None
    ending: str = ""
    meter: Meter = field(default_factory=Meter)
    _size: int = 0
    _looked: float = 0.0
    _counted: float = 0.0

    @classmethod
    def start(
        cls,
        family: Family,
        cell: Cell,
        folder: Path,
        recording: Path | None,
        memory_limit_mb: float,
        task: Task = play_cell,
        starter: Starter = spawned,
    ) -> Running:
        """Start `task` in a new process."""
        folder.mkdir(parents=True)
        child = family.start(task, (cell, folder, recording), folder, starter)
        return cls(cell, folder, child, memory_limit_mb)

    def has_ended(self) -> bool:
        """Whether it is over, and with it all that it started; stops it if it is over a limit."""
        code = self.child.exit_code  # before the events are read: none comes after
        self._read_events()
        if self.released is not None:
            self.meter.look(self.child.process.pid)
        said_all = self._seen("ended")
        if code is None and not self.ending:
            if said_all is None:
                self.ending = self._limit_reached()
            lingers = said_all is not None and time.monotonic() - said_all > EXIT_GRACE
            if not self.ending and not lingers and not self._repeats_over():
                return False
        elif said_all is None and code is not None:
            self.ending = self.ending or crashed(code)
        self.child.stop()
        self._read_events()
        self.ending = self.ending or self._clock_lies()
        return True

    def is_ready(self) -> bool:
        """Whether it has started, imported and compiled, and waits to be released."""
        return self.released is None and self._when("ready") is not None

    def release(self) -> None:
        """Let its clock start."""
        with suppress(FileNotFoundError):  # a plug-in has removed the folder: seen in a moment
            (self.folder / GO).touch()
        self.released = time.monotonic()
        self.meter.look(self.child.process.pid)

    def start_seconds(self) -> float:
        """Process start, imports, compilation."""
        return (self._when("ready") or time.monotonic()) - self.scheduled

    def play_seconds(self) -> float:
        """Physics, set-up and solver."""
        begun = self._when("started")
        return (self._when("ended") or time.monotonic()) - begun if begun else 0.0

    def failure(self) -> str:
        """Why it did not come to its end, or ""; a time limit and a refusal are no failures."""
        told = [str(e["reason"]) for e in self.events if e["event"] == "failed"]
        reason = self.ending or next(iter(told), "")
        return "" if Ending.of(reason) in (Ending.TIME_LIMIT, Ending.UNSUPPORTED) else reason

    def printed(self) -> str:
        """What its process printed, tracebacks too."""
        return content_of(self.folder / OUTPUT).decode(errors="replace")

    def _when(self, event: str) -> float | None:
        return next((float(e["at"]) for e in self.events if e["event"] == event), None)

    def _seen(self, event: str) -> float | None:
        """When an event was first seen, by the clock here."""
        return next(
            (s for e, (_, s) in zip(self.events, self.seen, strict=True) if e["event"] == event),
            None,
        )

    def _read_events(self) -> None:
        path, before = self.folder / EVENTS, time.monotonic()
        size = path.stat().st_size if path.exists() else 0
        if size < self._size:
            self.ending = self.ending or "its journal was removed or cut while it ran"
        elif size > self._size:
            self._size = size
            events, damage = read_journal(self.folder)
            new = events[len(self.events) :]
            self.events += new
            self.seen += [(self._looked, time.monotonic())] * len(new)
            self.steps = sum(e["event"] == "step" for e in self.events)
            self.ending = self.ending or damage
        self._looked = before

    def _limit_reached(self) -> str:
        limit, now = self.cell.time_limit, time.monotonic()
        warming = self._seen("warming")
        if self.released is not None:
            begun_again = self._seen("repeating") is not None
            if limit is not None and not begun_again and now - self.released > limit + GRACE:
                return f"{Ending.TIME_LIMIT} of {limit:g} s"
        elif self._when("ready") is not None:
            pass  # it waits for us
        elif warming is None:
            if now - self.scheduled > START_LIMIT:
                return f"{Ending.HUNG} for {START_LIMIT:g} s as it was loaded, {BEFORE}"
        else:
            longest = START_LIMIT if limit is None else max(limit, WARM_UP_LIMIT)
            compiling = self._compile_seconds(now)
            if now - warming - min(compiling, START_LIMIT) > longest:
                return (
                    f"{Ending.HUNG} for {longest:g} s in its warm-up, before its first projection"
                )
        return self._memory_reached(now)

    def _repeats_over(self) -> bool:
        """Whether its repeats take longer than they may: all that is judged is there by then."""
        begun, limit = self._seen("repeating"), self.cell.time_limit
        if begun is None or limit is None:
            return False
        return time.monotonic() - begun > (self.cell.repeats - 1) * (limit + GRACE)

    def _compile_seconds(self, now: float) -> float:
        begun = [e["at"] for e in self.events if e["event"] == "compiling"]
        done = [e["at"] for e in self.events if e["event"] == "compiled"]
        return float(sum([*done, now][: len(begun)]) - sum(begun))

    def _memory_reached(self, now: float) -> str:
        if (pid := self.child.process.pid) is None:  # not begun
            return ""
        if _resident_mb(pid) > self.memory_limit_mb:
            return f"{Ending.MEMORY_LIMIT} of {self.memory_limit_mb:g} MB"
        if now - self._counted > FAMILY_SECONDS:
            self._counted = now
            if _family_mb(pid) > self.memory_limit_mb:
                return f"{Ending.MEMORY_LIMIT} of {self.memory_limit_mb:g} MB, with what it started"
        return ""

    def _clock_lies(self) -> str:
        """Whether the journal's times cannot be, as one clock serves all of a machine."""
        started = self._when("started")
        if started is None:
            return ""
        first = self._seen("started") or 0.0
        for event, (before, after) in zip(self.events, self.seen, strict=True):
            if not before - CLOCK_SLACK < event["at"] < after + CLOCK_SLACK:
                inside, outside = event["at"] - started, max(0.0, before - first)
                return (
                    f"{Ending.TAMPERED}: it says {inside:.1f} s, "
                    f"from outside it took {outside:.1f} s at least"
                )
        return ""


def crashed(code: int) -> str:
    """In words how a process ended that did not say so itself."""
    word = " (without a word)" if code == 0 else ""
    if code < 0:
        with suppress(ValueError):  # a signal without a name
            word = f" ({signal.Signals(-code).name})"
    return f"{Ending.CRASHED}: its process ended with exit code {code}{word}"


def _resident_mb(pid: int) -> float:
    try:
        return float(psutil.Process(pid).memory_info().rss / 1024**2)
    except psutil.Error:
        return 0.0


def _family_mb(pid: int) -> float:
    """With what a process has started, counting what that shares with it once."""
    total = _resident_mb(pid)
    with suppress(psutil.Error):
        for child in psutil.Process(pid).children(recursive=True):
            with suppress(psutil.Error):
                total += child.memory_full_info().uss / 1024**2
    return total
