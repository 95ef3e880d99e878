"""Claims of Tang et al. (2022) about step-and-project and step-and-reflect: section 4, Fig. 4."""

from __future__ import annotations

from itertools import product

import numpy as np

from strainbench.report.claims.claim import Finding, Verdict, at, claim
from strainbench.report.claims.evidence import Evidence, NotThereError
from strainbench.report.claims.sides import fraction, in_steps, listed, or_missing, unsteady

FIG4 = "run swing --solver {} --set resolution=20 --set step=0.01 --steps 200"
SAP = at("fig4", FIG4.format("newton-ipm"))
SHORT = at("fig4", "run swing --solver newton-ipm --set resolution=20 --set step=0.005 --steps 400")
SCHEMES = at(
    "fig4",
    FIG4.format("newton-ipm")
    + " --set integrator=sap,sar,bap,bar,bar-bdf2,bar-stable,sar-projected",
)
FREE = at("fig4", FIG4.format("none"))
OURS = {"solver": "newton-ipm"}
LONG = "claims/long"
SHORTEST = at(
    LONG, "run swing --solver newton-ipm --set resolution=20 --set step=0.0025 --duration 2"
)
LONG_RUNS = at(
    LONG,
    "run swing --solver newton-ipm --set resolution=10 --set integrator=sap,sar --set "
    "step=0.01,0.001 --duration 2",
)
SETTINGS = "claims/schemes"
_SWING = "run swing --solver newton-ipm --set resolution="
_BOTH = " --set norm=unweighted,mass --set diagonals=alternating,uniform"
MANY = tuple(
    at(SETTINGS, _SWING + words + " --duration 1")
    for words in (
        f"10 --set integrator=sap,sar,sar-projected{_BOTH} --set step=0.01,0.005",
        f"20 --set integrator=sap{_BOTH} --set step=0.01,0.005",
        f"20 --set integrator=sar,sar-projected{_BOTH} --set step=0.01",
        "10 --set integrator=sap --set limit=10%,0.1% --set step=0.01,0.005",
        "10 --set integrator=sar,sar-projected --set limit=10%,0.1% --set step=0.01",
        "10 --set integrator=sap --set step=0.0166666667,0.0083333333",
        "10 --set integrator=sar,sar-projected --set step=0.0166666667",
    )
)
Setting = tuple[int, str, str, float, float, float]
"""Cells, norm, diagonals, limit, step [s] and half the step."""
PRINTED: Setting = (10, "unweighted", "alternating", 0.01, 0.01, 0.005)
MASS: Setting = (10, "mass", "alternating", 0.01, 0.01, 0.005)
ALL: tuple[Setting, ...] = (
    *(
        (n, norm, diagonals, 0.01, 0.01, 0.005)
        for n, norm, diagonals in product(
            (10, 20), ("unweighted", "mass"), ("alternating", "uniform")
        )
    ),
    *((10, "unweighted", "alternating", limit, 0.01, 0.005) for limit in (0.1, 0.001)),
    (10, "unweighted", "alternating", 0.01, 0.0166666667, 0.0083333333),
)
RUNS = {
    "SAP": ("sap", False),
    "SAR": ("sar", False),
    "SAP at half the step": ("sap", True),
    "SAR with line 8 from the projected positions": ("sar-projected", False),
}
"""Schemes, and whether they take half the step."""


@claim(
    "T14",
    "4",
    "Step-and-project is stable, but dissipative.",
    SAP,
    SHORT,
    SHORTEST,
    fairness="Their step is not written.",
)
def dissipative(seen: Evidence) -> Finding:
    """Energy that is lost, by step."""
    first = {**OURS, "integrator": "sap", "step": 0.01}
    long, short = (seen.energy_at("fig4", 2.0, **{**first, "step": s}) for s in (0.01, 0.005))
    rises = unsteady(seen, "fig4", 2.0, **first)[0]
    top = float(seen.energy("fig4", **first)["energy"].max())
    calm = top <= 0
    return Finding(
        Verdict.of(calm and long < 0 and short < 0),
        f"In steps of {fraction(0.01)} s it has {long:.1f} mJ at 2 s of the 0 that it began with, "
        f"never more than {top:.1f} on the way; all its rises come to {rises:.2f}.",
        or_missing(lambda: _by_step(seen, long, short)),
    )


def _by_step(seen: Evidence, long: float, short: float) -> str:
    half = f"In half the step it loses {short / long:.2f} times as much"
    try:
        shortest = seen.energy_at(LONG, 2.0, step=0.0025, resolution=20, **OURS)
    except NotThereError as missing:
        return f"{half}. Not measured yet: {missing}."
    falls = "falls with the step" if long < short < shortest else "does not fall with the step"
    return (
        f"{half}, in half of that {shortest / short:.2f} times: the loss {falls} "
        f"({listed([long, short, shortest])} mJ)."
    )


@claim(
    "T15",
    "4, Fig. 4",
    "Implicit Euler without limits loses energy faster than step-and-project.",
    FREE,
    SAP,
    fairness="The unlimited cloth comes to rest lower; the step.",
)
def free_cloth(seen: Evidence) -> Finding:
    """Early and late; by motion alone."""
    who = {"free": {"solver": "none"}, "sap": OURS}
    cell = {"integrator": "sap", "step": 0.01}
    energy = {
        (name, time): seen.energy_at("fig4", time, **cell, **of)
        for name, of in who.items()
        for time in (0.4, 2.0)
    }
    moving, low = {}, {}
    for name, of in who.items():
        steps = in_steps(seen, "fig4", ("time", "kinetic_energy", "gravity_energy"), **cell, **of)
        moving[name] = 1000 * steps["kinetic_energy"][steps["time"].between(1, 2)].mean()
        low[name] = 1000 * steps["gravity_energy"].iloc[-1]
    early, late = (energy["free", t] < energy["sap", t] for t in (0.4, 2.0))
    slower = moving["free"] < moving["sap"]
    lower = "it hangs lower" if low["free"] < low["sap"] else "it does not hang lower"
    motion = "it moves less, too" if slower else "by its motion it is the reverse"
    return Finding(
        Verdict.of(bool(early and late and slower), late),
        f"Total energy of the unlimited and the limited cloth at 2 s {energy['free', 2.0]:.1f} and "
        f"{energy['sap', 2.0]:.1f} mJ, at 0.4 s {energy['free', 0.4]:.1f} and "
        f"{energy['sap', 0.4]:.1f}.",
        f"Gravity's part at the end is {low['free']:.0f} and {low['sap']:.0f} mJ ({lower}), the "
        f"mean kinetic energy from 1 to 2 s {moving['free']:.1f} and {moving['sap']:.1f} mJ: "
        f"{motion}.",
    )


def _energies(seen: Evidence, of: Setting) -> dict[str, float]:
    return {name: seen.energy_at(SETTINGS, 1.0, **_cell(of, name)) for name in RUNS}


def _cell(of: Setting, name: str) -> dict[str, object]:
    n, norm, diagonals, limit, step, half = of
    scheme, halved = RUNS[name]
    setting = {"resolution": n, "norm": norm, "diagonals": diagonals, "limit": limit}
    return {**OURS, **setting, "integrator": scheme, "step": half if halved else step}


@claim(
    "T16",
    "abstract, 4, Fig. 4",
    "Step-and-reflect conserves more energy than step-and-project.",
    *MANY,
    fairness="They compare at an equal step, which has step-and-reflect project twice as often. "
    "Line 8 as printed takes the velocity from the reflected positions: perhaps a misprint.",
)
def reflect(seen: Evidence) -> Finding:
    """At an equal step, and at an equal number of projections, in each setting."""
    found, missing = {}, 0
    for setting in ALL:
        try:
            found[setting] = _energies(seen, setting)
        except NotThereError:
            missing += 1
    if PRINTED not in found:
        raise NotThereError(f"{SETTINGS} lacks the unweighted norm with alternating diagonals")
    sap, sar, half, projected = RUNS
    n = len(found)
    equal, twice = (sum(e[sar] > e[name] for e in found.values()) for name in (sap, half))
    better = sum(e[projected] > e[half] for e in found.values())
    lacking = f" {missing} more are not measured yet." if missing else ""
    return Finding(
        Verdict.of(equal == twice == n, equal == n),
        f"At an equal step in {equal} of {n} settings ({_varied(list(found))}); at an equal number "
        f"of projections in {twice} of {n}.{lacking} Unweighted, "
        "alternating, 10 cells, at 1 s: "
        + ", ".join(f"{energy:.1f} mJ ({name})" for name, energy in found[PRINTED].items())
        + ".",
        f"With line 8 from the projected positions it beats SAP at half the step in {better} of "
        f"{n}. " + or_missing(lambda: _rises(seen)),
    )


def _varied(settings: list[Setting]) -> str:
    """The values that tell settings apart."""
    n, norms, diagonals, limits, steps, _ = map(sorted, map(set, zip(*settings, strict=True)))
    return (
        f"{' and '.join(map(str, n))} cells, {' and '.join(norms)} norm, "
        f"{' and '.join(diagonals)} diagonals, limits of "
        f"{', '.join(f'{100 * limit:g}%' for limit in limits)}, steps of "
        f"{', '.join(map(fraction, steps))} s"
    )


def _rises(seen: Evidence) -> str:
    printed, mass = (
        [unsteady(seen, SETTINGS, 1.0, **_cell(of, name))[0] for name in RUNS]
        for of in (PRINTED, MASS)
    )
    adds = "adds" if max(printed) > 2 * max(mass) else "does not add"
    return (
        f"All rises of these four to 1 s come to {listed(printed, '.2f')} mJ in the printed, "
        f"unweighted norm, and to {listed(mass, '.2f')} in that of the masses: the first {adds} "
        "energy."
    )


def to_1_2(seen: Evidence, solver: str, scheme: str) -> tuple[float, float, int]:
    """Rises, roughness and turns of a run of Fig. 4 to 1.2 s."""
    return unsteady(seen, "fig4", 1.2, solver=solver, integrator=scheme, step=0.01)


@claim(
    "T17",
    "4",
    "Step-and-reflect's energy oscillates slightly about a smooth curve, unlike implicit Euler's "
    "and step-and-project's.",
    SCHEMES,
    FREE,
    fairness="Line 8's velocity is that of a point off the limits, odd in one step, even in the "
    "next.",
)
def oscillates(seen: Evidence) -> Finding:
    """Second differences and turns of the energy."""
    free, sap, sar, projected = (
        to_1_2(seen, *who)
        for who in (
            *(("none", "sap"), ("newton-ipm", "sap")),
            *(("newton-ipm", "sar"), ("newton-ipm", "sar-projected")),
        )
    )
    return Finding(
        Verdict.of(sar[1] > 2 * sap[1] and sar[2] > sap[2]),
        f"Root mean square of second differences to 1.2 s: {free[1]:.3f} (IE), {sap[1]:.3f} (SAP), "
        f"{sar[1]:.3f} mJ (SAR).",
        f"The energy turns {free[2]}, {sap[2]} and {sar[2]} times; with line 8 from the projected "
        f"positions {projected[2]} times, with {projected[1]:.3f} mJ.",
    )


@claim(
    "T18",
    "4",
    "This resembles the behaviour of symplectic methods (a conjecture).",
    SCHEMES,
    LONG_RUNS,
    fairness="The wording is a conjecture. A symplectic method's energy goes up and down about a "
    "level that it keeps.",
)
def symplectic(seen: Evidence) -> Finding:
    """Whether the level of the energy is kept over the run."""
    sar = {**OURS, "integrator": "sar"}
    means, turns = _quarters(seen, "fig4", {**sar, "step": 0.01})
    try:
        fine = _quarters(seen, LONG, {**sar, "step": 0.001, "resolution": 10})[0]
        sap = _quarters(seen, LONG, {**sar, "integrator": "sap", "step": 0.001})[0]
        keeps = not _falls(fine)
        second = (
            f"In steps of 1/1000 s, at 10 cells: {listed(fine)} mJ; step-and-project {listed(sap)}."
        )
    except NotThereError as missing:
        keeps, second = False, f"Not measured yet: {missing}."
    how = "its level falls from each to the next" if _falls(means) else "its level is kept"
    supported = "" if keeps or not _falls(means) else "Not supported. "
    return Finding(
        Verdict.of(not _falls(means) and keeps, not _falls(means) or keeps),
        f"{supported}It turns {turns} times; {how}: means over the quarters of 2 s "
        f"{listed(means)} mJ.",
        second,
    )


def _quarters(seen: Evidence, folder: str, wanted: dict[str, object]) -> tuple[list[float], int]:
    energy = seen.energy(folder, **wanted)["energy"].to_numpy()
    turns = unsteady(seen, folder, np.inf, **wanted)[2]
    return [float(part.mean()) for part in np.array_split(energy, 4)], turns


def _falls(means: list[float]) -> bool:
    return bool(np.all(np.diff(means) < 0))
