"""Solvers that fail in one way each; run by tests/bench/test_failure.py as a file from outside."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from strainbench import Solution, Solver


def shrunk(problem, factor):
    """The candidate, smaller about its centre of mass."""
    centre = np.average(problem.target, axis=0, weights=problem.weights)
    return centre + factor * (problem.target - centre)


@dataclass(frozen=True)
class Slack(Solver):
    """Shrinks the cloth: within the limits, and far from the optimum (nobody)."""

    name = "slack"
    status: str = "not the optimum"

    def solve(self, problem, state, *, tolerance, monitor, deadline):
        x = shrunk(problem, 0.5)
        x[problem.pinned] = problem.target[problem.pinned]
        return Solution(x, self.status, 7)


@dataclass(frozen=True)
class Idle(Solver):
    """Leaves the candidate as it is (nobody)."""

    name = "idle"
    status: str = "not limited"

    def solve(self, problem, state, *, tolerance, monitor, deadline):
        return Solution(problem.target.copy(), self.status, 0)


@dataclass(frozen=True)
class Turn(Solver):
    """Shrinks the cloth, and pulls a corner of a triangle across its opposite edge (nobody)."""

    name = "turn"

    def solve(self, problem, state, *, tolerance, monitor, deadline):
        x = shrunk(problem, 0.3)
        element = problem.elements[len(problem.elements) // 2]
        a, b, c = x[element]
        x[element[0]] = a + 1.2 * ((b + c) / 2 - a)
        return Solution(x, "done", 0)


@dataclass(frozen=True)
class Shift(Solver):
    """Moves a free cloth by so many edges upwards and along x (nobody)."""

    name = "shift"
    up: float = 0.0
    along: float = 0.0

    def solve(self, problem, state, *, tolerance, monitor, deadline):
        way = problem.edge_length * np.array([self.along, self.up, 0.0])
        return Solution(problem.target + way, "done", 0)


@dataclass(frozen=True)
class Late(Solver):
    """Leaves the candidate as it is from the third on, and shrinks it before (nobody)."""

    name = "late"

    def prepare(self, problem):
        return []

    def solve(self, problem, state, *, tolerance, monitor, deadline):
        state.append(1)
        x = problem.target.copy() if len(state) > 2 else shrunk(problem, 0.5)
        return Solution(x, "done", 0)
