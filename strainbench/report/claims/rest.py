"""Claims of Tang et al. (2022) about drapes and collisions: Figs. 2 and 6."""

from __future__ import annotations

from itertools import combinations

import pandas as pd

from strainbench.report.claims.claim import Finding, Verdict, at, claim
from strainbench.report.claims.evidence import Evidence, NotThereError
from strainbench.report.claims.sides import fraction, highest, or_missing
from strainbench.report.numbers import power

SHAPES = ("isotropic", "orthotropic", "anisotropic")
APART = "claims/drapes"
CONTACT = "claims/contact"


@claim(
    "T12",
    "Fig. 2",
    "Limits decide the drape: shapes are clearly different.",
    f"python -m strainbench.studies.drapes --resolution 15,30 -o results/{APART}",
    at(
        "drape",
        "run drape --solver newton-ipm --set resolution=30 --set "
        "shape=isotropic,orthotropic,anisotropic --steps 5",
    ),
    fairness="Their curves are read off a plot; a drape is one of several minima.",
)
def drapes(seen: Evidence) -> Finding:
    """Distances of the three surfaces, beside those between meshes; heights."""
    energies = or_missing(lambda: _heights(seen))
    try:
        table = seen.table(APART, "apart.csv")
    except NotThereError as missing:
        if energies.startswith("Not measured"):
            raise
        return Finding(Verdict.UNMEASURED, f"{missing}.", energies)
    finest = int(table["resolution"].max())
    coarse = int(table["resolution"].min())
    apart = {(a, b): _apart(table, (a, finest), (b, finest)) for a, b in combinations(SHAPES, 2)}
    moved = {a: _apart(table, (a, coarse), (a, finest)) for a in SHAPES}
    clear = [d > 2 * max(moved[a], moved[b]) for (a, b), d in apart.items()]
    return Finding(
        Verdict.of(all(clear), any(clear)),
        f"Hausdorff distances at {finest} cells: "
        + ", ".join(f"{1000 * d:.0f} mm ({a}, {b})" for (a, b), d in apart.items())
        + f"; of the same shapes at {coarse} and {finest} cells: "
        + ", ".join(f"{1000 * d:.0f} mm ({a})" for a, d in moved.items())
        + ". The side is 500 mm.",
        energies,
    )


def _apart(table: pd.DataFrame, one: tuple[str, int], other: tuple[str, int]) -> float:
    """The distance [m] of two drapes, (shape, cells)."""
    of = {tuple(row[:4]): row[4] for row in table.itertuples(index=False)}
    found = of.get((*one, *other), of.get((*other, *one)))
    if found is None:
        raise NotThereError(f"{APART} lacks {one[0]} and {other[0]} at {other[1]} cells")
    return float(found)


def _heights(seen: Evidence) -> str:
    at_rest = {"solver": "newton-ipm", "resolution": 30}
    cells = {name: seen.cells("drape", shape=name, **at_rest).tail(1) for name in SHAPES}
    low = {n: 1000 * seen.steps("drape", c, "gravity_energy").iloc[-1] for n, c in cells.items()}
    most, least = max(low.values()), min(low.values())
    return (
        "Energies of gravity at 30 cells, so heights of the centres of mass: "
        + ", ".join(f"{energy:.2f} mJ ({name})" for name, energy in low.items())
        + f", up to {100 * (most - least) / abs(least):.0f}% apart, of the last two "
        f"{100 * abs(low['orthotropic'] / low['anisotropic'] - 1):.1f}%."
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
    at(
        CONTACT,
        "run collision --solver clarabel,none --set resolution=10 --set stiffness=10,100,1000 "
        "--set step=0.005,0.0025 --duration 0.3 --time-limit 60",
    ),
    fairness="Their stiffness and sphere are not written; they promise no intersection during time "
    "integration only.",
)
def collisions(seen: Evidence) -> Finding:
    """Limits kept, and how deep the sheet is in the sphere."""
    cells = seen.cells("collision", solver="clarabel")
    deep = {
        int(n): 1000 * seen.steps("collision", of, "penetration").max()
        for n, of in cells.groupby("resolution")
    }
    kept = cells["max_violation"].max()
    outside = highest(deep.values()) < 0.1
    return Finding(
        Verdict.of(bool(kept <= 1e-6 and outside), bool(kept <= 1e-6)),
        f"Limits are violated by up to {power(kept)}; after the projection the sheet is in the "
        "sphere by up to " + ", ".join(f"{d:.1f} mm at {n} cells" for n, d in deep.items()) + ".",
        or_missing(lambda: _stiffer(seen)),
    )


def _stiffer(seen: Evidence) -> str:
    told, deeper = [], []
    for stiffness in (10, 100, 1000):
        for step in (0.005, 0.0025):
            free, limited = (
                1000 * seen.steps(CONTACT, cells, "penetration").max()
                for cells in (
                    seen.cells(CONTACT, solver=solver, stiffness=stiffness, step=step)
                    for solver in ("none", "clarabel")
                )
            )
            deeper.append(limited > free)
            told.append(f"{free:.1f} and {limited:.1f} ({stiffness} N/m, {fraction(step)} s)")
    return (
        f"Without limits and with them, at 10 cells, in mm: {', '.join(told)}. With limits it is "
        f"deeper in {sum(deeper)} of {len(deeper)}."
    )
