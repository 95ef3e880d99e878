"""Claims of Hernandez et al. (2013) about limits on principal stretches of volumes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from strainbench.problem.principal import PrincipalLimits
from strainbench.report.claims.claim import Finding, Verdict, claim
from strainbench.report.claims.evidence import Evidence, NotThereError
from strainbench.report.numbers import power

VOLUMES = "python -m strainbench.studies.volumes --step 1,5,20 --resolution 2,4 -o results/volumes"
LIMIT = 0.05
STEPS = (1.0, 5.0, 20.0)  # [ms]
LOAD = 20.0  # [N]


def _first(seen: Evidence, limits: str, step: float, resolution: int = 2) -> dict[str, float]:
    """Time [ms], height [m] and transverse stretch of the first violated step (Fig. 4)."""
    table = seen.table("volumes", "fig4.csv")
    of_mesh = table[table["resolution"] == resolution]
    rows = of_mesh[(of_mesh["limits"] == limits) & (of_mesh["step_ms"] == step)]
    if rows.empty:
        raise NotThereError(f"volumes holds no {limits} limits at {step:g} ms")
    return {name: float(rows.iloc[0][name]) for name in ("time_ms", "top", "stretch")}


def _told(seen: Evidence, limits: str, steps: Sequence[float] = STEPS, resolution: int = 2) -> str:
    found = [_first(seen, limits, step, resolution) for step in steps]
    return "; ".join(
        f"step {step:g} ms: after {f['time_ms']:.0f} ms, top at {f['top']:.2f} m, transverse "
        f"stretch {f['stretch']:.3f}"
        for step, f in zip(steps, found, strict=True)
    )


@claim(
    "H1",
    "abstract, 3.3, 5.2",
    "Along an axis limits stay as given, and vanish at right angles: d / |cos|.",
)
def along_axes(_: Evidence) -> Finding:
    """Uniaxial stretches of the largest amount allowed, by angle to the limited axis."""
    limits = PrincipalLimits("hyperbolic", (None, 1 - LIMIT), (None, 1 + LIMIT))
    worst = 0.0
    for degrees in (30.0, 45.0, 60.0):
        angle = np.deg2rad(90 - degrees)  # from e1; the limited axis is e2
        u = np.array([np.cos(angle), np.sin(angle)])
        amount = LIMIT / abs(u[1])
        F = np.eye(3, 2) + amount * np.outer(np.append(u, 0.0), u)
        worst = max(worst, float(abs(limits.values(F[None]).min())))
    return Finding(
        Verdict.of(worst < 1e-9),
        f"Uniaxial stretches of d / |cos| at 30, 45 and 60 degrees to a limited axis of 5% meet "
        f"the limit to {power(worst)}.",
        "Derivatives and values by finite differences: `pytest tests/problem/test_principal.py`.",
    )


@claim(
    "H3",
    "Eqs. 19-20, Fig. 4",
    "Orthogonal projection of limits is violated in the first frame, and freezes the beam.",
    VOLUMES,
)
def orthogonal(seen: Evidence) -> Finding:
    """When it is violated first."""
    first = all(_first(seen, "orthogonal", step)["time_ms"] == step for step in STEPS)
    return Finding(Verdict.of(first), f"{_told(seen, 'orthogonal')}.")


@claim(
    "H4",
    "Fig. 4",
    "Linear interpolation of limits is violated very late, with the beam nearly collapsed.",
    VOLUMES,
    fairness="Eqs. 21 and 22 print |D v|, the text describes the radius of an ellipsoid.",
)
def linear(seen: Evidence) -> Finding:
    """When each of the two readings is violated first."""
    printed = _first(seen, "linear", 5.0)
    return Finding(
        Verdict.of(printed["top"] < 0.7 and printed["stretch"] > 1.2),
        f"{_told(seen, 'linear')}.",
        f"The ellipsoid, milder: {_told(seen, 'ellipsoid')}.",
    )


@claim(
    "H5",
    "Fig. 4",
    "Hyperbolic limits are coherent with the 5% asked for.",
    VOLUMES,
)
def hyperbolic(seen: Evidence) -> Finding:
    """When they are violated first."""
    stretches = [_first(seen, "hyperbolic", step)["stretch"] for step in STEPS]
    return Finding(
        Verdict.of(all(abs(s - 1 - LIMIT) < 0.02 for s in stretches)),
        f"{_told(seen, 'hyperbolic')}.",
        f"On 1,600 tetrahedra: {_told(seen, 'hyperbolic', resolution=4)}.",
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
    "5.2, Fig. 3",
    "A finger with anisotropic limits is as with isotropic ones when pressed flat, far stiffer on "
    "its side and tip.",
    VOLUMES,
    fairness="Their mesh, pins and friction are not written. Ours are choices, made so that "
    "forces come near those of an earlier prototype: their agreement with it checks nothing.",
)
def finger(seen: Evidence) -> Finding:
    """Ratios of forces, anisotropic over isotropic."""
    ratios, told = {}, []
    for press, depth in (("flat", 1.0), ("side", 1.0), ("tip", 1.0)):
        (aniso, done), (iso, _) = (
            _press(seen, press, material, depth) for material in ("anisotropic", "isotropic")
        )
        ratios[press] = aniso / iso
        how = f"{aniso:.2f} against {iso:.2f} N" if done else f"rigid against {iso:.2f} N"
        told.append(f"{press} {how}")
    stiffer = min(ratios["side"], ratios["tip"])
    return Finding(
        Verdict.of(abs(ratios["flat"] - 1) < 0.1 and stiffer > 1.5),
        f"Force at a depth of 1 mm: {'; '.join(told)}. Rigid: the solver was not done.",
        f"Depth under a load of {LOAD:g} N: {_yielded(seen)}.",
    )


def _yielded(seen: Evidence) -> str:
    """Depths [mm] under LOAD, anisotropic against isotropic."""
    table = seen.table("volumes", "load.csv")
    depths = table[table["load"] == LOAD].set_index(["press", "material"])["depth_mm"]
    if depths.empty:
        raise NotThereError(f"volumes holds no load of {LOAD:g} N")
    return "; ".join(
        f"{press} {depths[press, 'anisotropic']:.2f} against {depths[press, 'isotropic']:.2f} mm"
        for press in ("flat", "side", "tip")
    )


@claim(
    "H10",
    "5.2",
    "It is interactive below about 5 constraints and under 1 Hz above 40 constrained tetrahedra.",
    VOLUMES,
    fairness="i7-3770; unoptimised code without warm starts.",
)
def interactive(seen: Evidence) -> Finding:
    """Sweeps by number of rows, beside an interior point's iterations."""
    table = seen.table("volumes", "sweeps.csv")
    told = "; ".join(
        f"rows {row['rows']}: {row['sweeps']:.0f} sweeps (solved {row['solved']:.0f}%), "
        f"{row['ratio']:.2g} times lcp-qp's time"
        for _, row in table.iterrows()
    )
    grows = bool(table["sweeps"].iloc[-1] > 5 * table["sweeps"].iloc[0])
    return Finding(
        Verdict.of(False, grows),
        f"The shape holds, seconds are another machine's: {told}.",
        f"lcp-qp takes {table['iterations'].min():.0f} to {table['iterations'].max():.0f} "
        "iterations throughout: it is projected Gauss-Seidel that slows down, not the model.",
    )


@claim(
    "H11",
    "4, 6",
    "Limits and Coulomb friction are solved together, in one complementarity problem.",
    VOLUMES,
    fairness="Rows are flagged near their limits here; flagged at the candidate alone they "
    "miss contact.",
)
def together(seen: Evidence) -> Finding:
    """The error of the friction cones, and what is solved."""
    table = seen.table("volumes", "press.csv")
    error, done = table["cone_error"].max(), (table["converged"] == "yes").mean()
    return Finding(
        Verdict.of(error < 1e-9 and done == 1, error < 1e-9),
        f"Largest error of a friction cone {power(error)}; {100 * done:.0f}% of the presses are "
        f"solved, in up to {table['sweeps'].max():.0f} sweeps.",
    )


def violation(seen: Evidence, method: str, step: float, material: str = "anisotropic") -> float:
    """The worst violation of the beam's limits by a method."""
    table = seen.table("volumes", "violation.csv")
    rows = table[
        (table["method"] == method) & (table["step_ms"] == step) & (table["material"] == material)
    ]
    if rows.empty:
        raise NotThereError(f"volumes holds no {method} at {step:g} ms")
    return float(rows.iloc[0]["worst"])


@claim(
    "H13",
    "3.1, 5.1",
    "Limits are enforced, linearised once a step.",
    VOLUMES,
    fairness="Their rule of correction and damping are not written.",
)
def enforced(seen: Evidence) -> Finding:
    """Violation that is left of limits of 4%."""
    literal, tuned, exact = (
        [violation(seen, name, step) for step in STEPS]
        for name in ("lcp-pgs-literal", "lcp-pgs", "lcp-qp-literal")
    )

    def told(found: list[float]) -> str:
        return ", ".join(f"{v:.2g}" for v in found)

    steps = ", ".join(f"{step:g}" for step in STEPS)
    return Finding(
        Verdict.of(max(literal) < 0.01, max(tuned) < 0.01),
        f"In steps of {steps} ms limits of 4% are violated by up to {told(literal)} as printed; "
        "with rows near their limits, a fifth of the correction and three rounds by "
        f"{told(tuned)}.",
        f"Solved exactly in place of projected Gauss-Seidel: {told(exact)}; it is the "
        "linearisation that limits it.",
    )


@claim(
    "H15",
    "2, 3.1",
    "Limits on principal stretches are isotropic, free of parametrisation.",
)
def isotropic(_: Evidence) -> Finding:
    """The same value whatever the rotation of material and space."""
    limits = PrincipalLimits("isotropic", (0.9, 0.9), (1.1, 1.1))
    F = np.array([[1.08, 0.03], [-0.02, 0.95], [0.1, 0.2]])
    turns = [np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]]) for a in (0.0, 0.7, 2.0)]
    least = [float(limits.values((F @ turn)[None]).min()) for turn in turns]
    return Finding(
        Verdict.of(float(np.ptp(least)) < 1e-12),
        f"Turning the material axes changes the limits' values by {power(float(np.ptp(least)))}.",
    )
