"""The referee: what an answer is worth, from its positions alone.

With any multipliers Y, L(x) = f(x) + sum_i <Y_i, (G x)_i> - b_i |Y_i| is strongly convex, with
its minimum D(Y) at x_Y = target - M^-1 G^T Y on the free vertices. So, in the norm of M:

1. D(Y) = <Y, G target> - 1/2 ||G^T Y||^2_{M^-1} - sum b_i |Y_i| is a lower bound on f(x*);
   with exact limits |Y_i| is the nuclear norm of an element's multiplier matrix.
2. A point with violations v_i has L(x) <= f(x) + sum |Y_i| v_i, so
   1/2 ||x - x_Y||^2 <= f(x) + sum |Y_i| v_i - D(Y): its gap, never negative. Of several
   Y that are known the gap is the least.
3. A feasible x_ref has 1/2 ||x_ref - x*||^2 <= f(x_ref) - D(Y), and x* the same distance to x_Y
   at most, so ||x - x*|| <= min(||x - x_ref||, ||x - x_Y||) + sqrt(2 (f(x_ref) - D(Y))).
   A feasible x is itself such an x_ref: ||x - x*|| <= sqrt(2 (f(x) - D(Y))).

Y and x_ref come from a reference solver (`strainbench.referee.reference`); nothing that it claims
is used: Y may be anything, and x_ref is feasible or is not used.

Lower bounds on stretch make the problem nonconvex: there is no such D, and no answer is called
optimal. What remains is whether x meets the limits, whether it is a local optimum
(`strainbench.referee.kkt`), and how its objective compares with the best that is known. So it is
with limits on principal stretches, and in the norm of a metric; for the former the reason says how
far apart singular values are where limits are active: where they are equal, what is within the
limits depends on how they are decomposed, here by LAPACK with rotations.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from threadpoolctl import threadpool_limits

from strainbench.arrays import FloatArray
from strainbench.problem.contact import depths, rubs
from strainbench.problem.dual import dual_gap, relative
from strainbench.problem.problem import Problem
from strainbench.referee.kkt import kkt_residual, smallest_gap
from strainbench.referee.reference import Reference, reference_of
from strainbench.solver.solver import check_threads

OUTCOMES = ("optimal", "feasible", "violated", "no answer")


@dataclass(frozen=True)
class Certificate:
    """What the referee found; lengths in m, objectives in m^2 (kg m^2 with masses).

    Attributes
    ----------
    outcome : "optimal" (violation and gap both met), "feasible" (the violation alone),
        "violated", or "no answer" (nothing usable came back).
    reason : in words, where the outcome is not "optimal".
    max_violation : largest max(0, ||F d|| - b) over the limited directions, or b - ||F d|| of a
        lower bound; with exact limits largest max(0, ||F D||_2 - 1) times the tightest axis's
        bound.
    max_principal_stretch : largest singular value of any F, the true stretch.
    min_principal_stretch : smallest one, how far an element is compressed.
    objective : f(x) = 1/2 ||x - target||_M^2.
    lower_bound : D(Y) <= f(x*), or 0 where the reference failed.
    relative_gap : (f(x) + sum |Y_i| v_i - D) / max(D, floor); for a feasible point the usual
        (f - D) / D. The floor is half a squared correction of 1e-3 edges a vertex.
    distance : largest distance of a vertex from the reference solution; NaN without one.
    distance_bound : rigorous upper bound on ||x - x*||, the 2-norm over all vertices.
    reference_error : rigorous upper bound on ||x_ref - x*|| in the same norm.
    active_constraints : constraints within 1e-6 of their bound at the reference solution.
    kkt_residual, best_known : only with lower bounds, which leave no lower bound on the objective,
        gap or distance (NaN): the residual of the conditions of a *local* optimum (see
        `strainbench.referee.kkt`), and the least objective known of any positions within the
        limits.
    """

    outcome: str
    reason: str
    max_violation: float
    max_principal_stretch: float
    objective: float
    lower_bound: float
    relative_gap: float
    distance: float
    distance_bound: float
    reference_error: float
    active_constraints: int
    kkt_residual: float = float("nan")
    best_known: float = float("nan")
    min_principal_stretch: float = float("nan")


def certify(
    problem: Problem,
    positions: FloatArray,
    violation: float = 1e-6,
    gap: float = 1e-4,
    reference: Reference | None = None,
    best_known: float = float("inf"),
    threads: int = 1,
) -> Certificate:
    """Judge an answer to `problem`; there is a verdict on any answer to any problem.

    Parameters
    ----------
    positions : (n, 3) [m]; pinned vertices count as lying at their targets, so moving a pin
        shows as stretch of the elements around it.
    violation, gap : thresholds of the outcome; with lower bounds, `gap` is that of the residual
        below which an answer is called a local optimum.
    reference : of this very problem, where it is known already.
    best_known : with lower bounds, the least objective known of other answers within the limits.
    threads : of BLAS and OpenMP, for the reference.

    Raises
    ------
    ValueError
        If a threshold is not positive, or for no whole number of threads.

    Examples
    --------
    What violates no limit need not be the projection: a sheet at rest, far from its target.

    >>> rest, target = [[0, 0], [1, 0], [0, 1]], [[0, 0, 0], [1.3, 0, 0], [0, 1, 0]]
    >>> problem = Problem(rest, [[0, 1, 2]], target, StretchLimits.isotropic(1.1, directions=2))
    >>> found = certify(problem, [[0, 0, 0], [1, 0, 0], [0, 1, 0]])
    >>> found.outcome, round(found.objective, 3), round(found.lower_bound, 3)
    ('feasible', 0.045, 0.01)
    """
    if not (violation > 0 and gap > 0):
        raise ValueError(f"violation is {violation} and gap {gap}: numbers above 0 are valid")
    check_threads(threads)
    reason = _unusable(problem, positions)
    if reason:
        nan = float("nan")
        return Certificate("no answer", reason, nan, nan, nan, nan, nan, nan, nan, nan, 0)
    x = np.array(positions, dtype=np.float64)
    x[problem.pinned] = problem.target[problem.pinned]
    if reference is None:
        with threadpool_limits(threads):
            reference = reference_of(problem)
    with np.errstate(all="ignore"):  # an answer may be infinitely wrong
        if problem.convex:
            return _certify_optimum(problem, x, violation, gap, reference)
        return _certify_local(problem, x, violation, gap, reference, best_known)


def _certify_optimum(
    problem: Problem, x: FloatArray, violation: float, gap: float, ref: Reference
) -> Certificate:
    """Judge positions by the bounds of the module's docstring.

    The objective of isolated vertices is a sum of its own, whose optimum is 0 at their target: how
    far they are from there is known, and the bounds are those of the other vertices.
    """
    v = _violations(problem, x)
    least, largest = _principal_stretches(problem, x)
    worst = float(v.max())
    inside = x.copy()
    inside[problem.isolated] = problem.target[problem.isolated]
    astray = float(np.linalg.norm(x - inside))
    true_gap = dual_gap(ref.duals[0], problem.objective(inside), v)
    radius = float(np.sqrt(2 * true_gap / problem.least_weight))
    apart = float(np.linalg.norm(inside - ref.positions))
    bound = float(np.fmin(apart, radius)) + ref.error
    if worst == 0:
        bound = min(bound, radius)
    objective = problem.objective(x)
    total = min(dual_gap(dual, objective, v) for dual in ref.duals)
    relative_gap = relative(problem, total, ref.lower_bound)
    outcome, reason = _outcome(ref, worst, relative_gap, violation, gap)
    return Certificate(
        outcome=outcome,
        reason=reason,
        max_violation=worst,
        max_principal_stretch=largest,
        min_principal_stretch=least,
        objective=objective,
        lower_bound=ref.lower_bound,
        relative_gap=relative_gap,
        distance=float(np.linalg.norm(x - ref.positions, axis=1).max()),
        distance_bound=float(np.hypot(bound, astray)),
        reference_error=ref.error,
        active_constraints=ref.active_constraints,
    )


def _certify_local(
    problem: Problem,
    x: FloatArray,
    violation: float,
    gap: float,
    ref: Reference,
    best_known: float,
) -> Certificate:
    """Judge positions under lower bounds: at best a local optimum."""
    worst = float(_violations(problem, x).max())
    least, largest = _principal_stretches(problem, x)
    objective = problem.objective(x)
    residual = kkt_residual(problem, x) if np.isfinite(worst + objective) else float("inf")
    for y in (x, ref.positions):
        if _violations(problem, y).max() <= violation:
            best_known = min(best_known, problem.objective(y))
    outcome, nan = "feasible", float("nan")
    excess = relative(problem, objective - best_known, best_known)
    if worst > violation:
        outcome, reason = "violated", _violated(ref, worst, violation)
    elif rubs(problem.contact):
        reason = "contact with friction: no projection, so that no optimum is to be expected"
    elif not residual <= gap:
        reason = f"no local optimum: KKT residual {residual:.2e} above {gap:.0e}"
    else:
        reason = f"at best a local optimum: KKT residual {residual:.2e}"
    if outcome == "feasible":
        reason += f", objective {excess:.2e} above the best known"
    if np.isfinite(values := smallest_gap(problem, x)):
        reason += f", singular values {values:.0e} apart where limits are active"
    return Certificate(
        outcome=outcome,
        reason=reason,
        max_violation=worst,
        max_principal_stretch=largest,
        min_principal_stretch=least,
        objective=objective,
        lower_bound=nan,
        relative_gap=nan,
        distance=nan,
        distance_bound=nan,
        reference_error=nan,
        active_constraints=ref.active_constraints,
        kkt_residual=residual,
        best_known=best_known,
    )


def _unusable(problem: Problem, positions: FloatArray) -> str | None:
    """Why an answer cannot be judged at all, or None."""
    try:
        array = np.asarray(positions)
    except Exception as error:  # whatever a solver's own type raises
        return f"positions that are no array: {' '.join(str(error).split())}"
    if array.shape != problem.target.shape:
        return f"positions of shape {array.shape}, not {problem.target.shape}"
    if array.dtype.kind not in "iuf":
        return f"positions of type {array.dtype}"
    with np.errstate(over="ignore"):
        array = array.astype(np.float64)
    bad = np.flatnonzero(~np.isfinite(array).all(axis=1))
    if len(bad):
        return f"positions of {len(bad)} vertices are not finite"
    return None


def _violations(problem: Problem, x: FloatArray) -> FloatArray:
    """Those of finite positions: infinite where they are too large to be computed.

    Depths within planes follow those of the limits, in mean edges.
    """
    v = problem.violations(x)
    if problem.contact:
        deep = depths(problem.contact, x[problem.used]) / problem.edge_length
        v = np.concatenate([v, deep])
    return np.where(np.isnan(v), np.inf, v)


def _principal_stretches(problem: Problem, x: FloatArray) -> tuple[float, float]:
    """The smallest and the largest singular value of any F."""
    size = float(np.abs(x).max()) or 1.0  # or the squares of a diverged answer overflow
    F = problem.deformation_gradients(x / size)
    scale = float(np.abs(F).max()) or 1.0
    F = F / scale
    squares = np.linalg.eigvalsh(np.swapaxes(F, 1, 2) @ F)
    least, largest = (float(np.sqrt(max(0.0, s))) for s in (squares.min(), squares.max()))
    return size * scale * least, size * scale * largest


def _outcome(
    ref: Reference,
    worst: float,
    relative_gap: float,
    violation: float,
    gap: float,
) -> tuple[str, str]:
    """Outcome and reason from the two thresholds."""
    if worst > violation:
        return "violated", _violated(ref, worst, violation)
    if relative_gap <= gap:
        return "optimal", ""
    if not np.isfinite(ref.error):
        reason = "the reference solver found no feasible point to compare with"
        return "feasible", reason if ref.failure is None else f"{reason} ({ref.failure})"
    return "feasible", f"relative gap {relative_gap:.2e} above {gap:.0e}"


def _violated(ref: Reference, worst: float, violation: float) -> str:
    """The reason of that outcome."""
    reason = ref.infeasible or f"violation {worst:.2e} above {violation:.0e}"
    if ref.failure is None or np.isfinite(ref.error):
        return reason
    return f"{reason}; the reference failed ({ref.failure})"
