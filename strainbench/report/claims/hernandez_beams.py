"""Claims of Hernandez et al. (2013) about the beams of Fig. 2, and how well limits are kept."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import pandas as pd

from strainbench.report.claims.claim import Finding, Verdict, claim
from strainbench.report.claims.evidence import Evidence, NotThereError
from strainbench.report.claims.hernandez import STEPS, VOLUMES
from strainbench.report.measures import length
from strainbench.report.numbers import power

SOFT, STIFF, TO_KEEP = 5e3, 2e5, 4e6  # [Pa]; the last keeps 4% by elasticity
SETTLING = 6.0  # [1/s], damping by which stiff beams come to rest
REST = 0.1  # [m], height of the tip at rest
LITERAL, TUNED, KEPT = "lcp-pgs-literal", "lcp-pgs", "sequential-cuts"
TUNING = "rows near their limits, a fifth of the correction and three rounds"


def _beams(seen: Evidence, **wanted: object) -> pd.DataFrame:
    """The rows of beams with these values in these columns."""
    table = seen.table("volumes", "beams.csv")
    for column, value in wanted.items():
        table = table[table[column] == value]
    if table.empty:
        raise NotThereError(f"volumes holds no beam with {wanted}")
    return table


def _beam(seen: Evidence, material: str, method: str, step: float = 20.0) -> pd.Series:
    """One of Fig. 2."""
    young = STIFF if material == "stiff" else SOFT
    wanted = {"material": material, "method": method, "young": young, "step_ms": step}
    return _beams(seen, alpha=2.0, **wanted).iloc[0]


@claim(
    "H7",
    "5.1, Fig. 2",
    "The soft beam with anisotropic limits stretches far more along its axis and wobbles along it; "
    "the isotropic and the stiff one do not.",
    VOLUMES,
    fairness="Damping and step are not written; the soft beams never settle wholly. Isotropic "
    "limits are kept by another method than the paper's, whose linearisation loses them (H13).",
)
def wobbles(seen: Evidence) -> Finding:
    """Stretch along the axis, and how much the length varies late."""
    stiff, soft, equal = (
        _beam(seen, name, method)
        for name, method in (("stiff", "none"), ("anisotropic", "lcp-qp"), ("isotropic", KEPT))
    )
    others = (stiff, equal)
    far = all(soft["along"] - 1 > 2 * (b["along"] - 1) for b in others)
    wobbling = all(soft["wobble"] > 2 * b["wobble"] for b in others)
    finer = [_beam(seen, "anisotropic", "lcp-qp", 10.0), _beam(seen, "isotropic", KEPT, 10.0)]
    return Finding(
        Verdict.of(far and wobbling, far),
        f"In steps of 20 ms, after 1.2 s: {_described([stiff, soft, equal])}.",
        f"In steps of 10 ms: {_described(finer)}.",
    )


def _described(beams: Iterable[pd.Series]) -> str:
    """Where beams come to, and how far beyond their limits they were."""
    return "; ".join(
        f"{b['material']} ({_kept_by(b)}): tip at ({b['tip_x']:.3f}, {b['tip_y']:.3f}) m, "
        f"stretched by up to {100 * (b['along'] - 1):.2g}% along the axis, its length varies by "
        f"{length(b['wobble'])}"
        for b in beams
    )


def _kept_by(beam: pd.Series) -> str:
    if beam["material"] == "stiff":
        return "no limits"
    return f"{beam['method']}, up to {power(beam['violation'])} beyond its limits of 4%"


@claim(
    "H8",
    "5.1, Fig. 2",
    "The stiff beam, of 200 kPa, has a similar vertical deformation as the anisotropic one.",
    VOLUMES,
    fairness="Their stiffness is chosen by eye.",
)
def similar(seen: Evidence) -> Finding:
    """How far both tips sink, and the stiffness with which they sink alike."""
    beams = _beams(seen, material="stiff", alpha=SETTLING).sort_values("young")
    sinks = REST - beams["tip_y"].to_numpy()
    stiff = float(sinks[(beams["young"] == STIFF).argmax()])
    coarse, fine = (
        REST - float(_beam(seen, "anisotropic", "lcp-qp", h)["tip_y"]) for h in (20, 10)
    )
    apart = abs(stiff / coarse - 1)
    return Finding(
        Verdict.of(apart < 0.1, apart < 0.4),
        f"The tips sink by {stiff:.3f} m (stiff, at rest) and {coarse:.3f} m (anisotropic, still "
        f"moving; {fine:.3f} m in steps of 10 ms): {100 * apart:.0f}% apart.",
        _alike(sinks, beams["young"].to_numpy(), coarse),
    )


def _alike(sinks: np.ndarray, young: np.ndarray, wanted: float) -> str:
    """The stiffness with which a stiff beam sinks as far, between those that were tried."""
    tried = f"{young[0] / 1e3:g} to {young[-1] / 1e3:g} kPa"
    if not sinks.min() <= wanted <= sinks.max():
        return (
            f"Stiff beams of {tried} sink by {sinks.max():.3f} to {sinks.min():.3f} m: none so far."
        )
    equal = np.exp(np.interp(-wanted, -sinks, np.log(young)))
    return f"Of stiff beams of {tried}, one of {equal / 1e3:.0f} kPa would sink as far."


def _violation(seen: Evidence, method: str, step: float, material: str = "anisotropic") -> float:
    """The worst violation of the beam's limits by a method."""
    table = seen.table("volumes", "violation.csv")
    rows = table[
        (table["method"] == method) & (table["step_ms"] == step) & (table["material"] == material)
    ]
    if rows.empty:
        raise NotThereError(f"volumes holds no {method} at {step:g} ms")
    return float(rows.iloc[0]["worst"])


def _told(found: Iterable[float]) -> str:
    return ", ".join(f"{v:.2g}" if v > 1e-3 else power(v) for v in found)


@claim(
    "H12",
    "1",
    "Limits on strain allow larger time steps than a stiff material.",
    VOLUMES,
    fairness="The paper speaks of hyperelasticity, whose stiffness grows with strain; the stiff "
    "beam here is linear, turned with the elements, and no hyperelastic material is tried. Nor are "
    "explicit integrators, or implicit ones iterated to convergence.",
)
def larger_steps(seen: Evidence) -> Finding:
    """Violation at 1 and 20 ms, and a beam stiff enough to keep 4% by elasticity."""
    steps = (1.0, 20.0)
    literal, tuned = ([_violation(seen, m, h) for h in steps] for m in (LITERAL, TUNED))
    cuts = _violation(seen, KEPT, 20.0, "isotropic")
    stiff = {h: _beams(seen, young=TO_KEEP, step_ms=h).iloc[0] for h in (5.0, 20.0)}
    upright = all(beam["inverted"] == 0 for beam in stiff.values())
    kept = max(tuned) < 0.01
    return Finding(
        Verdict.of(kept and not upright, kept),
        f"Limits of 4% are violated by {_told(literal)} at 1 and 20 ms as printed, by "
        f"{_told(tuned)} with {TUNING}: the step is bounded by the linearisation. Isotropic limits "
        f"by sequential-cuts, which does not linearise once, by {power(cuts)} at 20 ms.",
        f"A linear elastic beam of {TO_KEEP / 1e6:g} MPa without limits, by the same linearised "
        f"backward Euler, has a strain of {stiff[5.0]['strain']:.3f} at 5 ms and "
        f"{stiff[20.0]['strain']:.3f} at 20 ms, {'no' if upright else 'some'} step with inverted "
        "elements: it takes the same steps.",
    )


@claim(
    "H13",
    "3.5, 4",
    "Limits are enforced, linearised once a step.",
    VOLUMES,
    fairness="Their rule of correction and damping are not written.",
)
def enforced(seen: Evidence) -> Finding:
    """Violation that is left of limits of 4%."""
    literal, tuned, exact = (
        [_violation(seen, name, step) for step in STEPS]
        for name in (LITERAL, TUNED, "lcp-qp-literal")
    )
    equal, cuts = (
        [_violation(seen, name, step, "isotropic") for step in STEPS] for name in (LITERAL, KEPT)
    )
    steps = ", ".join(f"{step:g}" for step in STEPS)
    return Finding(
        Verdict.of(max(literal) < 0.01, max(tuned) < 0.01),
        f"In steps of {steps} ms limits of 4% are violated by up to {_told(literal)} as printed; "
        f"with {TUNING} by {_told(tuned)}.",
        f"Solved exactly in place of projected Gauss-Seidel: {_told(exact)}. Isotropic limits: "
        f"{_told(equal)} as printed, {_told(cuts)} by sequential-cuts, which linearises anew until "
        "they are kept: it is the one linearisation that loses them.",
    )
