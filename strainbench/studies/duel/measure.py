"""Ratios of times: solvers take turns on the same frames, in one process, on one thread.

1. Record the frames, the projections before answered by the reference solver; compile every solver.
2. Each repeat prepares each solver anew for each sequence of consecutive frames, on a clock of its
   own, so that what a solver keeps from one frame to the next is from this repeat.
3. Frame by frame the solvers take turns, and another one begins in each repeat: what else the
   machine does falls on all alike.
4. The referee measures the answers of the last repeat when all clocks have stopped.

With units each turn also has one numeric factorisation and one solve of the 3n x 3n matrix in which
the vertices of an element interact, by the linear solver in use; and the steps of implicit Euler
are timed while the frames are recorded.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from time import perf_counter
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from strainbench.arrays import FloatArray
from strainbench.bench.machine import fixed_threads
from strainbench.bench.recording import Recording
from strainbench.options import shown
from strainbench.physics.linear import best_linear_solver
from strainbench.physics.pattern import Pattern
from strainbench.problem.problem import Problem
from strainbench.referee.certificate import Certificate, certify
from strainbench.referee.reference import ReferenceSolver
from strainbench.solver.solver import Solution, Solver, run_solver, warm_up

MOST_FRAMES = 100_000  # all their targets are in memory
FACTORISATION, IMPLICIT_EULER = "factorisation + solve", "implicit Euler step"


@dataclass
class Racer:
    """A solver, or a unit of time, and what was measured of it.

    Parameters
    ----------
    label : the solver's, or FACTORISATION followed by the linear solver's name, or IMPLICIT_EULER
    setups, seconds : [s] of each set-up, of each projection
    answers : of the last repeat, by frame
    certificates : of the answers
    """

    label: str
    setups: list[float] = field(default_factory=list)
    seconds: list[float] = field(default_factory=list)
    answers: dict[int, Solution] = field(default_factory=dict)
    certificates: list[Certificate] = field(default_factory=list)

    @property
    def setup(self) -> float:
        """[s], the median; NaN of a unit."""
        return float(np.median(self.setups)) if self.setups else float("nan")

    @property
    def median(self) -> float:
        """[s] a projection; NaN where there was none."""
        return float(np.median(self.seconds)) if self.seconds else float("nan")

    @property
    def quartiles(self) -> tuple[float, float]:
        """[s] between which the middle half of the projections lies."""
        first, third = np.percentile(self.seconds, [25, 75]) if self.seconds else (np.nan,) * 2
        return float(first), float(third)

    @property
    def iterations(self) -> float:
        """Median over the frames; NaN of a unit."""
        counts = [a.iterations for a in self.answers.values()]
        return float(np.median(counts)) if counts else float("nan")

    @property
    def worst_violation(self) -> float:
        """Over the frames; NaN where an answer is not usable."""
        return float(np.max([c.max_violation for c in self.certificates] or [np.nan]))

    @property
    def worst_gap(self) -> float:
        """Over the frames; NaN where an answer is not usable."""
        return float(np.max([c.relative_gap for c in self.certificates] or [np.nan]))

    @property
    def unsolved(self) -> list[str]:
        """What it says of frames that it does not call solved."""
        return sorted({str(a.status) for a in self.answers.values()} - {"solved"})


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


def duel(
    solvers: Sequence[Solver],
    recording: Recording,
    sequences: Sequence[Sequence[int]],
    repeats: int,
    tolerance: float,
    time_limit: float | None = None,
    units: bool = False,
    progress: Callable[[], None] = lambda: None,
) -> list[Racer]:
    """Measure all solvers; with `units` the units follow them.

    Parameters
    ----------
    sequences : of frames of the recording, see `parse_frames`
    time_limit : [s] a projection
    progress : told of each turn that has ended

    Raises
    ------
    ValueError
        One line: a solver cannot take the scene.
    """
    problem = recording.problem
    for solver in solvers:
        if refusal := solver.supports(problem):
            raise ValueError(f"{solver.label} cannot take this scene: {refusal}")
    entries = [Racer(solver.label) for solver in solvers]
    with fixed_threads(1), threadpool_limits(1):
        for solver in solvers:
            warm_up(solver, problem, tolerance)
        unit = Factorisation(problem) if units else None
        for repeat in range(repeats):
            turns = list(rotated(list(zip(solvers, entries, strict=True)), repeat))
            for frames in sequences:
                ready = [Prepared(solver, problem, entry) for solver, entry in turns]  # 2
                for number in frames:
                    frame = recording.frame(number)
                    for turn in ready:  # 3
                        turn.take_turn(number, frame, tolerance, time_limit)
                        progress()
                    if unit:
                        unit.take_turn()
    judge(entries, recording)  # 4
    if unit:
        entries += [unit.entry, Racer(IMPLICIT_EULER, seconds=list(recording.step_seconds))]
    return entries


def rotated(items: Sequence[Any], by: int) -> Iterator[Any]:
    """All items from one on, around."""
    for k in range(len(items)):
        yield items[(k + by) % len(items)]


class Prepared:
    """A solver that is prepared, with what is measured of it."""

    def __init__(self, solver: Solver, problem: Problem, entry: Racer) -> None:
        begin = perf_counter()
        self._state = solver.prepare(problem)
        entry.setups.append(perf_counter() - begin)
        self._solver, self._entry = solver, entry

    def take_turn(
        self, number: int, frame: Problem, tolerance: float, time_limit: float | None
    ) -> None:
        """Project one frame."""
        answer = run_solver(self._solver, frame, self._state, tolerance, time_limit)
        self._entry.seconds.append(answer.seconds)
        self._entry.answers[number] = answer


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
        begin = perf_counter()
        self._linear.factorise(self._data)
        self._linear.solve(self._b)
        self.entry.seconds.append(perf_counter() - begin)
