"""Claims of Hernandez et al. (2013) about the collapsing beam (Fig. 4) and the finger (Fig. 3)."""

from __future__ import annotations

import numpy as np
import pandas as pd

from strainbench.report.claims.claim import Finding, Verdict, claim
from strainbench.report.claims.evidence import Evidence, NotThereError
from strainbench.report.numbers import power

VOLUMES = "python -m strainbench.studies.volumes --step 1,5,20 --resolution 2,4 -o results/volumes"
LIMIT = 0.05
STEPS = (1.0, 5.0, 20.0)  # [ms]
LOAD = 20.0  # [N]
PRESSES, MATERIALS = ("flat", "side", "tip"), ("anisotropic", "isotropic")
STIFFER = 1.5  # times, in force or in depth
TETRAHEDRA = {2: "200", 4: "1,600"}  # by cells across
READINGS = ("linear", "ellipsoid")
COLLAPSED, EXCESS = 0.7, 1.2  # height [m] and transverse stretch of a beam that has collapsed
FEW, MANY = 5, 40  # rows, of the paper's words


def _first(seen: Evidence, limits: str, step: float, resolution: int = 2) -> pd.Series:
    """Time [ms], height [m] and transverse stretch of the first violated step (Fig. 4)."""
    table = seen.table("volumes", "fig4.csv")
    of_mesh = table[table["resolution"] == resolution]
    rows = of_mesh[(of_mesh["limits"] == limits) & (of_mesh["step_ms"] == step)]
    if rows.empty:
        raise NotThereError(f"volumes holds no {limits} limits at {step:g} ms")
    return rows.iloc[0]


def _told(seen: Evidence, limits: str, resolution: int = 2) -> str:
    found = [_first(seen, limits, step, resolution) for step in STEPS]
    times, tops, stretches = (
        ", ".join(format(first[name], form) for first in found)
        for name, form in (("time_ms", ".0f"), ("top", ".3f"), ("stretch", ".3f"))
    )
    return (
        f"on {TETRAHEDRA[resolution]} tetrahedra, in steps of {', '.join(f'{h:g}' for h in STEPS)} "
        f"ms, after {times} ms, with the top at {tops} m and a transverse stretch of {stretches}"
    )


@claim(
    "H3",
    "5.2, Eqs. 19-20, Fig. 4",
    "Orthogonal projection of limits is violated in the first frame, and freezes the beam.",
    VOLUMES,
    fairness="How their solver enforces them is another matter: here the linearised limits are "
    "not kept exactly (H13), so that the beam creeps.",
)
def orthogonal(seen: Evidence) -> Finding:
    """When it is violated first, and how far the beam falls with it enforced."""
    first = all(
        _first(seen, "orthogonal", step, mesh)["time_ms"] == step
        for step in STEPS
        for mesh in TETRAHEDRA
    )
    table = seen.table("volumes", "enforced.csv").set_index(["limits", "method"])
    free = table.loc[("hyperbolic", "none")]
    held, ours = table.loc[("orthogonal", "lcp-qp")], table.loc[("hyperbolic", "lcp-qp")]
    frozen = 1 - held["top"] < 0.1 * (1 - free["top"])
    return Finding(
        Verdict.of(first and frozen, first),
        f"Violated first {_told(seen, 'orthogonal')}. Enforced by lcp-qp, after 0.3 s the top is "
        f"at {held['top']:.3f} m, of 1 m at rest and {free['top']:.3f} m without limits "
        f"({ours['top']:.3f} m with hyperbolic ones).",
        f"It is violated first {_told(seen, 'orthogonal', 4)}.",
    )


@claim(
    "H4",
    "5.2, Eqs. 21-22, Fig. 4",
    "Linear interpolation of limits is violated very late, with the beam nearly collapsed.",
    VOLUMES,
    fairness="Eqs. 21 and 22 print |D v|, the text describes the radius of an ellipsoid. What "
    "number stands for an unrestricted axis is not written.",
)
def linear(seen: Evidence) -> Finding:
    """When each of the two readings is violated first, on both meshes."""
    cases = [(k, mesh, step) for k in READINGS for mesh in TETRAHEDRA for step in STEPS]
    late = {case: _late(_first(seen, case[0], case[2], case[1])) for case in cases}
    printed = all(late["linear", 2, step] for step in STEPS)
    return Finding(
        Verdict.of(all(late.values()), printed),
        f"As printed, violated first {_told(seen, 'linear')}; "
        f"{_told(seen, 'linear', 4)}. Late, a top below {COLLAPSED:g} m and a stretch above "
        f"{EXCESS:g}, are {_late_of(late, 'linear')}.",
        f"The ellipsoid, violated first {_told(seen, 'ellipsoid')}; {_told(seen, 'ellipsoid', 4)}: "
        f"late are {_late_of(late, 'ellipsoid')}. {_freed(seen)}",
    )


def _late(first: pd.Series) -> bool:
    return bool(first["top"] < COLLAPSED and first["stretch"] > EXCESS)


def _late_of(late: dict[tuple[str, int, float], bool], reading: str) -> str:
    told = (
        f"{sum(late[reading, mesh, step] for step in STEPS)} of {len(STEPS)} on {tetrahedra}"
        for mesh, tetrahedra in TETRAHEDRA.items()
    )
    return " and ".join(told)


def _freed(seen: Evidence) -> str:
    """How the printed reading depends on the number that stands for no limit."""
    table = seen.table("volumes", "free.csv")
    rows = table[table["limits"] == "linear"].groupby("resolution")
    told = (
        f"on {TETRAHEDRA[int(mesh)]} tetrahedra after "
        + ", ".join(f"{r['time_ms']:.0f} ms ({r['free']:,.0f})" for _, r in group.iterrows())
        for mesh, group in rows
    )
    return f"As printed, by the stretch that stands for no limit, at 5 ms: {'; '.join(told)}."


@claim(
    "H5",
    "5.2, Fig. 4",
    "Hyperbolic limits are coherent with the 5% asked for.",
    VOLUMES,
)
def hyperbolic(seen: Evidence) -> Finding:
    """When they are violated first."""
    found = [_first(seen, "hyperbolic", step, mesh) for step in STEPS for mesh in TETRAHEDRA]
    return Finding(
        Verdict.of(all(abs(first["stretch"] - 1 - LIMIT) < 0.02 for first in found)),
        f"Violated first {_told(seen, 'hyperbolic')}.",
        f"It is violated first {_told(seen, 'hyperbolic', 4)}.",
    )


def _press(seen: Evidence, press: str, material: str, depth: float) -> tuple[float, bool]:
    """Force [N] at a depth [mm] with friction 0.5, and whether the solver was done."""
    table = seen.table("volumes", "press.csv")
    at = (table["press"] == press) & (table["material"] == material)
    rows = table[at & (table["depth_mm"] == depth) & (table["friction"] == 0.5)]
    if rows.empty:
        raise NotThereError(f"volumes holds no {press} press at {depth:g} mm")
    return float(rows.iloc[0]["force"]), rows.iloc[0]["converged"] == "yes"


@claim(
    "H9",
    "5.1, 6, Fig. 3",
    "A finger with anisotropic limits is as with isotropic ones when pressed flat, far stiffer on "
    "its side and tip.",
    VOLUMES,
    fairness="Their mesh, pins and friction are not written. Ours are choices, made so that "
    "forces come near those of an earlier prototype: their agreement with it checks nothing.",
)
def finger(seen: Evidence) -> Finding:
    """Forces at a depth and depths under a load, anisotropic beside isotropic."""
    forces = {
        press: [_press(seen, press, material, 1.0) for material in MATERIALS] for press in PRESSES
    }
    told = "; ".join(
        f"{press} {f'{aniso:.2f}' if done else 'rigid'} against {iso:.2f} N"
        for press, ((aniso, done), (iso, _)) in forces.items()
    )
    ratios = {press: aniso / iso for press, ((aniso, _), (iso, _)) in forces.items()}
    depths = _yielded(seen)
    stiffer = ratios["side"] > STIFFER and all(
        depths[press, "isotropic"] > STIFFER * depths[press, "anisotropic"]
        for press in ("side", "tip")
    )
    yielded = "; ".join(
        f"{press} {depths[press, 'anisotropic']:.2f} against {depths[press, 'isotropic']:.2f} mm"
        for press in PRESSES
    )
    return Finding(
        Verdict.of(abs(ratios["flat"] - 1) < 0.1 and stiffer),
        f"Force at a depth of 1 mm: {told}. Rigid: the solver was not done.",
        f"Depth under a load of {LOAD:g} N: {yielded}; the solver was done.",
    )


def _yielded(seen: Evidence) -> pd.Series:
    """Depths [mm] under LOAD by press and material, where the solver was done."""
    table = seen.table("volumes", "load.csv")
    under = table[(table["load"] == LOAD) & (table["converged"] == "yes")]
    if len(under) != len(PRESSES) * len(MATERIALS):
        raise NotThereError(f"volumes holds no load of {LOAD:g} N on every press, solved")
    return under.set_index(["press", "material"])["depth_mm"]


@claim(
    "H10",
    "5.1",
    "It is interactive below about 5 constraints and under 1 Hz above 40 constrained tetrahedra.",
    VOLUMES,
    fairness="i7-3770; unoptimised code without warm starts. Seconds are another machine's, and "
    "rows here are those near their limits, contacts among them.",
)
def interactive(seen: Evidence) -> Finding:
    """Sweeps by number of rows, beside an interior point's iterations."""
    table = seen.table("volumes", "sweeps.csv")
    told = "; ".join(
        f"{row['rows']} rows: {row['sweeps']:.0f} sweeps (solved {row['solved']:.0f}%), "
        f"{row['ratio']:.2g} times lcp-qp's time"
        for _, row in table.iterrows()
    )
    few, many = _pressed_sweeps(seen, 0, FEW), _pressed_sweeps(seen, MANY, np.inf)
    grows = bool(table["sweeps"].iloc[-1] > 5 * table["sweeps"].iloc[0])
    return Finding(
        Verdict.of(False, grows and many.median() > 5 * few.median()),
        f"The shape is reproduced, the rates are not compared. The beam, medians: {told}. The "
        f"finger: {_spread(few)} at up to {FEW} rows, {_spread(many)} above {MANY}.",
        f"lcp-qp takes {table['iterations'].min():g} to {table['iterations'].max():g} iterations "
        "throughout: it is projected Gauss-Seidel that slows down, not the model.",
    )


def _pressed_sweeps(seen: Evidence, above: float, most: float) -> pd.Series:
    """Sweeps of the finger's presses with so many rows."""
    table = seen.table("volumes", "press.csv")
    sweeps = table["sweeps"][(table["rows"] > above) & (table["rows"] <= most)]
    if sweeps.empty:
        raise NotThereError(f"volumes holds no press with {above:g} to {most:g} rows")
    return sweeps


def _spread(sweeps: pd.Series) -> str:
    return f"{sweeps.median():.0f} sweeps ({sweeps.min()} to {sweeps.max()}, {len(sweeps)} presses)"


@claim(
    "H11",
    "abstract, 1, 4",
    "Limits and Coulomb friction are solved together, in one complementarity problem.",
    VOLUMES,
    fairness="Rows are flagged near their limits here; flagged at the candidate alone they "
    "miss contact.",
)
def together(seen: Evidence) -> Finding:
    """The error of the friction cones, what is solved, and forces by another method."""
    table = seen.table("volumes", "press.csv")
    error, done = table["cone_error"].max(), table["converged"] == "yes"
    pgs, qp = (_past(seen, "side", method) for method in ("lcp-pgs", "lcp-qp"))
    shared = [depth for depth in pgs.index if depth in qp.index and depth <= 1.0]
    alike = all(abs(pgs[depth] / qp[depth] - 1) < 0.01 for depth in shared)
    told = "; ".join(
        f"{depth:g} mm: {pgs[depth]:.4f} against {qp[depth]:.4f} N" for depth in shared
    )
    return Finding(
        Verdict.of(error < 1e-9 and alike and done.all(), error < 1e-9 and alike),
        f"Largest error of a friction cone {power(error)}; {done.sum()} of {len(table)} presses "
        f"are solved, in up to {table['sweeps'][done].max():.0f} sweeps; the others, pressed far "
        f"beyond their limits or with a friction of {table['friction'][~done].max():g}, are not in "
        f"{table['sweeps'].max():.0f}.",
        f"Without friction, on the side, beside an interior point of the same limits and contacts "
        f"(lcp-qp): {told}.",
    )


def _past(seen: Evidence, press: str, method: str) -> pd.Series:
    """Forces [N] without friction by depth [mm], where the method was done."""
    table = seen.table("volumes", "past.csv")
    rows = table[(table["press"] == press) & (table["method"] == method)]
    forces = rows[rows["converged"] == "yes"].set_index("depth_mm")["force"]
    if forces.empty:
        raise NotThereError(f"volumes holds no {press} press by {method}")
    return forces
