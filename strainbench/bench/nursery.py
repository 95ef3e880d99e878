"""A nursery: a process that has loaded what cells need, and from which each of them is forked.

Python's start, imports and compiled code take a cell one to three seconds; the fork of a process
that has them takes some hundredths. A nursery may itself be forked from another, so that what all
solvers need is loaded once and what one needs is loaded for that one alone: the memory of a cell is
that of a cell which loads all by itself.

A process with several threads must not be forked: where something that was loaded has started one,
or has failed, the nursery says so, and its cells start on their own. Linux alone has nurseries: on
other systems libraries do not survive a fork.
"""

from __future__ import annotations

import ctypes
import json
import os
import select
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import IO

import numpy as np
import psutil

from strainbench.bench.process import MARK, Child, Family, spawned, work_on

CAN_FORK = sys.platform == "linux"
LOST = 255  # exit code of a process whose nursery died before it did
LONGEST_MESSAGE = 1 << 16
Load = Callable[..., None]


@dataclass
class Nursery:
    """The starter's side of one.

    Attributes
    ----------
    control, theirs : both ends of what it is told and tells
    unfit : why no process may be forked from it, or ""
    pids : of each process forked so far, by its number
    exits : exit codes, by process
    """

    child: Child
    control: socket.socket
    theirs: socket.socket
    unfit: str = ""
    forks: int = 0
    pids: dict[int, int] = field(default_factory=dict)
    exits: dict[int, int] = field(default_factory=dict)

    @classmethod
    def planted(
        cls, family: Family, folder: Path, load: Load, *args: object, within: Nursery | None = None
    ) -> Nursery:
        """One that does `load(*args)`, forked from the nursery that it is `within`, if any."""
        ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        ours.setblocking(False)
        for end in (ours, theirs):
            family.at_end.enter_context(end)
        starter = partial(spawned if within is None else within.forked, fds=(theirs.fileno(),))
        folder.mkdir(parents=True)
        return cls(family.start(serve, (load, args), folder, starter), ours, theirs)

    def forked(self, task: Path, mark: str, output: Path, fds: tuple[int, ...] = ()) -> Fork:
        """A process that does what the file `task` asks for; see `Family.start`."""
        self.forks += 1
        request = {"number": self.forks, "task": str(task), "mark": mark, "output": str(output)}
        with suppress(OSError):  # it has ended, which `Fork` finds out
            socket.send_fds(self.control, [json.dumps(request).encode()], fds)
        return Fork(self, self.forks, partial(spawned, task, mark, output, fds=fds))

    @property
    def dead(self) -> bool:
        """Whether it has ended without a word."""
        ended = self.child.exit_code is not None
        self.listen()
        return ended and not self.unfit

    def listen(self) -> None:
        """Read what it has said: whom it has forked, and how they ended."""
        while True:
            try:
                said = self.control.recv(LONGEST_MESSAGE)
            except OSError:  # nothing more, for now or for ever
                return
            if not said:
                return
            for name, value in json.loads(said).items():
                if name == "unfit":
                    self.unfit = value
                else:
                    known = self.pids if name == "pids" else self.exits
                    known.update({int(k): v for k, v in value.items()})


@dataclass
class Fork:
    """A forked process, with what `subprocess.Popen` has of one."""

    nursery: Nursery
    number: int
    alone: Callable[[], subprocess.Popen[bytes]]
    stdin: IO[bytes] | None = None
    _instead: subprocess.Popen[bytes] | None = None

    @property
    def pid(self) -> int | None:
        """None until the nursery has forked it."""
        self._look()
        return self._instead.pid if self._instead else self.nursery.pids.get(self.number)

    def poll(self) -> int | None:
        """Its exit code, or None while it runs."""
        self._look()
        if self._instead:
            return self._instead.poll()
        pid = self.nursery.pids.get(self.number)
        died = self.nursery.child.exit_code
        if pid in self.nursery.exits:
            return self.nursery.exits[pid]
        if died is None:
            return None
        return died if pid is None else None if _lives(pid) else LOST

    def kill(self) -> None:
        """End it; one that was not forked yet waits for a nursery that hangs, which ends too."""
        pid = self.pid
        if pid is None:
            self.nursery.child.process.kill()
        elif self.poll() is None:
            os.kill(pid, signal.SIGKILL)

    def wait(self, timeout: float) -> int:
        """Its exit code, once it has ended."""
        until = time.monotonic() + timeout
        while (code := self.poll()) is None:
            if time.monotonic() > until:
                raise subprocess.TimeoutExpired("a fork", timeout)
            time.sleep(0.001)
        return code

    def _look(self) -> None:
        self.nursery.listen()
        if self.nursery.unfit and not self._instead and self.number not in self.nursery.pids:
            self._instead = self.alone()


def _lives(pid: int) -> bool:
    try:
        return bool(psutil.Process(pid).status() != psutil.STATUS_ZOMBIE)
    except psutil.NoSuchProcess:
        return False


def serve(load: Load, args: tuple[object, ...], fd: int) -> None:
    """Do `load(*args)`, then fork a process for each task asked for, until the starter is gone.

    In a forked process this returns when its task is done, and so ends it as any other ends.
    """
    control = socket.socket(fileno=fd)
    if unfit := _unfit(load, args):
        control.send(json.dumps({"unfit": unfit}).encode())
        return
    for path, kb in _file_pages().items():
        _touched[path] = max(kb, _touched.get(path, 0))
    woken, wake = os.pipe2(os.O_NONBLOCK | os.O_CLOEXEC)
    signal.signal(signal.SIGCHLD, lambda *_: None)
    signal.set_wakeup_fd(wake, warn_on_full_buffer=False)
    while True:
        ready, _, _ = select.select([control.fileno(), woken], [], [])
        if woken in ready:
            os.read(woken, LONGEST_MESSAGE)
            if ended := dict(_ended()):
                control.send(json.dumps({"exits": ended}).encode())
        if control.fileno() in ready:
            message, fds, _, _ = socket.recv_fds(control, LONGEST_MESSAGE, 1)
            if not message:
                return
            request = json.loads(message)
            if (pid := os.fork()) == 0:
                signal.set_wakeup_fd(-1)
                for end in (woken, wake):
                    os.close(end)
                control.close()
                _begin(request["mark"], Path(request["output"]))
                work_on(request["task"], *map(str, fds))
                return
            control.send(json.dumps({"pids": {request["number"]: pid}}).encode())
            for passed in fds:
                os.close(passed)


def _unfit(load: Load, args: tuple[object, ...]) -> str:
    """Load, and say why this process must not be forked, or ""."""
    try:
        load(*args)
    except Exception as error:  # each cell meets it by itself, and says so
        return f"{type(error).__name__}: {error}"
    threads = len(os.listdir("/proc/self/task"))
    return "" if threads == 1 else f"it has {threads} threads"


_touched: dict[str, int] = {}
"""Resident pages [kB] of each file that this process's nurseries have mapped."""


def untouched_mb() -> float:
    """What of its nurseries' files is not resident here [MB].

    A fork shares their other memory at once, and a library's pages when it first uses them; a
    process that loads all by itself has used them by then.
    """
    here = _file_pages()
    return sum(max(0, kb - here.get(path, 0)) for path, kb in _touched.items()) / 1024


def _file_pages() -> dict[str, int]:
    """Resident pages [kB] of each file that is mapped."""
    pages: dict[str, int] = {}
    path = ""
    for line in Path("/proc/self/smaps").read_text(encoding="utf-8").splitlines():
        first, *words = line.split(maxsplit=5)
        if not first.endswith(":"):
            path = words[4] if len(words) == 5 and words[4].startswith("/") else ""
        elif first == "Rss:" and path:
            pages[path] = pages.get(path, 0) + int(words[0])
    return pages


def _ended() -> Iterator[tuple[int, int]]:
    """Processes that have ended, and their exit codes."""
    with suppress(ChildProcessError):
        while (found := os.waitpid(-1, os.WNOHANG))[0]:
            yield found[0], os.waitstatus_to_exitcode(found[1])


def _begin(mark: str, output: Path) -> None:
    """Give a forked process what one has that was started by itself."""
    signal.signal(signal.SIGCHLD, signal.SIG_DFL)
    os.setsid()
    os.environ[MARK] = mark
    _show(mark)
    for number, path, flags in (
        (0, os.devnull, os.O_RDONLY),
        (1, output, os.O_WRONLY | os.O_CREAT | os.O_APPEND),
    ):
        opened = os.open(path, flags)
        os.dup2(opened, number)
        os.close(opened)
    os.dup2(1, 2)
    np.random.seed()  # noqa: NPY002 (what plug-ins may use: all would draw the same numbers)


def _show(mark: str) -> None:
    """Write the mark where others see a process's environment: where it was when that began."""
    facts = Path("/proc/self/stat").read_text(encoding="utf-8").rpartition(")")[2].split()
    start, end = int(facts[47]), int(facts[48])
    shown = ctypes.string_at(start, end - start)
    at = shown.index(f"{MARK}=".encode()) + len(MARK) + 1
    old = shown[at : shown.index(b"\0", at)]
    if len(old) != len(mark):
        raise ValueError(f"the mark {mark} has another length than its nursery's {old.decode()}")
    ctypes.memmove(start + at, mark.encode(), len(mark))
