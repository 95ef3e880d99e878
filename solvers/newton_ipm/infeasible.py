"""Showing that no positions meet the limits, where the interior point jams instead of diverging.

Limits that are wider by w can be met from some w* on. A projection onto those has an interior and
causes no trouble; the nearer w comes to w*, the larger its multipliers. Where w* > 0 their bound
on the objective under the limits themselves grows past that of any point within the limits.

1. w from twice the violation of a point at hand, which is then well inside, halving a bracket.
2. An iterate's multipliers show it: stop.
3. The projection went through: w is the bracket's upper end; if not, its lower end.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

from strainbench import Problem
from strainbench.arrays import FloatArray
from strainbench.problem.dual import dual_bound

HALVINGS = 20


def infeasible_multipliers(
    problem: Problem,
    violation: float,
    least: float,
    projection: Callable[[Problem, float], Iterator[tuple[float, FloatArray]]],
) -> FloatArray | None:
    """(rows, 3) whose bound exceeds the largest objective, or None where none was found.

    Parameters
    ----------
    violation : of some positions
    least : widths below are not tried: the limits can be met but for so much
    projection : onto limits wider by a width, yields the error of each iterate, below 1 in the end
        where all went well, and its multipliers
    """
    if not violation > 0:  # some positions are within the limits
        return None
    low, high, width = 0.0, 2 * violation, 2 * violation
    for _ in range(HALVINGS):
        error = float("inf")
        for error, Y in projection(problem.tightened(-width), width):  # noqa: B007
            if dual_bound(problem, Y)[0] > problem.largest_objective:  # 2
                return Y
        if error < 1:  # 3
            high = width
        else:
            low = width
        width = 0.5 * (low + high)
        if width < least:
            break
    return None
