"""The referee: no certificate may be contradicted by a feasible point or by the true optimum."""

from __future__ import annotations

from dataclasses import fields
from functools import cache

import numpy as np
import pytest

from strainbench import Problem, StretchLimits, certify, solve
from strainbench.problem.grid import square_grid
from strainbench.referee.certificate import OUTCOMES
from strainbench.referee.reference import Reference, ReferenceSolver, content_key, reference_of
from tests.problems import (
    moved,
    random_placed_problem,
    renumbered,
    rotation,
    scattered_triangles,
)

SEEDS = range(50)
FEW = range(8)
ROUNDING = 1e-12


@cache
def solved(seed):
    """A problem, its reference, and feasible points from the rest shape to the optimum."""
    problem, placed = random_placed_problem(np.random.default_rng(seed))
    ref = reference_of(problem)
    assert np.isfinite(ref.error), "the reference solver failed"
    shares = (0.0, 0.5, 0.9, 0.99, 0.9999, 1.0)
    points = [(1 - s) * placed + s * ref.positions for s in shares]
    return problem, ref, [x for x in points if not problem.violations(x).any()]


def perturbed(rng, problem, x):
    """Noise of 1e-9 to 10 edge lengths on the free vertices."""
    noise = 10 ** rng.uniform(-9, 1) * problem.edge_length * rng.normal(size=x.shape)
    noise[problem.pinned] = 0
    return x + noise


def same_certificate(first, second, rel):
    assert first.outcome == second.outcome
    for name in ("objective", "max_principal_stretch"):
        assert getattr(first, name) == pytest.approx(getattr(second, name), rel=1e-9)
    assert first.max_violation == pytest.approx(second.max_violation, abs=1e-9, rel=1e-9)
    assert first.lower_bound == pytest.approx(second.lower_bound, rel=rel)


# --- nothing contradicts a certificate


@pytest.mark.parametrize("seed", SEEDS)
def test_no_feasible_point_is_below_the_lower_bound(seed):
    problem, ref, points = solved(seed)
    assert len(points) >= 4
    for x in points:
        certificate = certify(problem, x, reference=ref)
        assert certificate.lower_bound <= certificate.objective * (1 + ROUNDING)
        assert certificate.max_violation == 0


@pytest.mark.parametrize("seed", SEEDS)
def test_the_lower_bound_is_tight(seed):
    """Were it 0, the test above could not fail."""
    problem, ref, _ = solved(seed)
    assert ref.lower_bound > 0.999 * problem.objective(ref.positions)


@pytest.mark.parametrize("seed", SEEDS)
def test_clarabel_is_certified_optimal(seed):
    problem, ref, _ = solved(seed)
    solution = solve(problem, "clarabel")
    assert certify(problem, solution.positions, reference=ref).outcome == "optimal"


@pytest.mark.parametrize("seed", SEEDS)
def test_no_point_is_farther_from_the_optimum_than_its_distance_bound(seed):
    problem, ref, points = solved(seed)
    rng = np.random.default_rng(seed)
    for x in [*points, problem.target, *(perturbed(rng, problem, p) for p in points)]:
        certificate = certify(problem, x, reference=ref)
        distance = np.linalg.norm(x - ref.positions)
        assert certificate.distance_bound >= (distance - ref.error) * (1 - ROUNDING)


@pytest.mark.parametrize("seed", SEEDS)
def test_a_poor_reference_is_rigorous_too(seed):
    """Bounds from wrong multipliers and a point far from optimal, beside a good reference."""
    problem, good, points = solved(seed)
    rng = np.random.default_rng(seed)
    multipliers = rng.normal(size=(problem.rows, 3)) * good.multiplier_norms[:, None]
    poor = Reference.verified(problem, points[int(rng.integers(len(points)))], multipliers)
    assert np.linalg.norm(poor.positions - good.positions) <= poor.error + good.error
    for x in [*points, problem.target, *(perturbed(rng, problem, p) for p in points)]:
        certificate = certify(problem, x, reference=poor)
        distance = np.linalg.norm(x - good.positions)
        assert certificate.distance_bound >= (distance - good.error) * (1 - ROUNDING)


@pytest.mark.parametrize("seed", SEEDS)
def test_any_multipliers_give_a_lower_bound(seed):
    problem, ref, _ = solved(seed)
    rng = np.random.default_rng(seed)
    along = problem.G @ problem.target
    for scale in 10.0 ** np.arange(-9, 7, 3):
        noise = scale * rng.normal(size=along.shape)
        for Y in (noise, scale * np.maximum(0, rng.normal(size=(problem.rows, 1))) * along):
            bound = Reference.verified(problem, ref.positions, Y)
            assert bound.lower_bound <= problem.objective(ref.positions) * (1 + ROUNDING)
            assert bound.error >= 0
            assert bound.infeasible is None, "a feasible problem"


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_multipliers_that_are_no_numbers_count_as_zero(value):
    problem, ref, _ = solved(0)
    Y = np.full((problem.rows, 3), value)
    assert Reference.verified(problem, ref.positions, Y).lower_bound == 0


def test_a_reference_that_is_not_feasible_is_not_used():
    problem, ref, _ = solved(0)
    Y = np.zeros((problem.rows, 3))
    for x in (problem.target, np.full_like(problem.target, np.nan), 2 * ref.positions):
        assert Reference.verified(problem, x, Y).error == np.inf
        assert np.isnan(Reference.verified(problem, x, Y).positions).all()


def test_without_a_reference_the_outcome_says_so():
    problem, ref, _ = solved(0)
    nothing = Reference.verified(problem, problem.target, np.zeros((problem.rows, 3)))
    certificate = certify(problem, ref.positions, reference=nothing)
    assert certificate.outcome == "feasible"
    assert "reference" in certificate.reason
    assert certificate.lower_bound == 0
    assert certificate.distance_bound < np.inf, "a feasible point is its own reference"


# --- exact answers


def one_triangle(rng, mass):
    rest = np.array([[0, 0], [1, 0], [0.2, 0.8]]) + 0.2 * rng.normal(size=(3, 2))
    limits = StretchLimits.sampled(rng.uniform(0, np.pi, 1), [1.02])
    d = limits.directions[0]
    target = 1.5 * np.outer(rest @ d, rotation(rng)[0]) + 0.1 * rng.normal(size=(3, 3))
    return Problem(rest, [[0, 1, 2]], target, limits, mass=mass)


@pytest.mark.parametrize("mass", [None, [0.1, 1.0, 5.0]])
@pytest.mark.parametrize("seed", FEW)
def test_one_limited_direction_of_one_triangle(seed, mass):
    problem = one_triangle(np.random.default_rng(seed), mass)
    g, t, m = problem.row_coefficients[0], problem.target, problem.weights
    y = g @ t
    excess = np.linalg.norm(y) - 1.02
    assert excess > 0
    exact = t - np.outer(g / m, y / np.linalg.norm(y)) * excess / np.sum(g**2 / m)
    certificate = certify(problem, exact)
    assert certificate.outcome == "optimal"
    optimum = excess**2 / (2 * np.sum(g**2 / m))
    assert certificate.objective == pytest.approx(optimum, rel=1e-12)
    assert certificate.lower_bound == pytest.approx(optimum, rel=1e-6)
    assert certificate.lower_bound <= optimum * (1 + ROUNDING)
    assert certificate.max_violation <= 1e-14


@pytest.mark.parametrize("mass", [False, True])
@pytest.mark.parametrize("seed", FEW)
def test_the_distance_bound_holds_for_the_exact_optimum(seed, mass):
    rng = np.random.default_rng(seed)
    problem, exact = scattered_triangles(rng, mass=mass)
    ref = reference_of(problem)
    assert np.linalg.norm(ref.positions - exact) <= ref.error
    assert ref.lower_bound <= problem.objective(exact) * (1 + ROUNDING)
    for _ in range(30):
        x = perturbed(rng, problem, exact)
        distance = np.linalg.norm(x - exact)
        assert certify(problem, x, reference=ref).distance_bound >= distance * (1 - ROUNDING)


@pytest.mark.parametrize("mass", [False, True])
@pytest.mark.parametrize("seed", FEW)
def test_the_exact_optimum_is_certified(seed, mass):
    problem, exact = scattered_triangles(np.random.default_rng(seed), mass=mass)
    assert certify(problem, exact).outcome == "optimal"


@pytest.mark.parametrize("pins", [0, 3])
def test_a_target_within_the_limits_is_its_own_projection(rng, pins):
    problem, placed = random_placed_problem(rng, pins=pins)
    certificate = certify(problem.with_target(placed), placed)
    assert certificate.outcome == "optimal"
    assert certificate.objective == 0
    assert certificate.lower_bound == 0
    assert certificate.distance_bound == 0


def test_nothing_is_free_to_move(rng):
    problem, placed = random_placed_problem(rng, pins=0)
    everywhere = np.arange(problem.vertices)
    held = Problem(problem.rest, problem.elements, placed, problem.limits, pinned=everywhere)
    certificate = certify(held, placed)
    assert certificate.outcome == "optimal"
    assert certificate.distance_bound == 0


@pytest.mark.parametrize("seed", FEW)
def test_the_principal_stretches_of_an_affine_map(seed):
    rng = np.random.default_rng(seed)
    problem, _ = random_placed_problem(rng, pins=0)
    A = rng.normal(size=(3, 2))
    certificate = certify(problem, problem.rest @ A.T + rng.normal(size=3))
    assert certificate.max_principal_stretch == pytest.approx(np.linalg.norm(A, 2), rel=1e-8)
    assert certificate.min_principal_stretch == pytest.approx(np.linalg.norm(A, -2), rel=1e-6)


@pytest.mark.parametrize("seed", SEEDS)
def test_the_principal_stretch_is_no_less_than_any_stretch(seed):
    problem, ref, points = solved(seed)
    for x in (*points, problem.target):
        certificate = certify(problem, x, reference=ref)
        assert certificate.max_principal_stretch >= problem.stretches(x).max() * (1 - ROUNDING)


# --- outcomes


def test_each_outcome_is_reached(rng):
    problem, ref, points = solved(1)
    answers = {
        "optimal": ref.positions,
        "feasible": points[0],
        "violated": problem.target,
        "no answer": np.full_like(problem.target, np.nan),
    }
    assert tuple(answers) == OUTCOMES
    for outcome, x in answers.items():
        certificate = certify(problem, x, reference=ref)
        assert certificate.outcome == outcome
        assert bool(certificate.reason) == (outcome != "optimal")


@pytest.mark.parametrize("seed", SEEDS)
def test_the_target_returned_as_it_is_is_violated(seed):
    problem, ref, _ = solved(seed)
    certificate = certify(problem, problem.target, reference=ref)
    assert certificate.outcome == "violated"
    assert certificate.objective == 0
    assert certificate.max_violation == problem.violations(problem.target).max()
    assert certificate.relative_gap > 1e-3, "cheating on the limits does not close the gap"


def test_the_thresholds_decide(rng):
    problem, ref, _ = solved(2)
    x = 1.001 * (ref.positions - problem.target[0]) + problem.target[0]
    x[problem.pinned] = problem.target[problem.pinned]
    found = certify(problem, x, reference=ref)
    v, gap = found.max_violation, found.relative_gap
    assert v > 0
    for violation, allowed, outcome in (
        (1.01 * v, 1.01 * gap, "optimal"),
        (1.01 * v, 0.99 * gap, "feasible"),
        (0.99 * v, 1.01 * gap, "violated"),
    ):
        assert certify(problem, x, violation, allowed, ref).outcome == outcome


@pytest.mark.parametrize("bad", [0.0, -1e-6, np.nan])
@pytest.mark.parametrize("name", ["violation", "gap"])
def test_thresholds_must_be_positive(name, bad):
    problem, ref, _ = solved(0)
    with pytest.raises(ValueError, match=rf"{name} .*{bad}.*above 0"):
        certify(problem, ref.positions, **{name: bad}, reference=ref)


def unusable(x):
    yield "not finite", np.full_like(x, np.nan)
    yield "not finite", np.where(np.arange(x.size).reshape(x.shape) == 5, np.inf, x)
    yield "1 vertices are not finite", np.where(np.arange(len(x))[:, None] == 2, -np.inf, x)
    yield "shape", x[:-1]
    yield "shape", x[:, :2]
    yield "shape", x.ravel()
    yield "shape", x[None]
    yield "shape ()", None
    yield "complex", x.astype(complex)
    yield "object", x.astype(object)
    yield "type", x.astype(str)
    yield "bool", np.ones(x.shape, bool)
    yield "", [[1.0, 2.0, 3.0], [1.0]]


@pytest.mark.parametrize("case", range(13))
def test_what_is_no_answer_has_a_reason_and_no_numbers(case):
    problem, ref, _ = solved(0)
    words, answer = list(unusable(ref.positions))[case]
    certificate = certify(problem, answer, reference=ref)
    assert certificate.outcome == "no answer"
    assert certificate.reason
    assert words in certificate.reason
    floats = [getattr(certificate, f.name) for f in fields(certificate) if f.type == "float"]
    assert len(floats) == 11
    assert np.isnan(floats).all()


@pytest.mark.parametrize("cast", [np.float32, np.longdouble, np.asfortranarray, np.ndarray.tolist])
def test_other_kinds_of_real_arrays_are_judged(cast):
    problem, ref, points = solved(0)
    answer = cast(points[0])
    assert certify(problem, answer, reference=ref).outcome in ("feasible", "violated")


@pytest.mark.parametrize("size", [1e30, 1e155, 1e300])
def test_a_diverged_answer_is_violated_at_any_size(size):
    problem, ref, _ = solved(0)
    certificate = certify(problem, size * ref.positions, reference=ref)
    assert certificate.outcome == "violated"
    assert certificate.distance_bound > size / 10


def test_the_answer_is_left_as_it_is():
    problem, ref, _ = solved(3)
    answer = ref.positions + 1.0
    before = answer.copy()
    certify(problem, answer, reference=ref)
    np.testing.assert_array_equal(answer, before)


# --- pins


def test_moved_pins_are_judged_as_lying_at_their_targets(rng):
    problem, _ = random_placed_problem(rng, pins=3)
    ref = reference_of(problem)
    x = ref.positions.copy()
    x[problem.pinned] += 0.3 * problem.edge_length
    assert certify(problem, x, reference=ref) == certify(problem, ref.positions, reference=ref)


def test_moving_along_with_a_moved_pin_shows_as_stretch(rng):
    problem, _ = random_placed_problem(rng, pins=1, directions=4)
    ref = reference_of(problem)
    everything_moved = ref.positions + 5 * problem.edge_length
    assert certify(problem, everything_moved, reference=ref).outcome == "violated"


def grid_with_pins(cells, pins, target_of, directions):
    rest, elements = square_grid(cells, float(cells), "uniform")
    target = np.column_stack([rest, np.zeros(len(rest))])
    target[pins] = target_of(target[pins])
    return Problem(rest, elements, target, StretchLimits.isotropic(1.01, directions), pins)


def test_pins_too_far_apart_are_violated_and_named():
    problem = grid_with_pins(3, [0, 12], lambda x: 1.015 * x, directions=4)
    certificate = certify(problem, problem.target)
    assert certificate.outcome == "violated"
    assert certificate.reason.startswith("infeasible: pinned vertices 0 and 12 ")
    assert certificate.distance_bound == np.inf


def test_infeasible_pins_that_no_path_of_edges_shows_are_found_by_duality():
    """Pins off the edges' directions: the path between them is longer than the straight line."""
    problem = grid_with_pins(2, [0, 5], lambda x: 1.06 * x, directions=12)
    assert problem.infeasible_pins() is None
    certificate = certify(problem, problem.target)
    assert certificate.outcome == "violated"
    assert certificate.reason.startswith("infeasible")


def test_pins_just_within_reach_are_not_infeasible():
    problem = grid_with_pins(3, [0, 12], lambda x: 1.0099 * x, directions=4)
    ref = reference_of(problem)
    assert ref.infeasible is None
    assert certify(problem, ref.positions, reference=ref).outcome == "optimal"


# --- invariances


@pytest.mark.parametrize("seed", FEW)
def test_a_certificate_does_not_depend_on_where_the_cloth_is(seed):
    problem, ref, points = solved(seed)
    rng = np.random.default_rng(seed)
    Q, shift = rotation(rng), problem.edge_length * rng.normal(size=3)
    other = moved(problem, Q, shift)
    for x in (ref.positions, points[1], problem.target):
        same_certificate(certify(other, x @ Q.T + shift), certify(problem, x), rel=1e-5)


@pytest.mark.parametrize("seed", FEW)
def test_a_certificate_does_not_depend_on_vertex_numbers(seed):
    problem, ref, points = solved(seed)
    order = np.random.default_rng(seed).permutation(problem.vertices)
    other = renumbered(problem, order)
    for x in (ref.positions, points[1], problem.target):
        same_certificate(certify(other, x[order]), certify(problem, x), rel=1e-5)


@pytest.mark.parametrize("seed", FEW)
def test_the_bounds_of_given_multipliers_turn_with_the_cloth(seed):
    problem, ref, points = solved(seed)
    rng = np.random.default_rng(seed)
    Q, shift = rotation(rng), problem.edge_length * rng.normal(size=3)
    Y = ref.multiplier_norms[:, None] * (problem.G @ points[-1])
    before = Reference.verified(problem, points[1], Y)
    after = Reference.verified(moved(problem, Q, shift), points[1] @ Q.T + shift, Y @ Q.T)
    assert before.lower_bound > 0
    assert after.lower_bound == pytest.approx(before.lower_bound, rel=1e-9)
    np.testing.assert_allclose(after.multiplier_norms, before.multiplier_norms, rtol=1e-9)


@pytest.mark.parametrize("unit", [1e-3, 1e3])
@pytest.mark.parametrize("seed", range(4))
def test_a_certificate_does_not_depend_on_the_unit_of_length(seed, unit):
    problem, ref, points = solved(seed)
    other = Problem(
        rest=unit * problem.rest,
        elements=problem.elements,
        target=unit * problem.target,
        limits=problem.limits,
        pinned=problem.pinned,
        mass=problem.mass,
    )
    for x in (ref.positions, points[1], problem.target):
        small, large = certify(problem, x), certify(other, unit * x)
        if x is not ref.positions:  # whose violation may be 1e-17 in the other unit
            assert large.outcome == small.outcome
        assert large.relative_gap == pytest.approx(small.relative_gap, rel=1e-4, abs=1e-5)
        assert large.objective == pytest.approx(unit**2 * small.objective, rel=1e-9)


def test_equal_masses_scale_the_objective_and_move_nothing(rng):
    problem, _ = random_placed_problem(rng, mass=False)
    heavy = Problem(
        problem.rest,
        problem.elements,
        problem.target,
        problem.limits,
        problem.pinned,
        np.full(problem.vertices, 0.01),
    )
    plain, weighted = reference_of(problem), reference_of(heavy)
    assert weighted.lower_bound == pytest.approx(0.01 * plain.lower_bound, rel=1e-5)
    apart = np.linalg.norm(plain.positions - weighted.positions)
    assert apart <= plain.error + weighted.error


# --- references that are kept


def test_a_reference_is_kept_and_used_again(rng):
    problem, _ = random_placed_problem(rng)
    kept = {}
    first = ReferenceSolver(problem, kept)(problem)
    assert list(kept) == [content_key(problem)]
    before = dict(kept)
    again = ReferenceSolver(problem, kept)(problem)
    assert kept[content_key(problem)] is before[content_key(problem)]
    np.testing.assert_array_equal(again.positions, first.positions)
    assert again.lower_bound == first.lower_bound


def test_a_kept_reference_is_not_believed(rng):
    problem, placed = random_placed_problem(rng)
    huge = 1e6 * rng.normal(size=(problem.rows, 3))
    kept = {content_key(problem): (problem.target, [huge, -huge], None)}
    ref = ReferenceSolver(problem, kept)(problem)
    assert ref.error == np.inf
    assert all(bound <= problem.objective(placed) for bound, _ in ref.duals)


def test_the_key_of_a_reference_knows_all_that_the_optimum_depends_on(rng):
    problem, _ = random_placed_problem(rng, mass=True, pins=2)
    given = {f.name: getattr(problem, f.name) for f in fields(problem)}
    others = [
        problem.with_target(problem.target + 1e-9),
        problem.tightened(1e-6),
        Problem(**{**given, "pinned": given["pinned"][:1]}),
        Problem(**{**given, "mass": None}),
        Problem(**{**given, "rest": 2 * given["rest"]}),
    ]
    keys = {content_key(p) for p in (problem, *others)}
    assert len(keys) == 6
    assert content_key(Problem(**given)) == content_key(problem)
