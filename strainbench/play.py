"""One cell in a process of its own: play the scene, time the solver, write down what happens.

Nothing here judges. Each projection's candidate and answer go to `frames.bin` and a line about
it to `events.jsonl`, both flushed at once, so that whatever ends the process, what was measured
before stays.
"""

from __future__ import annotations

import json
import os
import sys
import time
import traceback
from collections.abc import Callable, Iterator
from itertools import groupby
from pathlib import Path
from typing import IO, Any

import numpy as np
from threadpoolctl import threadpool_info

from strainbench.cell import Cell
from strainbench.limits import FloatArray
from strainbench.problem import Problem
from strainbench.scenario import StepReport
from strainbench.solver import Solver, run_solver, warm_up

EVENTS, FRAMES, GO = "events.jsonl", "frames.bin", "go"


class Stop(Exception):  # noqa: N818
    """Ends a cell early, with the reason."""


class Journal:
    """The two files of a running cell."""

    def __init__(self, folder: Path) -> None:
        self._events = (folder / EVENTS).open("a")
        self._frames = (folder / FRAMES).open("ab")

    def write(self, event: str, **facts: object) -> None:
        """Append one event."""
        self._events.write(json.dumps({"event": event, "at": time.time(), **facts}) + "\n")
        self._events.flush()

    def frame(self, target: FloatArray, positions: FloatArray) -> None:
        """Append a candidate and its answer."""
        np.save(self._frames, target)
        np.save(self._frames, np.asarray(positions, dtype=np.float64))
        self._frames.flush()


def read_events(folder: Path) -> list[dict[str, Any]]:
    """The events so far; a line torn by a killed process is left out."""
    path = folder / EVENTS
    lines = path.read_text().split("\n")[:-1] if path.exists() else []
    return [json.loads(line) for line in lines]


def read_frames(folder: Path, count: int) -> Iterator[tuple[FloatArray, FloatArray]]:
    """The first `count` pairs of candidate and answer."""
    if not count:
        return
    with (folder / FRAMES).open("rb") as file:
        for _ in range(count):
            yield np.load(file), np.load(file)


Task = Callable[[Cell, Path, Path | None], None]
"""What a process of its own does: with a cell, the folder to write to, what it is fed or None."""


def play(cell: Cell, folder: Path, recording: Path | None) -> None:
    """Run `cell`, writing to `folder`; `recording` holds the frames to replay."""
    with_journal(folder, lambda journal: _play(cell, folder, journal, recording))


def with_journal(folder: Path, work: Callable[[Journal], None]) -> None:
    """Do a process's work, whose every failure becomes an event of its journal."""
    journal = Journal(folder)
    journal.write("process", pid=os.getpid())
    with (folder / "output.txt").open("w") as output:
        _redirect(output)
        try:
            work(journal)
        except Stop as stop:
            journal.write("failed", reason=str(stop))
        except Exception as error:  # the one place where a solver's own error becomes a row
            traceback.print_exc(file=output)
            journal.write("failed", reason=f"{type(error).__name__}: {error}")
        journal.write("ended", peak_memory_mb=_peak_memory_mb())


def _redirect(output: IO[str]) -> None:
    """Send what solvers print, from native code too, to the cell's own file."""
    sys.stdout.flush()
    for descriptor in (1, 2):
        os.dup2(output.fileno(), descriptor)


def _play(cell: Cell, folder: Path, journal: Journal, recording: Path | None) -> None:
    scenario, solver = cell.scenario.scenario(), cell.solver.solver()
    problem = scenario.problem()
    threads = max((pool["num_threads"] for pool in threadpool_info()), default=1)
    journal.write(
        "loaded",
        variables=3 * len(problem.free),
        constraints=problem.constraints,
        nonzeros=3 * problem.G.nnz,
        needs=", ".join(sorted(scenario.needs)),
        blas_threads=threads,
        notes=scenario.notes(),
    )
    if refusal := solver.supports(problem):
        raise Stop(f"unsupported: {refusal}")
    warm_up(solver, problem, cell.tolerance)
    if recording is None:
        scenario.warm_up()
    wait_for_go(folder, journal)
    begin = time.perf_counter()
    state = solver.prepare(problem)
    journal.write("setup", seconds=time.perf_counter() - begin)
    table = _Table(cell, solver, problem, state, journal, begin)
    steps = replay(recording, table.project) if recording else scenario.play(table.project)
    for step, report in enumerate(steps, start=1):
        journal.write("step", step=step, **vars(report))
        if step == cell.steps:
            return
        table.step = step + 1
        table.check_time()


def wait_for_go(folder: Path, journal: Journal) -> None:
    """Wait until nothing else that is ours keeps the machine busy."""
    journal.write("ready")
    while not (folder / GO).exists():
        time.sleep(0.002)
    journal.write("started")


def replay(recording: Path, project: Callable[[FloatArray], FloatArray]) -> Iterator[StepReport]:
    """Project the candidates of a recorded run, step by step, whatever became of them."""
    events = [e for e in read_events(recording) if e["event"] == "projection"]
    targets = (target for target, _ in read_frames(recording, len(events)))
    for _, projections in groupby(zip(events, targets, strict=True), key=lambda p: p[0]["step"]):
        for _, target in projections:
            project(target)
        yield StepReport()


class _Table:
    """Where candidates meet the solver: each projection timed and written down."""

    def __init__(
        self,
        cell: Cell,
        solver: Solver,
        problem: Problem,
        state: Any,
        journal: Journal,
        begin: float,
    ) -> None:
        self.cell, self.solver, self.problem, self.state = cell, solver, problem, state
        self.journal, self.begin, self.step = journal, begin, 1

    def remaining(self) -> float | None:
        """Seconds left of the cell's time, or None without a limit."""
        limit = self.cell.time_limit
        return None if limit is None else limit - (time.perf_counter() - self.begin)

    def check_time(self) -> None:
        """End the cell at its limit."""
        remaining = self.remaining()
        if remaining is not None and remaining <= 0:
            raise Stop(f"time limit of {self.cell.time_limit:g} s")

    def project(self, target: FloatArray) -> FloatArray:
        """Limit one candidate; an answer that is not usable ends the cell."""
        self.check_time()
        if not np.all(np.isfinite(target)):
            raise Stop("the simulation has left the finite numbers")
        problem = self.problem.with_target(target)
        remaining = self.remaining()
        solution = run_solver(self.solver, problem, self.state, self.cell.tolerance, remaining)
        positions = np.asarray(solution.positions)
        usable = positions.shape == target.shape and positions.dtype == np.float64
        self.journal.frame(target, positions if usable else np.full_like(target, np.nan))
        self.journal.write(
            "projection",
            step=self.step,
            seconds=solution.seconds,
            iterations=int(solution.iterations),
            status=str(solution.status),
            details=dict(solution.details),
        )
        if not usable:
            raise Stop(f"positions of shape {positions.shape}, type {positions.dtype}")
        if not np.all(np.isfinite(positions)):
            raise Stop(f"positions that are not finite; it says {str(solution.status)!r}")
        return positions


def _peak_memory_mb() -> float:
    """Largest resident size of this process so far [MB]."""
    status = Path("/proc/self/status")
    if status.exists():  # Linux: unlike getrusage, not inherited from the parent
        line = next(s for s in status.read_text().splitlines() if s.startswith("VmHWM"))
        return int(line.split()[1]) / 1024
    import resource  # not on every platform

    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024**2
