"""The rounds of one projection: to the limits from where a start is, then down the objective."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from solvers.sequential_cuts.program import Answer, Restricted
from strainbench import Clock, Problem, Solution, section
from strainbench.arrays import FloatArray
from strainbench.problem.contact import depths

STILL = 1e-5
"""Largest move of a coordinate, in edges, after which positions rest."""
REPAIRS = 12
"""Programs with slack on the way to the limits, its price doubled each time: 3 or 4 mostly do."""
STATIONARY = 1e-4
"""KKT residual up to which a round that gains nothing is the last of an answer."""


@dataclass(frozen=True)
class Limit:
    """What ends a projection: its tolerance, the rounds of a start, the clock; and who watches."""

    tolerance: float
    rounds: int
    deadline: Clock
    monitor: Callable[..., None]


class Run:
    """One projection; `count` is of its programs so far, `descents` of starts within the limits."""

    def __init__(self, problem: Problem, limit: Limit) -> None:
        self.problem, self.limit = problem, limit
        self.count, self.descents, self._least = 0, 0, np.inf

    def within(self, x: FloatArray) -> bool:
        """Whether the limits hold at x, pins included, and planes in edges."""
        problem, tolerance = self.problem, self.limit.tolerance
        deep = depths(problem.contact, x[problem.used]) / problem.edge_length
        return bool(max(problem.violations(x).max(), deep.max(initial=0.0)) <= tolerance)

    def optimum(self, program: Restricted) -> Solution:
        """Of a convex problem, by its one program."""
        answer = self._round(program, self.problem.target)
        status = "solved" if "Solved" in answer.status else answer.status
        return self._solution(program, answer.positions, answer, status, 1)

    def repaired(self, repair: Restricted, x: FloatArray) -> tuple[FloatArray, str]:
        """Positions within the limits, and ""; or the last on the way there, and what ended it."""
        for k in range(REPAIRS):
            if self.within(x):
                return x, ""
            answer = self._round(repair, x, 2.0**k)
            if "PrimalInfeasible" in answer.status:  # the upper bounds alone are
                return answer.positions, answer.status
            if not np.isfinite(answer.positions).all():
                break
            x = answer.positions
            if self.limit.deadline.passed:
                return x, "" if self.within(x) else "time limit"
        return x, "" if self.within(x) else "no start within the limits"

    def descent(self, program: Restricted, x: FloatArray) -> Solution:
        """From x within the limits to where positions rest; each round is kept if it gains."""
        self.descents += 1
        objective, rounds, status = self.problem.objective(x), 0, "iteration limit"
        while rounds < self.limit.rounds:
            answer, rounds = self._round(program, x), rounds + 1
            y = answer.positions
            still = bool(np.abs(y - x).max() <= STILL * self.problem.edge_length)
            gained = self.within(y) and self.problem.objective(y) < objective
            if gained:
                x, objective = y, self.problem.objective(y)
                self._show(x, objective)
            if still or not gained:
                status = self._ending(program, x, answer, still)
                break
            if self.limit.deadline.passed:
                status = "time limit"
                break
        return self._solution(program, x, answer, status, rounds)

    def _ending(self, program: Restricted, x: FloatArray, answer: Answer, still: bool) -> str:
        if answer.status == "MaxTime":  # its duals are no multipliers yet
            return "time limit"
        if still or program.residual(self.problem, x, answer.duals) <= STATIONARY:
            return "solved"
        return "time limit" if self.limit.deadline.passed else "stalled"

    def _round(self, program: Restricted, x: FloatArray, dearer: float = 1) -> Answer:
        tolerance, deadline = self.limit.tolerance, self.limit.deadline
        with section("Clarabel"):
            answer = program.solve(self.problem, x, tolerance, deadline, dearer)
        self.count += answer.programs
        return answer

    def _show(self, x: FloatArray, objective: float) -> None:
        """To whoever watches, if nothing better was shown."""
        if objective < self._least:
            self._least = objective
            self.limit.monitor(x, iterations=self.count)

    def _solution(
        self, program: Restricted, x: FloatArray, answer: Answer, status: str, rounds: int
    ) -> Solution:
        details = {
            "rounds": float(rounds),
            "stationarity": program.residual(self.problem, x, answer.duals),
        }
        multipliers = program.multipliers(x, answer.duals)
        return Solution(x, status, self.count, multipliers, details)
