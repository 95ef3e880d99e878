"""No projection: the candidate itself (implicit Euler alone, the first row of Table 1)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from strainbench import Clock, Problem, Solution, Solver


@dataclass(frozen=True)
class NoProjection(Solver):
    """No projection: the candidate itself (implicit Euler alone, Tang et al. 2022, Table 1)."""

    name = "none"
    takes_exact = True
    takes_lower = True
    takes_principal = True
    takes_metric = True
    takes_contact = True
    takes_friction = True

    def solve(
        self,
        problem: Problem,
        state: None,
        *,
        tolerance: float,
        monitor: Callable[..., None],
        deadline: Clock,
    ) -> Solution:
        """Return the target."""
        return Solution(problem.target.copy(), "not limited", 0)
