"""A cell's process, watched from outside: its steps, its time, its memory."""

from __future__ import annotations

import time
from concurrent.futures import Future
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import psutil
from pebble import ProcessExpired, ProcessPool

from strainbench.cell import Cell
from strainbench.play import EVENTS, GO, Task, play, read_events

START_LIMIT = 180.0  # [s] for imports and compilation, before a cell's clock starts
GRACE = 2.0  # [s] after the time limit in which a solver may stop by itself


@dataclass
class Running:
    """One cell in a process of its own.

    Attributes
    ----------
    steps : time steps done so far
    released : whether its clock may have started
    ending : once ended, why it was ended from outside, or ""
    """

    cell: Cell
    folder: Path
    future: Future[None]
    memory_limit_mb: float
    scheduled: float = field(default_factory=time.time)
    events: list[dict[str, Any]] = field(default_factory=list)
    steps: int = 0
    released: bool = False
    ending: str = ""
    _size: int = 0

    @classmethod
    def start(
        cls,
        pool: ProcessPool,
        cell: Cell,
        folder: Path,
        recording: Path | None,
        memory_limit_mb: float,
        task: Task = play,
    ) -> Running:
        """Start `task` in the next process of `pool`."""
        folder.mkdir(parents=True)
        future = pool.schedule(task, args=(cell, folder, recording))
        return cls(cell, folder, future, memory_limit_mb)

    def has_ended(self) -> bool:
        """Whether the process is gone; stops it if it is over a limit."""
        done = self.future.done()  # before the events are read: none comes after
        self._read_events()
        if done:
            self.ending = self.ending or self._crash()
            return True
        self.ending = self._limit_reached()
        if self.ending:
            self.future.cancel()
        return False

    def is_ready(self) -> bool:
        """Whether it has started, imported and compiled, and waits to be released."""
        return not self.released and self._when("ready") is not None

    def release(self) -> None:
        """Let its clock start."""
        (self.folder / GO).touch()
        self.released = True

    def start_seconds(self) -> float:
        """Process start, imports, compilation."""
        return (self._when("ready") or time.time()) - self.scheduled

    def play_seconds(self) -> float:
        """Physics, set-up and solver."""
        begun = self._when("started")
        return (self._when("ended") or time.time()) - begun if begun else 0.0

    def _when(self, event: str) -> float | None:
        return next((float(e["at"]) for e in self.events if e["event"] == event), None)

    def _read_events(self) -> None:
        path = self.folder / EVENTS
        size = path.stat().st_size if path.exists() else 0
        if size != self._size:
            self._size = size
            self.events = read_events(self.folder)
            self.steps = sum(e["event"] == "step" for e in self.events)

    def _crash(self) -> str:
        if self.future.cancelled():
            return "stopped"
        error = self.future.exception()
        if isinstance(error, ProcessExpired):
            return f"crashed: its process ended with exit code {error.exitcode}"
        return f"{type(error).__name__}: {error}" if error else ""

    def _limit_reached(self) -> str:
        limit = self.cell.time_limit
        begun = self._when("started")
        if self._when("ready") is None and time.time() - self.scheduled > START_LIMIT:
            return f"hung for {START_LIMIT:g} s before its first projection"
        if begun is not None and limit is not None and time.time() - begun > limit + GRACE:
            return f"time limit of {limit:g} s"
        pid = next((e["pid"] for e in self.events if e["event"] == "process"), None)
        if pid is not None and _resident_mb(pid) > self.memory_limit_mb:
            return f"memory limit of {self.memory_limit_mb:g} MB"
        return ""


def _resident_mb(pid: int) -> float:
    try:
        return float(psutil.Process(pid).memory_info().rss / 1024**2)
    except psutil.NoSuchProcess:
        return 0.0
