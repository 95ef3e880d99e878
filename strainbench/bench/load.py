"""What a machine did beside a cell while the cell's clock ran."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any

import psutil

SHORTEST = 0.25
"""[s] of which a load can be told: systems count time in hundredths of a second."""
OTHER_WORK = 0.5
"""Cores busy with other work from which on a cell counts as measured beside it."""
IDLE = ("idle", "iowait", "steal", "guest", "guest_nice")  # guests' time is in user already


@dataclass(frozen=True)
class Reading:
    """Times so far [s].

    Parameters
    ----------
    busy : of all cores
    stolen : of all cores, by other guests of the host; None where the system does not say
    own : of the cell's process, and of what it has started that has ended
    """

    at: float
    busy: float
    stolen: float | None
    own: float

    @classmethod
    def of(cls, pid: int) -> Reading:
        """Of a process, and of all; psutil.Error if it is gone."""
        own = psutil.Process(pid).cpu_times()
        return cls.split(time.monotonic(), psutil.cpu_times(), sum(own[:4]))

    @classmethod
    def split(cls, at: float, cores: Any, own: float) -> Reading:
        """From times as psutil has them."""
        busy = sum(seconds for name, seconds in cores._asdict().items() if name not in IDLE)
        return cls(at, busy, getattr(cores, "steal", None), own)


@dataclass
class Meter:
    """Looks at a process, from its start on until it has gone."""

    first: Reading | None = None
    last: Reading | None = None

    def look(self, pid: int | None) -> None:
        """Read the times, unless it is gone."""
        try:
            self.last = Reading.of(pid) if pid is not None else self.last
        except psutil.Error:
            return
        self.first = self.first or self.last

    def columns(self) -> dict[str, float]:
        """Cores that were busy with other work, and seconds stolen; nothing of too short a time."""
        a, b = self.first, self.last
        if a is None or b is None or b.at - a.at < SHORTEST:
            return {}
        others = (b.busy - a.busy) - (b.own - a.own)
        found = {"load": round(max(0.0, others / (b.at - a.at)), 2)}
        if a.stolen is not None and b.stolen is not None:
            found["stolen_seconds"] = round(b.stolen - a.stolen, 2)
        return found
