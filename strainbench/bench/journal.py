"""What a cell's process writes down: events in `events.jsonl`, candidates and answers beside them.

Each is flushed at once, so that whatever ends the process, what was measured before stays.
"""

from __future__ import annotations

import json
import math
import time
from collections.abc import Callable, Iterator
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from strainbench.arrays import FloatArray
from strainbench.bench.ending import Ending
from strainbench.scenario.scenario import StepReport

EVENTS, FRAMES, TARGETS, GO = "events.jsonl", "frames.bin", "targets.bin", "go"
NUMBER = (int, float)
Events = list[dict[str, Any]]
FACTS: dict[str, dict[str, type | tuple[type, ...]]] = {
    "loaded": {
        "variables": int,
        "constraints": int,
        "nonzeros": int,
        "needs": str,
        "blas_threads": int,
    },
    "warming": {},
    "compiling": {},
    "compiled": {},
    "ready": {},
    "started": {},
    "setup": {"seconds": NUMBER},
    "projection": {
        "step": int,
        "begin": NUMBER,
        "end": NUMBER,
        "seconds": NUMBER,
        "iterations": int,
        "status": str,
        "details": dict,
    },
    "step": {"step": int, **{f.name: NUMBER for f in fields(StepReport)}},
    "enough": {},
    "repeating": {"peak_memory_mb": NUMBER},
    "again": {"projection": int, "begin": NUMBER, "end": NUMBER, "seconds": NUMBER},
    "iterate": {"tolerance": NUMBER, "seconds": NUMBER, "iterations": int, "status": str},
    "answer": {"tolerance": NUMBER, "seconds": NUMBER, "iterations": int, "status": str},
    "failed": {"reason": str},
    "ended": {"peak_memory_mb": NUMBER},
}
"""The events, and what must be said with each."""
now = time.monotonic  # one clock for all processes of a machine, as far as it has one


class Journal:
    """The two files of a running cell."""

    def __init__(self, folder: Path, clock: Callable[[], float] = now) -> None:
        self._events = (folder / EVENTS).open("a", encoding="utf-8")
        self._frames = (folder / FRAMES).open("ab")
        self.clock = clock

    def write(self, event: str, **facts: object) -> None:
        """Append one event."""
        self._events.write(json.dumps({"event": event, "at": self.clock(), **facts}) + "\n")
        self._events.flush()

    def frame(self, target: FloatArray, positions: FloatArray) -> None:
        """Append a candidate and its answer."""
        np.save(self._frames, target)
        np.save(self._frames, np.asarray(positions, dtype=np.float64))
        self._frames.flush()


def read_journal(folder: Path) -> tuple[Events, str]:
    """The events so far, and where the journal is damaged, or ""; nothing is read beyond that.

    A line torn by a killed process is left out.
    """
    path = folder / EVENTS
    if not path.exists():
        return [], ""
    events: Events = []
    lines = path.read_text(encoding="utf-8", errors="replace").split("\n")[:-1]
    for number, line in enumerate(lines, start=1):
        try:
            event = json.loads(line)
            sound = _is_sound(event)
        except (ValueError, RecursionError):
            sound = False
        if not sound:
            return events, f"{Ending.DAMAGED} at line {number}"
        events.append(event)
    return events, ""


def _is_sound(event: Any) -> bool:
    """Whether it is an event with its facts."""
    if not isinstance(event, dict) or not isinstance(event.get("at"), NUMBER):
        return False
    expected = FACTS.get(str(event.get("event")))
    if expected is None or not math.isfinite(event["at"]):
        return False
    details = event.get("details", {})
    return all(isinstance(event.get(k), kind) for k, kind in expected.items()) and (
        isinstance(details, dict) and all(isinstance(v, NUMBER) for v in details.values())
    )


def read_events(folder: Path) -> Events:
    """The events so far, those before any damage."""
    return read_journal(folder)[0]


def only(events: Events, kind: str) -> Events:
    """The events of one kind."""
    return [e for e in events if e["event"] == kind]


def read_frames(folder: Path, count: int) -> Iterator[tuple[FloatArray, FloatArray]]:
    """The first `count` pairs of candidate and answer."""
    if not count:
        return
    with (folder / FRAMES).open("rb") as file:
        for _ in range(count):
            yield np.load(file), np.load(file)


def keep_targets(recording: Path) -> None:
    """Leave the candidates alone in a recording: answers are nothing to feed a solver with."""
    if not (recording / FRAMES).exists():
        return
    count = len(only(read_events(recording), "projection"))
    with (recording / TARGETS).open("wb") as file:
        for target, _ in read_frames(recording, count):
            np.save(file, target)
    (recording / FRAMES).unlink()


def read_targets(recording: Path, count: int) -> Iterator[FloatArray]:
    """The first `count` candidates of a recording."""
    with (recording / TARGETS).open("rb") as file:
        for _ in range(count):
            yield np.load(file)
