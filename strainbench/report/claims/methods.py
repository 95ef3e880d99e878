"""Claims of Tang et al. (2022) about other methods: sections 1 and 2."""

from __future__ import annotations

import pandas as pd

from strainbench.report.claims.claim import Finding, Verdict, at, claim
from strainbench.report.claims.evidence import Evidence, NotThereError
from strainbench.report.claims.projection import FIELD, FRAMES, ON_FRAMES
from strainbench.report.claims.reading import loads, time_over
from strainbench.report.claims.sides import or_missing
from strainbench.report.measures import COUNT, OPTIMAL, VIOLATED, digits, length
from strainbench.report.names import settings
from strainbench.report.numbers import power
from strainbench.report.steps import newest_steps

LINEARISED, EDGES = "claims/linearised", "claims/edges"
BASIC_HARD = at(
    "failures",
    "run stress --solver clarabel,clarabel-default,clarabel-paper,newton-ipm,fast-projection,"
    "gauss-seidel --set case=slivers,mass-ratio,displaced --set severity=1,0.1 --set "
    "resolution=10 --time-limit 10 --steps 1",
)
PAIR = ("fast-projection", "gauss-seidel")


@claim(
    "T6",
    "1",
    "Local iterations converge very slowly, above all when limits are tight.",
    at(
        "sweeps",
        "run swing --solver gauss-seidel,clarabel --set resolution=20 --set "
        "limit=20%,10%,5%,2%,1%,0.5%,0.1% --steps 15",
    ),
    fairness="Order of sweeps, relaxation, and their strain entries in place of directions.",
)
def local_iterations(seen: Evidence) -> Finding:
    """Sweeps and seconds of Gauss-Seidel by limit."""
    at = {v: seen.one("sweeps", solver="gauss-seidel", limit=v, directions=4) for v in (0.2, 0.001)}
    sweeps = [at[v]["iterations_mean"] for v in (0.2, 0.001)]
    slower = at[0.001]["solve_seconds_mean"] / at[0.2]["solve_seconds_mean"]
    return Finding(
        Verdict.of(sweeps[1] > 10 * sweeps[0], sweeps[1] > 2 * sweeps[0]),
        f"From 20% to 0.1% its time grows {slower:.0f} times, ending {at[0.001]['ending']}.",
        f"Sweeps in place of seconds: {sweeps[0]:.0f} to {sweeps[1]:.0f} a projection.",
    )


@claim(
    "T7",
    "1, 2",
    "Coupling all constraints is faster than one element after the other; fast projection has no "
    "guarantee.",
    ON_FRAMES,
    "make bench-paper PAPER=results/paper",
    BASIC_HARD,
    fairness="Weights of the masses; their line search.",
)
def coupling(seen: Evidence) -> Finding:
    """Fast projection beside Gauss-Seidel, and where masses differ by 1e4."""
    fast, local = (seen.one(FIELD, solver=s) for s in PAIR)
    hard = seen.one("failures", scenario="stress", case="mass-ratio", severity=1.0, solver=PAIR[0])
    ratios = {"frames 14 to 22": local["time"] / fast["time"], **_slower(seen)}
    faster = sum(ratio > 1 for ratio in ratios.values())
    fails = hard["ending"] == VIOLATED
    return Finding(
        Verdict.of(faster == len(ratios) and fails, faster > 0),
        f"Fast projection is faster in {faster} of {len(ratios)} cells in which both end within "
        "the limits. Gauss-Seidel's time over its: "
        + ", ".join(f"{digits(r)} ({name})" for name, r in ratios.items())
        + f".{loads([fast, local])} They stop {length(1000 * fast['distance_max'])} (fast) and "
        f"{length(1000 * local['distance_max'])} from the projection (frames 14 to 22). At a mass "
        f"ratio of 1e4 fast projection is {hard['ending']} ({hard['why']}).",
        or_missing(_equally_far, seen),
    )


def _slower(seen: Evidence) -> dict[str, float]:
    """Gauss-Seidel's time over fast projection's in the closed loops of `paper`; none without."""
    try:
        cells = seen.cells("paper", solver=PAIR, scenario="swing")
    except NotThereError:
        return {}
    within = cells[cells["ending"].isin(COUNT)]
    times = within.pivot_table("time", ["resolution", "limit"], "solver", aggfunc="last")
    both = times.reindex(columns=list(PAIR)).dropna()
    slower = both[PAIR[1]] / both[PAIR[0]]
    return {f"{n} cells, {100 * v:g}%": float(r) for (n, v), r in slower.items()}


def _equally_far(seen: Evidence) -> str:
    """On one frame: to a violation, and to the distance at which fast projection stops."""
    samples = seen.table("convergence", "convergence.csv").set_index("solver")
    stops = 1.001 * float(samples.loc[PAIR[0], "distance"].iloc[-1])
    to = (("max_violation", 1e-6), ("distance", stops))
    ratios = [time_over(seen, PAIR[1], PAIR[0], measure, level) for measure, level in to]
    return (
        f"On one frame (`results/convergence`) Gauss-Seidel takes {digits(ratios[0])} times as "
        f"long as fast projection to a violation of 1e-6, but {digits(ratios[1])} times to the "
        f"distance from the projection at which that one stops, {length(1000 * stops)}."
    )


@claim(
    "T8",
    "2",
    "Linearised formulations cannot guarantee that limits are enforced tightly.",
    ON_FRAMES,
    at(LINEARISED, f"{FRAMES} --solver linearized-qp --set linearized-qp.max_steps=1,2,4,8"),
    fairness="Their budget of projected Gauss-Seidel; a trust region.",
)
def linearised(seen: Evidence) -> Finding:
    """Violation after one linearisation and after many."""
    cells = seen.cells(LINEARISED)
    worst = cells.sort_values("iterations_mean")["max_violation"]
    many = seen.one(FIELD, solver="linearized-qp")["max_violation"]
    return Finding(
        Verdict.of(many > 1e-6, worst.iloc[0] > 1e-3),
        f"Linearised once, limits are violated by {power(worst.iloc[0])}; repeated to convergence "
        f"by {power(many)}.",
        "After 1, 2, 4, 8 linearisations: " + ", ".join(power(v) for v in worst) + ".",
    )


@claim(
    "T9",
    "2",
    "Jin et al. need relaxation to keep away from bad local minima.",
    ON_FRAMES,
    at(
        EDGES,
        "run swing --mode replay --frames 14-20 --set resolution=10 --solver ipopt-edges --set "
        "ipopt-edges.lower=0,0.9 --set ipopt-edges.warm=false,true --time-limit 60",
    ),
    at(
        EDGES,
        "run stretch-square --set resolution=6,10 --steps 1 --solver ipopt-edges --solver "
        "results/claims/edges/ipopt_edges_noisy.py --set ipopt-edges.lower=0,0.9 --set "
        "ipopt-edges-noisy.lower=0,0.9 --time-limit 60",
    ),
    fairness="Their active-set iteration is not here, only their limits on edges: whether it needs "
    "relaxation is not tested, only whether there are local minima to keep away from.",
)
def edges(seen: Evidence) -> Finding:
    """What limits on edge lengths allow, and whether they have local minima."""
    found = seen.one(FIELD, solver="ipopt-edges")
    other = (
        "Limits on edges are another set: their optimum violates those on directions by "
        f"{power(found['max_violation'])}, {length(1000 * found['distance_max'])} away."
    )
    try:
        apart = {lower: _apart(seen, lower) for lower in (0.0, 0.9)}
    except NotThereError as missing:
        convex = "Upper limits on edges alone are convex, so that they have no local minima."
        return Finding(Verdict.NOT_TESTABLE, f"{convex} Not measured yet: {missing}.", other)
    minima = {lower: int((of > TWO_MINIMA).sum()) for lower, of in apart.items()}
    told = "; ".join(_minima(lower, of, minima[lower]) for lower, of in apart.items())
    verdict = Verdict.CONDITIONS if minima[0.9] and not minima[0.0] else Verdict.NOT_TESTABLE
    return Finding(
        verdict,
        "Limits on edges, Ipopt from two starts, the candidate and the frame before, or one with "
        f"noise: {told}. Upper limits alone, as they have them, are convex.",
        other,
    )


TWO_MINIMA = 1e-3
"""Of objectives, relatively, from which on two answers are two minima."""


def _minima(lower: float, apart: pd.Series, unlike: int) -> str:
    name = f"lower ones of {lower:g} as well" if lower else "upper limits alone"
    scenes = ", ".join(dict.fromkeys(apart.index[apart > TWO_MINIMA].get_level_values("scenario")))
    return (
        f"{name}, objectives differ in {unlike} of {len(apart)} problems"
        + (f" ({scenes})" if unlike else "")
        + f", by up to {power(float(apart.max()))} of them"
    )


def _apart(seen: Evidence, lower: float) -> pd.Series:
    """For each problem by how much the solved answers' objectives differ, relatively."""
    cells = seen.cells(EDGES)
    own = cells[[settings(text).get("lower") == lower for text in cells["solver_parameters"]]]
    steps = newest_steps(seen.root / EDGES, own)
    solved = steps[steps["status"].str.startswith("solved")]
    of = solved.merge(own[["cell", "scenario", "resolution"]], on="cell")
    objectives = of.assign(objective=pd.to_numeric(of["objective"]))
    found = objectives.groupby(["scenario", "resolution", "step"])["objective"]
    most, least = found.max(), found.min()
    apart = ((most - least) / most.where(most > 0))[found.size() > 1].dropna()
    if apart.empty:
        raise NotThereError(f"{EDGES} holds no problem with two answers, lower {lower:g}")
    return apart


@claim(
    "T10",
    "2",
    "ADMM applies too.",
    ON_FRAMES,
    at(
        "directions",
        "run swing --solver newton-ipm,clarabel,admm,gauss-seidel-principal --mode replay --set "
        "resolution=10 --set directions=2,4,8,18,36,exact --steps 10 --time-limit 60",
    ),
    fairness="Penalty weights.",
)
def admm(seen: Evidence) -> Finding:
    """The same optimum."""
    found, ours = (seen.one(FIELD, solver=s) for s in ("admm", "clarabel"))
    return Finding(
        Verdict.of(found["ending"] == OPTIMAL),
        f"ADMM ends {found['ending']}, {length(1000 * found['distance_max'])} from the optimum, in "
        f"{found['time'] / ours['time']:.1f} times Clarabel's time.{loads([found, ours])} "
        f"{or_missing(_more_directions, seen)}",
        or_missing(_to_gap, seen),
    )


def _more_directions(seen: Evidence) -> str:
    """What 18 directions cost beside 4, at 10 cells."""
    over = {
        s: seen.ratio("directions", "time", {"directions": 4}, solver=s, directions=18)
        for s in ("admm", "clarabel")
    }
    many = [seen.one("directions", solver="admm", directions=n) for n in (18, 36)]
    ended = ", ".join(f"{r['directions']} {r['ending']} {r['why']}".strip() for r in many)
    return (
        f"From 4 to 18 directions (10 cells) its time grows {over['admm']:.0f} times, Clarabel's "
        f"{over['clarabel']:.1f} times; by directions: {ended}."
    )


def _to_gap(seen: Evidence) -> str:
    """Seconds to equal gaps, on one frame."""
    ratios = [
        time_over(seen, "admm", "clarabel", "relative_gap", gap) for gap in (1e-2, 1e-4, 1e-6)
    ]
    return (
        "On one frame (`results/convergence`) its time to a gap of 1e-2, 1e-4, 1e-6 is "
        f"{', '.join(digits(r) for r in ratios)} times Clarabel's."
    )
