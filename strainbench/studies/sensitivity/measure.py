"""How much solvers' answers, iterations and times depend on how a projection is written down.

1. Write the projection down in many ways that make no difference to its optimum: `writings`.
2. Let each solver project each of them, prepared anew; one process, one thread.
3. Take each answer back to the projection as it is, where the referee judges it.

Answers to the same writing, again and again, show what is noise: `as it is`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from time import process_time

import numpy as np

from strainbench.arrays import FloatArray
from strainbench.plugins import told
from strainbench.problem.problem import Problem
from strainbench.progress import Track, untracked
from strainbench.referee.certificate import Certificate, certify
from strainbench.referee.reference import reference_of
from strainbench.solver.solver import Solution, Solver, run_solver, warm_up
from strainbench.studies.sensitivity.writings import AS_IT_IS, Writing, count, writings
from strainbench.studies.threads import one_thread

SEED = 0
DRAWS = 20


@dataclass(frozen=True, eq=False)
class Trial:
    """A solver's answer to a projection written down in some way.

    Parameters
    ----------
    method : the solver's label
    group, words : of the writing
    solution : its positions as they came, its seconds those of the process's CPU
    positions : (n, 3) taken back to the projection as it is [m]
    certificate : of these
    """

    method: str
    group: str
    words: str
    solution: Solution
    positions: FloatArray
    certificate: Certificate


@dataclass(frozen=True, eq=False)
class Sensitivity:
    """All trials on a projection."""

    problem: Problem
    trials: list[Trial] = field(default_factory=list)

    @property
    def methods(self) -> list[str]:
        """In the order in which they were given."""
        return list(dict.fromkeys(trial.method for trial in self.trials))

    def of(self, method: str, group: str) -> list[Trial]:
        """A method's trials of one group."""
        return [t for t in self.trials if (t.method, t.group) == (method, group)]

    def first(self, method: str) -> Trial:
        """A method's first trial as it is, with which others are compared."""
        return self.of(method, AS_IT_IS)[0]

    def spread(self, method: str, group: str) -> float:
        """Largest distance of a vertex between any two answers, that as it is among them [m].

        NaN where fewer than two are finite.
        """
        trials = [self.first(method), *self.of(method, group)]
        answers = [t.positions for t in trials if np.all(np.isfinite(t.positions))]
        if len(answers) < 2:
            return float("nan")
        x = np.stack(answers)
        return max(float(np.linalg.norm(x[k:] - x[k], axis=2).max()) for k in range(len(x)))

    def changes(self, method: str, group: str) -> int:
        """How many trials have another outcome than the first as it is."""
        outcome = self.first(method).certificate.outcome
        return sum(t.certificate.outcome != outcome for t in self.of(method, group))


def measure(
    solvers: Sequence[Solver],
    problem: Problem,
    draws: int = DRAWS,
    tolerance: float = 1e-6,
    time_limit: float | None = None,
    track: Track = untracked,
) -> Sensitivity:
    """Let all solvers project a problem in all ways to write it down.

    Parameters
    ----------
    draws : writings a group
    time_limit : [s] a projection

    Raises
    ------
    ValueError
        One line: a solver cannot take the problem.
    """
    for solver in solvers:
        if refusal := solver.supports(problem):
            raise ValueError(f"{solver.label} cannot take this scene: {refusal}")
    found, reference = Sensitivity(problem), reference_of(problem)
    ways = writings(problem, draws, SEED)
    turns = ((solver, way) for way in ways for solver in solvers)
    with one_thread():
        for solver in solvers:
            warm_up(solver, problem, tolerance)
        for solver, way in track(turns, "projections", count(draws) * len(solvers)):
            solution = attempt(solver, way, tolerance, time_limit)
            x = way.back(solution.positions)
            certificate = certify(problem, x, reference=reference)
            trial = Trial(solver.label, way.group, way.words, solution, x, certificate)
            found.trials.append(trial)
    return found


def attempt(solver: Solver, way: Writing, tolerance: float, time_limit: float | None) -> Solution:
    """Its answer; where it raises or answers with no positions, none, with the reason."""
    nothing = np.full_like(way.problem.target, np.nan)
    try:
        state = solver.prepare(way.problem)
        found = run_solver(solver, way.problem, state, tolerance, time_limit, now=process_time)
    except Exception as error:  # a failing solver is data here too
        return Solution(nothing, told(error), 0)
    if np.shape(found.positions) != nothing.shape:
        return Solution(nothing, f"positions of shape {np.shape(found.positions)}", 0)
    return found
