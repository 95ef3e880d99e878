"""One solver on one frame, in a process of its own: its iterates, or its answers to ever tighter
tolerances, written down with the seconds and iterations that they took.

1. The solver runs at each tolerance from LOOSEST down. Its answers are kept, and so are the
   iterates that it shows through `monitor`, ever fewer of them, while the clock stands still.
2. Once a run has shown iterates, the next one is at the tightest tolerance, and the last. So it is
   once the time left is short beside the last run: tighter ones take longer.

All runs together have the cell's time limit. What comes back after it is not kept: it is no answer
at its tolerance, only where the solver was when it had to stop.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from strainbench.arrays import FloatArray
from strainbench.bench.cell import Cell
from strainbench.bench.ending import Ending
from strainbench.bench.journal import Journal
from strainbench.bench.play import Stop, start_warming, wait_for_go, with_journal
from strainbench.problem.export import load_problem
from strainbench.problem.problem import Problem
from strainbench.scenario.stage import plain_solution
from strainbench.solver.solver import Solution, run_solver, warm_up

LOOSEST = 1e2
"""Clarabel then stops 8 iterations into the 14 that it does, on the swing's frame 5 at 10 cells."""
SHORT = 3.0  # times the seconds of the last run
ALL = 20  # iterates are kept one by one up to this many,
GROWTH = 1.1  # and from there on where their count has grown by this


def trace_cell(cell: Cell, folder: Path, frame: Path | None) -> None:
    """Run `cell`'s solver on the exported problem at `frame`, writing to `folder`."""
    assert frame is not None
    problem = load_problem(frame)
    with_journal(folder, lambda journal: _trace(cell, folder, journal, problem))


def _trace(cell: Cell, folder: Path, journal: Journal, problem: Problem) -> None:
    solver = cell.solver.solver()
    start_warming(journal)
    if refusal := solver.supports(problem):
        raise Stop(f"{Ending.UNSUPPORTED}: {refusal}")
    warm_up(solver, problem, cell.tolerance)
    wait_for_go(folder, journal)
    begin = journal.clock()
    state = solver.prepare(problem)
    journal.write("setup", seconds=journal.clock() - begin)

    limit = np.inf if cell.time_limit is None else cell.time_limit
    over = Stop(f"{Ending.TIME_LIMIT} of {limit:g} s")
    left = limit - (journal.clock() - begin)
    looser = tolerances(cell.tolerance)
    while looser:
        if left <= 0:
            raise over
        tolerance = looser.pop(0)
        keeper = Keeper(journal, problem, tolerance, left)
        solution = run_solver(solver, problem, state, tolerance, left, keeper.watch)  # 1
        if solution.seconds >= left:
            raise over
        keeper.answer(solution)
        left = limit - (journal.clock() - begin)
        if keeper.has_iterates or left < SHORT * solution.seconds:
            del looser[:-1]  # 2


def tolerances(tightest: float) -> list[float]:
    """LOOSEST and each tenth of it above `tightest`, and that."""
    steps = int(np.ceil(np.log10(LOOSEST / tightest) - 1e-9))
    return [*(LOOSEST / 10**k for k in range(steps)), tightest]


class Keeper:
    """Writes the iterates and the answer of one run down, within the time that is left."""

    def __init__(self, journal: Journal, problem: Problem, tolerance: float, left: float) -> None:
        self._journal, self._target, self._tolerance = journal, problem.target, tolerance
        self._left = left  # seconds
        self._next = 0.0
        self.has_iterates = False

    def watch(
        self, seconds: float, iterations: int, positions: FloatArray, _: FloatArray | None
    ) -> None:
        """See `strainbench.solver.solver.Watch`."""
        self.has_iterates = True
        if iterations >= self._next and seconds < self._left:
            self._next = iterations + 1 if iterations < ALL else GROWTH * iterations
            self._write("iterate", seconds, iterations, positions, "")

    def answer(self, solution: Solution) -> None:
        """What the run came back with."""
        said = plain_solution(solution)
        self._write("answer", said.seconds, said.iterations, said.positions, said.status)

    def _write(
        self, event: str, seconds: float, iterations: int, positions: FloatArray, status: str
    ) -> None:
        usable = np.shape(positions) == self._target.shape
        kept = np.asarray(positions, float) if usable else np.full_like(self._target, np.nan)
        self._journal.frame(self._target, kept)
        self._journal.write(
            event,
            tolerance=self._tolerance,
            seconds=seconds,
            iterations=int(iterations),
            status=status,
        )
