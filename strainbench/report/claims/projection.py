"""Claims of Tang et al. (2022) about the projection itself: sections 1 to 3, 5 and 6."""

from __future__ import annotations

import numpy as np

from strainbench.report.claims.claim import Finding, Verdict, at, claim
from strainbench.report.claims.evidence import Evidence
from strainbench.report.measures import OPTIMAL, VIOLATED, length
from strainbench.report.numbers import power
from strainbench.report.versions import NOT_INSTALLED

FIELD, LINEARISED = "claims/field", "claims/linearised"
FRAMES = "run swing --mode replay --frames 14-22 --set resolution=20"
ON_FRAMES = at(
    FIELD,
    f"{FRAMES} --solver newton-ipm,clarabel,clarabel-default,clarabel-paper,qoco-default,"
    "cvxpy-ecos,cvxpy-scs-default,ipopt,ipopt-default,ipopt-default-lbfgs,admm,linearized-qp,"
    "gauss-seidel,fast-projection,ipopt-edges --time-limit 180",
)
HARD = (
    'make failures FAILURES=results/failures HARD="--set resolution=10 --time-limit 10 --solver '
    "admm,augmented-lagrangian,clarabel,clarabel-default,clarabel-paper,cvxpy,cvxpy-ecos,cvxpy-scs,"
    "dykstra,fast-projection,gauss-seidel,gauss-seidel-strain,gauss-seidel-principal,ipopt,"
    'ipopt-edges,linearized-qp,newton-ipm,none,qoco,xpbd --results results/failures"'
)
UNLIKE = ("newton-ipm", "clarabel", "admm", "ipopt", "linearized-qp")
"""Methods that have nothing in common but the problem."""


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


@claim("T2", "3.2, 6", "Limits on compression, and limits on both sides, are not convex.")
def not_convex(_: Evidence) -> Finding:
    """Two admissible gradients of an edge whose midpoint is collapsed."""
    along, back = np.array([1.0, 0.0]), np.array([-1.0, 0.0])
    least = 0.9
    between = float(np.linalg.norm((along + back) / 2))
    admissible = all(np.linalg.norm(edge) >= least for edge in (along, back))
    return Finding(
        Verdict.of(admissible and between < least),
        f"An edge and its reverse keep a lower limit of {least:g}; half way between them its "
        f"length is {between:g}.",
        "The referee calls no answer under lower limits optimal, at best a local optimum "
        "(`pytest tests/referee/test_kkt.py -k local`).",
    )


@claim(
    "T3",
    "Eqs. 9-12",
    "The cone program equals the quadratically constrained one.",
    ON_FRAMES,
    fairness="MOSEK's presolve and dualiser; a tolerance of 1e-8 relative to t0.",
)
def cone_program(seen: Evidence) -> Finding:
    """Eq. 12 to the letter beside the same cones with a quadratic objective."""
    literal, ours = (seen.one(FIELD, solver=s) for s in ("clarabel-paper", "clarabel"))
    return Finding(
        Verdict.of(literal["ending"] == OPTIMAL, literal["max_violation"] <= 1e-6),
        f"Equal in exact arithmetic. Eq. 12 to the letter keeps the limits to "
        f"{power(literal['max_violation'])} with a gap of {power(literal['relative_gap_max'])}; "
        f"the quadratic objective, by the same solver, {power(ours['relative_gap_max'])}: its "
        "linear objective t0 - x'x loses digits.",
        f"Farthest vertex from the optimum: {length(1000 * literal['distance_max'])} and "
        f"{length(1000 * ours['distance_max'])}.",
    )


@claim(
    "T4",
    "3.3",
    "Any solver of second-order cone programs can solve it.",
    ON_FRAMES,
    fairness="Default tolerances; MOSEK is not free (`strainbench export` writes CBF for it).",
)
def any_solver(seen: Evidence) -> Finding:
    """Cone solvers out of the box."""
    names = ("clarabel-default", "qoco-default", "cvxpy-ecos", "cvxpy-scs-default")
    cells = seen.cells(FIELD, solver=names)
    cells = cells[cells["why"] != NOT_INSTALLED]
    said = "; ".join(f"{r['solver']} {r['ending']} {r['why']}".strip() for _, r in cells.iterrows())
    interior = cells[cells["solver"] != "cvxpy-scs-default"]
    kept = (interior["max_violation"] <= 1e-5).all()
    return Finding(
        Verdict.of(bool((cells["max_violation"] <= 1e-6).all()), bool(kept)),
        f"{said}.",
        "On 200 random problems (`make certificates`): SCS out of the box is the one that says "
        "solved while limits are violated.",
    )


@claim(
    "T5",
    "1, 3.3",
    "A cone program is much cheaper than general nonlinear programming.",
    ON_FRAMES,
    fairness="MUMPS against MA57; which Hessian and scaling their Ipopt was given is not written.",
)
def cheaper_than_nlp(seen: Evidence) -> Finding:
    """Ipopt, scaled and out of the box, beside the cone solver."""
    scaled = seen.ratio(FIELD, "time", {"solver": "clarabel"}, solver="ipopt")
    literal = seen.ratio(FIELD, "time", {"solver": "clarabel-paper"}, solver="ipopt")
    default = seen.one(FIELD, solver="ipopt-default")
    cells = [seen.one(FIELD, solver=s) for s in ("ipopt", "clarabel")]
    counts = " and ".join(f"{c['iterations_mean']:.0f}" for c in cells)
    return Finding(
        Verdict.of(scaled > 5 and literal > 1, scaled > 1),
        f"In edge lengths, with the exact Hessian, Ipopt takes {scaled:.1f} times as long as "
        f"Clarabel and {literal:.2f} times as long as Eq. 12 to the letter; out of the box it ends "
        f"{default['ending']} ({default['why']}). It is not a matter of the class of problem.",
        f"Iterations of Ipopt and of Clarabel: {counts}.",
    )


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
    HARD,
    fairness="Weights of the masses; their line search.",
)
def coupling(seen: Evidence) -> Finding:
    """Fast projection beside Gauss-Seidel, and where masses differ by 1e4."""
    fast, local = (seen.one(FIELD, solver=s) for s in ("fast-projection", "gauss-seidel"))
    hard = seen.one(
        "failures", scenario="stress", case="mass-ratio", severity=1.0, solver=fast["solver"]
    )
    ratio = local["time"] / fast["time"]
    return Finding(
        Verdict.of(ratio > 1 and hard["ending"] == VIOLATED, ratio > 1),
        f"Gauss-Seidel takes {ratio:.1f} times as long; both stop at admissible points, "
        f"{length(1000 * fast['distance_max'])} (fast) and {length(1000 * local['distance_max'])} "
        f"from the projection. At a mass ratio of 1e4 fast projection is {hard['ending']} "
        f"({hard['why']}).",
        "Time to equal distance: `strainbench converge swing --frame 30 --set resolution=20`.",
    )


@claim(
    "T8",
    "2",
    "Linearised formulations cannot enforce limits tightly.",
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
    fairness="Their active-set iteration on equalities is not here; only their limits on edges.",
)
def edges(seen: Evidence) -> Finding:
    """What limits on edge lengths allow."""
    found = seen.one(FIELD, solver="ipopt-edges")
    return Finding(
        Verdict.NOT_TESTABLE,
        "Upper limits on edges alone are convex, so the comparison does not apply to them. Their "
        f"optimum is another set's: it violates the limits on directions by "
        f"{power(found['max_violation'])}, {length(1000 * found['distance_max'])} away.",
    )


@claim(
    "T10",
    "2",
    "ADMM applies too.",
    ON_FRAMES,
    fairness="Penalty weights.",
)
def admm(seen: Evidence) -> Finding:
    """The same optimum."""
    found, ours = (seen.one(FIELD, solver=s) for s in ("admm", "clarabel"))
    return Finding(
        Verdict.of(found["ending"] == OPTIMAL),
        f"ADMM ends {found['ending']}, {length(1000 * found['distance_max'])} from the optimum, in "
        f"{found['time'] / ours['time']:.1f} times Clarabel's time.",
        "Time against gap: `results/convergence`.",
    )


@claim(
    "T11",
    "3.1, 5, Fig. 2",
    "Any limits in any directions: isotropic, orthotropic, anisotropic.",
    at(
        "drape",
        "run drape --solver newton-ipm --set resolution=60 --set "
        "shape=isotropic,orthotropic,anisotropic --steps 2",
    ),
    fairness="The corners' distance and the curves are read off plots.",
)
def any_limits(seen: Evidence) -> Finding:
    """Certified drapes within three curves."""
    cells = seen.cells("drape", solver="newton-ipm", resolution=60)
    shapes = cells.drop_duplicates("shape", keep="last")
    kept = (shapes["max_violation"] <= 1e-6).all() and len(shapes) == 3
    worst = 1000 * shapes["distance_max"].max()
    return Finding(
        Verdict.of(bool(kept)),
        f"{len(shapes)} curves, largest violation {power(shapes['max_violation'].max())}, farthest "
        f"vertex {length(worst)} from the projection.",
        "The drapes are minima of energy by a barrier method without projections.",
    )


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
