"""Claims of Tang et al. (2022) about motion and rest: section 4, Figs. 2 and 4 to 6."""

from __future__ import annotations

from itertools import product

import numpy as np

from strainbench.report.claims.claim import Finding, Verdict, at, claim
from strainbench.report.claims.evidence import Evidence
from strainbench.report.energy import unsteadiness

FIG4 = "run swing --solver {} --set resolution=20 --set step=0.01 --steps 200"
SAP = at("fig4", FIG4.format("newton-ipm"))
SHORT = at("fig4", "run swing --solver newton-ipm --set resolution=20 --set step=0.005 --steps 400")
SCHEMES = at(
    "fig4",
    FIG4.format("newton-ipm")
    + " --set integrator=sap,sar,bap,bar,bar-bdf2,bar-stable,sar-projected",
)
FREE = at("fig4", FIG4.format("none"))
SETTINGS = "claims/schemes"
MANY = at(
    SETTINGS,
    "run swing --solver newton-ipm --set resolution=10 --set integrator=sap,sar,sar-projected "
    "--set norm=unweighted,mass --set diagonals=alternating,uniform --set step=0.01,0.005 "
    "--duration 1",
)
BLOWN_UP = 1000.0  # mJ; the cloth has some 60 to lose


@claim(
    "T12",
    "Fig. 2",
    "Limits decide the drape: shapes are clearly different.",
    at(
        "drape",
        "run drape --solver newton-ipm --set resolution=60 --set "
        "shape=isotropic,orthotropic,anisotropic --steps 2",
    ),
    fairness="Their curves are read off a plot.",
)
def drapes(seen: Evidence) -> Finding:
    """Energies of gravity of the three drapes, so heights of their centres of mass."""
    names = ("isotropic", "orthotropic", "anisotropic")
    at_rest = {"solver": "newton-ipm", "resolution": 60}
    cells = {name: seen.cells("drape", shape=name, **at_rest).tail(1) for name in names}
    low = {n: 1000 * seen.steps("drape", c, "gravity_energy").iloc[-1] for n, c in cells.items()}
    apart = [abs(low["orthotropic"] - low[n]) for n in ("isotropic", "anisotropic")]
    return Finding(
        Verdict.of(min(apart) > 1, max(apart) > 1),
        "Energies of gravity of "
        + ", ".join(f"{energy:.2f} mJ ({name})" for name, energy in low.items())
        + f": the isotropic drape hangs higher, by {100 * apart[0] / abs(low['orthotropic']):.0f}% "
        f"of its fall; the other two differ by {100 * apart[1] / abs(low['orthotropic']):.1f}%.",
        "`strainbench render drape` and `polar drape` show them.",
    )


@claim(
    "T14",
    "4",
    "Step-and-project is stable, but dissipative.",
    SAP,
    SHORT,
    fairness="Their step is not written.",
)
def dissipative(seen: Evidence) -> Finding:
    """Energy that is lost, at two steps."""
    long, short = (
        seen.energy_at("fig4", 2.0, solver="newton-ipm", integrator="sap", step=step)
        for step in (0.01, 0.005)
    )
    return Finding(
        Verdict.of(long < short < 0),
        f"At 2 s it has {long:.1f} mJ of the 0 that it began with.",
        f"At half the step {short:.1f} mJ: the loss goes with the step.",
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
    """Early and late."""
    at = {
        (name, time): seen.energy_at("fig4", time, integrator="sap", solver=solver, step=0.01)
        for name, solver in (("free", "none"), ("sap", "newton-ipm"))
        for time in (0.4, 2.0)
    }
    early, late = (at["free", t] < at["sap", t] for t in (0.4, 2.0))
    return Finding(
        Verdict.of(early and late, late),
        f"At 2 s {at['free', 2.0]:.1f} against {at['sap', 2.0]:.1f} mJ; at 0.4 s "
        f"{at['free', 0.4]:.1f} against {at['sap', 0.4]:.1f}. The two come to rest at unlike "
        "heights.",
    )


@claim(
    "T16",
    "abstract, 4, Fig. 4",
    "Step-and-reflect conserves more energy than step-and-project.",
    MANY,
    fairness="They compare at an equal step. Line 8 may be a misprint: from the projected x^1/2 it "
    "conserves more than either.",
)
def reflect(seen: Evidence) -> Finding:
    """At an equal step, and at an equal number of projections, in each setting."""
    settings = list(product(("unweighted", "mass"), ("alternating", "uniform")))
    at = {
        (name, *of): seen.energy_at(
            SETTINGS, 1.0, integrator=scheme, step=step, norm=of[0], diagonals=of[1]
        )
        for name, scheme, step in (
            *(("sap", "sap", 0.01), ("sar", "sar", 0.01)),
            *(("half", "sap", 0.005), ("projected", "sar-projected", 0.01)),
        )
        for of in settings
    }
    wins = {n: sum(at[("sar", *of)] > at[(n, *of)] for of in settings) for n in ("sap", "half")}
    better = sum(at[("projected", *of)] > at[("half", *of)] for of in settings)
    first = settings[0]
    return Finding(
        Verdict.of(wins["half"] == wins["sap"] == len(settings), wins["sap"] == len(settings)),
        f"At an equal step in {wins['sap']} of {len(settings)} settings; at an equal number of "
        f"projections in {wins['half']} of {len(settings)}. As in the paper's setting, at 1 s: "
        f"{at[('sap', *first)]:.1f} mJ (SAP), {at[('sar', *first)]:.1f} (SAR), "
        f"{at[('half', *first)]:.1f} (SAP at half the step).",
        f"With line 8 from the projected positions SAR beats SAP at half the step in {better} of "
        f"{len(settings)}.",
    )


def _unsteady(seen: Evidence, solver: str, scheme: str) -> tuple[float, float, int]:
    curve = seen.energy("fig4", solver=solver, integrator=scheme, step=0.01)
    return unsteadiness(curve["energy"][curve["time"] <= 1.2].to_numpy())


@claim(
    "T17",
    "4",
    "Step-and-reflect's energy oscillates slightly about a smooth curve, unlike implicit Euler's "
    "and step-and-project's.",
    SCHEMES,
    FREE,
    fairness="It comes from line 8's odd-even velocity.",
)
def oscillates(seen: Evidence) -> Finding:
    """Second differences and turns of the energy."""
    free, sap, sar = (
        _unsteady(seen, *who)
        for who in (("none", "sap"), ("newton-ipm", "sap"), ("newton-ipm", "sar"))
    )
    return Finding(
        Verdict.of(sar[1] > 2 * sap[1] and sar[2] > sap[2]),
        f"Root mean square of second differences to 1.2 s: {free[1]:.3f} (IE), {sap[1]:.3f} (SAP), "
        f"{sar[1]:.3f} mJ (SAR).",
        f"The energy turns {free[2]}, {sap[2]} and {sar[2]} times.",
    )


@claim(
    "T18",
    "4",
    "This resembles the behaviour of symplectic methods (a conjecture).",
    SCHEMES,
    fairness="The wording is a conjecture.",
)
def symplectic(seen: Evidence) -> Finding:
    """Whether energy is kept over the run."""
    curve = seen.energy("fig4", solver="newton-ipm", integrator="sar", step=0.01)[
        "energy"
    ].to_numpy()
    half = len(curve) // 2
    return Finding(
        Verdict.of(bool(curve[-1] > curve[half])),
        f"Its energy falls steadily: {curve[half]:.1f} mJ half way, {curve[-1]:.1f} at the end.",
    )


@claim(
    "T19",
    "4, Fig. 4",
    "The BDF-2 variants damp less and fluctuate more.",
    SCHEMES,
    fairness="Details of their BAR are not written; ours is a stable form.",
)
def bdf2(seen: Evidence) -> Finding:
    """BAP beside SAP."""
    ends = {
        s: seen.energy_at("fig4", 2.0, solver="newton-ipm", integrator=s, step=0.01)
        for s in ("sap", "bap")
    }
    rough = {s: _unsteady(seen, "newton-ipm", s)[1] for s in ("sap", "bap")}
    return Finding(
        Verdict.of(ends["bap"] > ends["sap"] and rough["bap"] > rough["sap"]),
        f"At 2 s {ends['bap']:.1f} mJ (BAP) against {ends['sap']:.1f} (SAP).",
        f"Second differences {rough['bap']:.3f} against {rough['sap']:.3f} mJ.",
    )


@claim(
    "T20",
    "4",
    "BAR is unstable with the BDF-2 formula for the mid-step velocity.",
    SCHEMES,
    fairness="What their stable BAR was is not written.",
)
def bar(seen: Evidence) -> Finding:
    """Whether it blows up, with either formula."""
    top = {
        s: float(seen.energy("fig4", solver="newton-ipm", integrator=s)["energy"].max())
        for s in ("bar-bdf2", "bar", "bar-stable")
    }
    return Finding(
        Verdict.of(top["bar-bdf2"] > BLOWN_UP),
        f"Its energy rises to {top['bar-bdf2']:.0f} mJ; with the other formula to "
        f"{top['bar']:.0f}; with implicit Euler in the first half step to {top['bar-stable']:.1f}.",
    )


@claim(
    "T21",
    "4, Fig. 5",
    "Step-and-reflect is robust for large steps, but conserves less.",
    at(
        "fig5",
        "run swing --solver newton-ipm --set integrator=sar --set resolution=20 --set step="
        "0.0041666667,0.01,0.0166666667,0.0333333333,0.1,0.2 --duration 2",
    ),
    fairness="Which steps they took is read off a plot.",
)
def large_steps(seen: Evidence) -> Finding:
    """Energy at 2 s by step."""
    cells = (
        seen.cells("fig5", integrator="sar")
        .sort_values("step")
        .drop_duplicates("step", keep="last")
    )
    curves = [seen.energy("fig5", integrator="sar", step=float(step)) for step in cells["step"]]
    ends = [float(curve["energy"].iloc[-1]) for curve in curves]
    stable = all(c["energy"].max() <= c["energy"].iloc[0] + 1e-9 for c in curves)
    falls = bool(np.all(np.diff(ends) < 0))
    steps = ", ".join(f"1/{1 / step:.0f}" for step in cells["step"])
    return Finding(
        Verdict.of(stable and falls, stable),
        f"No run's energy rises above its first step's. At 2 s, for steps of {steps} s: "
        + ", ".join(f"{end:.1f}" for end in ends)
        + " mJ.",
    )


@claim(
    "T23",
    "5, Fig. 6",
    "The scheme goes with ordinary collision handling (0.1%, penalties).",
    at(
        "collision",
        "run collision --solver clarabel,gauss-seidel --set resolution=10,20 --steps 60 "
        "--time-limit 120",
    ),
    fairness="Their stiffness; they promise no intersection during time integration only.",
)
def collisions(seen: Evidence) -> Finding:
    """Limits kept, and how deep the sheet is in the sphere."""
    cells = seen.cells("collision", solver="clarabel")
    deep = 1000 * seen.steps("collision", cells, "penetration").max()
    kept = cells["max_violation"].max()
    return Finding(
        Verdict.of(kept <= 1e-6 and deep < 0.1, kept <= 1e-6),
        f"Limits are kept to {kept:.0e}; the projection pushes the sheet up to {deep:.1f} mm into "
        "the sphere.",
    )
