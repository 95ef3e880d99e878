"""One cell in a process of its own: play the scene, time the solver, write down what happens.

Nothing here judges. Each projection's candidate and answer go to `frames.bin` and a line about
it to `events.jsonl`, both flushed at once, so that whatever ends the process, what was measured
before stays.
"""

from __future__ import annotations

import sys
import time
import traceback
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import partial
from itertools import dropwhile, groupby
from operator import itemgetter
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_info

from strainbench.arrays import FloatArray
from strainbench.bench.cell import Cell
from strainbench.bench.ending import VIOLATION, Ending
from strainbench.bench.journal import GO, Journal, only, read_events, read_frames, read_targets
from strainbench.bench.nursery import untouched_mb
from strainbench.physics.integrators import Project
from strainbench.plugins import told
from strainbench.scenario.scenario import StepReport
from strainbench.scenario.stage import Projection, Stage, StageError


class Stop(Exception):  # noqa: N818
    """Ends a cell early, with the reason."""


Task = Callable[[Cell, Path, Path | None], None]
"""What a process of its own does: with a cell, the folder to write to, what it is fed or None."""


def play_cell(cell: Cell, folder: Path, recording: Path | None) -> None:
    """Run `cell`, writing to `folder`; `recording` holds the frames to replay."""

    def work(journal: Journal) -> None:
        _play(cell, folder, journal, recording)
        if cell.repeats > 1:
            _repeat(cell, folder, journal)

    with_journal(folder, work)


def with_journal(folder: Path, work: Callable[[Journal], None]) -> None:
    """Do a process's work, whose every failure becomes an event of its journal."""
    journal = Journal(folder)
    try:
        work(journal)
    except Stop as stop:
        journal.write("failed", reason=str(stop))
    except BaseException as error:  # a solver's own error, sys.exit among them, becomes a row
        reason = error.reason if isinstance(error, StageError) else told(error)
        journal.write("failed", reason=reason)
        with suppress(Exception):  # a solver may have closed what prints
            cause = error.__cause__ if isinstance(error, StageError) else None
            traceback.print_exception(cause or error)  # a plug-in's own, not what ours made of it
    journal.write("ended", peak_memory_mb=_peak_memory_mb() + untouched_mb())


def _play(cell: Cell, folder: Path, journal: Journal, recording: Path | None) -> None:
    stage = Stage(cell.scenario.scenario(), cell.solver.solver(), cell.tolerance, journal.clock)
    journal.write("loaded", **_what_is_loaded(stage))
    start_warming(journal)
    if refusal := stage.refusal():
        raise Stop(f"{Ending.UNSUPPORTED}: {refusal}")
    stage.warm_up(physics=recording is None)
    wait_for_go(folder, journal)
    timer, failing = _Timer(cell.time_limit, journal.clock), list[int]()
    stage.set_up()
    journal.write("setup", seconds=timer.elapsed())

    def project(target: FloatArray) -> FloatArray:
        timer.check()
        projection = stage.solve(target, timer.remaining())
        write_down(journal, projection)
        if cell.patience is not None and violates(projection):
            failing.append(stage.step)
        return stage.accept(projection)

    first, last = cell.window
    fed = partial(replay, recording, first) if recording else None
    for report in stage.steps(cell.steps, project, fed, first):
        journal.write("step", step=stage.step, **vars(report))
        if failing and cell.patience is not None and stage.step >= failing[0] + cell.patience:
            journal.write("enough")
            return
        if stage.step < last:
            timer.check()


def _repeat(cell: Cell, folder: Path, journal: Journal) -> None:
    """Project the candidates again, for the seconds alone, once all steps are done."""
    journal.write("repeating", peak_memory_mb=_peak_memory_mb() + untouched_mb())
    count = len(only(read_events(folder), "projection"))
    for _ in range(1, cell.repeats):
        _round(cell, folder, count, journal)


def _round(cell: Cell, folder: Path, count: int, journal: Journal) -> None:
    """All candidates in their order, by a solver that is loaded and prepared anew.

    Whatever it keeps from frame to frame is before each what it was the first time.
    """
    stage = Stage(cell.scenario.scenario(), cell.solver.solver(), cell.tolerance, journal.clock)
    timer = _Timer(cell.time_limit, journal.clock)
    stage.set_up()
    for number, (target, answer) in enumerate(read_frames(folder, count), start=1):
        timer.check()
        again = stage.solve(target, timer.remaining())
        stage.positions = answer
        facts = {"begin": again.begin, "end": again.end, "seconds": again.solution.seconds}
        journal.write("again", projection=number, **facts)


def _what_is_loaded(stage: Stage) -> dict[str, object]:
    """How large the problem is, and what the scene says of itself."""
    problem, scenario = stage.problem, stage.scenario
    return {
        "variables": 3 * len(problem.free),
        "constraints": int(problem.constraints),
        "nonzeros": int(3 * problem.G.nnz),
        "needs": ", ".join(sorted(scenario.needs)),
        "blas_threads": max((pool["num_threads"] for pool in threadpool_info()), default=1),
        "notes": scenario.notes(),
    }


def start_warming(journal: Journal) -> None:
    """Tell of the warm-up, and of what numba compiles, which is not to be taken for a hang."""
    journal.write("warming")
    if "strainbench.compiled" in sys.modules:
        _tell_of_compilation(journal)


def _tell_of_compilation(journal: Journal) -> None:
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


def replay(recording: Path, first: int, project: Project) -> Iterator[StepReport]:
    """Project the candidates of a recorded run, from step `first` on, whatever became of them."""
    events = only(read_events(recording), "projection")
    targets = read_targets(recording, len(events))
    fed = ((e["step"], target) for e, target in zip(events, targets, strict=True))
    later = dropwhile(lambda p: p[0] < first, fed)
    for _, projections in groupby(later, key=itemgetter(0)):
        for _, target in projections:
            project(target)
        yield StepReport()


class _Timer:
    """A cell's time, from now on."""

    def __init__(self, limit: float | None, clock: Callable[[], float]) -> None:
        self._limit, self._clock, self._begin = limit, clock, clock()

    def elapsed(self) -> float:
        """Seconds so far."""
        return self._clock() - self._begin

    def remaining(self) -> float | None:
        """Seconds left of it, or None without a limit."""
        return None if self._limit is None else self._limit - self.elapsed()

    def check(self) -> None:
        """End the cell at its limit."""
        remaining = self.remaining()
        if remaining is not None and remaining <= 0:
            raise Stop(f"{Ending.TIME_LIMIT} of {self._limit:g} s")


def violates(projection: Projection) -> bool:
    """Whether an answer is beyond the limits of its problem, as far as it is one."""
    if projection.fault:
        return False
    with np.errstate(all="ignore"):  # an answer may be infinitely wrong
        worst = projection.frame.violations(projection.solution.positions).max()
    return not worst <= VIOLATION


def write_down(journal: Journal, projection: Projection) -> None:
    """Candidate and answer, and what the solver says of it; before anything is made of it."""
    target, solution = projection.frame.target, projection.solution
    journal.frame(target, solution.positions if projection.fits else np.full_like(target, np.nan))
    journal.write(
        "projection",
        step=projection.step,
        seconds=solution.seconds,
        begin=projection.begin,
        end=projection.end,
        iterations=solution.iterations,
        status=solution.status,
        details=dict(solution.details),
    )


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
