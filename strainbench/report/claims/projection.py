"""Claims of Tang et al. (2022) about the projection itself: sections 1, 3, 5 and 6."""

from __future__ import annotations

import numpy as np
import pandas as pd

from strainbench.report.claims.claim import Finding, Verdict, at, claim
from strainbench.report.claims.evidence import Evidence, NotThereError
from strainbench.report.claims.reading import tally
from strainbench.report.claims.sides import or_missing
from strainbench.report.local import local_table
from strainbench.report.measures import NO_ANSWER, OPTIMAL, VIOLATED, length
from strainbench.report.numbers import power

FIELD, TIGHTNESS = "claims/field", "claims/tightness"
FRAMES = "run swing --mode replay --frames 14-22 --set resolution=20"
ON_FRAMES = at(
    FIELD,
    f"{FRAMES} --solver newton-ipm,clarabel,clarabel-default,clarabel-paper,qoco-default,"
    "cvxpy-ecos,cvxpy-ecos-default,cvxpy-mosek-default,cvxpy-scs-default,ipopt,ipopt-default,"
    "ipopt-default-lbfgs,admm,linearized-qp,gauss-seidel,fast-projection,ipopt-edges "
    "--time-limit 180",
)
FROM_REST = at(
    TIGHTNESS,
    "run swing --mode replay --frames 1-15 --set resolution=20 --solver clarabel-paper,cvxpy-ecos",
)
CONES = ("newton-ipm", "clarabel", "clarabel-default", "clarabel-paper")
UNLIKE = ("newton-ipm", "clarabel", "admm", "ipopt", "linearized-qp")
"""Methods that have nothing in common but the problem."""
FIRST_ORDER = ("cvxpy-scs-default",)
OUT_OF_THE_BOX = ("clarabel-default", "qoco-default", "cvxpy-ecos-default", "cvxpy-mosek-default")
SCALED = ("cvxpy-ecos", "cvxpy-mosek")
STATIONARY = 1e-5  # KKT residual


@claim(
    "T1",
    "abstract, 3.2, 3.3, 6",
    "With upper bounds alone the projection has exactly one solution.",
    ON_FRAMES,
    fairness="Presupposes that some positions are within the limits: `twist` has none.",
)
def one_solution(seen: Evidence) -> Finding:
    """Answers of unrelated methods, against rigorous bounds on their distance to the optimum."""
    cells = seen.cells(FIELD, solver=UNLIKE)
    apart, bound = 1000 * cells["distance_max"].max(), 1000 * cells["distance_bound_max"].max()
    optimal = int((cells["ending"] == OPTIMAL).sum())
    return Finding(
        Verdict.of(optimal == len(UNLIKE)),
        f"{optimal} of {len(cells)} unrelated methods are certified optimal; their vertices are "
        f"within {length(apart)} of one point.",
        f"Strictly convex objective, convex set; by the certificates' bounds at most "
        f"{length(bound)} over all vertices together.",
    )


@claim(
    "T2",
    "3.2, 6",
    "Limits on compression, and limits on both sides, are not convex.",
    at(
        "compression",
        "run stretch-square --solver sequential-cuts,ipopt,gauss-seidel --set resolution=6,10,20 "
        "--set compression=10% --set sequential-cuts.restriction=rows,polar --set "
        "sequential-cuts.starts=accordion,rest --steps 1 --time-limit 30",
    ),
    fairness="The edge is arithmetic; the other side is one scene.",
)
def not_convex(seen: Evidence) -> Finding:
    """Two admissible gradients of an edge whose midpoint is collapsed; two local optima."""
    along, back = np.array([1.0, 0.0]), np.array([-1.0, 0.0])
    least = 0.9
    between = float(np.linalg.norm((along + back) / 2))
    admissible = all(np.linalg.norm(edge) >= least for edge in (along, back))
    return Finding(
        Verdict.of(admissible and between < least),
        f"An edge and its reverse keep a lower limit of {least:g}; half way between them its "
        f"length is {between:g}.",
        or_missing(_local_optima, seen),
    )


def _local_optima(seen: Evidence) -> str:
    """The two stationary answers to one problem whose objectives are the farthest apart."""
    local = local_table(seen.root / "compression", seen.read("compression"))
    table = pd.DataFrame(local.lines, columns=local.headings)
    known = table[[not isinstance(value, str) for value in table["objective"]]]
    still = known[known["KKT residual"] <= STATIONARY].sort_values("objective")
    pairs = [(of.iloc[0], of.iloc[-1]) for _, of in still.groupby("scene") if len(of) > 1]
    if not pairs:
        raise NotThereError("compression holds no two stationary answers to one problem")
    low, high = max(pairs, key=lambda pair: pair[1]["objective"] / pair[0]["objective"])
    apart = high["objective"] / low["objective"] - 1
    return (
        f"On one problem ({low['scene']}, compression to 10% allowed) two answers that keep all "
        f"limits and are stationary, KKT residuals {power(low['KKT residual'])} "
        f"({low['method']}) and {power(high['KKT residual'])} ({high['method']}), have objectives "
        f"{apart:.0%} apart: in a convex problem they would be the same."
    )


@claim(
    "T3",
    "Eqs. 9-12",
    "The cone program equals the quadratically constrained one.",
    ON_FRAMES,
    FROM_REST,
    fairness="MOSEK's presolve and dualiser; a tolerance of 1e-8 relative to t0.",
)
def cone_program(seen: Evidence) -> Finding:
    """Eq. 12 to the letter beside the same cones with a quadratic objective."""
    literal, ours = (seen.one(FIELD, solver=s) for s in ("clarabel-paper", "clarabel"))
    rest = or_missing(_from_rest, seen)
    other = " ".join(or_missing(tell, seen) for tell in (_about_target, _far))
    return Finding(
        Verdict.of(literal["ending"] == OPTIMAL, literal["max_violation"] <= 1e-6),
        f"Equal in exact arithmetic. In motion (frames 14 to 22) Eq. 12 to the letter violates "
        f"limits by {power(literal['max_violation'])}, with a gap of "
        f"{power(literal['relative_gap_max'])}; the quadratic objective, by the same solver, has "
        f"{power(ours['relative_gap_max'])}. {rest}",
        other,
    )


def _from_rest(seen: Evidence) -> str:
    """Frames whose corrections are small beside the positions."""
    cell = seen.one(TIGHTNESS, solver="clarabel-paper", mode="replay:1-15", limit=0.01)
    optimal, of = int(cell["projections_optimal"]), int(cell["projections"])
    far = length(1000 * cell["distance_max"])
    if optimal == of:
        return f"From rest (1 to 15) it is optimal in all {of} frames, within {far}."
    return (
        f"From rest (1 to 15), where corrections are small, it is optimal in {optimal} of {of} "
        f"frames, with gaps up to {power(cell['relative_gap_max'])} and vertices up to {far} away: "
        "its linear objective t0 - x'x loses digits."
    )


def _about_target(seen: Evidence) -> str:
    """ECOS, which knows linear objectives and cones alone, given displacements in edges."""
    cells = [_answered(seen, FIELD, solver="cvxpy-ecos")]
    cells += [_answered(seen, TIGHTNESS, solver="cvxpy-ecos", mode="replay:1-15", limit=0.01)]
    gaps = " and ".join(power(cell["relative_gap_max"]) for cell in cells)
    far = length(1000 * max(cell["distance_max"] for cell in cells))
    ended = " and ".join(dict.fromkeys(cell["ending"] for cell in cells))
    return (
        "By another solver, ECOS, which takes linear objectives and cones alone, with "
        f"displacements from the target as unknowns and scaled: {ended}, gaps {gaps} (in motion, "
        f"from rest), vertices within {far}."
    )


def _far(seen: Evidence) -> str:
    """The same problem a long way from the origin."""
    of = {"scenario": "stress", "case": "far", "severity": 1.0}
    literal, ours = (seen.one("failures", solver=s, **of) for s in ("clarabel-paper", "clarabel"))
    return (
        f"Far from the origin (`stress`, far) Eq. 12 to the letter {_verb(literal)}, with the "
        f"quadratic objective it {_verb(ours)}."
    )


def _verb(cell: pd.Series) -> str:
    said = ended(cell)
    return said if said.startswith("violates") else f"ends {said}"


def _answered(seen: Evidence, folder: str, **wanted: object) -> pd.Series:
    """A cell that has answers; NotThereError with its reason for one that has none."""
    cell = seen.one(folder, **wanted)
    if cell["ending"] == NO_ANSWER:
        raise NotThereError(f"in {folder} {_unavailable(cell)}")
    return cell


def _unavailable(cell: pd.Series) -> str:
    """Why a solver could not run: `cvxpy's backend ECOS is not installed`."""
    why = str(cell["reason"]).rpartition("unavailable: ")[2]
    return f"{cell['solver']} has no answer: {why.partition(';')[0].partition(' (')[0]}"


@claim(
    "T4",
    "3.3",
    "Any solver of second-order cone programs can solve it.",
    ON_FRAMES,
    fairness="Default tolerances. ECOS is an extra (`strainbench[ecos]`), MOSEK needs a licence; "
    "`strainbench export` writes CBF for others.",
)
def any_solver(seen: Evidence) -> Finding:
    """Cone solvers out of the box."""
    names = OUT_OF_THE_BOX + FIRST_ORDER
    asked = seen.cells(FIELD, solver=names + SCALED)
    idle = asked["reason"].astype(str).str.startswith("unavailable")
    cells, others = asked[~idle], asked[idle]
    known = {name.removesuffix("-default") for name in asked["solver"]}
    missing = [s for s in names if s.removesuffix("-default") not in known]
    said = [f"{r['solver']} {ended(r)}" for _, r in cells.iterrows()]
    said += [_unavailable(r) for _, r in others.iterrows()]
    said += [f"not measured yet: {', '.join(missing)}"] if missing else []
    optimal = cells["ending"] == OPTIMAL
    interior = optimal[~cells["solver"].isin(FIRST_ORDER)]
    return Finding(
        Verdict.of(bool(optimal.all()), bool(len(interior) and interior.all())),
        f"Out of the box (`-default`), or scaled: {'; '.join(said)}. {_first_order(cells)}".strip(),
        or_missing(_violated, seen),
    )


def ended(cell: pd.Series) -> str:
    """An ending with its number."""
    if cell["ending"] == VIOLATED:
        return str(cell["why"])
    why = f"gap {power(cell['relative_gap_max'])}" if cell["ending"] == OPTIMAL else cell["why"]
    return f"{cell['ending']} ({why})" if why else str(cell["ending"])


def _first_order(cells: pd.DataFrame) -> str:
    """What sets those apart that are not optimal."""
    short = cells[cells["ending"] != OPTIMAL]
    if short.empty or not short["solver"].isin(FIRST_ORDER).all():
        return ""
    return "Interior points solve it; SCS, a first-order method, stops earlier."


def _violated(seen: Evidence) -> str:
    """On how many random problems each stops beyond the limits, by its own test or the clock."""
    counts = tally(seen)
    counts = counts[counts.index.isin(("cvxpy-default", *OUT_OF_THE_BOX, *FIRST_ORDER))]
    told = ", ".join(f"{name} {count}" for name, count in counts["violated"].items())
    said = f"of these {counts['solved, but violated'].sum()} are said to be solved"
    return f"On 200 random problems (`make certificates`), beyond the limits: {told}; {said}."


@claim(
    "T11",
    "3.1, 5, Fig. 2",
    "Any limits in any directions: isotropic, orthotropic, anisotropic.",
    at(
        "drape",
        "run drape --solver newton-ipm,clarabel --set resolution=30,60 --set "
        "shape=isotropic,orthotropic,anisotropic --steps 5",
    ),
    fairness="The corners' distance and the curves are read off plots.",
)
def any_limits(seen: Evidence) -> Finding:
    """Certified drapes within three curves."""
    solvers = ("newton-ipm", "clarabel")
    cells = {n: seen.cells("drape", solver=solvers, resolution=n) for n in (30, 60)}
    told = "; ".join(f"at {n} cells {_drapes(of)}" for n, of in cells.items())
    whole = [of.loc[of["ending"] == OPTIMAL, "shape"].nunique() == 3 for of in cells.values()]
    return Finding(
        Verdict.of(all(whole), any(whole)),
        f"{told[0].upper()}{told[1:]}.",
        "The drapes are minima of energy by a barrier method without projections.",
    )


def _drapes(cells: pd.DataFrame) -> str:
    """What became of each curve by each solver; a failure of one is not one of the program."""
    ends = [
        f"{row.shape}: {row.solver} {row.ending} (violation {power(row.max_violation)}, "
        f"{length(1000 * row.distance_max)} from the projection)"
        for row in cells.sort_values("shape", kind="stable").itertuples()
    ]
    return ", ".join(ends)


@claim(
    "T13",
    "3.1, Fig. 2, 5",
    "Constraints are satisfied precisely, whatever the limits.",
    at(
        "directions",
        "run swing --solver newton-ipm --mode replay --set resolution=10 --set "
        "directions=2,4,8,18,36,exact --steps 10",
    ),
    fairness="They do not claim all directions.",
)
def precisely(seen: Evidence) -> Finding:
    """In the sampled directions, and between them."""
    cells = seen.cells("directions", solver="newton-ipm").sort_values("max_principal_stretch")
    sampled = cells["max_violation"].max()
    beyond = {
        r["directions"]: r["max_principal_stretch"] - 1 - r["limit"] for _, r in cells.iterrows()
    }
    four = beyond.get("4", np.nan)
    closed = 1.01 / np.cos(np.pi / 8)
    return Finding(
        Verdict.of(sampled <= 1e-6 and four <= 1e-6, sampled <= 1e-6),
        f"In the sampled directions to {power(sampled)}. Between 4 of them the true stretch goes "
        f"beyond 1% by {power(four)}, between 18 by {power(beyond.get('18', np.nan))}; exact "
        f"limits keep it to {power(max(beyond.get('exact', np.nan), 0.0))}.",
        f"By the closed form b / cos(pi / 2m) at most {closed:.4f} for four directions: "
        f"{'not' if 1.01 + four <= closed else 'WRONGLY'} exceeded.",
    )
