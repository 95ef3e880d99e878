"""One cell in a process of its own: play the scene, time the solver, write down what happens.

Nothing here judges. Each projection's candidate and answer go to `frames.bin` and a line about
it to `events.jsonl`, both flushed at once, so that whatever ends the process, what was measured
before stays.
"""

from __future__ import annotations

import sys
import time
import traceback
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import fields
from itertools import groupby
from numbers import Integral, Real
from pathlib import Path
from typing import Any

import numpy as np
from threadpoolctl import threadpool_info

from strainbench.arrays import FloatArray
from strainbench.bench.cell import Cell
from strainbench.bench.ending import Ending
from strainbench.bench.journal import GO, Journal, read_events, read_targets
from strainbench.bench.nursery import untouched_mb
from strainbench.plugins import told
from strainbench.problem.problem import Problem
from strainbench.scenario.scenario import StepReport
from strainbench.solver.solver import Solution, Solver, run_solver, warm_up

LONGEST_STATUS = 1000  # characters


class Stop(Exception):  # noqa: N818
    """Ends a cell early, with the reason."""


Task = Callable[[Cell, Path, Path | None], None]
"""What a process of its own does: with a cell, the folder to write to, what it is fed or None."""


def play(cell: Cell, folder: Path, recording: Path | None) -> None:
    """Run `cell`, writing to `folder`; `recording` holds the frames to replay."""
    with_journal(folder, lambda journal: _play(cell, folder, journal, recording))


def with_journal(folder: Path, work: Callable[[Journal], None]) -> None:
    """Do a process's work, whose every failure becomes an event of its journal."""
    journal = Journal(folder)
    try:
        work(journal)
    except Stop as stop:
        journal.write("failed", reason=str(stop))
    except BaseException as error:  # a solver's own error, sys.exit among them, becomes a row
        journal.write("failed", reason=told(error))
        with suppress(Exception):  # a solver may have closed what prints
            traceback.print_exc()
    journal.write("ended", peak_memory_mb=_peak_memory_mb() + untouched_mb())


def _play(cell: Cell, folder: Path, journal: Journal, recording: Path | None) -> None:
    scenario = cell.scenario.scenario()
    problem = scenario.problem()
    solver = cell.solver.solver()
    threads = max((pool["num_threads"] for pool in threadpool_info()), default=1)
    journal.write(
        "loaded",
        variables=3 * len(problem.free),
        constraints=int(problem.constraints),
        nonzeros=int(3 * problem.G.nnz),
        needs=", ".join(sorted(scenario.needs)),
        blas_threads=threads,
        notes=scenario.notes(),
    )
    start_warming(journal)
    if refusal := solver.supports(problem):
        raise Stop(f"{Ending.UNSUPPORTED}: {refusal}")
    warm_up(solver, problem, cell.tolerance)
    if recording is None:
        scenario.warm_up()
    wait_for_go(folder, journal)
    begin = journal.clock()
    state = solver.prepare(problem)
    journal.write("setup", seconds=journal.clock() - begin)
    table = _Table(cell, solver, problem, state, journal, begin)
    steps = replay(recording, table.project) if recording else scenario.play(table.project)
    for step, report in enumerate(steps, start=1):
        journal.write("step", step=step, **_facts(report))
        if step == cell.steps:
            return
        table.step = step + 1
        table.check_time()
    raise Stop("the scene has no more steps")


def _facts(report: StepReport) -> dict[str, float]:
    """A scene's report on a step, all numbers."""
    if not isinstance(report, StepReport):
        raise Stop(f"the scene yields {type(report).__name__}, not a StepReport")
    found = {f.name: getattr(report, f.name) for f in fields(StepReport)}
    return {k: _number(v, f"the scene's {k}") for k, v in found.items()}


def _number(value: object, what: str) -> float:
    """A real number as JSON can hold it."""
    if isinstance(value, bool | np.bool_):
        return bool(value)
    try:
        if isinstance(value, Integral) and abs(int(value)) < 2**63:
            return int(value)
        if isinstance(value, Real):
            return float(value)
    except OverflowError:
        pass  # a whole number of more digits than floats reach
    raise Stop(f"{what} is {_short(value)}: a number is valid")


def _short(value: object) -> str:
    try:
        return repr(value)[:80]
    except Exception as error:  # a plug-in's own type
        return f"a {type(value).__name__} ({told(error)[:80]})"


def start_warming(journal: Journal) -> None:
    """Tell of the warm-up, and of what numba compiles, which is not to be taken for a hang."""
    journal.write("warming")
    if "numba" not in sys.modules:
        return
    from numba.core import event

    class Teller(event.Listener):  # type: ignore[misc]
        """Writes down when the outermost compilation begins and ends."""

        depth = 0

        def on_start(self, _: object) -> None:
            """A function, or one that it calls, is to be compiled."""
            self.depth += 1
            if self.depth == 1:
                journal.write("compiling")

        def on_end(self, _: object) -> None:
            """It is compiled."""
            self.depth -= 1
            if self.depth == 0:
                journal.write("compiled")

    event.register("numba:compile", Teller())


def wait_for_go(folder: Path, journal: Journal) -> None:
    """Wait until nothing else that is ours keeps the machine busy."""
    journal.write("ready")
    while not (folder / GO).exists():
        time.sleep(0.002)
    journal.write("started")


def replay(recording: Path, project: Callable[[FloatArray], FloatArray]) -> Iterator[StepReport]:
    """Project the candidates of a recorded run, step by step, whatever became of them."""
    events = [e for e in read_events(recording) if e["event"] == "projection"]
    targets = read_targets(recording, len(events))
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
        return None if limit is None else limit - (self.journal.clock() - self.begin)

    def check_time(self) -> None:
        """End the cell at its limit."""
        remaining = self.remaining()
        if remaining is not None and remaining <= 0:
            raise Stop(f"{Ending.TIME_LIMIT} of {self.cell.time_limit:g} s")

    def project(self, target: FloatArray) -> FloatArray:
        """Limit one candidate; an answer that is not usable ends the cell."""
        self.check_time()
        if not np.all(np.isfinite(target)):
            raise Stop("the simulation has left the finite numbers")
        problem = self.problem.with_target(target)
        remaining = self.remaining()
        begin = self.journal.clock()
        solution = run_solver(self.solver, problem, self.state, self.cell.tolerance, remaining)
        facts: dict[str, Any] = {"begin": begin, "end": self.journal.clock()}
        facts |= what_it_says(solution)
        positions = np.asarray(solution.positions)
        usable = positions.shape == target.shape and positions.dtype == np.float64
        self.journal.frame(target, positions if usable else np.full_like(target, np.nan))
        self.journal.write("projection", step=self.step, seconds=solution.seconds, **facts)
        if not usable:
            raise Stop(f"positions of shape {positions.shape}, type {positions.dtype}")
        if not np.all(np.isfinite(positions)):
            raise Stop(f"positions that are not finite; it says {facts['status']!r}")
        return positions.copy()  # a solver may keep its own, and the problem's are read-only


def what_it_says(solution: Solution) -> dict[str, Any]:
    """Iterations, status and details of a solver's answer; one that is of no use ends the cell."""
    iterations, details = _number(solution.iterations, "iterations"), solution.details
    if iterations != iterations // 1 or iterations < 0:
        raise Stop(f"iterations is {_short(iterations)}: a whole number from 0 on is valid")
    if not isinstance(details, Mapping):
        raise Stop(f"details is {_short(details)}: a dict of numbers is valid")
    try:
        status = str(solution.status)[:LONGEST_STATUS]
    except Exception as error:  # of a solver's own type
        raise Stop(f"a status that cannot be written ({told(error)})") from None
    return {
        "iterations": int(iterations),
        "status": status,
        "details": {str(k): _number(v, f"details[{_short(k)}]") for k, v in details.items()},
    }


def _peak_memory_mb() -> float:
    """Largest resident size of this process so far [MB]."""
    status = Path("/proc/self/status")
    if status.exists():  # Linux: unlike getrusage, not inherited from the parent
        line = next(
            s for s in status.read_text(encoding="utf-8").splitlines() if s.startswith("VmHWM")
        )
        return int(line.split()[1]) / 1024
    import resource  # not on every platform

    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024**2
