"""Claims of Hernandez et al. (2013) about limits, their derivatives and axes: computed here."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from strainbench.arrays import FloatArray
from strainbench.problem.principal import PrincipalLimits
from strainbench.problem.principal_rows import FREE, KINDS, SEPARATION, linear, rotation_svd
from strainbench.report.claims.claim import Finding, Verdict, claim
from strainbench.report.claims.evidence import Evidence
from strainbench.report.claims.hernandez import LIMIT
from strainbench.report.numbers import power
from strainbench.scenario.registry import find_scenario
from strainbench.scenario.stage import Stage
from strainbench.solver.registry import find_solver

BOUND = 1.1
COUNT = 100  # random F
DIFFERENCE, TINY = 1e-6, 1e-30  # of F
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
    another = _another_way(F, rng.normal(size=F.shape))
    exact = max(error, another) < 1e-6
    return Finding(
        Verdict.of(exact and sizes[-1] < 10 * sizes[0], exact),
        f"Of {len(F)} random F, inverted ones among them, the derivatives of all {len(KINDS)} "
        f"kinds are central differences to {power(error)}. They are singular where singular "
        f"values are equal or opposite, such as at F = I: at gaps of .1, .01, 1e-3, 1e-5 "
        f"the largest entry has size {told}. Values are kept {power(SEPARATION)} apart here, also "
        "those of opposite sign.",
        "Automatic differentiation of the hyperbolic limits, by complex steps through the "
        f"eigenvalues of F^T F, without a singular value decomposition: {power(another)}.",
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


def _another_way(F: FloatArray, towards: FloatArray) -> float:
    """The largest difference of hyperbolic limits' derivatives from complex steps, as `_wrong`."""
    moved = F + 1j * TINY * towards
    squares, axes = np.linalg.eig(np.swapaxes(moved, 1, 2) @ moved)
    order = np.argsort(-squares.real, axis=1)
    s = np.sqrt(np.take_along_axis(squares, order, 1))
    s[:, 2] *= np.sign(np.linalg.det(F))
    v = np.take_along_axis(axes, order[:, None, :], 2)
    c = np.swapaxes(v / np.sqrt((v * v).sum(axis=1, keepdims=True)), 1, 2)
    rows = (c * np.sign(c.real) * (s - 1)[:, :, None]).imag[:, :, 1:].reshape(len(F), -1) / TINY
    limits = PrincipalLimits("hyperbolic", None, UPPER)
    slope = np.einsum("ecxy,exy->ec", limits.linearised(F)[1], towards)
    wrong = np.abs(rows + slope).max(axis=1)
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

    def radius(degrees: float, free: float) -> FloatArray:
        c, s = np.cos(np.deg2rad(degrees)), np.sin(np.deg2rad(degrees))
        about = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
        axes = np.swapaxes(about @ frames.V, 1, 2)
        upper = np.array([free, free, 1 + LIMIT])
        return frames.s[:, :, None] - linear(frames.s, axes, upper).value

    def change(degrees: float, free: float = FREE["linear"][1]) -> float:
        return float(np.abs(radius(degrees, free) / radius(0, free) - 1).max())

    moved = x + 1e-4 * np.random.default_rng(0).normal(size=x.shape)
    cosines = np.einsum(
        "eij,eij->ej", frames.V, rotation_svd(problem.deformation_gradients(moved)).V
    )
    share = np.mean(np.abs(cosines).min(axis=1) < np.cos(np.deg2rad(10)))
    return Finding(
        Verdict.of(change(180) > 1e-9),
        f"Eqs. 21 and 22 see squares of V alone: half a turn about the vertical changes the limits "
        f"by {power(change(180))} of their size. What relaxes the limited axis is any other turn: "
        f"10 degrees by a factor of up to {1 + change(10, 10.0):.2g} where a stretch of 10 stands "
        f"for no limit, {power(1 + change(10))} where {power(FREE['linear'][1])} does (any number "
        "may).",
        f"The closest two stretches of an element, the transverse ones, differ by "
        f"{np.median(frames.gaps):.3f} in the median, so that V is nearly free about the vertical: "
        f"vertices moved by .1 mm turn the axes by more than 10 degrees in {100 * share:.0f}% of "
        "the elements.",
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


@claim(
    "H1",
    "abstract, 3.3",
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
        f"At {COUNT} random F, the limits are |v^T E e| <= d, of Biot's strain E = sqrt(F^T F) - I "
        f"and each of its eigenvectors v, to {power(_from_strain())}: they see no strain that is "
        "across the axis e.",
    )


def _from_strain() -> float:
    """How far the limits' values are from those of Biot's strain, at most."""
    worst = 0.0
    limits = PrincipalLimits("hyperbolic", (None, 1 - LIMIT), (None, 1 + LIMIT))
    for F in np.random.default_rng(0).normal(size=(COUNT, 3, 2)):
        strain = _biot(F)
        across = np.abs(np.linalg.eigh(strain)[1].T @ strain[:, 1]).max()
        worst = max(worst, abs(LIMIT - across - float(limits.values(F[None]).min())))
    return worst


@claim(
    "H15",
    "2, 3.2",
    "Limits on principal stretches are isotropic, free of parametrisation.",
    fairness="Only where limits are the same along all axes; hyperbolic limits of equal size are "
    "not wholly so.",
)
def isotropic(_: Evidence) -> Finding:
    """The same value whatever the rotation of material and space, and by another definition."""
    F = np.random.default_rng(0).normal(size=(COUNT, 3, 2))
    turned = np.stack([F @ _turn(angle) for angle in np.linspace(0, np.pi, 37)])
    least, entry = (_ranging(measure, turned) for measure in (_least_value, _largest_entry))
    u = _turn(np.linspace(0, np.pi, 3601))[:, :, 0]
    lengths = np.linalg.norm(np.einsum("exy,ky->kex", F, u), axis=2)
    apart = np.abs(BOUND - lengths.max(axis=0) - _least_value(F)).max()
    return Finding(
        Verdict.of(least < 1e-12 and apart < 1e-5),
        f"Turning the material axes of {len(F)} random F by 0 to 180 degrees changes the limits' "
        f"values by {power(least)}; the largest entry of the Green strain changes by {entry:.2g}.",
        f"The largest length of F u, of {len(u)} directions u and without a decomposition, gives "
        f"the same values to {power(apart)}.",
    )


def _turn(angle: float | FloatArray) -> FloatArray:
    """Rotations (..., 2, 2) by angles."""
    c, s = np.cos(angle), np.sin(angle)
    turn: FloatArray = np.moveaxis(np.array([[c, -s], [s, c]]), (0, 1), (-2, -1))
    return turn


def _ranging(measure: Callable[[FloatArray], FloatArray], turned: FloatArray) -> float:
    """By how much the measures (e,) of F differ between its turns (k, e, 3, 2), at most."""
    return float(np.ptp([measure(F) for F in turned], axis=0).max())


def _least_value(F: FloatArray) -> FloatArray:
    limits = PrincipalLimits("isotropic", None, (BOUND, BOUND))
    least: FloatArray = limits.values(F).min(axis=1)
    return least


def _largest_entry(F: FloatArray) -> FloatArray:
    strain = np.swapaxes(F, 1, 2) @ F - np.eye(2)
    largest: FloatArray = np.abs(0.5 * strain).max(axis=(1, 2))
    return largest
