"""Limits on principal stretches: values, derivatives, what they allow, and bad input."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import sqrtm

from strainbench import PrincipalLimits, Problem, StretchLimits, certify, solve
from strainbench.problem.draws import rotation
from strainbench.problem.principal_rows import KINDS, rotation_svd
from strainbench.solver.registry import find_solver, list_solvers

D = 0.05
AXES = {2: ((0.9, None), (None, 1.05)), 3: ((0.9, None, 0.97), (None, 1.1, 1.05))}
"""Limits with free axes, by material axes."""


def limits_of(kind, dim):
    if kind == "isotropic":
        return PrincipalLimits(kind, 0.96, 1.04, dim)
    return PrincipalLimits(kind, *AXES[dim])


def drawn(rng, dim, s):
    """F with these singular values (dim,)."""
    U = rotation(rng)[:, :dim]
    return (U * s @ rotation(rng, dim).T)[None]


# --- values and derivatives


@pytest.mark.parametrize("dim", [2, 3])
def test_frames_are_rotations_that_give_f_back(dim, rng):
    F = np.concatenate([drawn(rng, dim, s) for s in rng.uniform(0.3, 2, (20, dim))])
    if dim == 3:
        F[::2, :, 0] *= -1  # inverted
    U, s, V = rotation_svd(F)
    np.testing.assert_allclose(np.einsum("exi,ei,eyi->exy", U, s, V), F, atol=1e-13)
    if dim == 3:
        assert np.linalg.det(U) == pytest.approx(1)
        assert np.linalg.det(V) == pytest.approx(1)
        assert np.all(np.sign(s[:, 2]) == np.sign(np.linalg.det(F)))


STRETCHES = {2: ([1.3, 0.7], [1.02, 0.5]), 3: ([1.3, 0.9, 0.6], [1.2, 0.8, -0.4], [2.0, 1.1, -1.0])}


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("kind", KINDS)
def test_derivatives_are_those_of_the_values_inverted_or_not(kind, dim, rng):
    limits = limits_of(kind, dim)
    for s in STRETCHES[dim]:
        F = drawn(rng, dim, np.array(s))
        values, slopes = limits.linearised(F)
        np.testing.assert_array_equal(values, limits.values(F))
        for x, y in np.ndindex(3, dim):
            step = np.zeros((1, 3, dim))
            step[0, x, y] = 1e-4
            at = [limits.values(F + k * step)[0] for k in (-2, -1, 1, 2)]
            central = (at[0] - 8 * at[1] + 8 * at[2] - at[3]) / 12e-4
            np.testing.assert_allclose(
                slopes[0, :, x, y], central, atol=3e-9 * max(1, np.abs(slopes).max())
            )


def test_limits_are_those_of_the_papers_equations(rng):
    F = drawn(rng, 3, [1.2, 1.0, 0.8])
    _, s, V = rotation_svd(F)
    cosines = np.abs(V[0].T)  # |e_i^T V^T e_j|
    (lower,), (upper,) = [0.96], [1.05]
    both = np.array([lower - 1, upper - 1])[:, None, None]
    strain = s[0][:, None] - 1
    printed = {  # Eqs. 11 and 12, 19 and 20, 21 and 22
        "hyperbolic": cosines * strain - both,
        "orthogonal": strain - both * cosines,
        "linear": strain - both,  # equal limits: a sphere
        "ellipsoid": strain - both,
        "isotropic": strain - both,
    }
    for kind, g in printed.items():
        found = PrincipalLimits(kind, lower, upper).values(F)
        g = g * np.array([1, -1])[:, None, None]
        g = g if kind in ("hyperbolic", "orthogonal") else g[:, :, :1]
        np.testing.assert_allclose(found, g.reshape(1, -1), atol=1e-13)


def test_linear_limits_as_printed_are_not_the_ellipsoids_radius():
    F = rotated_stretch(np.pi / 4, 0.3)
    lower, upper = (None, 0.95), (1.5, 1.05)
    printed, words = (PrincipalLimits(k, lower, upper).values(F) for k in ("linear", "ellipsoid"))
    assert printed[0, 2] == pytest.approx(np.hypot(1.5, 1.05) / 2**0.5 - 1.3)
    assert words[0, 2] == pytest.approx(2**0.5 / np.hypot(1 / 1.5, 1 / 1.05) - 1.3)


def test_a_free_axis_has_no_row():
    assert PrincipalLimits("hyperbolic", (None, 0.95), (None, 1.05)).bounds.shape == (4,)
    assert PrincipalLimits("hyperbolic", 0.95, 1.05).bounds.shape == (18,)
    assert PrincipalLimits("orthogonal", None, (None, None, 1.05)).bounds.shape == (3,)
    assert PrincipalLimits("linear", None, (None, None, 1.05)).bounds.shape == (3,)
    assert PrincipalLimits("isotropic", 0.95, 1.05).bounds.shape == (6,)


def test_the_rest_state_is_a_corner_of_orthogonal_limits_alone():
    F = np.eye(3)[None]
    for kind in KINDS:
        limits = PrincipalLimits(kind, (None, None, 0.95) if kind != "isotropic" else 0.95)
        values, slopes = limits.linearised(F)
        assert np.all(np.isfinite(slopes))
        assert values.min() == pytest.approx(0.0 if kind == "orthogonal" else D)


@pytest.mark.parametrize("sign", [1, -1])
def test_equal_values_are_kept_apart(sign, rng):
    """Equal up to sign, too: an element that is inverted."""
    limits = PrincipalLimits("hyperbolic", 0.9, 1.1)
    largest = []
    for gap in (0.1, 1e-2, 1e-3, 1e-5, 1e-9, 0.0):
        F = drawn(rng, 3, [1.3, 0.8, sign * (0.8 - gap)])
        slopes = limits.linearised(F)[1]
        largest.append(np.linalg.norm(slopes, axis=(2, 3)).max())
    assert np.all(np.isfinite(largest))
    assert largest[-1] < 1e7


def test_biot_rows_have_the_value_of_hyperbolic_ones_and_bounded_slopes(rng):
    """They are |v_i^T E e_j|, whose derivative is found here with V held."""
    limits = PrincipalLimits("hyperbolic", None, 1.05)
    for gap in (0.2, 1e-6, 0.0):
        F = drawn(rng, 3, [1.2, 0.9, 0.9 - gap])
        values, slopes = limits.linearised(F, "biot")
        np.testing.assert_array_equal(values, limits.values(F))
        assert np.linalg.norm(slopes, axis=(2, 3)).max() < 1.0 + 1e-12
        V = rotation_svd(F)[2][0]

        def held(F, V=V):
            E = np.real(sqrtm(F[0].T @ F[0])) - np.eye(3)
            return (D - V.T @ E * np.sign(V.T)).ravel()

        for x, y in np.ndindex(3, 3):
            step = np.zeros((1, 3, 3))
            step[0, x, y] = 1e-5
            central = (held(F + step) - held(F - step)) / 2e-5
            np.testing.assert_allclose(slopes[0, :, x, y], central, atol=1e-8)


def test_triangles_are_the_plane_of_tetrahedra(rng):
    turn = rotation(rng)
    flat = (turn[:, :2] * [1.2, 0.8] @ rotation(rng, 2).T)[None]
    solid = np.concatenate([flat, turn[None, :, 2:]], axis=2)
    on_triangles = PrincipalLimits("hyperbolic", (0.95, None), (None, 1.1)).values(flat)
    on_volumes = PrincipalLimits("hyperbolic", (0.95, None, None), (None, 1.1, None)).values(solid)
    rows = on_volumes.reshape(2, 3)
    order = np.argsort(-rotation_svd(solid)[1][0])[[0, 2]]  # without the unit stretch
    np.testing.assert_allclose(on_triangles.reshape(2, 2), rows[:, order], atol=1e-12)


def test_a_limit_is_one_whichever_axis_is_stretched_most():
    """Rows below and above are those of three principal axes for each limited one."""
    limits = PrincipalLimits("hyperbolic", (None, None, 0.9), (None, 1.1, 1.05))
    marked = np.zeros((2, 9), dtype=bool)
    marked[0, 1] = marked[1, 4] = True  # below, on e3; above, on e3, the second principal axis
    found = limits.whichever_axis(marked.ravel()).reshape(2, 9)
    assert np.flatnonzero(found[0]).tolist() == [0, 1, 2]
    assert np.flatnonzero(found[1]).tolist() == [4, 6, 8]
    same = PrincipalLimits("isotropic", 0.9, 1.1).whichever_axis(np.arange(12) == 3)
    assert np.flatnonzero(same).tolist() == [3]


# --- what they allow: the table of what 5% on e2 alone forbids


def rotated_stretch(angle, amount):
    """(1, 3, 2) a uniaxial stretch at this angle from e2."""
    u = np.array([np.sin(angle), np.cos(angle)])
    return (np.eye(3, 2) + amount * np.eye(3, 2) @ np.outer(u, u))[None]


MODES = {
    "30 degrees": lambda a: rotated_stretch(np.pi / 6, a),
    "45 degrees": lambda a: rotated_stretch(np.pi / 4, a),
    "60 degrees": lambda a: rotated_stretch(np.pi / 3, a),
    "85 degrees": lambda a: rotated_stretch(np.deg2rad(85), a),
    "along e1": lambda a: rotated_stretch(np.pi / 2, a),
    "shear F12": lambda a: np.array([[[1, a], [0, 1], [0, 0]]]),
    "shear F21": lambda a: np.array([[[1, 0], [a, 1], [0, 0]]]),
}
HYPERBOLIC = PrincipalLimits("hyperbolic", (None, 1 - D), (None, 1 + D))
ANGLES = np.linspace(0, np.pi, 3600, endpoint=False)  # of d, from e2
RADIUS = 1 + D / np.maximum(np.abs(np.cos(ANGLES)), 1e-12)


def biot_strain(F):
    return np.real(sqrtm(F[0].T @ F[0])) - np.eye(2)


RULES = {
    "hyperbolic": lambda F: HYPERBOLIC.values(F).min() >= 0,
    "||F e2||": lambda F: np.linalg.norm(F[0, :, 1]) <= 1 + D,
    "||E e2||": lambda F: np.linalg.norm(biot_strain(F)[:, 1]) <= D,
    "all d": lambda F: np.all(
        np.linalg.norm(F[0] @ [np.sin(ANGLES), np.cos(ANGLES)], axis=0) <= RADIUS
    ),
}
TABLE = {  # the largest amount allowed, up to 3
    "30 degrees": (0.0577, 0.0661, 0.0577, 0.0548),
    "45 degrees": (0.0707, 0.0977, 0.0707, 0.0617),
    "60 degrees": (0.1000, 0.1874, 0.1000, 0.0735),
    "85 degrees": (0.574, 2.81, 0.574, 0.114),
    "along e1": (3, 3, 3, 0.127),
    "shear F12": (0.133, 0.320, 0.100, 0.123),
    "shear F21": (0.142, 3, 0.100, 0.128),
}


def largest_allowed(within, mode):
    amounts = np.concatenate([np.arange(0, 0.3, 0.02), np.arange(0.3, 3.05, 0.1)])
    beyond = np.flatnonzero([not within(mode(a)) for a in amounts])
    if len(beyond) == 0:
        return 3.0
    low, high = amounts[beyond[0] - 1], amounts[beyond[0]]
    for _ in range(12):
        middle = (low + high) / 2
        low, high = (middle, high) if within(mode(middle)) else (low, middle)
    return low


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("rule", RULES)
def test_the_largest_amount_that_limits_on_one_axis_allow(rule, mode):
    known = TABLE[mode][list(RULES).index(rule)]
    assert largest_allowed(RULES[rule], MODES[mode]) == pytest.approx(known, rel=6e-3)


@pytest.mark.parametrize(
    ("upper", "pair", "known"),
    [
        (
            (1 + D, 1 + D),
            ([[1.0608, 0.0091], [0.0091, 1.0603]], [[1.0172, 0.0861], [0.0861, 0.8193]]),
            (0.000076, 0.003718, -0.003945),
        ),
        (
            (1 + D, None),
            ([[0.858, -0.294], [0.167, 1.618]], [[0.399, -0.346], [0.800, 0.676]]),
            (0.0440, 0.0090, -0.0380),
        ),
    ],
)
def test_hyperbolic_limits_are_not_convex(upper, pair, known):
    """Equal ones from above, away from repeated values; and with an axis free."""
    one, two = (np.eye(3, 2) @ np.array(F) for F in pair)
    limits = PrincipalLimits("hyperbolic", None, upper)
    values = limits.values(np.array([one, two, (one + two) / 2])).min(axis=1)
    np.testing.assert_allclose(values, known, atol=1e-4)


# --- as limits of a problem


def pulled(limits, scale=1.2):
    """A square of two triangles."""
    rest = np.array([[0.0, 0], [1, 0], [0, 1], [1, 1]])
    return Problem(
        rest, [[0, 1, 3], [0, 3, 2]], np.column_stack([rest * [1, scale], [0] * 4]), limits
    )


def test_the_referee_measures_them_and_calls_answers_local():
    problem = pulled(HYPERBOLIC)
    assert not problem.convex
    found = certify(problem, problem.target)
    assert (found.outcome, found.max_violation) == ("violated", pytest.approx(0.15))
    assert "local" in certify(problem, pulled(HYPERBOLIC, 1.05).target).reason


def test_positions_that_are_not_finite_have_no_measure():
    problem = pulled(HYPERBOLIC)
    x = problem.target.copy()
    x[0] = np.nan
    assert np.all(np.isnan(problem.violations(x)))


def test_tightened_limits_leave_a_margin():
    problem = pulled(HYPERBOLIC)
    v = problem.tightened(0.01).violations(problem.target)
    assert v.max() == pytest.approx(0.16)


TAKERS = ("none", "lcp-pgs", "lcp-qp", "ipopt-principal", "gauss-seidel-clamp", "sequential-cuts")


@pytest.mark.parametrize("name", [e.name for e in list_solvers() if not e.unavailable])
def test_others_refuse_them_with_the_reason(name):
    if not name.startswith(TAKERS):
        reason = "no form for limits on principal stretches"
        assert reason in find_solver(name).supports(pulled(HYPERBOLIC))


def test_a_refused_problem_is_not_solved():
    with pytest.raises(ValueError, match="no form for limits on principal stretches"):
        solve(pulled(HYPERBOLIC), "clarabel")


def test_lengths_are_bounded_by_isotropic_limits():
    rest = pulled(HYPERBOLIC).rest
    far = np.column_stack([1.2 * rest, [0] * 4])
    for limits, reason in ((HYPERBOLIC, None), (PrincipalLimits("isotropic", None, 1.1, 2), "2")):
        problem = Problem(rest, [[0, 1, 3], [0, 3, 2]], far, limits, [0, 2])
        found = problem.infeasible_pins()
        assert (found is None) == (reason is None)


@pytest.mark.parametrize(
    ("build", "words"),
    [
        (lambda: PrincipalLimits("cubic", 0.9, 1.1), r"limits\.kind is 'cubic': valid are hyper"),
        (lambda: PrincipalLimits("linear", 1.2, 1.1), r"limits\.lower\[0\] is 1\.2: 0 to 1"),
        (
            lambda: PrincipalLimits("linear", (None, 0.9), (1.1, 0.8)),
            r"limits\.upper\[1\] is 0\.8: 1 or more",
        ),
        (lambda: PrincipalLimits("linear", (0.9, np.nan)), r"limits\.lower\[1\] is nan"),
        (lambda: PrincipalLimits("linear", (0.9, 0.9), (1.1,) * 3), "2 and 3 axes; 2 or 3, above"),
        (lambda: PrincipalLimits("linear", (0.9,) * 4), "4 axes"),
        (lambda: PrincipalLimits("linear", (None, None, None)), "no axis is limited"),
        (
            lambda: PrincipalLimits("isotropic", (0.9, 0.8, 0.9)),
            r"limits\.lower\[1\] is 0\.8, but 0\.9 on axis 0",
        ),
        (
            lambda: pulled(PrincipalLimits("hyperbolic", (None, 0.9, 0.95))),
            r"limits\.lower\[2\] is 0\.95: the elements have 2 material axes",
        ),
        (lambda: HYPERBOLIC.linearised(np.eye(3, 2)[None], "frozen"), "rows is 'frozen'"),
    ],
)
def test_bad_limits_are_refused_in_a_line(build, words):
    with pytest.raises(ValueError, match=words) as error:
        build()
    assert "\n" not in str(error.value)


def test_stretch_limits_stay_what_they_were():
    assert pulled(StretchLimits.isotropic(1.1)).convex
