"""Solvers of limits on principal stretches: clamped singular values, and Ipopt."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from solvers.gauss_seidel_clamp import GaussSeidelClamp, decompose
from solvers.ipopt_principal import IpoptPrincipal, Program
from strainbench import Clock, PrincipalLimits, Problem, StretchLimits, certify, solve
from strainbench import sparse as sp
from strainbench.problem.contact import Plane
from strainbench.problem.grid import square_grid
from strainbench.problem.principal_rows import KINDS
from strainbench.referee.kkt import kkt_residual
from strainbench.solver.solver import run_solver
from tests.problems import central_difference, random_volume

BOTH = PrincipalLimits("isotropic", 0.9, 1.1, 3)


def one(F, limits, **more):
    """A single element with the corners 0, e_1, ... that is to become F."""
    dim = F.shape[1]
    rest = np.vstack([np.zeros(dim), np.eye(dim)])
    return Problem(rest, [range(dim + 1)], rest @ F.T, limits, **more)


def axial(kind, dim):
    """Limits along the last axis, or on all of them."""
    if kind == "isotropic":
        return PrincipalLimits(kind, 0.9, 1.1, dim)
    free = (None,) * (dim - 1)
    return PrincipalLimits(kind, (*free, 0.9), (*free, 1.1))


def sheet(limits):
    """Stretched along one axis, pressed along the other, a little out of its plane."""
    rest, elements = square_grid(3, 1.0, "alternating")
    lift = 0.05 * np.random.default_rng(0).normal(size=len(rest))
    return Problem(rest, elements, np.column_stack([rest * [1.4, 0.8], lift]), limits)


# --- clamped singular values


@pytest.mark.parametrize("case", ["any", "flat", "line", "inverted", "nothing"])
def test_any_matrix_is_decomposed_by_rotations(case, rng):
    F = rng.normal(size=(3, 3))
    if case == "flat":
        F[:, 2] = 0
    elif case == "line":
        F = np.outer(F[0], F[1])
    elif case == "inverted":
        F = np.linalg.qr(F)[0]
        F[:, 0] *= -np.sign(np.linalg.det(F))
    elif case == "nothing":
        F[:] = 0
    U, s, V = np.empty((3, 3)), np.empty(3), np.empty((3, 3))
    decompose(F.copy(), U, s, V)
    np.testing.assert_allclose(U * s @ V.T, F, atol=1e-14 * 10)
    for Q in (U, V):
        np.testing.assert_allclose(Q.T @ Q, np.eye(3), atol=1e-14)
        assert np.linalg.det(Q) > 0


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("move", ["downhill", "shape"])
def test_a_pinless_element_takes_its_clamped_shape(move, seed):
    """Of equal masses, on the regular tetrahedron both levers are the same: one visit is enough."""
    rest = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], dtype=float)
    F = np.random.default_rng(seed).normal(size=(3, 3))
    problem = Problem(rest, [[0, 1, 2, 3]], rest @ F.T, BOTH)
    found = solve(problem, GaussSeidelClamp(move))
    assert found.status == "solved"
    assert found.iterations <= 2
    U, s, Vt = np.linalg.svd(F)
    s[2] *= np.sign(np.linalg.det(F))
    flip = np.sign(s)
    expected = rest @ (U * flip * np.clip(s * 1.0, 0.9, 1.1) * flip @ Vt).T
    if np.all(s > 0):
        np.testing.assert_allclose(found.positions, expected, atol=1e-12)


@pytest.mark.parametrize("limits", [(None, 1.05), (0.9, None), (0.9, 1.1), (0.98, 1.02)])
def test_sweeps_end_within_the_limits_of_a_sheet(limits):
    problem = sheet(PrincipalLimits("isotropic", *limits, 2))
    found = solve(problem, "gauss-seidel-clamp")
    assert found.status == "solved"
    assert problem.violations(found.positions).max() < 1e-6
    assert "local" in certify(problem, found.positions).reason


def test_sweeps_keep_pins_and_end_on_volumes():
    for seed in (2, 3, 5):
        problem, _ = random_volume(np.random.default_rng(seed), BOTH)
        found = solve(problem, "gauss-seidel-clamp")
        assert found.status == "solved"
        np.testing.assert_array_equal(
            found.positions[problem.pinned], problem.target[problem.pinned]
        )
        assert problem.violations(found.positions).max() < 1e-6


def test_a_metric_of_masses_moves_as_masses_do():
    problem, _ = random_volume(np.random.default_rng(2), BOTH)
    mass = np.linspace(1, 2, problem.vertices)
    weighted = replace(problem, mass=mass)
    metric = replace(problem, mass=None, metric=sp.diags_array(np.repeat(mass, 3)))
    found = [solve(p, "gauss-seidel-clamp").positions for p in (weighted, metric)]
    np.testing.assert_allclose(*found, atol=1e-9)


def test_too_few_sweeps_are_said_to_be_too_few():
    problem = sheet(PrincipalLimits("isotropic", 0.9, 1.1, 2))
    found = solve(problem, GaussSeidelClamp(max_sweeps=3))
    assert (found.status, found.iterations) == ("iteration limit", 3)


@pytest.mark.parametrize("kind", sorted(set(KINDS) - {"isotropic"}))
def test_limits_that_see_axes_are_refused(kind):
    reason = GaussSeidelClamp().supports(sheet(axial(kind, 2)))
    assert f"{kind} limits depend on their axes" in reason


@pytest.mark.parametrize("solver", [GaussSeidelClamp(), IpoptPrincipal()])
def test_limits_on_stretch_are_refused(solver):
    reason = solver.supports(sheet(StretchLimits.isotropic(1.1)))
    assert reason == "it limits principal stretches alone"


def test_unknown_moves_are_named():
    with pytest.raises(ValueError, match="move is 'far': valid are downhill, shape"):
        GaussSeidelClamp("far")


# --- Ipopt

cyipopt = pytest.importorskip("cyipopt")


def answer(problem, solver=None):
    """Without the warm-up of `solve`, which is an Ipopt run of its own."""
    return run_solver(solver or IpoptPrincipal(), problem, None, 1e-6)


@pytest.mark.parametrize("kind", KINDS)
def test_derivatives_are_those_of_the_rows(kind):
    problem, _ = random_volume(np.random.default_rng(4), axial(kind, 3))
    problem = problem.with_target(problem.target, contact=[Plane((0, 0, 0), (1, 2, 3))])
    program = Program(problem, print, Clock())
    x = program.target + 0.1 * np.random.default_rng(1).normal(size=len(program.target))
    shape = program.rows, len(x)
    J = sp.coo_array((program.jacobian(x), program.jacobianstructure()), shape=shape).toarray()
    expected = central_difference(program.constraints, x, 1e-6)
    assert np.abs(J - expected).max() < 1e-6 * np.abs(J).max()
    slope = central_difference(program.objective, x, 1e-6)
    np.testing.assert_allclose(program.gradient(x), slope, atol=1e-6 * np.abs(slope).max())


STRETCHED = np.array([[1.25, 0.2, 0.1], [0.1, 0.8, 0.05], [0.05, 0.1, 1.15]])


@pytest.mark.parametrize(
    ("kind", "dim"), [*((kind, 2) for kind in KINDS), ("hyperbolic", 3), ("orthogonal", 3)]
)
def test_elements_end_within_the_limits_at_a_local_optimum(kind, dim):
    problem = one(STRETCHED[:, :dim], axial(kind, dim))
    found = answer(problem)
    assert found.status == "solved"
    assert problem.violations(found.positions).max() < 1e-6
    assert kkt_residual(problem, found.positions) < 1e-5


def test_the_referee_calls_its_answer_local():
    problem = one(STRETCHED[:, :2], axial("isotropic", 2))
    verdict = certify(problem, answer(problem).positions)
    assert verdict.outcome == "feasible"
    assert "local" in verdict.reason


def test_two_equal_values_at_one_limit_are_not_claimed():
    """The optimum lies in a kink of the rows: there is no Newton step to it."""
    problem = one(STRETCHED, axial("isotropic", 3))
    found = answer(problem, IpoptPrincipal(max_iterations=60))
    assert found.status == "iteration limit"


def test_an_optimum_is_below_what_sweeps_find_and_in_the_metric():
    problem, _ = random_volume(np.random.default_rng(5), BOTH)
    metric = sp.diags_array(np.repeat(np.linspace(1, 2, problem.vertices), 3))
    problem = replace(problem, mass=None, metric=metric)
    local, swept = answer(problem), solve(problem, "gauss-seidel-clamp")
    assert local.status == swept.status == "solved"
    assert problem.objective(local.positions) < problem.objective(swept.positions)
    assert kkt_residual(problem, local.positions) < 1e-3


def test_vertices_stay_off_a_plane():
    problem = one(np.eye(3), BOTH)
    problem = problem.with_target(problem.target, contact=[Plane((0, 0.05, 0), (0, 1, 0))])
    found = answer(problem)
    assert found.positions[:, 1].min() > 0.05 - 1e-6
    assert problem.violations(found.positions).max() < 1e-6
