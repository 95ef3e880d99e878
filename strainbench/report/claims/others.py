"""Claims of Tang et al. (2022) about the cone program beside the other methods: Table 1."""

from __future__ import annotations

from typing import NamedTuple

import pandas as pd

from strainbench.report.claims.claim import Finding, Verdict, at, claim
from strainbench.report.claims.evidence import Evidence
from strainbench.report.claims.failing import tally
from strainbench.report.claims.sides import highest, listed, or_missing
from strainbench.report.claims.table1 import PAPER, TABLE1
from strainbench.report.measures import COUNT, OUT_OF_TIME, duration, length
from strainbench.report.numbers import power
from strainbench.report.printed import LIMITS, PAPER_SECONDS, SIZES

TABLE = "claims/table"


@claim(
    "T31",
    "5.1, 6",
    "The cone program beats both others by wide margins, above all when large and tight.",
    TABLE1,
    at(
        "convergence",
        "converge swing --frame 30 --set resolution=20 --time-limit 20 --solver "
        "newton-ipm,clarabel,ipopt,gauss-seidel",
    ),
    fairness="Gauss-Seidel ends at another point than the projection; their Ipopt's Hessian.",
)
def margins(seen: Evidence) -> Finding:
    """Others over the cone program, in their table and here."""
    theirs = {
        (name, limit): [
            other / ours
            for other, ours in zip(
                PAPER_SECONDS[name, limit], PAPER_SECONDS["SOCP", limit], strict=True
            )
        ]
        for name in ("GS", "NLP")
        for limit in LIMITS
    }
    slower = [r for ratios in theirs.values() for r in ratios if r < 1]
    ours = {s: _margins(seen, s) for s in ("gauss-seidel", "ipopt-default-lbfgs")}
    every = [m.ratio for found in ours.values() for m in found]
    hard = [m.ratio for found in ours.values() for m in found if m.hard]
    off = highest(seen.cells(PAPER, solver="gauss-seidel")["distance_max"])
    return Finding(
        Verdict.of(not slower and min(every) > 1, min(hard) > 1),
        f"In the paper's own table Gauss-Seidel takes {listed(theirs['GS', 0.1], '.2f')} times as "
        f"long at 10%, {listed(theirs['GS', 0.01], '.1f')} at 1%. Here, over Clarabel: "
        + "; ".join(f"{s} {', '.join(m.told for m in found)}" for s, found in ours.items())
        + f". Gauss-Seidel ends up to {length(1000 * off)} from the projection.",
        or_missing(lambda: _to_gap(seen)),
    )


class Margin(NamedTuple):
    """A mean time over Clarabel's, in words, and whether the case is tight and not small."""

    ratio: float
    told: str
    hard: bool


def _margins(seen: Evidence, solver: str) -> list[Margin]:
    """By limit and size, with the steps of a mean over fewer."""
    found = []
    for limit in LIMITS:
        for n in SIZES:
            where = {"resolution": n, "limit": limit}
            one = seen.one(PAPER, solver=solver, **where)
            done = tally(seen, PAPER, solver=solver, **where)
            ratio = seen.ratio(
                PAPER, "solve_seconds_mean", {"solver": "clarabel"}, solver=solver, **where
            )
            if not (count := done.finished):
                continue
            few = "" if one["done"] == done.asked else f", {count} step{'s' * (count != 1)}"
            told = f"{ratio:.0f}" if ratio >= 10 else f"{ratio:.2g}"
            words = f"{told} ({n} cells, {100 * limit:g}%{few})"
            found.append(Margin(ratio, words, limit < 0.1 and n > 10))
    return found


def _to_gap(seen: Evidence) -> str:
    table = seen.table("convergence", "convergence.csv")
    told = []
    for solver in ("clarabel", "ipopt", "newton-ipm", "gauss-seidel"):
        own = table[table["solver"] == solver]
        there = own[own["relative_gap"] <= 1e-2]
        if own.empty:
            continue
        told.append(
            f"{solver} {duration(there['seconds'].min())}"
            if len(there)
            else f"{solver} never (it ends at {power(own['relative_gap'].iloc[-1])})"
        )
    return f"Seconds to a relative gap of 1e-2 at 20 cells, 1%: {', '.join(told)}."


@claim(
    "T32",
    "5.1",
    "The cone program handles all cases of the table.",
    TABLE1,
    at(
        TABLE,
        "run swing --mode replay --frames 12-16 --set resolution=10,20,40,60 --set limit=10% "
        "--solver clarabel-default,clarabel-paper",
    ),
    fairness="The clock is ours: it ends cells that would go on.",
)
def handles_all(seen: Evidence) -> Finding:
    """Endings of the cone solvers, and of the two forms nearest to the paper's."""
    names = ("clarabel-paper", "clarabel-default", "clarabel", "newton-ipm")
    cells = seen.cells(PAPER, solver=names)
    bad = cells[~cells["ending"].isin((*COUNT, OUT_OF_TIME))]
    cut = cells[cells["ending"] == OUT_OF_TIME]
    absent = [s for s in names if s not in set(cells["solver"])]
    worst = highest(cells.loc[cells["ending"] != OUT_OF_TIME, "max_violation"])
    told = [_endings(s, of) for s, of in cells.groupby("solver")]
    needs = 100 * PAPER_SECONDS["SOCP", 0.01][-1]
    clock = (
        f" The clock is ours, {cut['time_limit'].iloc[0]:.0f} s a cell; the paper's own 100 steps "
        f"take {needs:.0f} s at 60 cells."
        if len(cut)
        else ""
    )
    return Finding(
        Verdict.of(bad.empty and cut.empty and not absent, bad.empty),
        f"{'; '.join(told)}.{clock} Largest violation of those that end in time {power(worst)}."
        + (f" Not run there: {', '.join(absent)}." if absent else ""),
        or_missing(lambda: _forms(seen, 0.01, "claims/growth"))
        + " "
        + or_missing(lambda: _forms(seen, 0.1, TABLE)),
    )


def _endings(solver: str, cells: pd.DataFrame) -> str:
    counts = cells["ending"].value_counts()
    return f"{solver}: of {len(cells)} cells " + ", ".join(f"{n} {e}" for e, n in counts.items())


def _forms(seen: Evidence, limit: float, folder: str) -> str:
    forms = ("clarabel-paper", "clarabel-default")
    cells = seen.cells(folder, limit=limit, solver=forms, resolution=SIZES)
    told = "; ".join(_endings(s, of) for s, of in cells.groupby("solver"))
    return f"Five frames at {100 * limit:g}%: {told}."
