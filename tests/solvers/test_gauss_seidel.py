"""Gauss-Seidel's corrections of an element: exact where they can be, and never past a pin."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from solvers.gauss_seidel import GaussSeidel
from solvers.gauss_seidel.strain import polar
from strainbench import Problem, StretchLimits, solve
from tests.problems import moved, random_placed_problem, rotation

VARIANTS = ["directions", "strain", "principal"]
BY_ELEMENT = ["strain", "principal"]
EQUILATERAL = np.array([[0.0, 0.0], [1.0, 0.0], [0.5, 0.75**0.5]])
ONE = np.array([[0, 1, 2]])


def isotropic_problem(seed, pins=2, mass=True, limits=None):
    """A random mesh stretched beyond the same limit in all directions, feasible at its rest."""
    rng = np.random.default_rng(seed)
    problem, _ = random_placed_problem(
        rng, directions=4, limit=0.05, mass=mass, pins=pins, per_element=False
    )
    return replace(problem, limits=limits or StretchLimits.isotropic(1.05, directions=4))


def lone(F, limits, rest=EQUILATERAL, **more):
    """One triangle with the deformation gradient F."""
    return Problem(rest, ONE, rest @ F.T + [0.3, -0.2, 0.1], limits, **more)


def answer(problem, constraint, **settings):
    solution = solve(problem, GaussSeidel(constraint=constraint, **settings))
    assert solution.status == "solved", constraint
    return solution.positions


def gradient(rng, kind):
    """(3, 2): random, of rank 1 or nearly, zero, or with equal singular values."""
    F = rng.normal(size=(3, 2))
    line = np.outer(rng.normal(size=3), rng.normal(size=2))
    return {
        "any": F,
        "rank 1": line,
        "nearly": line + 1e-9 * F,
        "zero": 0 * F,
        "equal": 1.3 * np.linalg.qr(F)[0],
        "axes": np.diag([2.0, 0.5, 0.0])[:, :2],
    }[kind]


# --- the decomposition


@pytest.mark.parametrize("kind", ["any", "rank 1", "nearly", "zero", "equal", "axes"])
def test_the_polar_decomposition_is_numpys(kind, rng):
    for _ in range(50):
        F = gradient(rng, kind)
        R = F.copy()
        s1, s2, c, s = polar(R)
        V = np.array([[c, -s], [s, c]])
        assert [s1, s2] == pytest.approx(np.linalg.svd(F)[1], abs=1e-14)
        np.testing.assert_allclose(R.T @ R, np.eye(2), atol=1e-14)
        np.testing.assert_allclose(R @ V @ np.diag([s1, s2]) @ V.T, F, atol=1e-14)


# --- one element alone


@pytest.mark.parametrize("limits", [StretchLimits.exact(1.1), StretchLimits.exact(1.1, weft=1.3)])
def test_an_equilateral_triangle_of_equal_masses_is_projected_exactly(limits, rng):
    """The variational inequality <t - x, z - x> <= 0 for every z within the limits."""
    rest = EQUILATERAL / (limits.bounds / limits.bounds.min())  # equilateral as F D sees it
    for _ in range(20):
        problem = lone(1.5 * gradient(rng, "any"), limits, rest)
        x = answer(problem, "principal", max_sweeps=1)
        assert problem.violations(x).max() < 1e-12
        for size in 10.0 ** rng.uniform(-4, 0, 100):
            z = x + size * rng.normal(size=(3, 3))
            z *= min(1.0, 1.1 / problem.stretches(z)[0])
            assert np.sum((problem.target - x) * (z - x)) < 1e-12


def test_the_strain_of_a_lone_triangle_is_clamped_entry_by_entry():
    limits = StretchLimits.orthotropic(warp=1.1, weft=1.2, shear=2.0)
    F = np.array([[1.5, 0.0], [0.0, 0.7], [0.0, 0.0]])
    x = answer(lone(F, limits), "strain", max_sweeps=1)
    expected = np.array([[1.1, 0.0], [0.0, 0.7], [0.0, 0.0]])
    np.testing.assert_allclose(lone(F, limits).deformation_gradients(x)[0], expected, atol=1e-14)


@pytest.mark.parametrize("kind", ["any", "rank 1", "zero", "equal"])
@pytest.mark.parametrize(("constraint", "sweeps"), [("strain", 30), ("principal", 100)])
@pytest.mark.parametrize("lower", [None, 0.8])
def test_a_lone_triangle_soon_is_within_its_limits(kind, constraint, sweeps, lower, rng):
    limits = StretchLimits.isotropic(1.1, 4, lower=lower)
    for _ in range(30):
        rest = EQUILATERAL + 0.2 * rng.uniform(-1, 1, (3, 2))
        problem = lone(gradient(rng, kind), limits, rest)
        x = answer(problem, constraint, max_sweeps=sweeps)
        assert problem.violations(x).max() < 1e-6


@pytest.mark.parametrize("constraint", BY_ELEMENT)
def test_two_pins_leave_the_third_vertex_to_meet_the_limits(constraint, rng):
    limits = StretchLimits.isotropic(1.1, 4)
    for _ in range(20):
        Q = rotation(rng)
        target = EQUILATERAL @ Q[:, :2].T
        target[2] += rng.normal(size=3)
        problem = Problem(EQUILATERAL, ONE, target, limits, pinned=[0, 1])
        x = answer(problem, constraint)
        assert np.array_equal(x[:2], target[:2])
        assert problem.violations(x).max() < 1e-6


# --- a sheet


@pytest.mark.parametrize("constraint", VARIANTS)
@pytest.mark.parametrize("mass", [False, True])
def test_without_pins_momentum_is_conserved(constraint, mass):
    problem = isotropic_problem(3, pins=0, mass=mass)
    change = problem.weights[:, None] * (answer(problem, constraint) - problem.target)
    assert np.abs(change).max() > 1e-6
    assert np.abs(change.sum(axis=0)).max() < 1e-10 * np.abs(change).max()


@pytest.mark.parametrize("constraint", BY_ELEMENT)
@pytest.mark.parametrize("seed", range(4))
def test_rigid_motion_moves_the_answer(constraint, seed, rng):
    problem = isotropic_problem(seed)
    Q, shift = rotation(rng), rng.normal(size=3)
    expected = answer(problem, constraint) @ Q.T + shift
    np.testing.assert_allclose(answer(moved(problem, Q, shift), constraint), expected, atol=1e-8)


@pytest.mark.parametrize("constraint", BY_ELEMENT)
@pytest.mark.parametrize("seed", range(4))
def test_the_first_corner_of_an_element_does_not_matter(constraint, seed, rng):
    problem = isotropic_problem(seed)
    turned = np.array([rng.permutation(e) for e in problem.elements])
    other = answer(replace(problem, elements=turned), constraint)
    np.testing.assert_allclose(answer(problem, constraint), other, atol=1e-8)


@pytest.mark.parametrize("constraint", VARIANTS)
@pytest.mark.parametrize("lower", [None, 0.9])
@pytest.mark.parametrize("pins", [0, 1, 4])
def test_it_stops_within_the_limits(constraint, lower, pins):
    problem = isotropic_problem(pins, pins, limits=StretchLimits.isotropic(1.05, 4, lower=lower))
    x = answer(problem, constraint)
    assert problem.violations(problem.target).max() > 0.01
    assert problem.violations(x).max() < 1e-6
    assert np.array_equal(x[problem.pinned], problem.target[problem.pinned])


@pytest.mark.parametrize("seed", range(30))
def test_clamping_principal_stretches_leads_away_from_no_point_within_the_limits(seed):
    """Sweeps are not expansive in the norm of M, whatever the mesh, masses and pins."""
    rng = np.random.default_rng(seed)
    problem, placed = random_placed_problem(rng, mass=True, per_element=False)
    problem = replace(problem, limits=StretchLimits.exact(1.05))
    points = []
    solve(
        problem,
        GaussSeidel("principal", max_sweeps=64),
        watch=lambda seconds, iterations, x, multipliers: points.append(x),
    )
    distances = [problem.weights @ np.sum((x - placed) ** 2, axis=1) for x in points]
    assert len(points) > 2
    assert np.all(np.diff(distances) <= 1e-12 * distances[0])


@pytest.mark.parametrize("limits", [StretchLimits.exact(1.05), StretchLimits.exact(1.05, 1.2)])
def test_exact_limits_hold_in_every_direction(limits):
    problem = isotropic_problem(1, limits=limits)
    F = problem.deformation_gradients(answer(problem, "principal"))
    scaled = F / limits.bounds
    assert np.linalg.svd(scaled)[1].max() < 1 + 1e-6


@pytest.mark.parametrize("constraint", VARIANTS)
def test_the_sweep_limit_is_not_success(constraint):
    problem = isotropic_problem(2)
    solution = solve(problem, GaussSeidel(constraint=constraint, max_sweeps=1))
    assert (solution.status, solution.iterations) == ("iteration limit", 1)
    assert problem.violations(solution.positions).max() > 1e-6


# --- what it cannot take

CURVE = StretchLimits.sampled([0.0, 0.5, 1.0], [1.01, 1.1, 1.2])
ORTHOTROPIC = StretchLimits.orthotropic(1.01, 1.02, 1.3)


@pytest.mark.parametrize(
    ("constraint", "limits", "words"),
    [
        ("directions", StretchLimits.exact(1.01), "gauss-seidel-principal has"),
        ("strain", StretchLimits.exact(1.01), "warp, weft and shear"),
        ("strain", StretchLimits.isotropic(1.01, 18), "warp, weft and shear"),
        ("strain", CURVE, "warp, weft and shear"),
        ("principal", CURVE, "alike in all directions"),
        ("principal", ORTHOTROPIC, "alike in all directions"),
        ("principal", StretchLimits.sampled([0.3], [1.01]), "alike in all directions"),
    ],
)
def test_limits_that_it_cannot_clamp_are_refused_with_the_reason(constraint, limits, words):
    refusal = GaussSeidel(constraint=constraint).supports(lone(np.eye(3, 2), limits))
    assert refusal is not None
    assert words in refusal


@pytest.mark.parametrize(
    ("constraint", "limits"),
    [
        ("strain", ORTHOTROPIC),
        ("strain", StretchLimits.isotropic(1.01, 2)),
        ("principal", StretchLimits.isotropic(1.01, 18)),
        ("principal", StretchLimits.exact(1.01, 1.2)),
    ],
)
def test_limits_that_it_can_clamp_are_taken(constraint, limits):
    assert GaussSeidel(constraint=constraint).supports(lone(np.eye(3, 2), limits)) is None


@pytest.mark.parametrize("constraint", BY_ELEMENT)
def test_volumes_are_refused(constraint):
    rest = np.vstack([np.zeros(3), np.eye(3)])
    problem = Problem(rest, [[0, 1, 2, 3]], rest, StretchLimits(np.eye(3), [1.1] * 3))
    assert "volumes" in str(GaussSeidel(constraint=constraint).supports(problem))


def test_an_unknown_constraint_names_the_valid_ones():
    with pytest.raises(ValueError, match="valid are directions, strain, principal"):
        GaussSeidel(constraint="edges")
