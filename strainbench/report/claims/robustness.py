"""Claims of Tang et al. (2022) about robustness: section 5."""

from __future__ import annotations

import pandas as pd

from strainbench.report.claims.claim import Finding, Verdict, claim
from strainbench.report.claims.evidence import Evidence
from strainbench.report.claims.methods import BASIC_HARD
from strainbench.report.claims.projection import CONES, ended
from strainbench.report.claims.reading import tally
from strainbench.report.claims.sides import or_missing
from strainbench.report.measures import COUNT, OPTIMAL
from strainbench.report.versions import NOT_INSTALLED

ALL_HARD = (
    'make failures FAILURES=results/failures HARD="--set resolution=10 --time-limit 10 --solver '
    "admm,augmented-lagrangian,clarabel,clarabel-default,clarabel-paper,cvxpy,cvxpy-ecos,cvxpy-scs,"
    "dykstra,fast-projection,gauss-seidel,gauss-seidel-strain,gauss-seidel-principal,ipopt,"
    'ipopt-edges,linearized-qp,newton-ipm,none,qoco,xpbd --results results/failures"'
)
HARD_CASE = ["case", "severity", "limit"]


@claim(
    "T22",
    "5",
    "The method is robust on all static and dynamic examples.",
    BASIC_HARD,
    ALL_HARD,
    fairness="MOSEK's own scaling; their examples are milder than these scenes.",
)
def robust(seen: Evidence) -> Finding:
    """Cone solvers on scenes made to break methods, those apart that nobody solves."""
    cells = seen.cells("failures", scenario="stress")
    cells = cells[cells["why"] != NOT_INSTALLED]
    solved = cells["ending"].isin(COUNT).groupby([cells[c] for c in HARD_CASE]).transform("any")
    ours = cells[cells["solver"].isin(CONES)]
    asked = ours[solved[ours.index]]
    within = asked["ending"].isin(COUNT).groupby(asked["solver"]).agg(["sum", "size"])
    optimal = (asked["ending"] == OPTIMAL).groupby(asked["solver"]).sum()
    told = "; ".join(
        f"{name} within the limits {a} of {b}, optimal {optimal[name]}"
        for name, a, b in within.itertuples()
    )
    missing = [name for name in CONES if name not in within.index]
    whole = within["sum"] == within["size"]
    return Finding(
        Verdict.of(
            bool(not missing and (optimal == within["size"]).all()),
            bool(len(within) and whole.any()),
        ),
        f"On the hard cases of `stress` that some method solves: {told}.{_beyond(asked)}"
        + (f" Not measured yet: {', '.join(missing)}." if missing else "")
        + _unsolved(ours[~solved[ours.index]]),
        or_missing(_random_problems, seen),
    )


def _beyond(cells: pd.DataFrame) -> str:
    """Which cases end beyond the limits, or without an answer."""
    lost = cells[~cells["ending"].isin(COUNT)]
    told = (f"{r['solver']} on {_case(r)} {ended(r)}" for _, r in lost.iterrows())
    return f" Not within them: {', '.join(told)}." if len(lost) else ""


def _case(cell: pd.Series) -> str:
    return f"{cell['case']} {cell['severity']:g} at {100 * cell['limit']:g}%"


def _unsolved(cells: pd.DataFrame) -> str:
    """Which cases no method solves, and how those of the cone solvers end that were asked."""
    if cells.empty:
        return ""
    names = dict.fromkeys(_case(cell) for _, cell in cells.iterrows())
    ends = ", ".join(sorted(set(cells["ending"])))
    return f" Left out, as no method at all ends within the limits: {', '.join(names)} ({ends})."


def _random_problems(seen: Evidence) -> str:
    found = tally(seen).reindex(CONES).dropna().astype(int)
    told = "; ".join(
        f"{name} {r['optimal']} optimal, {r['feasible']} within the limits, "
        f"{r['violated'] + r['no answer']} neither, {r['refused']} refused"
        for name, r in found.iterrows()
    )
    return (
        f"On 200 random problems (`make certificates`, 0.2 s each): {told}. Refused are exact "
        "limits, for which Eq. 12 has no form."
    )
