"""Ratios of times: solvers take turns on the same frames, in one process, on one thread.

1. Record the frames, the projections before answered by the reference solver; compile every solver.
2. Each repeat prepares each solver anew for each sequence of consecutive frames, on a clock of its
   own, so that what a solver keeps from one frame to the next is from this repeat.
3. Frame by frame the solvers take turns, and another one begins in each repeat: what else the
   machine does falls on all alike.
4. The referee measures the answers of the last repeat when all clocks have stopped.

Another checkout's solvers take turns with this one's, each checkout in a process of its own
(`strainbench.studies.duel.trees`), and the referee of this one measures both.

With units each turn also has one numeric factorisation and one solve of the 3n x 3n matrix in which
the vertices of an element interact, by the linear solver in use; and the steps of implicit Euler
are timed while the frames are recorded.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from time import perf_counter, process_time
from typing import Any, Protocol

import numpy as np

from strainbench.arrays import FloatArray
from strainbench.bench.recording import Recording
from strainbench.options import shown
from strainbench.physics.linear import best_linear_solver
from strainbench.physics.pattern import Pattern
from strainbench.problem.problem import Problem
from strainbench.referee.certificate import certify
from strainbench.referee.reference import ReferenceSolver
from strainbench.solver.solver import Solver, run_solver, warm_up
from strainbench.studies.duel.racer import Racer, Rules
from strainbench.studies.duel.trees import processes
from strainbench.studies.threads import one_thread

MOST_FRAMES = 100_000  # all their targets are in memory
FACTORISATION, IMPLICIT_EULER = "factorisation + solve", "implicit Euler step"


def parse_frames(text: str) -> list[list[int]]:
    """Sequences of consecutive frames: 5,14-16 is [[5], [14, 15, 16]].

    Raises
    ------
    ValueError
        One line that says what is valid.
    """
    try:
        ends = [[int(end) for end in word.split("-")] for word in text.split(",")]
    except ValueError:
        ends = []
    if not ends or any(len(e) > 2 or e[0] < 1 or e[-1] < e[0] for e in ends):
        valid = "whole numbers above 0 and ranges are valid, as in 5,14-29"
        raise ValueError(f"--frame {shown(text)}: {valid}")
    if (last := max(e[-1] for e in ends)) > MOST_FRAMES:
        raise ValueError(f"--frame {text}: {last} is too many; up to {MOST_FRAMES} is valid")
    return [list(range(e[0], e[-1] + 1)) for e in ends]


class Runner(Protocol):
    """Who takes turns: a solver in this process, or in that of a checkout."""

    entry: Racer

    def prepare(self) -> None:
        """Anew, on a clock of its own."""

    def take_turn(self, number: int, frame: Problem) -> None:
        """Project one frame, and add it to the entry."""


def duel(
    solvers: Sequence[Solver],
    recording: Recording,
    sequences: Sequence[Sequence[int]],
    repeats: int,
    tolerance: float,
    time_limit: float | None = None,
    units: bool = False,
    progress: Callable[[], None] = lambda: None,
    against: Path | None = None,
) -> list[Racer]:
    """Measure all solvers; those of another checkout and, with `units`, the units follow.

    Parameters
    ----------
    sequences : of frames of the recording, see `parse_frames`
    time_limit : [s] a projection
    progress : told of each turn that has ended
    against : the other checkout's folder

    Raises
    ------
    ValueError
        One line: a solver cannot take the scene, or the other checkout has none of its name.
    """
    problem, rules = recording.problem, Rules(tolerance, time_limit)
    for solver in solvers:
        if refusal := solver.supports(problem):
            raise ValueError(f"{solver.label} cannot take this scene: {refusal}")
    with one_thread(), _runners(solvers, problem, rules, against) as runners:
        unit = Factorisation(problem) if units else None
        for repeat in range(repeats):
            turns = list(rotated(runners, repeat))
            for frames in sequences:
                for turn in turns:  # 2
                    turn.prepare()
                for number in frames:
                    for turn in turns:  # 3
                        turn.take_turn(number, recording.frame(number))
                        progress()
                    if unit:
                        unit.take_turn()
    entries = [runner.entry for runner in runners]
    judge(entries, recording)  # 4
    if unit:
        entries += [unit.entry, Racer(IMPLICIT_EULER, seconds=list(recording.step_seconds))]
    return entries


@contextmanager
def _runners(
    solvers: Sequence[Solver], problem: Problem, rules: Rules, against: Path | None
) -> Iterator[Sequence[Runner]]:
    """All that take turns, compiled."""
    if against is None:
        yield [Here(solver, problem, rules) for solver in solvers]
    else:
        with processes(solvers, problem, rules, against) as runners:
            yield runners


def rotated(items: Sequence[Any], by: int) -> Iterator[Any]:
    """All items from one on, around."""
    for k in range(len(items)):
        yield items[(k + by) % len(items)]


class Here:
    """A solver in this process, with what is measured of it."""

    def __init__(self, solver: Solver, problem: Problem, rules: Rules) -> None:
        self._solver, self._problem, self._rules = solver, problem, rules
        self.entry = Racer(solver.label)
        warm_up(solver, problem, rules.tolerance)

    def prepare(self) -> None:
        """Anew, on a clock of its own."""
        begin = perf_counter()
        self._state = self._solver.prepare(self._problem)
        self.entry.setups.append(perf_counter() - begin)

    def take_turn(self, number: int, frame: Problem) -> None:
        """Project one frame."""
        rules, cpu = self._rules, process_time()
        answer = run_solver(self._solver, frame, self._state, rules.tolerance, rules.time_limit)
        self.entry.add(number, answer, process_time() - cpu)


def judge(entries: Sequence[Racer], recording: Recording) -> None:
    """Certify the answers."""
    referee = ReferenceSolver(recording.problem)
    for number in sorted(set().union(*(e.answers for e in entries))):
        frame = recording.frame(number)
        reference = referee(frame)
        for entry in entries:
            positions = entry.answers[number].positions
            entry.certificates.append(certify(frame, positions, reference=reference))


class Factorisation:
    """The unit that one numeric factorisation and one solve of a mesh's matrix make."""

    def __init__(self, problem: Problem) -> None:
        pattern = Pattern.of([problem.elements], problem.vertices, problem.held)
        matrix = pattern.matrix()
        self._linear = best_linear_solver(matrix)
        self._data = np.ones(len(pattern.indices))
        degree = 2.0 * float(np.diff(pattern.indptr).max())  # diagonally dominant
        pattern.add_diagonal(self._data, np.full(problem.vertices, degree))
        self._b: FloatArray = np.ones(pattern.size)
        self.entry = Racer(f"{FACTORISATION} ({self._linear.name})")

    def take_turn(self) -> None:
        """Time it once."""
        begin, cpu = perf_counter(), process_time()
        self._linear.factorise(self._data)
        self._linear.solve(self._b)
        self.entry.seconds.append(perf_counter() - begin)
        self.entry.cpu.append(process_time() - cpu)
