"""What is certain of a projection: its optimum between two bounds, or that it has none."""

from __future__ import annotations

from dataclasses import dataclass
from io import BytesIO

import numpy as np

from strainbench.arrays import FloatArray
from strainbench.problem.dual import relative
from strainbench.problem.problem import Problem
from strainbench.referee.reference import Kept, ReferenceSolver, content_key

AIM = 1e-9
"""Relative gap between the bounds that is aimed at; what was reached is in the index."""


@dataclass(frozen=True)
class Optimum:
    """A certificate.

    Parameters
    ----------
    positions : (n, 3) [m] within the limits, or NaN
    multipliers : (rows, 3), of whose multiples none has a higher bound
    objective, lower_bound : of the positions, and of all others; the optimum lies between
    active : constraints within 1e-6 of their bound at the positions
    infeasible : why there are no positions within the limits, or ""
    """

    positions: FloatArray
    multipliers: FloatArray
    objective: float
    lower_bound: float
    gap: float
    active: int
    infeasible: str

    @property
    def status(self) -> str:
        """What is certain, in a word or two."""
        if self.infeasible:
            return "infeasible"
        if self.lower_bound != self.lower_bound:
            return "local"
        return "optimal" if self.gap <= AIM else "optimal to the gap" if self.gap < 1 else "open"

    def content(self) -> bytes:
        """As a file."""
        buffer = BytesIO()
        np.savez_compressed(buffer, positions=self.positions, multipliers=self.multipliers)
        return buffer.getvalue()


def certified(problem: Problem) -> Optimum:
    """The optimum of a problem by the referee's reference, with what shows it."""
    kept: Kept = {}
    reference = ReferenceSolver(problem, kept)(problem)
    still = np.zeros((problem.rows, 3))
    Y = kept.get(content_key(problem), (still, [still], None))[1][0]
    norms = float(problem.dual_norms(Y).sum())  # the reference's are those of the best multiple
    multipliers = Y * (float(reference.multiplier_norms.sum()) / norms) if norms > 0 else still
    x = reference.positions
    objective = problem.objective(x)
    gap = relative(problem, objective - reference.lower_bound, reference.lower_bound)
    return Optimum(
        x,
        multipliers,
        objective,
        reference.lower_bound,
        max(gap, 0.0) if gap == gap else gap,
        reference.active_constraints,
        reference.infeasible or "",
    )
