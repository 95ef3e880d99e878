"""Claims of Tang et al. (2022) about cost: sections 1, 3.3, 5.1 and 6."""

from __future__ import annotations

import pandas as pd

from strainbench.report.claims.claim import Finding, Verdict, at, claim
from strainbench.report.claims.evidence import Evidence, NotThereError
from strainbench.report.claims.projection import CONES, FIELD, FRAMES, ON_FRAMES, TIGHTNESS, ended
from strainbench.report.claims.reading import loads, time_over
from strainbench.report.claims.sides import or_missing
from strainbench.report.measures import COUNT, duration

FOUR = ",".join(CONES)
PROGRAMS = "claims/programs"
MUCH = 5.0  # times
MOVING, FROM_REST = "replay:14-22", "replay:1-15"
TIGHT = (
    *(
        at(
            TIGHTNESS,
            f"run swing --mode replay --frames {frames.removeprefix('replay:')} --set "
            f"resolution=20 --set limit=20%,5%,1%,0.1% --solver {FOUR},ipopt",
        )
        for frames in (MOVING, FROM_REST)
    ),
    at(
        TIGHTNESS,
        "run swing --mode replay --frames 14-16 --set resolution=40 --set limit=20%,0.1% --solver "
        "newton-ipm,clarabel,clarabel-default",
    ),
)
DIRECTIONS = "claims/directions"
MANY_DIRECTIONS = (
    *(
        at(
            DIRECTIONS,
            f"run swing --mode replay --frames 14-20 --set resolution={n} --set limit=20%,1% "
            f"--set directions=4,18 --solver {FOUR} --repeats 3",
        )
        for n in (20, 10)
    ),
    at(
        DIRECTIONS,
        "run swing --mode replay --frames 14-16 --set resolution=20 --set offset=22.5 --set "
        f"directions=4,18 --solver {FOUR} --repeats 2",
    ),
)


@claim(
    "T5",
    "1, 3.3",
    "A cone program is much cheaper than general nonlinear programming.",
    at(PROGRAMS, f"{FRAMES} --solver clarabel,clarabel-default,clarabel-paper,ipopt --repeats 3"),
    ON_FRAMES,
    fairness="MUMPS against MA57; which Hessian and scaling their Ipopt was given is not written.",
)
def cheaper_than_nlp(seen: Evidence) -> Finding:
    """Ipopt, scaled and out of the box, beside the cone solver."""
    ipopt, clarabel, literal = (_timed(seen, s) for s in ("ipopt", "clarabel", "clarabel-paper"))
    over, over_literal = (ipopt["time"] / c["time"] for c in (clarabel, literal))
    exact, lbfgs = (seen.one(FIELD, solver=f"ipopt-default{s}") for s in ("", "-lbfgs"))
    default = lbfgs["time"] / seen.one(FIELD, solver="clarabel-default")["time"]
    much = default > MUCH or lbfgs["ending"] not in COUNT
    return Finding(
        Verdict.of(min(over, over_literal) > MUCH, much or over > 1),
        f"In edge lengths, with the exact Hessian, Ipopt takes {over:.1f} times as long as "
        f"Clarabel and {over_literal:.2f} times as long as Eq. 12 to the letter."
        f"{loads([ipopt, clarabel, literal])} Out of the box it ends {ended(exact)} with the "
        f"exact Hessian; with L-BFGS {ended(lbfgs)}, in {duration(lbfgs['time'])}, {default:.0f} "
        f"times as long as Clarabel out of the box. {_class(over, over_literal)}".strip(),
        "Iterations, and an iteration: "
        + "; ".join(_iterations(c) for c in (ipopt, clarabel, literal))
        + f". {or_missing(_to_gap, seen)}",
    )


def _timed(seen: Evidence, solver: str) -> pd.Series:
    """Of the repeated cells; where they are not there, of the same frames for another claim."""
    try:
        return seen.one(PROGRAMS, solver=solver)
    except NotThereError:
        return seen.one(TIGHTNESS, solver=solver, mode="replay:14-22", limit=0.01)


def _class(over: float, over_literal: float) -> str:
    """Said where the form of the cone program matters more than that it is one."""
    if over_literal > 1:
        return ""
    slower = "as slow" if over_literal > 0.9 else "the slower"
    faster = f"; with a quadratic objective it is {over:.1f} times faster" if over > 1 else ""
    return (
        f"As printed the cone program is {slower}{faster}: form, scaling and Hessian decide, "
        "beside the class of problem."
    )


def _iterations(cell: pd.Series) -> str:
    count = cell["iterations_mean"]
    return f"{cell['solver']} {count:.0f}, {duration(cell['solve_seconds_mean'] / count)}"


def _to_gap(seen: Evidence) -> str:
    ratio = time_over(seen, "ipopt", "clarabel", "relative_gap", 1e-6)
    return (
        f"On another frame (`results/convergence`) Ipopt takes {ratio:.1f} times as long as "
        "Clarabel to a gap of 1e-6."
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
    counts = {mode: _tight(seen, mode, "iterations_mean") for mode in (MOVING, FROM_REST)}
    times = {mode: _tight(seen, mode, "time") for mode in (MOVING, FROM_REST)}
    moving, rest = (max(counts[mode][s] for s in CONES) for mode in (MOVING, FROM_REST))
    lead = (
        "Once the cloth moves, tightness costs next to nothing."
        if moving < HARDLY
        else "Tightness costs iterations in motion too."
    )
    cells = seen.cells(TIGHTNESS, resolution=20, limit=(0.2, 0.001), mode=(MOVING, FROM_REST))
    timed = cells[cells["solver"].isin((*CONES, "ipopt"))]
    return Finding(
        Verdict.of(moving < HARDLY and rest < HARDLY, moving < HARDLY),
        f"{lead} Iterations at 0.1% over those at 20%, in motion (frames 14 to 22): "
        f"{_by_solver(counts[MOVING])}; from rest (1 to 15): {_by_solver(counts[FROM_REST])}, "
        f"where {_active(seen, 0.2):.0%} of the limits are active at 20%, "
        f"{_active(seen, 0.001):.0%} at 0.1%.",
        f"Times in motion: {_by_solver(times[MOVING])}; from rest: {_by_solver(times[FROM_REST])}."
        f"{loads(timed)} {or_missing(_larger, seen)}",
    )


HARDLY = 1.3  # times


def _tight(
    seen: Evidence,
    mode: str,
    column: str,
    solvers: tuple[str, ...] = (*CONES, "ipopt"),
    resolution: int = 20,
) -> dict[str, float]:
    """A column at 0.1% over that at 20%, by solver."""
    of = {"mode": mode, "resolution": resolution, "limit": 0.001}
    return {s: seen.ratio(TIGHTNESS, column, {"limit": 0.2}, solver=s, **of) for s in solvers}


def _by_solver(ratios: dict[str, float], form: str = ".2f") -> str:
    return ", ".join(f"{s} {r:{form}}" for s, r in ratios.items())


def _active(seen: Evidence, limit: float) -> float:
    """The part of the limits that are active at the optimum from rest, over the frames."""
    cells = seen.cells(TIGHTNESS, solver="newton-ipm", mode=FROM_REST, limit=limit, resolution=20)
    active = seen.steps(TIGHTNESS, cells, "active_constraints").mean()
    return float(active / cells["constraints"].iloc[-1])


def _larger(seen: Evidence) -> str:
    names = ("newton-ipm", "clarabel", "clarabel-default")
    ratios = _tight(seen, "replay:14-16", "iterations_mean", names, 40)
    return f"At 40 cells (frames 14 to 16), iterations: {_by_solver(ratios)}."


@claim(
    "T28",
    "5.1, 6",
    "From 4 to 18 directions changes the time slightly, by about 20%.",
    *MANY_DIRECTIONS,
    fairness="The limit and size are not told. A guess, MOSEK being untested: it may solve the "
    "dual, whose matrix has the size of 3n whatever the directions.",
)
def directions(seen: Evidence) -> Finding:
    """Times and iterations with 18 directions over those with 4."""
    settings = {f"{100 * v:g}%": {"limit": v, "resolution": 20, "offset": 0.0} for v in (0.01, 0.2)}
    times = {name: _more(seen, "time", **of) for name, of in settings.items()}
    counts = {name: _more(seen, "iterations_mean", **of) for name, of in settings.items()}
    of_3n = min(by["newton-ipm"] for by in times.values())
    guess = (
        f" newton-ipm's matrix has the size of 3n whatever the directions, and it takes "
        f"{of_3n:.1f} times or more: such a matrix alone does not explain 20%."
    )
    least = min(min(by.values()) for by in times.values())
    return Finding(
        Verdict.of(least < HARDLY),
        "Times with 18 over those with 4, "
        + "; ".join(f"at {name}: {_by_solver(by, '.1f')}" for name, by in times.items())
        + f".{guess if of_3n > HARDLY else ''}",
        "Iterations, "
        + "; ".join(f"at {name}: {_by_solver(by, '.1f')}" for name, by in counts.items())
        + f". {or_missing(_elsewhere, seen)}",
    )


def _more(seen: Evidence, column: str, **of: object) -> dict[str, float]:
    few = {"directions": 4}
    return {s: seen.ratio(DIRECTIONS, column, few, solver=s, directions=18, **of) for s in CONES}


def _elsewhere(seen: Evidence) -> str:
    """Times on a coarse mesh, and with directions that are turned."""
    at = {
        "at 10 cells, 1%": {"resolution": 10, "limit": 0.01, "offset": 0.0},
        "at 10 cells, 20%": {"resolution": 10, "limit": 0.2, "offset": 0.0},
        "at 20 cells, 1%, directions turned by 22.5 degrees": {
            **{"resolution": 20, "limit": 0.01, "offset": 22.5}
        },
    }
    return (
        "Times "
        + "; ".join(f"{k}: {_by_solver(_more(seen, 'time', **of), '.1f')}" for k, of in at.items())
        + "."
    )
