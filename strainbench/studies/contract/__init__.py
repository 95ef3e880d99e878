"""The contract that every solver keeps: `strainbench check`, and the tests of the suite's own.

Each clause is a function of a solver and of what it promises, `Promise`. It returns what it found,
in words; raises `BrokenError` with what is broken; or `NotApplicableError` with the reason.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import redirect_stdout
from dataclasses import dataclass
from enum import StrEnum
from io import StringIO

from strainbench.plugins import told
from strainbench.solver.solver import Solver
from strainbench.studies.contract import clauses, warm
from strainbench.studies.contract.promises import OPTIMAL as OPTIMAL
from strainbench.studies.contract.promises import Promise as Promise
from strainbench.studies.contract.promises import promise_of as promise_of
from strainbench.studies.contract.solving import BrokenError as BrokenError
from strainbench.studies.contract.solving import NotApplicableError as NotApplicableError

Clause = Callable[[Solver, Promise], str]
CLAUSES: tuple[Clause, ...] = (
    clauses.has_a_docstring_and_a_label,
    clauses.projects_a_triangle,
    clauses.leaves_what_is_within,
    clauses.keeps_pins_and_problem,
    clauses.claims_what_it_reaches,
    clauses.stays_within_the_limits,
    clauses.moves_with_the_target,
    clauses.has_stationary_multipliers,
    clauses.shows_its_iterates,
    clauses.agrees_with_another,
    warm.has_a_twin_with_a_name,
    warm.leaks_nothing,
    warm.survives_an_absurd_frame,
    warm.is_as_good_when_warm,
)
BUDGET = 25.0  # [s] of a solver's clauses together
EACH = 2.0  # [s] of each of its solves, by its deadline


class Verdict(StrEnum):
    """What became of a clause."""

    KEPT = "kept"
    BROKEN = "broken"
    OPEN = "not checked"


@dataclass(frozen=True)
class Finding:
    """A clause, what became of it, and why in words."""

    clause: str
    verdict: Verdict
    words: str


def check(
    solver: Solver, promise: Promise, file: str = "", budget: float = BUDGET
) -> Iterator[Finding]:
    """Hold a solver to the clauses, one after the other; what it prints is not shown.

    Parameters
    ----------
    file : its source, whose line is named where it raises
    budget : [s] after which what is left counts as broken
    """
    until = time.monotonic() + budget
    for clause in CLAUSES:
        words = (clause.__doc__ or "").split("\n")[0].rstrip(".")
        if time.monotonic() > until:
            late = f"not come to: the clauses before took {budget:g} s"
            yield Finding(words, Verdict.BROKEN, late)
            continue
        with redirect_stdout(StringIO()):
            finding = _held(clause, words, solver, promise, file)
        yield finding


def _held(clause: Clause, words: str, solver: Solver, promise: Promise, file: str) -> Finding:
    try:
        return Finding(words, Verdict.KEPT, clause(solver, promise))
    except NotApplicableError as reason:
        return Finding(words, Verdict.OPEN, str(reason))
    except BrokenError as broken:
        return Finding(words, Verdict.BROKEN, str(broken))
    except Exception as error:  # of a solver's own code, whatever it is
        return Finding(words, Verdict.BROKEN, f"it raises {told(error, file)}")
