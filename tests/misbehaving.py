"""Solvers that do what solvers must not; run by test_runner.py as a file from outside."""

from __future__ import annotations

import os
import time
from dataclasses import dataclass, replace

import numpy as np

from strainbench import Solution, Solver


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
