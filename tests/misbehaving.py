"""Solvers that do what solvers must not; run by test_runner.py as a file from outside."""

from __future__ import annotations

import atexit
import ctypes
import os
import shutil
import signal
import subprocess
import sys
import threading
import time
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import psutil

import strainbench.bench.play
import strainbench.scenario.stage
import strainbench.solver.solver
from strainbench import Solution, Solver

IN_CELL = "STRAINBENCH_MARK" in os.environ  # and not where the run is planned


def in_earnest(problem):
    """Whether this is not the warm-up."""
    return len(problem.elements) > 8


def sleep():
    while True:
        time.sleep(0.01)


def scratch():
    """The folder of this cell."""
    files = psutil.Process().open_files()
    return next(Path(f.path).parent for f in files if f.path.endswith("events.jsonl"))


class Harmless:
    """Answers with the target, but for what the classes below do besides."""

    def solve(self, problem, state, *, tolerance, monitor, deadline):
        if in_earnest(problem):
            self.misbehave()
        return Solution(problem.target.copy(), "solved", 0)

    def misbehave(self):
        pass


@dataclass(frozen=True)
class Crash(Solver):
    """Ends its process from native code (nobody)."""

    name = "crash"

    def solve(self, problem, state, *, tolerance, monitor, deadline):
        if len(problem.elements) > 8:  # not in the warm-up
            os.abort()
        return Solution(problem.target, "solved", 0)


@dataclass(frozen=True)
class Hang(Solver):
    """Answers twice, then never (nobody)."""

    name = "hang"

    def prepare(self, problem):
        return []

    def solve(self, problem, state, *, tolerance, monitor, deadline):
        state.append(1)
        while len(state) > 2:
            time.sleep(0.01)
        return Solution(problem.target.copy(), "solved", 0)


@dataclass(frozen=True)
class NaN(Solver):
    """Returns NaN and says that it is solved (nobody)."""

    name = "nan"

    def solve(self, problem, state, *, tolerance, monitor, deadline):
        return Solution(np.full_like(problem.target, np.nan), "solved", 0)


@dataclass(frozen=True)
class Lie(Solver):
    """Returns the target, stretched as it is, and says that it is solved (nobody)."""

    name = "lie"

    def solve(self, problem, state, *, tolerance, monitor, deadline):
        return replace(Solution(problem.target.copy(), "solved", 0), seconds=0.0)


@dataclass(frozen=True)
class Raise(Solver):
    """Raises (nobody)."""

    name = "raise"

    def solve(self, problem, state, *, tolerance, monitor, deadline):
        raise ZeroDivisionError("by a solver")


@dataclass(frozen=True)
class Shape(Solver):
    """Returns too few vertices (nobody)."""

    name = "shape"

    def solve(self, problem, state, *, tolerance, monitor, deadline):
        return Solution(problem.target[:-1], "solved", 0)


@dataclass(frozen=True)
class Nothing(Solver):
    """Returns no Solution (nobody)."""

    name = "nothing"

    def solve(self, problem, state, *, tolerance, monitor, deadline):
        return None


@dataclass(frozen=True)
class Hoard(Solver):
    """Takes memory until it is stopped (nobody)."""

    name = "hoard"

    def solve(self, problem, state, *, tolerance, monitor, deadline):
        hoard = []
        while len(problem.elements) > 8:
            hoard.append(np.ones(4_000_000))
            time.sleep(0.01)
        return Solution(problem.target, "solved", 0)


@dataclass(frozen=True)
class Refuse(Solver):
    """Takes no problem (nobody)."""

    name = "refuse"

    def supports(self, problem):
        return "it takes none"

    def solve(self, problem, state, *, tolerance, monitor, deadline):
        raise AssertionError


@dataclass(frozen=True)
class Vandal(Solver):
    """Tries to change the problem (nobody)."""

    name = "vandal"

    def solve(self, problem, state, *, tolerance, monitor, deadline):
        problem.target[:] = 0.0
        return Solution(problem.target, "solved", 0)


@dataclass(frozen=True)
class Segfault(Harmless, Solver):
    """Reads where nothing is (nobody)."""

    name = "segfault"

    def misbehave(self):
        ctypes.string_at(0)


@dataclass(frozen=True)
class Exit0(Harmless, Solver):
    """Ends its process as if all were well (nobody)."""

    name = "exit-0"

    def misbehave(self):
        os._exit(0)


@dataclass(frozen=True)
class Exit3(Harmless, Solver):
    """Ends its process (nobody)."""

    name = "exit-3"

    def misbehave(self):
        os._exit(3)


@dataclass(frozen=True)
class SysExit(Harmless, Solver):
    """Wants to end the run (nobody)."""

    name = "sys-exit"

    def misbehave(self):
        sys.exit("enough")


@dataclass(frozen=True)
class Interrupt(Harmless, Solver):
    """Raises what Ctrl-C raises (nobody)."""

    name = "interrupt"

    def misbehave(self):
        raise KeyboardInterrupt


@dataclass(frozen=True)
class NoMemory(Harmless, Solver):
    """Raises what a full memory raises (nobody)."""

    name = "no-memory"

    def misbehave(self):
        raise MemoryError


@dataclass(frozen=True)
class Recursion(Harmless, Solver):
    """Calls itself (nobody)."""

    name = "recursion"

    def misbehave(self):
        self.misbehave()


class Unspeakable(BaseException):
    def __str__(self):
        raise ValueError


@dataclass(frozen=True)
class Strange(Harmless, Solver):
    """Raises what cannot be written (nobody)."""

    name = "strange"

    def misbehave(self):
        raise Unspeakable


@dataclass(frozen=True)
class Surrogate(Harmless, Solver):
    """Raises what UTF-8 cannot hold (nobody)."""

    name = "surrogate"

    def misbehave(self):
        raise ValueError("cannot open \udcff")


@dataclass(frozen=True)
class Alarm(Harmless, Solver):
    """Is ended by a signal (nobody)."""

    name = "alarm"

    def misbehave(self):
        signal.signal(signal.SIGALRM, signal.SIG_DFL)
        signal.alarm(1)
        sleep()


@dataclass(frozen=True)
class Deaf(Harmless, Solver):
    """Hangs and hears no signal (nobody)."""

    name = "deaf"

    def misbehave(self):
        for s in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
            signal.signal(s, signal.SIG_IGN)
        sleep()


@dataclass(frozen=True)
class HangPrepare(Harmless, Solver):
    """Hangs as it is set up (nobody)."""

    name = "hang-prepare"

    def prepare(self, problem):
        if in_earnest(problem):
            sleep()


@dataclass(frozen=True)
class HangWarmUp(Harmless, Solver):
    """Hangs in its warm-up (nobody)."""

    name = "hang-warm-up"

    def prepare(self, problem):
        sleep()


@dataclass(frozen=True)
class HangSupports(Harmless, Solver):
    """Hangs when it is asked what it takes (nobody)."""

    name = "hang-supports"

    def supports(self, problem):
        sleep()


@dataclass(frozen=True)
class HangLoad(Harmless, Solver):
    """Hangs as it is made (nobody)."""

    name = "hang-load"

    def __post_init__(self):
        if IN_CELL:
            sleep()


@dataclass(frozen=True)
class RaisePrepare(Harmless, Solver):
    """Raises as it is set up (nobody)."""

    name = "raise-prepare"

    def prepare(self, problem):
        raise ZeroDivisionError("by a set-up")


@dataclass(frozen=True)
class RaiseSupports(Harmless, Solver):
    """Raises when it is asked what it takes (nobody)."""

    name = "raise-supports"

    def supports(self, problem):
        raise ZeroDivisionError("by a question")


@dataclass(frozen=True)
class RaiseLoad(Harmless, Solver):
    """Raises as it is made (nobody)."""

    name = "raise-load"

    def __post_init__(self):
        if IN_CELL:
            raise ZeroDivisionError("by a maker")


@dataclass(frozen=True)
class Single(Harmless, Solver):
    """Answers in single precision (nobody)."""

    name = "single"

    def solve(self, problem, state, *, tolerance, monitor, deadline):
        return Solution(problem.target.astype(np.float32), "solved", 0)


@dataclass(frozen=True)
class Complex(Harmless, Solver):
    """Answers in complex numbers (nobody)."""

    name = "complex"

    def solve(self, problem, state, *, tolerance, monitor, deadline):
        return Solution(problem.target + 1j, "solved", 0)


@dataclass(frozen=True)
class NoPositions(Harmless, Solver):
    """Answers without positions (nobody)."""

    name = "no-positions"

    def solve(self, problem, state, *, tolerance, monitor, deadline):
        return Solution(None, "solved", 0)


@dataclass(frozen=True)
class Huge(Harmless, Solver):
    """Answers with numbers whose squares are none (nobody)."""

    name = "huge"

    def solve(self, problem, state, *, tolerance, monitor, deadline):
        return Solution(np.full_like(problem.target, 1e308), "solved", 0)


@dataclass(frozen=True)
class TextDetails(Harmless, Solver):
    """Has a word among its numbers (nobody)."""

    name = "text-details"

    def solve(self, problem, state, *, tolerance, monitor, deadline):
        return Solution(problem.target, "solved", 0, details={"x": "text"})


@dataclass(frozen=True)
class ArrayDetails(Harmless, Solver):
    """Has an array among its numbers (nobody)."""

    name = "array-details"

    def solve(self, problem, state, *, tolerance, monitor, deadline):
        return Solution(problem.target, "solved", 0, details={"x": np.ones(2)})


@dataclass(frozen=True)
class ListDetails(Harmless, Solver):
    """Has a list for details (nobody)."""

    name = "list-details"

    def solve(self, problem, state, *, tolerance, monitor, deadline):
        return Solution(problem.target, "solved", 0, details=[1])


@dataclass(frozen=True)
class LargeDetails(Harmless, Solver):
    """Has a number of 5,000 digits (nobody)."""

    name = "large-details"

    def solve(self, problem, state, *, tolerance, monitor, deadline):
        return Solution(problem.target, "solved", 0, details={"x": 10**5000})


@dataclass(frozen=True)
class TextIterations(Harmless, Solver):
    """Counts in words (nobody)."""

    name = "text-iterations"

    def solve(self, problem, state, *, tolerance, monitor, deadline):
        return Solution(problem.target, "solved", "many")


@dataclass(frozen=True)
class NegativeIterations(Harmless, Solver):
    """Counts backwards (nobody)."""

    name = "negative-iterations"

    def solve(self, problem, state, *, tolerance, monitor, deadline):
        return Solution(problem.target, "solved", -1)


@dataclass(frozen=True)
class Mute(Harmless, Solver):
    """Has a status that cannot be written (nobody)."""

    name = "mute"

    def solve(self, problem, state, *, tolerance, monitor, deadline):
        return Solution(problem.target, Unspeakable(), 0)


@dataclass(frozen=True)
class LongStatus(Harmless, Solver):
    """Says a lot (nobody)."""

    name = "long-status"

    def solve(self, problem, state, *, tolerance, monitor, deadline):
        return Solution(problem.target, "so" * 10**6, 0)


@dataclass(frozen=True)
class OddStatus(Harmless, Solver):
    """Says what cannot be pickled (nobody)."""

    name = "odd-status"

    def solve(self, problem, state, *, tolerance, monitor, deadline):
        return Solution(problem.target, lambda: 1, 0, details={"inf": np.inf, "np": np.float32(1)})


@dataclass(frozen=True)
class LeavesThread(Harmless, Solver):
    """Leaves a thread (nobody)."""

    name = "leaves-thread"

    def misbehave(self):
        threading.Thread(target=sleep).start()


@dataclass(frozen=True)
class HangsAtExit(Harmless, Solver):
    """Hangs as Python ends (nobody)."""

    name = "hangs-at-exit"

    def misbehave(self):
        atexit.register(sleep)


@dataclass(frozen=True)
class LeavesChild(Harmless, Solver):
    """Leaves a process in a session of its own (nobody)."""

    name = "leaves-child"

    def misbehave(self):
        subprocess.Popen(["sleep", "600"], start_new_session=True)


@dataclass(frozen=True)
class Forks(Harmless, Solver):
    """Leaves a copy of itself (nobody)."""

    name = "forks"

    def misbehave(self):
        if os.fork() == 0:
            sleep()


@dataclass(frozen=True)
class ClosesOutput(Harmless, Solver):
    """Closes what it prints to (nobody)."""

    name = "closes-output"

    def misbehave(self):
        os.close(1)
        os.close(2)
        raise ValueError("unheard")


@dataclass(frozen=True)
class Shouts(Harmless, Solver):
    """Prints much (nobody)."""

    name = "shouts"

    def misbehave(self):
        print("x" * 10**7)
        os.write(2, b"y" * 10**7)


@dataclass(frozen=True)
class ReadsInput(Harmless, Solver):
    """Asks the user (nobody)."""

    name = "reads-input"

    def misbehave(self):
        input()


@dataclass(frozen=True)
class Wanders(Harmless, Solver):
    """Changes the working folder (nobody)."""

    name = "wanders"

    def misbehave(self):
        os.chdir("/")


@dataclass(frozen=True)
class RemovesFolder(Harmless, Solver):
    """Removes what it is written down in (nobody)."""

    name = "removes-folder"

    def misbehave(self):
        shutil.rmtree(scratch())


@dataclass(frozen=True)
class Junk(Harmless, Solver):
    """Writes into its journal (nobody)."""

    name = "junk"

    def misbehave(self):
        with (scratch() / "events.jsonl").open("a") as file:
            file.write("{}\n")


@dataclass(frozen=True)
class ChildrenHoard(Harmless, Solver):
    """Lets another process take the memory (nobody)."""

    name = "children-hoard"

    def misbehave(self):
        words = "import time; x = bytearray(600 * 2**20); time.sleep(600)"
        subprocess.run([sys.executable, "-c", words])


@dataclass(frozen=True)
class StopsClock(Harmless, Solver):
    """Stops the suite's clock (nobody)."""

    name = "stops-clock"

    def misbehave(self):
        strainbench.solver.solver.perf_counter = lambda: 0.0
        time.perf_counter = time.monotonic = time.time = lambda: 0.0


@dataclass(frozen=True)
class SlowClock(Harmless, Solver):
    """Makes a clock of its own for the journal (nobody)."""

    name = "slow-clock"

    def solve(self, problem, state, *, tolerance, monitor, deadline):
        write = strainbench.bench.play.Journal.write

        def late(journal, event, **facts):
            write(journal, event, **facts | {"at": 0.0})

        strainbench.bench.play.Journal.write = late
        return Solution(problem.target.copy(), "solved", 0)


@dataclass(frozen=True)
class FalseClaim(Harmless, Solver):
    """Says that it takes no time (nobody)."""

    name = "false-claim"

    def solve(self, problem, state, *, tolerance, monitor, deadline):
        run = strainbench.solver.solver.run_solver
        strainbench.scenario.stage.run_solver = lambda *args: replace(run(*args), seconds=0.0)
        time.sleep(0.3)
        return Solution(problem.target.copy(), "solved", 0)
