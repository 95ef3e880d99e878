"""Energies, their derivatives, and implicit Euler, against finite differences and conservation."""

from __future__ import annotations

from time import perf_counter

import numpy as np
import pytest

from strainbench.physics.body import GRAVITY
from strainbench.physics.cloth import Cloth, Material
from strainbench.physics.energies.bending import add_bending_gradient, angle_and_gradient, hinges
from strainbench.physics.energies.membrane import (
    add_membrane_gradient,
    add_membrane_hessian,
    eigenpairs,
    singular_frames,
)
from strainbench.physics.implicit_euler import NewtonSettings, minimise_step
from strainbench.physics.linear import NotPositiveDefiniteError, SuperLU, symmetric
from strainbench.physics.pattern import Pattern
from strainbench.problem.elements import shape_gradients
from strainbench.problem.grid import square_grid
from tests.problems import central_difference, hessian, random_mesh, rotation

LAM, MU = Material().lame
SEEDS = range(6)
NO_PINS = np.array([], dtype=np.int64)
TRIANGLE = np.array([[0, 1, 2]])
SHARP = NewtonSettings(tolerance=1e-7)


def small_cloth(rng, pinned=NO_PINS, **material):
    rest, elements = random_mesh(rng, vertices=12)
    return Cloth(rest, elements, Material(**material), pinned)


def lifted(rest, A=None):
    """Rest positions in space, after a linear map A (3, 2)."""
    return rest @ (np.eye(3)[:, :2] if A is None else A).T


def random_triangle(rng):
    """Rest gradients B, weight and the map from F to positions with that F."""
    rest = np.array([[0, 0], [1, 0.1], [0.2, 0.9]]) + 0.1 * rng.normal(size=(3, 2))
    gradients, areas = shape_gradients(rest, TRIANGLE)
    return rest, gradients, areas


def with_singular_values(rng, s):
    return rotation(rng)[:, :2] * s @ rotation(rng, 2).T


def membrane(x, elements, gradients, weights):
    out = np.zeros_like(x)
    return add_membrane_gradient(x, elements, gradients, weights, LAM, MU, out), out


def triangle_hessian(x, gradients, weight, clamp):
    """(9, 9), through the assembly."""
    pattern = Pattern.of([TRIANGLE], 3, NO_PINS)
    data = np.zeros(len(pattern.indices))
    weights = np.array([weight])
    add_membrane_hessian(x, gradients, weights, LAM, MU, clamp, *pattern.blocks(data))
    return symmetric(pattern.matrix(data)).toarray()


def eigen_decomposition(F):
    """Eigenvalues (6,) and eigenmatrices as rows (6, 6)."""
    U, s, V = np.empty((3, 3)), np.empty(2), np.empty((2, 2))
    values, Q = np.empty(6), np.empty((6, 3, 2))
    singular_frames(np.ascontiguousarray(F), U, s, V)
    eigenpairs(U, s, V, LAM, MU, values, Q)
    return values, Q.reshape(6, 6)


# --- membrane


@pytest.mark.parametrize("seed", SEEDS)
def test_membrane_gradient_is_the_derivative_of_the_energy(seed):
    rng = np.random.default_rng(seed)
    rest, elements = random_mesh(rng, vertices=12)
    rest /= np.ptp(rest)
    gradients, areas = shape_gradients(rest, elements)
    x = lifted(rest) + 0.05 * rng.normal(size=(len(rest), 3))
    _, gradient = membrane(x, elements, gradients, areas)
    numeric = central_difference(lambda x: membrane(x, elements, gradients, areas)[0], x)
    np.testing.assert_allclose(gradient, numeric, atol=1e-7 * np.abs(gradient).max())


@pytest.mark.parametrize(("s", "strain"), [(1.0, 0.0), (1.1, 0.105), (0.5, -0.375), (0.0, -0.5)])
def test_membrane_energy_of_a_uniaxial_stretch(rng, s, strain):
    rest, gradients, areas = random_triangle(rng)
    energy, _ = membrane(lifted(rest, np.eye(3)[:, :2] * [s, 1]), TRIANGLE, gradients, areas)
    assert energy == pytest.approx(areas[0] * (LAM / 2 + MU) * strain**2, abs=1e-12)


def test_plane_stress_leaves_the_free_edge_without_stress(rng):
    """E is the slope of stress over strain in uniaxial tension: lam and mu are plane stress."""
    rest, gradients, areas = random_triangle(rng)
    material = Material()
    axial, lateral = 0.01, -material.poisson * 0.01  # Green strains
    A = np.eye(3)[:, :2] * np.sqrt(1 + 2 * np.array([axial, lateral]))
    energy, _ = membrane(lifted(rest, A), TRIANGLE, gradients, areas)
    assert energy == pytest.approx(areas[0] * material.young * axial**2 / 2, rel=1e-10)


SINGULAR_VALUES = [
    (1.0, 1.0),
    (1.3, 1.1),
    (1.2, 0.7),
    (0.6, 0.3),
    (0.5, 0.5),
    (2.0, 0.1),
    (1.1, 1e-6),
    (1.1, 0.0),
    (0.0, 0.0),
]


@pytest.mark.parametrize("s", SINGULAR_VALUES)
def test_unclamped_membrane_hessian_is_the_derivative_of_the_gradient(rng, s):
    rest, gradients, areas = random_triangle(rng)
    x = lifted(rest, with_singular_values(rng, s))
    H = triangle_hessian(x, gradients, areas[0], clamp=False)

    def gradient(x):
        return membrane(x, TRIANGLE, gradients, areas)[1]

    numeric = central_difference(gradient, x, h=1e-4).reshape(9, 9)
    np.testing.assert_allclose(H, numeric, atol=1e-6 * np.abs(H).max())


@pytest.mark.parametrize("s", SINGULAR_VALUES)
def test_eigenmatrices_are_orthonormal(rng, s):
    _, Q = eigen_decomposition(with_singular_values(rng, s))
    np.testing.assert_allclose(Q @ Q.T, np.eye(6), atol=1e-8)


@pytest.mark.parametrize("s", SINGULAR_VALUES)
def test_clamped_membrane_hessian_is_positive_semidefinite(rng, s):
    rest, gradients, areas = random_triangle(rng)
    H = triangle_hessian(
        lifted(rest, with_singular_values(rng, s)), gradients, areas[0], clamp=True
    )
    np.testing.assert_allclose(H, H.T, atol=1e-12 * np.abs(H).max(initial=1))
    assert np.linalg.eigvalsh(H).min() >= -1e-12 * np.abs(H).max(initial=1)


@pytest.mark.parametrize("s", [(1.0, 1.0), (1.3, 1.1), (1.05, 1.0), (2.0, 1.5)])
def test_clamping_changes_nothing_under_tension(rng, s):
    rest, gradients, areas = random_triangle(rng)
    x = lifted(rest, with_singular_values(rng, s))
    clamped = triangle_hessian(x, gradients, areas[0], clamp=True)
    plain = triangle_hessian(x, gradients, areas[0], clamp=False)
    np.testing.assert_allclose(clamped, plain, atol=1e-11 * np.abs(plain).max())


@pytest.mark.parametrize("s", [(0.6, 0.3), (1.3, 0.4), (0.9, 0.9), (1.1, 0.0)])
def test_clamping_removes_just_the_negative_curvature(rng, s):
    values, Q = eigen_decomposition(with_singular_values(rng, s))
    assert values.min() < 0
    H = Q.T * values @ Q
    w, V = np.linalg.eigh(H)
    nearest = V * np.maximum(w, 0) @ V.T
    np.testing.assert_allclose(Q.T * np.maximum(values, 0) @ Q, nearest, atol=1e-9 * w.max())


# --- bending


def folded(angle, stretch=1.0):
    """Two unit right triangles that share an edge, the second turned about it."""
    return np.array(
        [
            [0, 0, 0],
            [stretch, 0, 0],
            [0, 1, 0],
            [0, -np.cos(angle), np.sin(angle)],
        ]
    )


FOLD_REST = folded(0.0)[:, :2].copy()
FOLD_ELEMENTS = np.array([[0, 1, 2], [1, 0, 3]])


@pytest.mark.parametrize("angle", [-2.5, -0.3, 0.0, 1e-5, 0.7, 3.0])
def test_the_hinge_angle_of_a_fold(angle):
    quads, _ = hinges(FOLD_REST, FOLD_ELEMENTS, np.array([0.5, 0.5]))
    found = angle_and_gradient(folded(angle), quads[0], np.zeros((4, 3)))
    assert abs(found) == pytest.approx(abs(angle), abs=1e-14)


def test_folds_to_either_side_have_opposite_angles():
    quads, _ = hinges(FOLD_REST, FOLD_ELEMENTS, np.array([0.5, 0.5]))
    up, down = (angle_and_gradient(folded(a), quads[0], np.zeros((4, 3))) for a in (0.4, -0.4))
    assert up == pytest.approx(-down, rel=1e-14)


def test_bending_energy_of_a_fold():
    cloth = Cloth(FOLD_REST, FOLD_ELEMENTS, Material(bending=2.0), NO_PINS)
    values, _ = cloth.gradient(folded(0.7))
    assert values["bending"] == pytest.approx(2.0 * 3 * 1**2 / (0.5 + 0.5) * 0.7**2, rel=1e-13)


def test_a_grid_has_a_hinge_for_each_interior_edge():
    rest, elements = square_grid(4, 1.0, "alternating")
    quads, weights = hinges(rest, elements, shape_gradients(rest, elements)[1])
    edges = {frozenset(p) for t in elements.tolist() for p in zip(t, t[1:] + t[:1], strict=True)}
    assert len(quads) == len(weights) == len(edges) - 4 * 4
    assert len({frozenset(q[:2]) for q in quads.tolist()}) == len(quads)


@pytest.mark.parametrize("seed", SEEDS)
def test_bending_gradient_is_the_derivative_of_the_energy(seed):
    rng = np.random.default_rng(seed)
    rest, elements = random_mesh(rng, vertices=12)
    rest /= np.ptp(rest)
    quads, weights = hinges(rest, elements, shape_gradients(rest, elements)[1])
    x = lifted(rest) + 0.05 * rng.normal(size=(len(rest), 3))

    def energy(x):
        return add_bending_gradient(x, quads, weights, np.zeros_like(x))

    gradient = np.zeros_like(x)
    add_bending_gradient(x, quads, weights, gradient)
    numeric = central_difference(energy, x)
    np.testing.assert_allclose(gradient, numeric, atol=1e-6 * np.abs(gradient).max())


def test_the_angle_does_not_depend_on_how_the_second_triangle_turns():
    flipped = FOLD_ELEMENTS[:, ::1].copy()
    flipped[1] = flipped[1, ::-1]
    areas = np.array([0.5, 0.5])
    for elements in (FOLD_ELEMENTS, flipped):
        quads, _ = hinges(FOLD_REST, elements, areas)
        found = angle_and_gradient(folded(0.7), quads[0], np.zeros((4, 3)))
        assert abs(found) == pytest.approx(0.7)


def test_a_collapsed_triangle_bends_nothing():
    x = folded(0.5)
    x[3] = [0.3, 0, 0]
    grad = np.ones((4, 3))
    quads, _ = hinges(FOLD_REST, FOLD_ELEMENTS, np.array([0.5, 0.5]))
    assert angle_and_gradient(x, quads[0], grad) == 0
    assert not grad.any()


@pytest.mark.parametrize("seed", SEEDS)
def test_bending_hessian_of_a_flat_sheet_is_exact(seed):
    """Gauss-Newton leaves out theta times its second derivative, and theta is 0."""
    rng = np.random.default_rng(seed)
    cloth = small_cloth(rng, young=0.0, bending=1.0)
    x = lifted(cloth.rest, with_singular_values(rng, (1.4, 0.8)))
    H = hessian(cloth, x, np.zeros(len(x))).toarray()
    h = 1e-5 * np.ptp(cloth.rest)
    numeric = central_difference(lambda x: cloth.gradient(x)[1], x, h).reshape(H.shape)
    np.testing.assert_allclose(H, numeric, atol=1e-6 * np.abs(H).max())


# --- the sheet


@pytest.mark.parametrize("seed", SEEDS)
def test_a_sheet_at_rest_has_no_energy_and_no_force(seed):
    rng = np.random.default_rng(seed)
    cloth = small_cloth(rng)
    x = lifted(cloth.rest, rotation(rng)[:, :2]) + rng.normal(size=3)
    values, gradient = cloth.gradient(x)
    scale = cloth.mass.sum() / (Material().density * Material().thickness)
    assert values["membrane"] == pytest.approx(0, abs=1e-18 * scale)
    assert values["bending"] == pytest.approx(0, abs=1e-18)
    np.testing.assert_allclose(gradient, 0, atol=1e-12)


@pytest.mark.parametrize("seed", SEEDS)
def test_rigid_motion_changes_no_energy_and_turns_the_forces(seed):
    rng = np.random.default_rng(seed)
    cloth = small_cloth(rng)
    x = lifted(cloth.rest) + 0.1 * np.ptp(cloth.rest) * rng.normal(size=(len(cloth.rest), 3))
    Q, shift = rotation(rng), rng.normal(size=3)
    before, after = cloth.gradient(x), cloth.gradient(x @ Q.T + shift)
    assert after[0] == pytest.approx(before[0], rel=1e-9)
    np.testing.assert_allclose(after[1], before[1] @ Q.T, atol=1e-9 * np.abs(before[1]).max())


@pytest.mark.parametrize("seed", SEEDS)
def test_internal_forces_have_no_sum_and_no_torque(seed):
    rng = np.random.default_rng(seed)
    cloth = small_cloth(rng, bending=1e-3)
    x = lifted(cloth.rest) + 0.1 * np.ptp(cloth.rest) * rng.normal(size=(len(cloth.rest), 3))
    force = -cloth.gradient(x)[1]
    size = np.abs(force).max()
    np.testing.assert_allclose(force.sum(axis=0), 0, atol=1e-11 * size)
    np.testing.assert_allclose(
        np.cross(x, force).sum(axis=0), 0, atol=1e-11 * size * np.ptp(cloth.rest)
    )


@pytest.mark.parametrize("pins", [(), (0,), (3, 7, 1)])
def test_assembled_hessian_is_the_derivative_of_the_forces(rng, pins):
    """Of a flat sheet under tension: nothing is clamped there, and Gauss-Newton is exact."""
    cloth = small_cloth(rng, np.array(pins, dtype=np.int64), bending=1e-3)
    in_plane = 0.01 * np.ptp(cloth.rest) / 3 * rng.normal(size=cloth.rest.shape)
    x = lifted(1.3 * cloth.rest + in_plane, rotation(rng)[:, :2])
    diagonal = rng.uniform(0, 1, len(x))
    free = np.setdiff1d(np.arange(len(x)), pins)
    h = 1e-5 * np.ptp(cloth.rest)
    dense = central_difference(lambda x: cloth.gradient(x)[1], x, h)[free][:, :, free]
    expected = dense.reshape(3 * len(free), -1) + np.diag(np.repeat(diagonal[free], 3))
    found = hessian(cloth, x, diagonal).toarray()
    np.testing.assert_allclose(found, expected, atol=1e-6 * np.abs(expected).max())


@pytest.mark.parametrize("seed", SEEDS)
def test_assembled_hessian_is_symmetric_and_positive_semidefinite(seed):
    rng = np.random.default_rng(seed)
    cloth = small_cloth(rng, np.array([2]))
    x = lifted(0.5 * cloth.rest) + 0.2 * np.ptp(cloth.rest) * rng.normal(size=(len(cloth.rest), 3))
    H = hessian(cloth, x, np.zeros(len(x))).toarray()
    np.testing.assert_allclose(H, H.T, atol=1e-12 * np.abs(H).max())
    assert np.linalg.eigvalsh(H).min() >= -1e-12 * np.abs(H).max()


@pytest.mark.parametrize("seed", SEEDS)
def test_masses_sum_to_that_of_the_sheet(seed):
    cloth = small_cloth(np.random.default_rng(seed), density=300.0, thickness=2e-3)
    area = shape_gradients(cloth.rest, cloth.elements)[1].sum()
    assert cloth.mass.sum() == pytest.approx(300.0 * 2e-3 * area, rel=1e-13)
    assert cloth.mass.min() > 0


# --- implicit Euler


def step(cloth, x, v, h, settings=SHARP):
    return minimise_step(cloth, x, x + h * v, h, settings)


@pytest.mark.parametrize("h", [1e-3, 1 / 60, 0.2])
def test_free_fall_is_exact(rng, h):
    cloth = small_cloth(rng)
    x = lifted(cloth.rest, rotation(rng)[:, :2])
    v = rng.normal(size=3)
    found, report = step(cloth, x, v, h)
    assert report.converged
    expected = x + h * v + h**2 * GRAVITY
    np.testing.assert_allclose(found, expected, atol=1e-12 * (1 + np.ptp(cloth.rest)))


@pytest.mark.parametrize("seed", SEEDS)
def test_momentum_changes_by_the_impulse_of_gravity(seed):
    rng = np.random.default_rng(seed)
    cloth = small_cloth(rng)
    h, m = 0.01, cloth.mass[:, None]
    x = lifted(1.1 * cloth.rest) + 0.02 * np.ptp(cloth.rest) * rng.normal(size=(len(m), 3))
    v = rng.normal(size=x.shape)
    found, report = step(cloth, x, v, h)
    assert report.converged
    change = np.sum(m * ((found - x) / h - v), axis=0)
    impulse = h * GRAVITY * m.sum()
    np.testing.assert_allclose(change, impulse, atol=1e-6 * np.linalg.norm(impulse))


def test_a_step_is_a_stationary_point_and_leaves_pins_alone(rng):
    pinned = np.array([0, 5])
    cloth = small_cloth(rng, pinned)
    x = lifted(1.1 * cloth.rest)
    h = 1 / 60
    found, report = step(cloth, x, np.zeros(3), h)
    assert report.converged
    assert report.residual <= SHARP.tolerance
    np.testing.assert_array_equal(found[pinned], x[pinned])
    force = cloth.potential(found)[1] + cloth.mass[:, None] * (found - x) / h**2
    free = cloth.pattern.free
    scale = 9.81 * np.linalg.norm(cloth.mass[free])
    assert np.linalg.norm(force[free]) <= 1.01 * SHARP.tolerance * scale + 1e-14


def test_too_few_iterations_are_not_convergence(rng):
    cloth = small_cloth(rng, np.array([0]))
    x = lifted(0.7 * cloth.rest) + 0.1 * np.ptp(cloth.rest) * rng.normal(size=(len(cloth.rest), 3))
    _, report = step(cloth, x, np.zeros(3), 0.1, NewtonSettings(max_iterations=1))
    assert not report.converged
    assert report.reason == "1 iterations"
    assert report.iterations == 1
    assert report.residual > 1e-6


def test_a_failed_line_search_is_not_convergence(rng):
    cloth = small_cloth(rng, np.array([0]))
    x = lifted(0.7 * cloth.rest)
    found, report = step(cloth, x, np.zeros(3), 0.1, NewtonSettings(max_halvings=0))
    assert not report.converged
    assert "line search" in report.reason
    np.testing.assert_array_equal(found, x)


def test_the_last_allowed_iteration_may_converge(rng):
    cloth = small_cloth(rng)
    x = lifted(cloth.rest)
    _, report = step(cloth, x, np.zeros(3), 0.01, NewtonSettings(max_iterations=1))
    assert report.converged, "one Newton step solves free fall"


@pytest.mark.parametrize("tolerance", [1e-8, 1e-10])
def test_newton_converges_where_the_fall_of_the_energy_drowns_in_rounding(tolerance):
    rest, elements = square_grid(10, 0.5, "alternating")
    cloth = Cloth(rest, elements, Material(), np.array([0, 110]))
    x, v, h = lifted(rest, np.array([[1, 0], [0, 0], [0, 1]])), 0.0, 1 / 60
    for _ in range(10):
        new, report = step(cloth, x, v, h, NewtonSettings(tolerance))
        assert report.converged, report
        assert report.residual <= tolerance
        x, v = new, (new - x) / h


def test_no_acceptable_step_along_a_direction_that_does_not_descend(rng):
    """A linear solver that lies is found out."""

    class Liar(SuperLU):
        def solve(self, b):
            return -super().solve(b)

    cloth = small_cloth(rng, np.array([0]))
    x = lifted(0.7 * cloth.rest)
    liar = Liar(cloth.pattern.matrix())
    found, report = minimise_step(cloth, x, x, 0.1, SHARP, liar)
    assert "line search" in report.reason
    np.testing.assert_array_equal(found, x)


def test_a_matrix_that_cannot_be_factorised_is_not_convergence(rng):
    class Refusing(SuperLU):
        def factorise(self, data):
            raise NotPositiveDefiniteError("refused")

    cloth = small_cloth(rng, np.array([0]))
    x = lifted(0.7 * cloth.rest)
    refusing = Refusing(cloth.pattern.matrix())
    found, report = minimise_step(cloth, x, x, 0.1, SHARP, refusing)
    assert (report.converged, report.reason, report.factorisations) == (False, "refused", 2)
    np.testing.assert_array_equal(found, x)


@pytest.mark.parametrize("bad", [np.nan, np.inf, 1e200])
def test_a_start_that_is_not_finite_is_not_convergence(rng, bad):
    cloth = small_cloth(rng, np.array([0]))
    x = lifted(cloth.rest)
    x[3, 1] = bad
    with np.errstate(all="ignore"):
        _, report = step(cloth, x, np.zeros(3), 0.1)
    assert not report.converged
    assert "not finite" in report.reason


def test_a_compressed_sheet_needs_the_clamped_hessian(rng):
    """Its own is indefinite: it wants to buckle."""
    cloth = small_cloth(rng, np.array([0]))
    x = lifted(0.5 * cloth.rest) + 1e-3 * rng.normal(size=(len(cloth.rest), 3))
    found, report = step(cloth, x, np.zeros(3), 0.5)
    assert report.converged
    assert report.factorisations > report.iterations
    before, after = (sum(cloth.gradient(p)[0].values()) for p in (x, found))
    assert after < before


def test_the_parts_of_a_step_add_up(rng):
    cloth = small_cloth(rng, np.array([0]))
    begin = perf_counter()
    _, report = step(cloth, lifted(1.1 * cloth.rest), np.zeros(3), 0.01)
    seconds = perf_counter() - begin
    parts = (report.assembly_seconds, report.factorisation_seconds, report.line_search_seconds)
    assert min(parts) > 0
    assert sum(parts) <= seconds
    assert report.evaluations > report.iterations


def test_implicit_euler_converges_with_order_one():
    rest, elements = square_grid(2, 0.5, "alternating")
    cloth = Cloth(rest, elements, Material(), np.array([0, 6]))

    def end(steps):
        x, v, h = lifted(1.02 * rest), np.zeros((len(rest), 3)), 0.08 / steps
        for _ in range(steps):
            new, report = step(cloth, x, v, h)
            assert report.converged
            x, v = new, (new - x) / h
        return x

    coarse, middle, fine = end(20), end(40), end(80)
    ratio = np.linalg.norm(coarse - middle) / np.linalg.norm(middle - fine)
    assert ratio == pytest.approx(2, abs=0.2)
