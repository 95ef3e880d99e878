"""Claims of Tang et al. (2022) about the look of motions, and what is left: sections 5 and 6."""

from __future__ import annotations

import pandas as pd

from strainbench.report.claims.claim import Finding, Verdict, at, claim
from strainbench.report.claims.evidence import Evidence, NotThereError
from strainbench.report.claims.sides import or_missing
from strainbench.report.measures import COUNT
from strainbench.report.numbers import power

LOOKS, SMOOTH = "claims/looks", "claims/smooth"
LOOK = "python -m strainbench.studies.looks {} -o results/" + LOOKS + "/{}"
LIMITS = (0.1, 0.01, 0.001)
MOTION = at(
    SMOOTH,
    "run swing --solver newton-ipm,none --set resolution=20 --set limit=10%,1%,0.1% --steps 60",
)
BY_STEP = LOOK.format(
    "swing --solver newton-ipm,none --set resolution=10 --set step=0.0166666667,0.0041666667 --set "
    "limit=10%,1%,0.1% --duration 1",
    "timesteps.csv",
)
BY_SIZE = LOOK.format(
    "swing --set resolution=10,20,40 --set limit=10%,1%,0.1% --duration 0.5", "sizes.csv"
)
CURVES = LOOK.format("chainmail --set pattern=rows,hexagonal --steps 20", "chainmail.csv")
PATTERNS = {"rows": "claims/chainmail", "hexagonal": "claims/patterns"}
AS_SMOOTH = 1.2
"""Times the jitter of the free cloth."""
HARDLY = 0.01
"""A part of the triangles."""


@claim(
    "T33",
    "6",
    "Animations stay smooth in time even when limits are tight.",
    MOTION,
    BY_STEP,
    fairness="One measure of smoothness; the step.",
)
def smooth(seen: Evidence) -> Finding:
    """Jitter by limit, over that of the free cloth."""
    free = seen.one(SMOOTH, solver="none")["jitter"]
    by = {v: seen.one(SMOOTH, solver="newton-ipm", limit=v)["jitter"] for v in LIMITS}
    tight, worst = by[min(by)] / free, max(by.values()) / free
    return Finding(
        Verdict.of(worst <= AS_SMOOTH, tight <= AS_SMOOTH),
        f"Change of acceleration in a step over acceleration, root mean squares: {free:.2f} "
        f"without limits, {_by_limit(by, '.2f')}. {_rougher(by, free)}",
        or_missing(_shorter, seen),
    )


def _by_limit(by: dict[float, float], form: str) -> str:
    return ", ".join(f"{j:{form}} at {100 * v:g}%" for v, j in by.items())


def _rougher(by: dict[float, float], free: float) -> str:
    """Which limits are rougher than none, by how much."""
    found = {v: j / free for v, j in by.items() if j > AS_SMOOTH * free}
    if not found:
        return "None is rougher than the free cloth."
    told = ", ".join(f"{100 * v:g}% is {r:.1f} times rougher" for v, r in found.items())
    return f"{told} than the free cloth."


def _shorter(seen: Evidence) -> str:
    """The same at two steps."""
    rows = seen.table(LOOKS, "timesteps.csv")
    told = [
        f"1/{1 / step:.0f} s {_of(of, 'none'):.2f} without limits, {_by_limit(_jitters(of), '.2f')}"
        for step, of in rows.groupby("step", sort=False)
    ]
    return f"At {rows['resolution'].iloc[0]} cells, by step: {'; '.join(told)}."


def _of(rows: pd.DataFrame, solver: str, **wanted: float) -> float:
    """Jitter of the first such row."""
    own = rows[rows["solver"] == solver]
    for column, value in wanted.items():
        own = own[(own[column] - value).abs() < 1e-9]
    if own.empty:
        raise NotThereError(f"{LOOKS} lacks {solver} {wanted or ''}".rstrip())
    return float(own["jitter"].iloc[0])


def _jitters(rows: pd.DataFrame) -> dict[float, float]:
    return {v: _of(rows, "newton-ipm", limit=v) for v in LIMITS}


@claim(
    "T34",
    "6",
    "No limit on compression is needed: cloth buckles out of plane at once.",
    BY_SIZE,
    MOTION,
    fairness="A coarse mesh locks; a cloth that stretches one way contracts the other by Poisson's "
    "ratio; between sampled directions shear is compression too. A judgement on looks.",
)
def buckles(seen: Evidence) -> Finding:
    """Which part of the triangles is compressed, by limit and mesh."""
    rows = seen.table(LOOKS, "sizes.csv")
    sizes = sorted(rows["resolution"].unique())
    fine = rows[rows["resolution"] == sizes[-1]]
    tight = fine[fine["limit"] == fine["limit"].min()]
    hardly, hardly_tight = (
        bool((of < HARDLY).all()) for of in (fine["below_95"], tight["below_90"])
    )
    when = (
        f" By more than a tenth hardly any is compressed at {100 * fine['limit'].min():g}%."
        if hardly_tight
        else ""
    )
    return Finding(
        Verdict.of(hardly, hardly_tight),
        f"Triangles, over all steps of half a second at {sizes[-1]} cells, whose least principal "
        f"stretch is below .99, .95, .9: {_shares(fine)}.{when}",
        "By mesh: "
        + "; ".join(
            f"{n} cells {_shares(of)}" for n, of in rows.groupby("resolution") if n != sizes[-1]
        )
        + f". {or_missing(_least, seen)}",
    )


def _shares(rows: pd.DataFrame) -> str:
    return ", ".join(
        f"{r['below_99']:.0%}, {r['below_95']:.0%}, {r['below_90']:.1%} at {100 * r['limit']:g}%"
        for _, r in rows.sort_values("limit", ascending=False).iterrows()
    )


def _least(seen: Evidence) -> str:
    least = {
        v: seen.one(SMOOTH, solver="newton-ipm", limit=v)["min_principal_stretch"] for v in LIMITS
    }
    return f"The least of any triangle in a second at 20 cells: {_by_limit(least, '.2f')}."


@claim(
    "T35",
    "Fig. 1, 5",
    "Measured, direction-dependent limits of chainmail can be imposed.",
    *(
        at(
            folder,
            f"run chainmail --solver newton-ipm,clarabel --set resolution=20{more} --steps 20",
        )
        for folder, more in zip(PATTERNS.values(), ("", " --set pattern=hexagonal"), strict=True)
    ),
    CURVES,
    fairness="Their data are not published: the curves are ours, of two patterns as theirs are.",
)
def chainmail(seen: Evidence) -> Finding:
    """Two solvers within such curves."""
    cells = {name: _pattern(seen, name) for name in PATTERNS}
    known = pd.concat([of for of in cells.values() if of is not None] or [pd.DataFrame()])
    if known.empty:
        raise NotThereError(f"{PATTERNS['rows']} holds no results")
    missing = [name for name, of in cells.items() if of is None]
    return Finding(
        Verdict.of(bool(known["ending"].isin(COUNT).all())),
        "; ".join(
            f"{r['pattern']}: {r['solver']} {r['ending']}, violation {power(r['max_violation'])}"
            for _, r in known.iterrows()
        )
        + (f"; not measured yet: {', '.join(missing)}" if missing else "")
        + ".",
        or_missing(_beyond, seen),
    )


def _pattern(seen: Evidence, name: str) -> pd.DataFrame | None:
    try:
        return seen.cells(PATTERNS[name], scenario="chainmail", pattern=name)
    except NotThereError:
        return None


def _beyond(seen: Evidence) -> str:
    rows = seen.table(LOOKS, "chainmail.csv")
    told = ", ".join(f"{power(max(r['beyond'], 0.0))} ({r['pattern']})" for _, r in rows.iterrows())
    few = ", ".join(f"{n}" for n in rows["directions"].unique())
    return (
        f"The curve in place of its {few} samples: at 180 angles the stretch is beyond it by at "
        f"most {told}, of strains of up to {rows['limit'].max():g}."
    )


@claim("T36", "4, 6", "Second-order reflection and coarser constraints might help (conjectures).")
def conjectures(_: Evidence) -> Finding:
    """Not implemented."""
    return Finding(Verdict.NOT_TESTABLE, "Neither is implemented.")
