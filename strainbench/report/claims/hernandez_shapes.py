"""Claims of Hernandez et al. (2013) about derivatives, axes, and the beams of Fig. 2."""

from __future__ import annotations

import numpy as np
import pandas as pd

from strainbench.arrays import FloatArray
from strainbench.problem.principal import PrincipalLimits
from strainbench.problem.principal_rows import FREE, KINDS, SEPARATION, linear, rotation_svd
from strainbench.report.claims.claim import Finding, Verdict, claim
from strainbench.report.claims.evidence import Evidence, NotThereError
from strainbench.report.claims.hernandez import LIMIT, VOLUMES, violation
from strainbench.report.numbers import power
from strainbench.scenario.registry import find_scenario
from strainbench.scenario.stage import Stage
from strainbench.solver.registry import find_solver

DIFFERENCE = 1e-6  # of F
LOWER, UPPER = (None, 1 - LIMIT, 1 - LIMIT), (None, 1 + LIMIT, 1 + LIMIT)


@claim(
    "H2",
    "3.5, Eqs. 13-18",
    "The Jacobians of the limits are as printed.",
    fairness="Their code may have kept equal values apart.",
)
def jacobians(_: Evidence) -> Finding:
    """Derivatives against central differences, and their size as two values meet."""
    rng = np.random.default_rng(0)
    F = _distinct(rng.normal(size=(400, 3, 3)))
    error = max(_wrong(kind, F, rng.normal(size=F.shape)) for kind in KINDS)
    gaps = (0.1, 0.01, 1e-3, 1e-5)
    sizes = [_slope(gap) for gap in gaps]
    told = ", ".join(f"{size:.3g}" for size in sizes)
    return Finding(
        Verdict.of(error < 1e-6 and sizes[-1] < 10 * sizes[0], error < 1e-6),
        f"Of {len(F)} random F, inverted ones among them, the derivatives of all {len(KINDS)} "
        f"kinds are central differences to {power(error)}. They are singular where singular "
        f"values are equal or opposite, such as at F = I: at gaps of .1, .01, 1e-3, 1e-5 "
        f"the largest has the size {told}.",
        f"Values are kept {SEPARATION:g} apart here, also those of opposite sign: "
        "`pytest tests/problem/test_principal.py`.",
    )


def _distinct(F: FloatArray) -> FloatArray:
    """Those whose singular values are apart, and not 0."""
    s = np.linalg.svd(F, compute_uv=False)
    return F[(-np.diff(s, axis=1) > 0.1).all(axis=1) & (s[:, 2] > 0.1)]


def _wrong(kind: str, F: FloatArray, towards: FloatArray) -> float:
    """The largest difference of a derivative, relative to the largest one of its element."""
    same = kind == "isotropic"
    limits = PrincipalLimits(kind, 1 - LIMIT if same else LOWER, 1 + LIMIT if same else UPPER)
    slope = np.einsum("ecxy,exy->ec", limits.linearised(F)[1], towards)
    ahead, behind = (limits.values(F + k * DIFFERENCE * towards) for k in (1, -1))
    wrong = np.abs((ahead - behind) / (2 * DIFFERENCE) - slope).max(axis=1)
    return float(np.max(wrong / np.maximum(np.abs(slope).max(axis=1), 1.0)))


def _slope(gap: float) -> float:
    """The largest entry of a derivative at stretches of 1.1 + gap, 1.1 and .9, turned."""
    c, s = np.cos(np.pi / 8), np.sin(np.pi / 8)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    F = np.diag([1.1 + gap, 1.1, 0.9]) @ turn.T
    limits = PrincipalLimits("hyperbolic", None, (None, 1 + LIMIT, 1 + LIMIT))
    return float(np.abs(limits.linearised(F[None])[1]).max())


@claim(
    "H6",
    "5.2",
    "Linear limits are violated late as V is turned by 180 degrees about the vertical.",
    fairness="Their decomposition may number and turn equal values otherwise.",
)
def turned(_: Evidence) -> Finding:
    """What turns of the principal axes change, in the beam of Fig. 4 before the first violation."""
    scene = find_scenario("beam-compress")(kind="linear", step=0.02)  # type: ignore[call-arg]
    stage = Stage.opened(scene, find_solver("none"))
    list(stage.steps(13))
    problem, x = stage.problem, stage.positions
    frames = rotation_svd(problem.deformation_gradients(x))
    upper = np.array([FREE["linear"][1]] * 2 + [1 + LIMIT])

    def radius(degrees: float) -> FloatArray:
        c, s = np.cos(np.deg2rad(degrees)), np.sin(np.deg2rad(degrees))
        about = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
        axes = np.swapaxes(about @ frames.V, 1, 2)
        return frames.s[:, :, None] - linear(frames.s, axes, upper).value

    change = {k: float(np.abs(radius(k) / radius(0) - 1).max()) for k in (180.0, 10.0)}
    moved = x + 1e-4 * np.random.default_rng(0).normal(size=x.shape)
    cosines = np.einsum(
        "eij,eij->ej", frames.V, rotation_svd(problem.deformation_gradients(moved)).V
    )
    share = np.mean(np.abs(cosines).min(axis=1) < np.cos(np.deg2rad(10)))
    return Finding(
        Verdict.of(change[180.0] > 1e-9),
        f"Eqs. 21 and 22 see squares of V alone: half a turn about the vertical changes the limits "
        f"by {power(change[180.0])} of their size, 10 degrees by a factor of up to "
        f"{1 + change[10.0]:.2g}. What relaxes the limited axis is any other turn.",
        f"The closest two stretches of an element, the transverse ones, differ by "
        f"{np.median(frames.gaps):.3f} in the median, so that V is nearly free about the vertical: "
        f"vertices moved by .1 mm turn the axes by more than 10 degrees in {100 * share:.0f}% of "
        "the elements.",
    )


def _beam(
    seen: Evidence, material: str, young: float, step: float, alpha: float = 2.0
) -> pd.Series:
    table = seen.table("volumes", "beams.csv")
    rows = table[(table["material"] == material) & (table["young"] == young)]
    rows = rows[(rows["step_ms"] == step) & (rows["alpha"] == alpha)]
    if rows.empty:
        raise NotThereError(f"volumes holds no {material} beam at {step:g} ms")
    return rows.iloc[0]


def _fig_2(seen: Evidence) -> dict[str, pd.Series]:
    given = {"stiff": 2e5, "anisotropic": 5e3, "isotropic": 5e3}
    return {name: _beam(seen, name, young, 20.0) for name, young in given.items()}


@claim(
    "H7",
    "1, 5.1, Fig. 2",
    "The soft beam with anisotropic limits stretches far more along its axis and wobbles along it; "
    "the isotropic and the stiff one do not.",
    VOLUMES,
    fairness="Damping and step are not written; the soft beams never settle wholly.",
)
def wobbles(seen: Evidence) -> Finding:
    """Stretch along the axis, and how much the length varies late."""
    beams = _fig_2(seen)
    stretch = {name: float(beam["along"]) - 1 for name, beam in beams.items()}
    wobble = {name: float(beam["wobble"]) for name, beam in beams.items()}
    others = ("stiff", "isotropic")
    far = all(stretch["anisotropic"] > 2 * stretch[name] for name in others)
    told = "; ".join(
        f"{name}: tip at ({b['tip_x']:.3f}, {b['tip_y']:.3f}) m, stretched by up to "
        f"{100 * stretch[name]:.0f}% along the axis, its length varies by {wobble[name]:.0f} mm"
        for name, b in beams.items()
    )
    return Finding(
        Verdict.of(far and all(wobble["anisotropic"] > 2 * wobble[n] for n in others), far),
        f"In steps of 20 ms, after 1.2 s: {told}.",
        f"At 10 ms the anisotropic beam's tip is at "
        f"y = {_beam(seen, 'anisotropic', 5e3, 10.0)['tip_y']:.3f} m.",
    )


@claim(
    "H8",
    "5.1",
    "The stiff beam, of 200 kPa, has a similar vertical deformation as the anisotropic one.",
    VOLUMES,
    fairness="Their stiffness is chosen by eye.",
)
def similar(seen: Evidence) -> Finding:
    """Heights of both tips."""
    stiff = float(_beam(seen, "stiff", 2e5, 20.0, 6.0)["tip_y"])  # at rest by then
    soft = float(_beam(seen, "anisotropic", 5e3, 20.0)["tip_y"])
    apart = abs(stiff / soft - 1)
    return Finding(
        Verdict.of(apart < 0.1, apart < 0.4),
        f"Tips at y = {stiff:.3f} m (stiff) and {soft:.3f} m: {100 * apart:.0f}% apart.",
    )


@claim(
    "H12",
    "1",
    "Limits on strain allow larger time steps than a stiff material.",
    VOLUMES,
    fairness="Explicit integrators, or implicit ones iterated to convergence, fare otherwise.",
)
def larger_steps(seen: Evidence) -> Finding:
    """Violation at 1 and 20 ms, and a beam stiff enough to keep 4% by elasticity."""
    steps = (1.0, 20.0)
    literal, tuned = (
        [violation(seen, name, step) for step in steps] for name in ("lcp-pgs-literal", "lcp-pgs")
    )
    stiff = {step: _beam(seen, "stiff", 4e6, step) for step in (5.0, 20.0)}
    upright = all(beam["inverted"] == 0 for beam in stiff.values())
    kept = max(tuned) < 0.01
    return Finding(
        Verdict.of(kept and not upright, kept),
        f"Limits of 4% are violated by {literal[0]:.3f} at 1 ms and {literal[1]:.2f} at 20 ms as "
        f"printed, by {tuned[0]:.3f} and {tuned[1]:.3f} with rows near their limits, a fifth of "
        "the correction and three rounds: the step is bounded by the linearisation.",
        "An elastic beam of 4 MPa without limits, by the same linearised backward Euler, has a "
        f"strain of {stiff[5.0]['strain']:.3f} at 5 ms and {stiff[20.0]['strain']:.3f} at 20 ms, "
        f"{'no' if upright else 'some'} step with inverted elements.",
    )


@claim(
    "H14",
    "2",
    "Limits on strain entries (Thomaszewski et al. 2009) confuse modes under large deformation.",
    fairness="Entries of the corotated Cauchy strain, as in `gauss-seidel-strain`.",
)
def entries(_: Evidence) -> Finding:
    """What a simple shear, which stretches no axis at first order, is read as by entries."""
    read = {amount: _biot(np.array([[1.0, amount], [0.0, 1.0]])) for amount in (0.1, 1.0)}
    share = {k: abs(E[1, 1] / E[0, 1]) for k, E in read.items()}
    turn = np.array([[1.0, -1.0], [1.0, 1.0]]) / np.sqrt(2)
    slanted = _biot(turn @ np.diag([1 + LIMIT, 1.0]) @ turn.T)
    return Finding(
        Verdict.of(share[0.1] < 0.1 < share[1.0]),
        f"A simple shear of .1 is read as a stretch of {power(read[0.1][1, 1])} across beside a "
        f"shear of {read[0.1][0, 1]:.3f}; one of 1 as {read[1.0][1, 1]:.2f} beside "
        f"{read[1.0][0, 1]:.2f}, and {read[1.0][0, 0]:.2f} along: limits on stretch act on shear.",
        f"A stretch of {100 * LIMIT:g}% at 45 degrees to the axes has entries of "
        f"{slanted[0, 0]:.4f}, {slanted[1, 1]:.4f} and {slanted[0, 1]:.4f}: limits of "
        f"{100 * LIMIT:g}% on entries allow twice as much there; those on principal stretches do "
        "not. Rotations alone are read as none by either.",
    )


def _biot(F: FloatArray) -> FloatArray:
    """sqrt(F^T F) - I, the corotated Cauchy strain."""
    squares, axes = np.linalg.eigh(F.T @ F)
    strain: FloatArray = (axes * np.sqrt(squares)) @ axes.T - np.eye(2)
    return strain
