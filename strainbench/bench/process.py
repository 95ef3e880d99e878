"""Processes that end: with their work, with whoever started them, with all that they started.

Each runs a function in a session of its own, and bears a mark in its environment, which whatever
it starts inherits. Beside them a warden waits at a pipe that only the starter holds: however that
one dies, `kill -9` included, the warden kills what bears its mark. (Linux's death signal would
reach a process but not what it has started, and comes when a thread ends.)

This file is run as a program too, so it imports nothing of ours.
"""

from __future__ import annotations

import os
import pickle
import secrets
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Protocol

import psutil

MARK = "STRAINBENCH_MARK"
PATIENCE = 10.0  # [s] for a process that was killed to be gone
OUTPUT = "output.txt"  # what a process prints, native code included


class Process(Protocol):
    """What there is of `subprocess.Popen` in a process that was started otherwise."""

    stdin: IO[bytes] | None

    @property
    def pid(self) -> int | None:
        """None until it has begun."""

    def poll(self) -> int | None:
        """Its exit code, or None while it runs."""

    def kill(self) -> None:
        """End it."""

    def wait(self, timeout: float) -> int:
        """Its exit code, once it has ended."""


Starter = Callable[[Path, str, Path], Process]
"""Starts what a file asks for, with a mark, its prints going to a file."""


@dataclass(frozen=True)
class Child:
    """A process of ours, the leader of a session."""

    process: Process
    mark: str

    @property
    def exit_code(self) -> int | None:
        """None while it runs; a negative number is the signal that ended it."""
        return self.process.poll()

    def stop(self) -> None:
        """Kill it, unless it has ended, and whatever it started."""
        if hasattr(os, "killpg") and self.process.pid is not None:
            with suppress(ProcessLookupError, PermissionError):  # none is left
                os.killpg(self.process.pid, signal.SIGKILL)
        with suppress(OSError):
            self.process.kill()
        kill_marked(self.mark)
        with suppress(subprocess.TimeoutExpired):  # stuck in the kernel: it is past helping
            self.process.wait(PATIENCE)
        if self.process.stdin:
            with suppress(OSError):  # what nobody will read
                self.process.stdin.close()


@dataclass
class Family:
    """What one starter has started; see `family`."""

    mark: str
    children: list[Child] = field(default_factory=list)
    at_end: ExitStack = field(default_factory=ExitStack)

    def start(
        self, work: Callable[..., None], args: tuple[object, ...], folder: Path, starter: Starter
    ) -> Child:
        """Do `work(*args)` in a new process, whose prints go to a file in `folder`."""
        mark = f"{self.mark}{len(self.children):06d}."
        task = folder / "task.pickle"
        task.write_bytes(pickle.dumps((sys.path, pickle.dumps((work, args)))))
        self.children.append(Child(starter(task, mark, folder / OUTPUT), mark))
        return self.children[-1]


def spawned(
    task: Path,
    mark: str,
    output: Path,
    stdin: int = subprocess.DEVNULL,
    fds: tuple[int, ...] = (),
) -> subprocess.Popen[bytes]:
    """Do what a file asks for in a Python of its own; `fds` are handed on to it."""
    words = [str(task), *map(str, fds)]
    with output.open("wb") as prints:
        return _run("work", words, {MARK: mark}, stdin, prints, fds)


@contextmanager
def family() -> Iterator[Family]:
    """A place to start processes; at its end, and at the starter's, all of them are killed."""
    ours = Family(f"{secrets.token_hex(8)}.")
    warden = _run("watch", [ours.mark], {}, subprocess.PIPE, subprocess.DEVNULL)
    assert warden.stdin is not None
    try:
        yield ours
    finally:
        for child in reversed(ours.children):  # none before those that it has forked
            if child.exit_code is None:
                child.stop()
        ours.at_end.close()
        warden.stdin.close()
        warden.wait()


def _run(
    role: str,
    words: list[str],
    marks: dict[str, str],
    stdin: int,
    output: int | IO[bytes],
    fds: tuple[int, ...] = (),
) -> subprocess.Popen[bytes]:
    """This file as a program."""
    return subprocess.Popen(
        [sys.executable, "-P", __file__, role, *words],
        env={**os.environ, **marks},
        stdin=stdin,
        stdout=output,
        stderr=output,
        start_new_session=True,
        pass_fds=fds,
    )


def kill_marked(mark: str) -> None:
    """Kill every process whose mark begins so, until there is none."""
    give_up = time.monotonic() + PATIENCE
    while (found := list(marked(mark))) and time.monotonic() < give_up:
        for process in found:
            with suppress(psutil.Error):
                process.kill()
        time.sleep(0.01)


def marked(mark: str) -> Iterator[psutil.Process]:
    """The processes whose mark begins so; those of other users cannot be seen."""
    for process in psutil.process_iter(["environ"]):
        if (process.info["environ"] or {}).get(MARK, "").startswith(mark):
            yield process


def watch(mark: str) -> None:
    """Wait until whoever started this is gone, then kill what bears the mark."""
    sys.stdin.read()
    kill_marked(mark)


def work_on(task: str, *fds: str) -> None:
    """Do what a file asks for, with the ends that were handed on."""
    sys.path[:], pickled = pickle.loads(Path(task).read_bytes())
    work, args = pickle.loads(pickled)
    work(*args, *map(int, fds))


if __name__ == "__main__":
    {"watch": watch, "work": work_on}[sys.argv[1]](*sys.argv[2:])  # type: ignore[operator]
