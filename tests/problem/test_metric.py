"""A metric in place of masses: checked, refused by those that need three equal coordinates."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp

from strainbench import Problem, StretchLimits, certify, solve
from strainbench.physics.solid import Solid, SolidMaterial
from strainbench.problem.export import as_npz
from strainbench.problem.grid import box_grid
from strainbench.problem.principal import PrincipalLimits
from strainbench.referee.kkt import kkt_residual, smallest_gap
from strainbench.referee.reference import content_key
from strainbench.solver.registry import find_solver, list_solvers

REST, ELEMENTS = box_grid((2, 1, 1), np.array([1.0, 0.5, 0.5]))
PINNED = np.flatnonzero(REST[:, 0] == 0)
LIMITS = PrincipalLimits("hyperbolic", (None, 0.96, 0.96), (None, 1.04, 1.04))
SIZE = REST.size


def problem(limits=LIMITS, target=1.0, **more):
    return Problem(REST, ELEMENTS, REST * [1, target, 1], limits, PINNED, **more)


def stiff(rng):
    """A step's metric, its frames turned."""
    body = Solid(REST, ELEMENTS, SolidMaterial(1e4), PINNED)
    return body.metric(REST + 0.02 * rng.normal(size=REST.shape), 0.05)


def test_the_objective_is_that_of_the_metric(rng):
    A, x = stiff(rng), REST + rng.normal(size=REST.shape)
    d = (x - REST).ravel()
    assert problem(metric=A).objective(x) == pytest.approx(0.5 * d @ A.toarray() @ d)
    mass = np.linspace(1, 2, len(REST))
    diagonal = sp.diags_array(np.repeat(mass, 3))
    expected = problem(mass=mass).objective(x)
    assert problem(metric=diagonal).objective(x) == pytest.approx(expected)


def test_it_is_kept_exactly_symmetric_and_read_only(rng):
    A = stiff(rng)
    kept = problem(metric=A).metric
    assert abs(kept - kept.T).max() == 0
    np.testing.assert_allclose(kept.toarray(), A.toarray(), rtol=1e-12, atol=1e-12)
    with pytest.raises(ValueError, match="read-only"):
        kept.data[0] = 1.0


def test_a_step_has_a_metric_and_a_place_of_its_own(rng):
    start = problem()
    frame = start.with_target(REST + 0.1, stiff(rng), REST)
    assert start.metric is None
    assert frame.metric is not None
    np.testing.assert_array_equal(frame.linearise_at, REST)
    assert frame.with_target(REST).metric is frame.metric
    assert content_key(frame) != content_key(start.with_target(REST + 0.1))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({(0, 4): 1.0}, r"metric\[0, 4\] is 1, but metric\[4, 0\] is 0: a symmetric"),
        ({(7, 7): -2.0}, r"metric\[7, 7\] is -2: a positive definite"),
        ({(3, 3): np.inf}, r"metric\.data\[3\] is inf: every entry must be finite"),
        ({(1, 2): 2.0, (2, 1): 2.0}, r"metric: pivot \d+ of its factorisation is -"),
    ],
)
def test_what_is_no_metric_is_named(change, words):
    A = sp.lil_array(sp.eye_array(SIZE))
    for at, value in change.items():
        A[at] = value
    with pytest.raises(ValueError, match=words) as error:
        problem(metric=sp.csc_array(A))
    assert "\n" not in str(error.value)


def test_other_shapes_and_places_are_named():
    with pytest.raises(ValueError, match=rf"metric: shape \(3, 3\) for {len(REST)} vertices; "):
        problem(metric=np.eye(3))
    with pytest.raises(ValueError, match=r"linearise_at: shape \(1, 3\), but rest has"):
        problem(linearise_at=REST[:1])
    with pytest.raises(ValueError, match=r"linearise_at\[0, 0\] is nan"):
        problem(linearise_at=np.full_like(REST, np.nan))


TAKERS = ("none", "lcp-pgs", "lcp-qp", "ipopt-principal", "gauss-seidel-clamp")


@pytest.mark.parametrize("name", [e.name for e in list_solvers() if not e.unavailable])
def test_solvers_that_need_masses_refuse_with_the_reason(name):
    if not name.startswith(TAKERS):
        axes = StretchLimits(np.eye(3), np.full(3, 1.1))
        refusal = find_solver(name).supports(problem(axes, metric=sp.eye_array(SIZE)))
        assert "in norms of masses alone" in refusal


def test_a_refused_metric_is_not_solved():
    axes = StretchLimits(np.eye(3), np.full(3, 1.1))
    with pytest.raises(ValueError, match="not in that of a metric"):
        solve(problem(axes, metric=sp.eye_array(SIZE)), "newton-ipm")
    with pytest.raises(ValueError, match="--format npz: files hold norms of masses alone"):
        as_npz(problem(axes, metric=sp.eye_array(SIZE)), "a box")


# --- the referee


@pytest.fixture
def pulled():
    """Four cubes, free, stretched by 10% along a limited axis and by nothing else."""
    frame = Problem(REST, ELEMENTS, REST * [1, 1.1, 1], LIMITS)
    return frame, REST * [1, 1.04, 1] + [0, 0.015, 0]


def test_a_metric_of_masses_has_the_residual_of_masses(pulled, rng):
    frame, optimum = pulled
    mass = np.linspace(1, 2, len(REST))
    weighted = Problem(REST, ELEMENTS, frame.target, LIMITS, mass=mass)
    same = frame.with_target(frame.target, sp.diags_array(np.repeat(mass, 3)))
    for x in (optimum, optimum + 1e-3 * rng.normal(size=optimum.shape)):
        assert kkt_residual(same, x) == pytest.approx(kkt_residual(weighted, x), abs=2e-5)


def test_a_local_optimum_in_the_norm_of_a_metric_is_called_one(pulled, rng):
    """Made to be one: the target lies off it along A^-1 of the normals of active limits."""
    frame, x = pulled
    x = x * [1, 1.0, 1.001]  # singular values apart
    A = stiff(rng)
    active = np.flatnonzero(frame.kind.measure(frame.G @ x) > -1e-9)
    rows, slopes = frame.kind.derivatives(frame.G @ x, active)
    force = np.zeros_like(x)
    for r, d in zip(rows.ravel(), slopes.reshape(-1, 3), strict=True):
        force += frame.G[[r]].T.toarray() * d
    pull = np.linalg.solve(A.toarray(), force.ravel()).reshape(-1, 3)
    target = x + 0.01 * pull / np.abs(pull).max()
    step = Problem(REST, ELEMENTS, target, LIMITS, metric=A)
    assert len(active) > 0
    assert kkt_residual(step, x) < 3e-5
    assert kkt_residual(step.with_target(target + 0.01 * rng.normal(size=x.shape)), x) > 0.1
    found = certify(step, x)
    assert found.outcome == "feasible"
    assert "at best a local optimum" in found.reason
    assert "singular values 1e-03 apart where limits are active" in found.reason


def test_equal_singular_values_are_told(pulled):
    frame, x = pulled
    assert smallest_gap(frame, x) < 1e-12
    assert smallest_gap(frame, REST) == np.inf
    assert "apart where limits are active" in certify(frame, x).reason
    sampled = Problem(REST, ELEMENTS, REST, StretchLimits(np.eye(3), np.full(3, 1.1)))
    assert np.isnan(smallest_gap(sampled, REST))


def test_what_violates_is_violated_however_low_its_objective(pulled, rng):
    frame, _ = pulled
    found = certify(frame.with_target(frame.target, stiff(rng)), frame.target)
    assert (found.outcome, found.objective) == ("violated", 0.0)
    assert found.max_violation == pytest.approx(0.06)
