"""What kind of failure a cell or a projection is that is not optimal: exactly one.

The referee decides, from positions, energies, clocks and exit codes. The solver's word counts in
three places alone: where it says "solved" and is not, that it stopped at a limit of its own, and
that it calls a problem infeasible to which it has no answer.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from enum import StrEnum
from itertools import accumulate, pairwise
from typing import TYPE_CHECKING, Any

from strainbench.bench.ending import Ending

if TYPE_CHECKING:  # reports read the kinds and need no referee
    from strainbench.bench.cell import Cell
    from strainbench.bench.journal import Events
    from strainbench.referee.certificate import Certificate
    from strainbench.referee.conduct import Conduct

RISE = 0.01  # of the largest energy in motion and strain so far: by so much energy may not rise
SHIFT = 1e-4  # [edges] by which a free cloth's centre of mass may be moved
CLOCK = ("time limit", "time_limit", "user_limit", "time out", "timeout", "max_time")
"""What solvers say, in lower case, where the clock ended a projection."""
COUNTED = re.compile(r"(iter|sweep|step).*limit|max\w*[ _]?(iter|sweep|step)", re.IGNORECASE)
"""What they say where a count of their own did."""
STORED = ("kinetic_energy", "membrane_energy", "bending_energy", "contact_energy")


class Failure(StrEnum):
    """The kinds. Of several that fit, the first counts."""

    UNAVAILABLE = "unavailable"  # what the solver needs is not installed
    REFUSED = "refused"  # by the solver, or called infeasible with no answer
    NO_VERDICT = "no verdict"  # the referee, a worker or a recording failed: nobody's failure
    RECORDS = "false records"  # its journal is damaged, or its clock was tampered with
    CRASHED = "crashed"  # by a signal, or its process ended by itself
    MEMORY = "memory"  # over the limit, or none left
    NOT_A_NUMBER = "not a number"
    ERROR = "error"  # an exception, or an answer of another shape or type
    TIME_LIMIT = "time limit"  # the cell's own, or the solver stopped for it
    FALSE_CLAIM = "says solved and is not"  # while it violates the limits
    ITERATION_LIMIT = "iteration limit"
    INVERTED = "inverted"  # see `strainbench.referee.conduct`
    ENERGY = "energy rises"  # in a step by more than RISE, the pins' work apart
    MOMENTUM = "momentum not kept"  # of a cloth that nothing holds
    OVERSTRETCHED = "over-stretched"
    DRIFTS = "drifts"  # from the closed loop of an optimal cell: see `strainbench.report.drift`
    NOT_OPTIMAL = "feasible, not optimal"


ORDER = tuple(Failure)
BEFORE = (Failure.UNAVAILABLE, Failure.REFUSED, Failure.NO_VERDICT)
"""Those that begin in no step."""
ENDINGS = {
    Ending.UNAVAILABLE: Failure.UNAVAILABLE,
    Ending.UNSUPPORTED: Failure.REFUSED,
    Ending.UNRECORDED: Failure.NO_VERDICT,
    Ending.UNJUDGED: Failure.NO_VERDICT,
    Ending.LOST: Failure.NO_VERDICT,
    Ending.TIME_LIMIT: Failure.TIME_LIMIT,
    Ending.HUNG: Failure.TIME_LIMIT,
    Ending.MEMORY_LIMIT: Failure.MEMORY,
    Ending.CRASHED: Failure.CRASHED,
    Ending.SILENT: Failure.CRASHED,
    Ending.DAMAGED: Failure.RECORDS,
    Ending.TAMPERED: Failure.RECORDS,
}
FAILURES = ("failure", "failure_step")
"""Their columns in runs.csv."""


def of_reason(reason: str) -> Failure:
    """Of a cell without an answer to its last step."""
    ending = Ending.of(reason)
    if ending is not None:
        return ENDINGS[ending]
    if reason.startswith("MemoryError"):
        return Failure.MEMORY
    if "infeasible" in reason.lower() and "not finite" in reason:
        return Failure.REFUSED
    left = ("positions that are not finite", "left the finite numbers")
    return Failure.NOT_A_NUMBER if any(words in reason for words in left) else Failure.ERROR


def ended(cell: Cell, reason: str, steps_done: int) -> dict[str, object]:
    """The columns of a cell without an answer to its last step."""
    first, last = cell.window
    kind = of_reason(reason)
    step = "" if kind in BEFORE else min(first + steps_done, last)
    return dict(zip(FAILURES, (kind.value, step), strict=True))


def of_projection(
    found: Certificate, done: Conduct, event: Mapping[str, Any], rise: float
) -> Failure | None:
    """Of one projection; None if it is optimal.

    Parameters
    ----------
    event : what its solver said
    rise : of the energy in its step, see `rises`
    """
    if found.outcome == "optimal":
        return None
    status, violated = event["status"], found.outcome == "violated"
    if found.outcome == "no answer":
        if "not finite" not in found.reason:
            return Failure.ERROR
        return Failure.REFUSED if "infeasible" in status.lower() else Failure.NOT_A_NUMBER
    fits = {
        Failure.TIME_LIMIT: by_clock(status),
        Failure.FALSE_CLAIM: violated and status == "solved",
        Failure.ITERATION_LIMIT: COUNTED.search(status),
        Failure.INVERTED: done.inverted,
        Failure.ENERGY: rise > RISE,
        Failure.MOMENTUM: done.momentum_error > SHIFT,
        Failure.OVERSTRETCHED: violated,
    }
    return next((kind for kind, fit in fits.items() if fit), Failure.NOT_OPTIMAL)


def by_clock(status: str) -> bool:
    """Whether a solver says that its time was over."""
    return any(words in status.lower() for words in CLOCK)


def of_steps(outcome: object, rows: Iterable[Mapping[str, object]]) -> dict[str, object]:
    """The columns of a cell that has done its steps, from those projections that have its outcome,
    which is that of the worst."""
    worst = [r for r in rows if r["outcome"] == outcome and r["failure"]]
    failed = [(ORDER.index(Failure(str(r["failure"]))), r["step"]) for r in worst]
    if not failed:
        return dict.fromkeys(FAILURES, "")
    kind = min(failed)[0]
    first = next(step for index, step in failed if index == kind)
    return dict(zip(FAILURES, (ORDER[kind].value, first), strict=True))


def rises(events: Events) -> dict[int, float]:
    """By how much energy rises in each step but the first, beyond what moving pins put in.

    It is relative to the largest energy of motion, strain and contact so far. Steps without
    energies, and those of scenes at rest, have none.
    """
    steps = [event for event in events if event["event"] == "step"]
    stored = [sum(e[name] for name in STORED) for e in steps]
    totals = [s + e["gravity_energy"] for s, e in zip(stored, steps, strict=True)]
    scales = list(accumulate(stored, max))[1:]
    changes = [after - before for before, after in pairwise(totals)]
    return {
        e["step"]: (change - e["pin_work"]) / scale
        for e, change, scale in zip(steps[1:], changes, scales, strict=True)
        if scale > 0
    }
