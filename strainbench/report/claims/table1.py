"""Claims of Tang et al. (2022) about times by size: section 5.1, Table 1."""

from __future__ import annotations

import numpy as np
import pandas as pd

from strainbench.bench.mode import replays
from strainbench.report.claims.claim import Finding, Verdict, at, claim
from strainbench.report.claims.evidence import Evidence, NotThereError
from strainbench.report.measures import COUNT, OUT_OF_TIME, duration, length
from strainbench.report.numbers import power
from strainbench.report.printed import PAPER_SECONDS, SIZES

GROWTH = (
    at(
        "claims/growth",
        "run swing --mode replay --frames 12-16 --set resolution=10,20,40,60 --solver "
        "newton-ipm,clarabel-default,clarabel-paper --repeats 3",
    ),
    at("claims/growth", "run swing --solver none --set resolution=10,20,40,60 --steps 20"),
)
BY_DEFAULT = at(
    "claims/ipopt",
    "run swing --mode replay --frames 2-10 --set resolution=10,20,40 --solver "
    "ipopt-default,ipopt-default-lbfgs,ipopt-edges-default-lbfgs --time-limit 120",
)
TABLE1 = "make bench-paper PAPER=results/paper"
PAPER = "paper"


def _by_size(seen: Evidence, folder: str, column: str, **wanted: object) -> pd.Series:
    cells = seen.cells(folder, resolution=SIZES, **wanted)
    found = cells.drop_duplicates("resolution", keep="last").set_index("resolution")[column]
    if len(found) < len(SIZES):
        raise NotThereError(f"{folder} lacks sizes for {wanted}")
    return found.reindex(SIZES).astype(float)


@claim(
    "T24",
    "5.1",
    "The cone program and implicit Euler take comparable time on small and moderate sizes.",
    *GROWTH,
    fairness='"Comparable" in absolute seconds.',
)
def comparable(seen: Evidence) -> Finding:
    """Ratios by size, the paper's own and ours."""
    theirs = np.divide(PAPER_SECONDS["SOCP", 0.01], PAPER_SECONDS["IE", 0.01])
    euler = _by_size(seen, "claims/growth", "ie_seconds_mean", solver="none", mode="simulate")
    ours = {
        s: _by_size(seen, "claims/growth", "time", solver=s) / euler
        for s in ("clarabel-paper", "newton-ipm")
    }
    own = "; ".join(f"{s} {', '.join(f'{v:.1f}' for v in r)}" for s, r in ours.items())
    return Finding(
        Verdict.of(bool(theirs[0] < 2), bool(ours["newton-ipm"].max() < 3)),
        f"By the paper's own table {', '.join(f'{r:.1f}' for r in theirs)} times at "
        f"{', '.join(map(str, SIZES))} cells. Here: {own}.",
    )


@claim(
    "T25",
    "5.1, 6",
    "The cone program's time grows much faster than implicit Euler's.",
    *GROWTH,
    fairness="A fixed overhead of each solve flattens their 10 x 10.",
)
def grows(seen: Evidence) -> Finding:
    """From 10 to 60 cells, the paper's own and ours."""
    theirs = {k: PAPER_SECONDS[k, 0.01][-1] / PAPER_SECONDS[k, 0.01][0] for k in ("SOCP", "IE")}
    euler = _by_size(seen, "claims/growth", "ie_seconds_mean", solver="none", mode="simulate")
    names = ("clarabel-paper", "clarabel-default", "newton-ipm")
    ours = {s: _by_size(seen, "claims/growth", "time", solver=s) for s in names}
    ratios = {s: t.iloc[-1] / t.iloc[0] for s, t in (ours | {"implicit Euler": euler}).items()}
    own = ", ".join(f"{s} {r:.0f}" for s, r in ratios.items())
    faster = ratios["clarabel-paper"] > 1.5 * ratios["implicit Euler"]
    return Finding(
        Verdict.of(bool(theirs["SOCP"] > theirs["IE"] and faster), bool(faster)),
        f"From 10 to 60 cells the paper's own table has SOCP {theirs['SOCP']:.0f} and implicit "
        f"Euler {theirs['IE']:.0f} times as long: the reverse. Here: {own}.",
        f"Iterations: {', '.join(f'{n:.0f}' for n in _iterations(seen))} (Eq. 12 to the letter).",
    )


def _iterations(seen: Evidence) -> pd.Series:
    return _by_size(seen, "claims/growth", "iterations_mean", solver="clarabel-paper")


@claim(
    "T26",
    "5.1",
    "8 s a step at 10,000 degrees of freedom and 30,000 constraints.",
    *GROWTH,
    fairness="i9-7900X; MOSEK's threads.",
)
def seconds_a_step(seen: Evidence) -> Finding:
    """Sizes and seconds at 60 cells."""
    cells = seen.cells("claims/growth", resolution=60)
    one = cells.iloc[0]
    projected = cells[cells["mode"].map(replays) & (cells["time"] > 0)]
    times = {r["solver"]: duration(2 * r["time"]) for _, r in projected.iterrows()}
    return Finding(
        Verdict.HOLDS,
        f"60 x 60 cells have {one['variables']:.0f} variables and {one['constraints']:.0f} "
        "constraints; twice the paper's 4.06 s is 8.1: four directions and two projections a step. "
        f"Two projections here: {', '.join(f'{s} {t}' for s, t in times.items())}.",
    )


@claim(
    "T29",
    "Table 1",
    "Ipopt with default options solves 10 x 10, some of 20 x 20, and fails from 40 x 40 on.",
    BY_DEFAULT,
    fairness="Which Hessian they gave is not written; MUMPS against MA57; time limits.",
)
def ipopt_by_default(seen: Evidence) -> Finding:
    """Steps answered, with either Hessian."""
    names = ("ipopt-default", "ipopt-default-lbfgs", "ipopt-edges-default-lbfgs")
    cells = seen.cells("claims/ipopt", solver=names).set_index(["solver", "resolution"])
    done = {
        (s, n): f"{cells.loc[(s, n), 'done']:.0f} of {cells.loc[(s, n), 'steps_asked']:.0f}"
        for s in names
        for n in (10, 20, 40)
        if (s, n) in cells.index
    }
    lbfgs = [cells["done"].get(("ipopt-default-lbfgs", n), 0) for n in (10, 20, 40)]
    shape = lbfgs[0] > lbfgs[1] > lbfgs[2]
    exact = cells["done"].get(("ipopt-default", 10), 0)
    told = "; ".join(
        f"{s}: {', '.join(t for (name, _), t in done.items() if name == s)}" for s in names
    )
    return Finding(
        Verdict.of(bool(shape and exact >= lbfgs[0]), bool(shape)),
        f"Steps answered at 10, 20 and 40 cells in 120 s a cell: {told}. The paper's pattern is "
        "that of L-BFGS; with the exact Hessian it is lost at 10 cells already.",
        "Limits on edges, as after Jin et al., with the same options.",
    )


@claim(
    "T30",
    "Table 1",
    "Gauss-Seidel fails to converge from 20 cells on at 1%, at 60 cells at 10%.",
    TABLE1,
    fairness="They clamp entries of the strain (`gauss-seidel-strain`), which is slower.",
)
def gauss_seidel(seen: Evidence) -> Finding:
    """Endings by size and limit."""
    cells = seen.cells(PAPER, solver="gauss-seidel")
    told = {
        f"{100 * limit:g}%": ", ".join(
            f"{r['resolution']:.0f} {r['ending']} {r['why']}".strip() for _, r in at.iterrows()
        )
        for limit, at in cells.sort_values("resolution").groupby("limit")
    }
    tight = cells[cells["limit"] == 0.01].set_index("resolution")["ending"]
    fails = [n for n in SIZES if tight.get(n) not in COUNT]
    return Finding(
        Verdict.of(fails[:1] == [20], bool(fails)),
        "; ".join(f"at {limit}: {text}" for limit, text in told.items()) + ".",
    )


@claim(
    "T31",
    "5.1, 6",
    "The cone program beats both others by wide margins, above all when large and tight.",
    "make bench BENCH=results/swing-short",
    fairness="At equal accuracy the order is another one.",
)
def margins(seen: Evidence) -> Finding:
    """Gauss-Seidel over the cone solver, in their table and here."""
    theirs = {
        limit: np.divide(PAPER_SECONDS["GS", limit], PAPER_SECONDS["SOCP", limit])
        for limit in (0.01, 0.1)
    }
    ours, off = {}, 0.0
    for limit in (0.01, 0.1):
        for n in (10, 20):
            where = {"resolution": n, "limit": limit}
            ratio = seen.ratio(
                "swing-short", "time", {"solver": "clarabel"}, solver="gauss-seidel", **where
            )
            ours[f"{n} cells, {100 * limit:g}%"] = ratio
            off = max(off, seen.one("swing-short", solver="gauss-seidel", **where)["distance_max"])
    return Finding(
        Verdict.of(min(theirs[0.1][:2]) > 1, theirs[0.01][1] > 1),
        f"The paper's own table has Gauss-Seidel faster at 10% on 10 and 20 cells "
        f"({', '.join(f'{r:.2f}' for r in theirs[0.1][:2])} of the cone program's time). Here "
        + ", ".join(f"{r:.2f} at {where}" for where, r in ours.items())
        + f" of Clarabel's, up to {length(1000 * off)} from the projection.",
    )


@claim(
    "T32",
    "5.1",
    "The cone program handles all cases of the table.",
    TABLE1,
    fairness="Tolerances.",
)
def handles_all(seen: Evidence) -> Finding:
    """Endings of the cone solver's three forms."""
    cells = seen.cells(PAPER, solver=("clarabel-paper", "clarabel-default", "clarabel"))
    bad = cells[~cells["ending"].isin((*COUNT, OUT_OF_TIME))]
    cut = int((cells["ending"] == OUT_OF_TIME).sum())
    worst = cells.loc[cells["ending"] != OUT_OF_TIME, "max_violation"].max()
    return Finding(
        Verdict.of(bad.empty and not cut, bad.empty),
        f"Of {len(cells)} cells {len(bad)} end violated or without an answer, {cut} out of time; "
        f"largest violation of those that end in time {power(worst)}.",
    )
