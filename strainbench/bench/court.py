"""The referee's process, and the cases before it: cells that have ended."""

from __future__ import annotations

import json
import os
import pickle
import subprocess
import sys
import time
import traceback
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

from strainbench.bench.ending import Ending
from strainbench.bench.isolation import Running, crashed
from strainbench.bench.judge import JUDGED, judge, judge_limit, unjudged
from strainbench.bench.mode import replays
from strainbench.bench.process import Child, Family, spawned
from strainbench.bench.rows import Verdict
from strainbench.files import uninterrupted
from strainbench.plugins import told
from strainbench.referee.reference import Kept

CASE, VERDICT = "case.pickle", "verdict.json"
"""In a cell's folder: what is to be judged, and what came of it."""
POLL_SECONDS = 0.02
LAST_GRACE = 3.0  # [s] for the referee to decide the open case when a run is interrupted


def serve() -> None:
    """The referee's process: judge the case in each folder that a line of its input names.

    References are kept for the cells that are fed the same frames: in memory, not in a file, from
    which a cell could take its answers.
    """
    home, recording, kept = Path.cwd(), "", Kept()
    for line in sys.stdin:
        folder = Path(json.loads(line))
        cell, ending = pickle.loads((folder / CASE).read_bytes())
        key = cell.recording_key if replays(cell.mode) else cell.key
        if key != recording:
            recording, kept = key, Kept()
        try:
            verdict: object = judge(cell, folder, ending, kept)
        except BaseException as error:  # of a scene's code, sys.exit among them, or our own
            traceback.print_exc()
            verdict = told(error)
        os.chdir(home)  # wherever a scene has gone
        part = folder / "verdict.part"
        part.write_text(json.dumps(verdict, default=_plain), encoding="utf-8")
        part.replace(folder / VERDICT)


def _plain(value: Any) -> object:
    """A NumPy number as Python's; anything else as text."""
    return getattr(value, "item", value.__str__)()


@dataclass
class Case:
    """What is before the referee."""

    item: Running
    judged: int = 0
    since: float = field(default_factory=time.monotonic)

    def failure(self, referee: Child) -> str:
        """Why the referee will not decide it, or ""."""
        if (code := referee.exit_code) is not None:
            return crashed(code).removeprefix(f"{Ending.CRASHED}: ")
        path = self.item.folder / JUDGED
        judged = path.stat().st_size if path.exists() else 0
        if judged != self.judged:
            self.judged, self.since = judged, time.monotonic()
        limit = judge_limit(self.item.events)
        if time.monotonic() - self.since > limit:
            return f"hung on projection {judged + 1}, beyond its limit of {limit:g} s for one"
        return ""


class Court:
    """The referee's process and the cases before it, one at a time.

    A process that has failed on one case is not asked again: the next case has a fresh one.

    Parameters
    ----------
    scratch : a folder for what the referee's process prints
    settle : takes each cell's process and its rows once they are there
    """

    def __init__(self, ours: Family, scratch: Path, settle: Callable[..., None]) -> None:
        self._family, self._scratch, self._settle = ours, scratch, settle
        self._waiting: deque[Running] = deque()
        self._open: Case | None = None
        self._referee: Child | None = None

    @property
    def idle(self) -> bool:
        """Whether no case is left."""
        return not self._waiting and self._open is None

    @contextmanager
    def in_session(self) -> Iterator[None]:
        """Decide what is left at the end; after an interrupt what is open, if that is soon done."""
        ended = False
        try:
            yield
            ended = True
        finally:
            until = time.monotonic() + (float("inf") if ended else LAST_GRACE)
            while time.monotonic() < until and (self._open or (ended and self._waiting)):
                self.advance(ended)
                time.sleep(POLL_SECONDS)

    def take(self, item: Running) -> None:
        """A cell that has ended becomes a case."""
        self._waiting.append(item)

    def advance(self, may_open: bool) -> None:
        """Write down the open case if it is decided; open the next one if that is allowed."""
        if self._open and (verdict := self._verdict(self._open)):
            with uninterrupted():  # a case is settled once
                item, self._open = self._open.item, None
                self._settle(item, *verdict)
        if self._waiting and self._open is None and may_open:
            item = self._waiting.popleft()
            self._hand_over(item)
            self._open = Case(item)

    def _hand_over(self, item: Running) -> None:
        """Give a case to the referee's process, which is started if there is none."""
        item.folder.mkdir(exist_ok=True)  # a plug-in may have removed it
        if self._referee is None or self._referee.exit_code is not None:
            folder = self._scratch / f"referee-{len(self._family.children)}"
            folder.mkdir(parents=True)
            self._referee = self._family.start(
                serve, (), folder, partial(spawned, stdin=subprocess.PIPE)
            )
        try:
            (item.folder / CASE).write_bytes(pickle.dumps((item.cell, item.ending)))
            stdin = self._referee.process.stdin
            assert stdin is not None
            stdin.write(json.dumps(str(item.folder)).encode() + b"\n")
            stdin.flush()
        except OSError:
            self._referee.stop()  # which decides the case: see `Case.failure`

    def _verdict(self, case: Case) -> Verdict | None:
        """The rows of a case, or None while it is open."""
        assert self._referee is not None
        item, failure = case.item, case.failure(self._referee)
        if (item.folder / VERDICT).exists():  # after the look at the process: none comes after
            found = json.loads((item.folder / VERDICT).read_text(encoding="utf-8"))
            if not isinstance(found, str):
                row, steps = found
                return row, steps
            failure = found
        if not failure:
            return None
        if not (item.folder / VERDICT).exists():
            self._referee.stop()
        return unjudged(item.cell, item.folder, item.ending, failure)
