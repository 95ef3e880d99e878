"""The projection within what touches isotropic limits, by programs within half-spaces.

Each takes those that the last one's answer presses on, and those that it is beyond.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from solvers.sequential_cuts.halfspaces import HalfSpaces, Restriction
from solvers.sequential_cuts.program import PRICE, Answer
from solvers.sequential_cuts.quadratic import Quadratic
from strainbench import Clock, Problem
from strainbench.arrays import FloatArray

PROGRAMS = 60
"""At most, of one restriction."""
CLOSE = 1e-3
"""How far beyond a restriction its answer may be, over the tolerance. In the first steps of 20 ms
of a beam of 200 tetrahedra the referee's residual is then 6e-5 to 7e-4; with 1e-2 up to 3e-3, and
with 1e-4 1e-5 to 2e-4, for half as many programs again."""
ROUGHLY = 0.1
"""The same over the slack, while there is any: x_k is to be renewed anyway."""
PRESSED = 1e-6
"""Half-spaces whose dual is below this part of the largest are left out of the next program: in
the norm of a metric each optimum is above the last all the same, so that none comes back for ever.
A beam's step takes the same programs so, in a third of the time."""


class PrincipalProgram:
    """Minimise the objective within the restriction that touches at some x.

    Parameters
    ----------
    slack : whether the lower limits may lack t >= 0, at a price.
    """

    def __init__(self, slack: bool) -> None:
        self.slack = slack
        self._kept: tuple[Clock, HalfSpaces] | None = None  # of the projection with that clock

    def solve(
        self, problem: Problem, x: FloatArray, tolerance: float, deadline: Clock, dearer: float = 1
    ) -> Answer:
        """From the half-spaces near x on, until the answer is beyond none."""
        price = dearer * PRICE * len(problem.free) if self.slack else None
        around, self._last = Restriction(problem, x), Quadratic(problem, price)
        cuts, programs = self._first(around, x, deadline), 0
        while programs < PROGRAMS:
            programs += 1
            answer = self._last.solved(around.rows(cuts), tolerance, deadline)
            duals = answer.duals[len(answer.duals) - len(cuts.element) :]
            pressing = cuts.those(duals > PRESSED * duals.max(initial=0.0))
            if not np.isfinite(answer.positions).all() or deadline.passed:
                break
            slack = self._last.slack
            more = around.beyond(answer.positions, max(CLOSE * tolerance, ROUGHLY * slack), slack)
            if len(more.element) == 0:
                break
            cuts = HalfSpaces.of([pressing, more])
        self._kept = deadline, pressing
        return replace(answer, programs=programs)

    def residual(self, problem: Problem, x: FloatArray, duals: FloatArray) -> float:
        """Of the KKT conditions at x with the duals of the last answer."""
        return self._last.residual(x, duals)

    def multipliers(self, x: FloatArray, duals: FloatArray) -> None:
        """None: half-spaces are no rows of G."""

    def _first(self, around: Restriction, x: FloatArray, deadline: Clock) -> HalfSpaces:
        """Those that x is near, and the ones that pressed in this projection's last round."""
        near = around.beyond(x, -around.near)
        if self._kept is None or self._kept[0] is not deadline:
            return near
        return HalfSpaces.of([near, around.renewed(self._kept[1])])
