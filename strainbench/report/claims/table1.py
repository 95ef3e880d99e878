"""Claims of Tang et al. (2022) about time by size: section 5.1, Table 1."""

from __future__ import annotations

import numpy as np
import pandas as pd

from strainbench.bench.mode import replays
from strainbench.report.claims.claim import Finding, Verdict, at, claim
from strainbench.report.claims.evidence import Evidence, NotThereError
from strainbench.report.claims.sides import listed, or_missing
from strainbench.report.measures import duration
from strainbench.report.printed import PAPER_SECONDS, SIZES

GROWTH = (
    at(
        "claims/growth",
        "run swing --mode replay --frames 12-16 --set resolution=10,20,40,60 --solver "
        "newton-ipm,clarabel-default,clarabel-paper --repeats 3",
    ),
    at("claims/growth", "run swing --solver none --set resolution=10,20,40,60 --steps 20"),
)
TABLE1 = "make bench-paper PAPER=results/paper"
PAPER = "paper"
CONES = ("clarabel-paper", "clarabel-default", "newton-ipm")
FREEDOM = 3 * (np.array(SIZES) + 1.0) ** 2  # degrees, at SIZES cells


def _by_size(seen: Evidence, folder: str, column: str, **wanted: object) -> pd.Series:
    cells = seen.cells(folder, resolution=SIZES, limit=0.01, **wanted)
    found = cells.drop_duplicates("resolution", keep="last").set_index("resolution")[column]
    if len(found) < len(SIZES):
        raise NotThereError(f"{folder} lacks sizes for {wanted}")
    return found.reindex(SIZES).astype(float)


def _euler(seen: Evidence) -> pd.Series:
    return _by_size(seen, "claims/growth", "ie_seconds_mean", solver="none", mode="simulate")


def _times(seen: Evidence) -> dict[str, pd.Series]:
    return {s: _by_size(seen, "claims/growth", "time", solver=s) for s in CONES}


@claim(
    "T24",
    "5.1",
    "The cone program and implicit Euler take comparable time on small and moderate sizes.",
    *GROWTH,
    TABLE1,
    fairness='"Comparable" in absolute seconds.',
)
def comparable(seen: Evidence) -> Finding:
    """Ratios by size, the paper's own and ours."""
    theirs = np.divide(PAPER_SECONDS["SOCP", 0.01], PAPER_SECONDS["IE", 0.01])
    euler = _euler(seen)
    ours = {s: time / euler for s, time in _times(seen).items()}
    small = [r for r in ours.values() if r.iloc[:2].max() < 2]
    return Finding(
        Verdict.of(bool(theirs[:2].max() < 2 and len(small) == len(ours)), bool(small)),
        f"By the paper's own table {listed(theirs)} times at {', '.join(map(str, SIZES))} cells. "
        f"Here: {'; '.join(f'{s} {listed(r)}' for s, r in ours.items())}.",
        or_missing(lambda: _closed_loop(seen)),
    )


def _closed_loop(seen: Evidence) -> str:
    told = []
    for solver in ("clarabel", "newton-ipm"):
        socp, euler = (
            _by_size(seen, PAPER, column, solver=solver)
            for column in ("solve_seconds_mean", "ie_seconds_mean")
        )
        told.append(f"{solver} {listed(socp / euler)}")
    return f"Means over the paper's 100 steps, implicit Euler's of the same run: {'; '.join(told)}."


@claim(
    "T25",
    "5.1",
    "For larger problems the cone program's time grows much faster than implicit Euler's.",
    *GROWTH,
    fairness="A fixed overhead of each solve flattens their 10 x 10. Section 6 has it grow rather "
    "rapidly, beside nothing else.",
)
def grows(seen: Evidence) -> Finding:
    """From 10 to 60 and from 40 to 60 cells, the paper's own and ours."""
    theirs = {k: pd.Series(PAPER_SECONDS[k, 0.01], SIZES) for k in ("SOCP", "IE")}
    ours = {**_times(seen), "IE": _euler(seen)}
    own, faster = (_faster(times) for times in (theirs, ours))
    apart = theirs["SOCP"] - theirs["IE"]
    return Finding(
        Verdict.of(len(own) == 1 and len(faster) == len(CONES), bool(own or faster)),
        "Times at 60 over those at 10 cells, at 60 over those at 40, exponents over the degrees of "
        f"freedom: in the paper's own table {_growth(theirs)}: by ratio "
        f"{'the cone program' if own else 'implicit Euler'} grows faster, while the difference "
        f"grows from {duration(apart[10])} to {duration(apart[60])}. Here {_growth(ours)}; "
        f"faster by both ratios than implicit Euler: {', '.join(faster) or 'none'}.",
        or_missing(lambda: _iterations(seen)),
    )


def _faster(times: dict[str, pd.Series]) -> list[str]:
    """Those that grow faster than implicit Euler, over all sizes and over the two largest."""
    euler = times["IE"]
    return [
        s
        for s, t in times.items()
        if s != "IE" and all(t[60] / t[n] > euler[60] / euler[n] for n in (10, 40))
    ]


def _growth(times: dict[str, pd.Series]) -> str:
    return "; ".join(
        f"{s} {t[60] / t[10]:.0f}, {t[60] / t[40]:.2f}, {exponent(t):.2f}" for s, t in times.items()
    )


def exponent(times: pd.Series) -> float:
    """Of the power of the degrees of freedom that fits times at SIZES best, in logarithms.

    >>> round(exponent(pd.Series(FREEDOM**1.5)), 6)
    1.5
    """
    return float(np.polyfit(np.log(FREEDOM), np.log(times.to_numpy()), 1)[0])


def _iterations(seen: Evidence) -> str:
    counts = {s: _by_size(seen, "claims/growth", "iterations_mean", solver=s) for s in CONES}
    return (
        (
            "Iterations grow less: "
            if all(c[60] < 2 * c[10] for c in counts.values())
            else "Iterations: "
        )
        + "; ".join(f"{s} {listed(c, '.0f')}" for s, c in counts.items())
        + "."
    )


@claim(
    "T26",
    "5.1",
    "8 s a step at 10,000 degrees of freedom and 30,000 constraints.",
    *GROWTH,
    fairness="i9-7900X; MOSEK's threads.",
)
def seconds_a_step(seen: Evidence) -> Finding:
    """Sizes and seconds at 60 cells."""
    cells = seen.cells("claims/growth", resolution=60, limit=0.01)
    one = cells.iloc[0]
    theirs = PAPER_SECONDS["SOCP", 0.01][-1]
    sizes = ((one["variables"], 1e4), (one["constraints"], 3e4), (2 * theirs, 8.0))
    projected = cells[cells["mode"].map(replays) & (cells["time"] > 0)]
    times = {r["solver"]: duration(2 * r["time"]) for _, r in projected.iterrows()}
    return Finding(
        Verdict.of(all(abs(found / told - 1) < 0.15 for found, told in sizes)),
        f"60 x 60 cells with four directions have {one['variables']:.0f} variables and "
        f"{one['constraints']:.0f} constraints; two projections a step take twice the paper's "
        f"{theirs:.2f} s, {2 * theirs:.1f} s. "
        f"Two projections here: {', '.join(f'{s} {t}' for s, t in times.items())}.",
    )
