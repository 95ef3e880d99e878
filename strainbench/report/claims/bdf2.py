"""Claims of Tang et al. (2022) about BDF-2 and large steps: section 4, Figs. 4 and 5."""

from __future__ import annotations

import numpy as np
import pandas as pd

from strainbench.arrays import FloatArray
from strainbench.physics.integrators import INTEGRATORS, Motion
from strainbench.report.claims.claim import Finding, Verdict, at, claim
from strainbench.report.claims.evidence import Evidence
from strainbench.report.claims.scheme import OURS, SCHEMES, SETTINGS, to_1_2
from strainbench.report.claims.sides import fraction, in_steps, listed, or_missing, unsteady

BLOWN_UP = 1000.0  # mJ; the cloth has some 60 to lose
LARGE = "claims/large-steps"
STEPS = "0.0041666667,0.01,0.0166666667,0.0333333333,0.1,0.2"
FASTER = at(
    SETTINGS,
    "run swing --solver newton-ipm --set resolution=10 --set integrator=bap,bar-stable --set "
    "step=0.01,0.005 --duration 1",
)
FREQUENCIES = np.geomspace(1e-3, 1e2, 41)  # of the model problem, times the step


def _top(seen: Evidence, scheme: str) -> float:
    return float(seen.energy("fig4", **OURS, integrator=scheme)["energy"].max())


@claim(
    "T19",
    "4, Fig. 4",
    "The BDF-2 variants damp less and fluctuate more.",
    SCHEMES,
    FASTER,
    fairness="Details of their BAR are not written; ours, with implicit Euler to the middle, is "
    "one form that is stable.",
)
def bdf2(seen: Evidence) -> Finding:
    """BAP beside SAP; BAR, or its stable form, beside SAR."""
    names = ("sap", "bap", "sar", "bar-stable")
    ends = {s: seen.energy_at("fig4", 2.0, **OURS, integrator=s, step=0.01) for s in names}
    rough = {s: to_1_2(seen, "newton-ipm", s)[1] for s in names}
    bap, stable = (
        ends[new] > ends[old] and rough[new] > rough[old]
        for new, old in (("bap", "sap"), ("bar-stable", "sar"))
    )
    letter = _top(seen, "bar") < BLOWN_UP
    told = "ends" if letter else "blows up (see T20)"
    return Finding(
        Verdict.of(bap and stable and letter, bap),
        "Energy at 2 s, and root mean square of its second differences to 1.2 s: "
        + "; ".join(f"{s.upper()} {ends[s]:.1f} and {rough[s]:.3f} mJ" for s in names)
        + f". BAR to the letter {told}.",
        or_missing(lambda: _other_mesh(seen)),
    )


def _other_mesh(seen: Evidence) -> str:
    cell = {**OURS, "resolution": 10, "norm": "unweighted", "diagonals": "alternating"}
    told = []
    for step in (0.01, 0.005):
        of = {**cell, "limit": 0.01, "step": step}
        ends = {s: seen.energy_at(SETTINGS, 1.0, **of, integrator=s) for s in ("sap", "bap")}
        rough = [unsteady(seen, SETTINGS, 1.0, **of, integrator=s)[1] for s in ends]
        told.append(
            f"in steps of {fraction(step)} s {listed(ends.values())} mJ at 1 s, second differences "
            f"{listed(rough, '.3f')}"
        )
    return f"At 10 cells, SAP and BAP: {'; '.join(told)}."


@claim(
    "T20",
    "4",
    "BAR is unstable with the BDF-2 formula for the mid-step velocity.",
    SCHEMES,
    fairness="What their stable BAR was is not written.",
)
def bar(seen: Evidence) -> Finding:
    """Whether it blows up, with either formula, and whether the scheme itself does."""
    top = {s: _top(seen, s) for s in ("bar-bdf2", "bar", "bar-stable")}
    too = top["bar"] > BLOWN_UP
    other = "blows up too, so the formula does not decide it" if too else "does not blow up"
    calm = "stays below" if top["bar-stable"] < 0 else "rises above"
    return Finding(
        Verdict.of(top["bar-bdf2"] > BLOWN_UP),
        f"With it {_blow_up(seen, 'bar-bdf2', top['bar-bdf2'])}. The other formula {other}: "
        f"{_blow_up(seen, 'bar', top['bar'])}. With implicit Euler in the first half step the "
        f"energy {calm} 0.",
        "Spectral radii of a step of a linear oscillator, largest over its frequencies, that the "
        "projection holds or leaves free: "
        + "; ".join(
            f"{spectral_radius(s, held=True):.2f} and {spectral_radius(s, held=False):.2f} "
            f"({s.upper()})"
            for s in ("bar-bdf2", "bar", "bar-stable", "bap", "sar")
        )
        + ". Above 1 is unstable.",
    )


def _blow_up(seen: Evidence, scheme: str, top: float) -> str:
    cell = seen.cells("fig4", **OURS, integrator=scheme).tail(1)
    steps = in_steps(seen, "fig4", ("time",), **OURS, integrator=scheme)
    failed = int(cell["newton_failures"].iloc[0])
    curve = seen.energy("fig4", **OURS, integrator=scheme)
    above = curve["time"][curve["energy"] > 0]
    since = f" from {above.iloc[0]:.2f} s on" if len(above) else ""
    return (
        f"its energy is above 0{since} and rises to {top:.0f} mJ; Newton's iteration for the step "
        f"fails on {failed} of {len(steps)} steps"
    )


def spectral_radius(scheme: str, held: bool) -> float:
    """Of a step of an oscillator that the projection holds at 0, or leaves alone.

    >>> spectral_radius("sap", held=False) <= 1
    True
    """
    radii = []
    for frequency in FREQUENCIES:

        def minimise(
            _: FloatArray, inertial: FloatArray, step: float, __: float, w: float = frequency
        ) -> FloatArray:
            return inertial / (1 + (w * step) ** 2)

        columns = []
        for x, v, x0, v0 in np.eye(4):
            motion = INTEGRATORS[scheme](
                Motion(x, v, 0.0, (x0, v0)),
                1.0,
                minimise,
                lambda x: 0 * x if held else x,
            )
            columns.append([motion.positions, motion.velocities, *(motion.before or ())])
        radii.append(np.abs(np.linalg.eigvals(np.array(columns).T)).max())
    return float(max(radii))


@claim(
    "T21",
    "4, Fig. 5",
    "Step-and-reflect is robust for large steps, but conserves less.",
    at(
        "fig5",
        "run swing --solver newton-ipm --set integrator=sar --set resolution=20 --set step="
        f"{STEPS} --duration 2",
    ),
    at(
        LARGE,
        "run swing --solver newton-ipm --set integrator=sar --set resolution=20 --set norm=mass "
        "--set diagonals=alternating,uniform --set step=0.01,0.0166666667,0.0333333333,0.1,0.2 "
        "--duration 2",
    ),
    fairness="Which steps they took is read off a plot.",
)
def large_steps(seen: Evidence) -> Finding:
    """Energy at 2 s by step."""
    ends, rises = _ends(seen, "fig5")
    falls = bool((ends.diff().dropna() < 0).all())
    return Finding(
        Verdict.of(not rises and falls, not rises),
        f"{_risen(rises)} At 2 s, for steps of {', '.join(map(fraction, ends.index))} s: "
        f"{listed(ends)} mJ{_turns_at(ends)}.",
        or_missing(lambda: f"In the norm of the masses: {_in_mass_norm(seen)}."),
    )


def _in_mass_norm(seen: Evidence) -> str:
    told = []
    for diagonals in ("alternating", "uniform"):
        ends, rises = _ends(seen, LARGE, norm="mass", diagonals=diagonals)
        told.append(
            f"{diagonals} diagonals, {', '.join(map(fraction, ends.index))} s, {listed(ends)} mJ"
            f"{_turns_at(ends)} ({_risen(rises).rstrip('.').lower()})"
        )
    return "; ".join(told)


def _ends(seen: Evidence, folder: str, **wanted: object) -> tuple[pd.Series, list[float]]:
    """Energies at the end by step, and the steps whose energy rises above the first one's."""
    cell = {"integrator": "sar", **wanted}
    steps = sorted(set(seen.cells(folder, **cell)["step"]))
    curves = {s: seen.energy(folder, **cell, step=float(s))["energy"] for s in steps}
    ends = pd.Series({s: float(curve.iloc[-1]) for s, curve in curves.items()})
    return ends, [s for s, curve in curves.items() if curve.max() > curve.iloc[0] + 1e-9]


def _risen(rises: list[float]) -> str:
    which = "No run's energy rises" if not rises else "The energy rises"
    at = f" in steps of {', '.join(map(fraction, rises))} s" if rises else ""
    return f"{which} above its first step's{at}."


def _turns_at(ends: pd.Series) -> str:
    """The steps beyond which it keeps more again, not less."""
    more = [
        fraction(a) for a, b in zip(ends.index, ends.index[1:], strict=False) if ends[b] > ends[a]
    ]
    return f": beyond {', '.join(more)} s it keeps more, not less" if more else ""
