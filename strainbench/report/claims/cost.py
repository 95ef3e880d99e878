"""Claims of Tang et al. (2022) about time and robustness: sections 5 and 6."""

from __future__ import annotations

from strainbench.report.claims.claim import Finding, Verdict, at, claim
from strainbench.report.claims.evidence import Evidence
from strainbench.report.claims.projection import HARD
from strainbench.report.measures import COUNT
from strainbench.report.numbers import power

CONES = ("newton-ipm", "clarabel", "clarabel-default", "clarabel-paper")
FOUR = ",".join(CONES)
MOVING, FROM_REST = "14-22", "1-15"
TIGHT = tuple(
    at(
        "claims/tightness",
        f"run swing --mode replay --frames {frames} --set resolution=20 --set "
        f"limit=20%,5%,1%,0.1% --solver {FOUR},ipopt",
    )
    for frames in (MOVING, FROM_REST)
)
MANY_DIRECTIONS = at(
    "claims/directions",
    "run swing --mode replay --frames 14-20 --set resolution=20 --set limit=20%,1% --set "
    f"directions=4,18 --solver {FOUR} --repeats 3",
)
SMOOTH = at(
    "claims/smooth",
    "run swing --solver newton-ipm,none --set resolution=20 --set limit=10%,1%,0.1% --steps 60",
)
CHAINMAIL = at(
    "claims/chainmail", "run chainmail --solver newton-ipm,clarabel --set resolution=20 --steps 20"
)


@claim(
    "T22",
    "5",
    "The method is robust on all static and dynamic examples.",
    HARD,
    fairness="MOSEK's own scaling.",
)
def robust(seen: Evidence) -> Finding:
    """Cone solvers on scenes made to break methods."""
    cells = seen.cells("failures", scenario="stress")
    cones = ("clarabel", "clarabel-default", "clarabel-paper", "newton-ipm")
    ours = cells[cells["solver"].isin(cones)]
    good = ours["ending"].isin(COUNT).groupby(ours["solver"]).agg(["sum", "size"])
    told = ", ".join(f"{name} {a} of {b}" for name, a, b in good.itertuples())
    missing = [name for name in cones if name not in good.index]
    tail = f" Not measured: {', '.join(missing)}." if missing else ""
    return Finding(
        Verdict.of(bool((good["sum"] == good["size"]).all()), bool(good["sum"].max() > 0)),
        f"Within the limits on the hard cases of `stress`: {told}.{tail}",
    )


@claim(
    "T27",
    "5.1, 6",
    "Tightness from 20% to 0.1% hardly changes the time.",
    *TIGHT,
    fairness="Which frames they timed; presolve.",
)
def tightness(seen: Evidence) -> Finding:
    """Iterations and times in motion, and from rest."""
    names = (*CONES, "ipopt")
    tight, loose = {"limit": 0.001}, {"limit": 0.2}
    by = {
        (mode, column): {
            s: seen.ratio("claims/tightness", column, loose, solver=s, mode=mode, **tight)
            for s in names
        }
        for mode in (f"replay:{MOVING}", f"replay:{FROM_REST}")
        for column in ("iterations_mean", "time")
    }

    def told(mode: str, column: str) -> str:
        return ", ".join(f"{s} {r:.2f}" for s, r in by[mode, column].items())

    cones = [by[f"replay:{MOVING}", "iterations_mean"][s] for s in CONES]
    rest = [by[f"replay:{FROM_REST}", "iterations_mean"][s] for s in CONES]
    return Finding(
        Verdict.of(max(cones) < 1.3 and max(rest) < 1.3, max(cones) < 1.5),
        f"Iterations at 0.1% over those at 20%, in motion (frames 14 to 22): "
        f"{told('replay:14-22', 'iterations_mean')}; from rest (1 to 15): "
        f"{told('replay:1-15', 'iterations_mean')}.",
        f"Times in motion: {told('replay:14-22', 'time')}; from rest: "
        f"{told('replay:1-15', 'time')}.",
    )


@claim(
    "T28",
    "5.1, 6",
    "From 4 to 18 directions takes about 20% more time.",
    MANY_DIRECTIONS,
    fairness="MOSEK's dualised form, whose matrix has the size of 3n whatever the directions; the "
    "limit and size are not told.",
)
def directions(seen: Evidence) -> Finding:
    """Times and iterations with 18 directions over those with 4."""
    few = {"directions": 4}
    ratios = {
        (column, limit, s): seen.ratio(
            "claims/directions", column, few, solver=s, limit=limit, directions=18
        )
        for column in ("time", "iterations_mean")
        for limit in (0.01, 0.2)
        for s in CONES
    }

    def told(column: str, limit: float) -> str:
        found = {s: r for (c, v, s), r in ratios.items() if (c, v) == (column, limit)}
        return ", ".join(f"{s} {r:.1f}" for s, r in found.items())

    least = min(r for (column, *_), r in ratios.items() if column == "time")
    return Finding(
        Verdict.of(least < 1.3),
        f"Times at 1%: {told('time', 0.01)}; at 20%: {told('time', 0.2)}.",
        f"Iterations at 1%: {told('iterations_mean', 0.01)}; at 20%: "
        f"{told('iterations_mean', 0.2)}.",
    )


@claim(
    "T33",
    "6",
    "Animations stay smooth in time even when limits are tight.",
    SMOOTH,
    fairness="One measure of smoothness; the step.",
)
def smooth(seen: Evidence) -> Finding:
    """Jitter by limit."""
    free = seen.one("claims/smooth", solver="none")["jitter"]
    by = {
        v: seen.one("claims/smooth", solver="newton-ipm", limit=v)["jitter"]
        for v in (0.1, 0.01, 0.001)
    }
    return Finding(
        Verdict.of(by[0.001] <= 1.2 * free, by[0.001] <= 2 * free),
        "Change of acceleration in a step over acceleration, root mean squares: "
        f"{free:.2f} without limits, "
        + ", ".join(f"{j:.2f} at {100 * v:g}%" for v, j in by.items())
        + ".",
    )


@claim(
    "T34",
    "6",
    "No limit on compression is needed: cloth buckles out of plane at once.",
    SMOOTH,
    fairness="A coarse mesh locks; a judgement on looks.",
)
def buckles(seen: Evidence) -> Finding:
    """Least principal stretch by limit."""
    by = {
        v: seen.one("claims/smooth", solver="newton-ipm", limit=v)["min_principal_stretch"]
        for v in (0.1, 0.01, 0.001)
    }
    return Finding(
        Verdict.of(min(by.values()) > 0.99, by[0.001] > 0.85),
        "Least principal stretch of any triangle at 20 cells: "
        + ", ".join(f"{s:.2f} at {100 * v:g}%" for v, s in by.items())
        + ": compression stays in elements of this size.",
    )


@claim(
    "T35",
    "Fig. 1, 5",
    "Measured, direction-dependent limits of chainmail can be imposed.",
    CHAINMAIL,
    fairness="Their data are not published.",
)
def chainmail(seen: Evidence) -> Finding:
    """Two solvers within such a curve."""
    cells = seen.cells("claims/chainmail", scenario="chainmail")
    return Finding(
        Verdict.of(bool(cells["ending"].isin(COUNT).all())),
        "; ".join(
            f"{r['solver']} {r['ending']}, violation {power(r['max_violation'])}"
            for _, r in cells.iterrows()
        )
        + ".",
    )


@claim("T36", "4, 6", "Second-order reflection and coarser constraints might help (conjectures).")
def conjectures(_: Evidence) -> Finding:
    """Not implemented."""
    return Finding(Verdict.NOT_TESTABLE, "Neither is implemented.")
