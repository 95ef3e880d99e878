"""The projection problem: its matrices, its invariances, and every bad input."""

from __future__ import annotations

import numpy as np
import pytest

from strainbench import Problem, StretchLimits, solve
from strainbench.problem.grid import square_grid
from tests.problems import (
    central_difference,
    moved,
    random_placed_problem,
    random_problem,
    renumbered,
    rotation,
)

SEEDS = range(8)
AXES = StretchLimits(np.eye(3), [1.1, 1.1, 1.1])


def triangle(**changes):
    rest = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]])
    given = {
        "rest": rest,
        "elements": [[0, 1, 2], [1, 3, 2]],
        "target": np.column_stack([rest, np.zeros(4)]),
        "limits": StretchLimits.isotropic(1.1, 2),
    }
    return Problem(**(given | changes))


def random_tetrahedra(rng, count=5):
    """Disjoint tetrahedra with three to five limited directions in space."""
    rest = rng.normal(size=(4 * count, 3))
    elements = np.arange(4 * count).reshape(count, 4)
    directions = rng.normal(size=(rng.integers(3, 6), 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    limits = StretchLimits(directions, rng.uniform(1, 1.2, len(directions)))
    return Problem(rest, elements, rng.normal(size=rest.shape), limits)


def with_entry(array, index, value):
    changed = np.array(array, dtype=float)
    changed[index] = value
    return changed


# --- bad input names the field, the index and the value


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("field", ["rest", "target"])
def test_positions_must_be_finite(field, value):
    bad = with_entry(getattr(triangle(), field), (2, 1), value)
    with pytest.raises(ValueError, match=rf"{field}\[2, 1\] is {value}"):
        triangle(**{field: bad})


@pytest.mark.parametrize(
    ("field", "value", "words"),
    [
        ("elements", [[0, 1, 2], [1, 4, 2]], r"elements\[1, 1\] is 4: .* 0 to 3"),
        ("elements", [[0, 1, 2], [1, -1, 2]], r"elements\[1, 1\] is -1: .* 0 to 3"),
        ("elements", [[0.0, 1.0, 2.0]], r"elements: .*integers.*float64"),
        ("elements", [0, 1, 2], r"elements: .*\(3,\)"),
        ("elements", np.zeros((0, 3), int), r"elements: shape \(0, 3\)"),
        ("elements", [[0, 1, 2, 3]], r"elements: shape \(1, 4\).*\(e, 3\)"),
        ("elements", [[0, 1, 2], [1, 3]], r"elements: "),
        ("elements", [[0, 1, 2], [0, 1, 1]], r"elements\[1\] .*\[0, 1, 1\].* no rest area"),
        ("pinned", [4], r"pinned\[0\] is 4: .* 0 to 3"),
        ("pinned", [0, -1], r"pinned\[1\] is -1"),
        ("pinned", [2, 0, 2], r"pinned\[2\] is 2: .*already"),
        ("pinned", [True, False, False, False], r"pinned: .*integers.*bool"),
        ("pinned", [[0]], r"pinned: .*\(1, 1\)"),
        ("pinned", 0, r"pinned: .*\(\)"),
        ("mass", [1, 1, 0, 1], r"mass\[2\] is 0"),
        ("mass", [1, 1, 1, -2], r"mass\[3\] is -2"),
        ("mass", [1, np.nan, 1, 1], r"mass\[1\] is nan"),
        ("mass", [1, 1, np.inf, 1], r"mass\[2\] is inf"),
        ("mass", [1, 1, 1], r"mass: 3 .* 4 vertices"),
        ("mass", 1.0, r"mass: .*\(\)"),
        ("mass", np.ones((4, 1)), r"mass: .*\(4, 1\)"),
        ("target", np.zeros((4, 2)), r"target: shape \(4, 2\).*\(4, 3\)"),
        ("target", np.zeros((3, 3)), r"target: shape \(3, 3\).*\(4, 3\)"),
        ("target", np.zeros(12), r"target: .*\(12,\)"),
        ("target", np.zeros((4, 3), complex) + 1j, r"target: "),
        ("target", [["a", "b", "c"]] * 4, r"target: "),
        ("target", None, r"target: "),
        ("rest", np.zeros((4, 1)), r"rest: shape \(4, 1\)"),
        ("rest", np.zeros((4, 4)), r"rest: shape \(4, 4\)"),
        ("rest", np.zeros(8), r"rest: .*\(8,\)"),
        ("limits", 1.01, r"limits: 1\.01 is not a StretchLimits"),
        ("limits", AXES, r"limits\.directions: 3 coordinates.* 2"),
        (
            "limits",
            StretchLimits.sampled([0.0], np.ones((3, 1))),
            r"limits\.bounds: 3 rows for 2 elements",
        ),
    ],
)
def test_bad_input(field, value, words):
    with pytest.raises(ValueError, match=words):
        triangle(**{field: value})


def test_an_element_without_area_is_named():
    rest = [[0, 0], [1, 0], [0, 1], [0.5, 0.5]]
    with pytest.raises(
        ValueError, match=r"elements\[1\] \(vertices \[1, 3, 2\]\) has no rest area"
    ):
        triangle(rest=rest)


def test_area_is_lost_at_any_scale_and_never_by_scale_alone():
    for scale in (1e-9, 1e9):
        triangle(rest=scale * triangle().rest)
        with pytest.raises(ValueError, match="no rest area"):
            triangle(rest=scale * np.array([[0, 0], [1, 3], [0.1, 0.3], [1, 1]]))


def test_volumes_need_tetrahedra():
    rest = np.vstack([np.zeros(3), np.eye(3)])
    with pytest.raises(ValueError, match=r"elements: shape \(1, 3\).*\(e, 4\)"):
        Problem(rest, [[0, 1, 2]], rest, AXES)


def test_volumes_need_directions_in_space():
    rest = np.vstack([np.zeros(3), np.eye(3)])
    with pytest.raises(ValueError, match=r"limits\.directions: 2 coordinates.* 3"):
        Problem(rest, [[0, 1, 2, 3]], rest, StretchLimits.isotropic(1.1))


def test_a_flat_tetrahedron_is_named():
    rest = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0.0]])
    with pytest.raises(ValueError, match=r"elements\[0\] .* no rest volume"):
        Problem(rest, [[0, 1, 2, 3]], rest, AXES)


@pytest.mark.parametrize(
    ("target", "words"),
    [(np.zeros((4, 2)), r"target: shape \(4, 2\)"), (np.full((4, 3), np.nan), r"target\[0, 0\]")],
)
def test_another_target_is_checked_too(target, words):
    with pytest.raises(ValueError, match=words):
        triangle().with_target(target)


def test_bounds_cannot_be_tightened_below_zero():
    with pytest.raises(ValueError, match=r"limits\.bounds\[0\] is -"):
        triangle().tightened(1.2)


# --- copies


def test_arrays_are_copies():
    arrays = {
        "rest": triangle().rest.copy(),
        "elements": triangle().elements.copy(),
        "target": triangle().target.copy(),
        "pinned": np.array([1]),
        "mass": np.ones(4),
    }
    problem = triangle(**arrays)
    before = {name: getattr(problem, name).copy() for name in arrays}
    for array in arrays.values():
        array += 1
    for name, value in before.items():
        np.testing.assert_array_equal(getattr(problem, name), value)


@pytest.mark.parametrize("name", ["rest", "elements", "target", "pinned", "mass"])
def test_arrays_are_read_only(name):
    problem = triangle(pinned=[1], mass=np.ones(4))
    with pytest.raises(ValueError, match="read-only"):
        getattr(problem, name)[0] = 0


@pytest.mark.parametrize(
    "name", ["bounds", "weights", "free", "gradients", "measures", "row_coefficients"]
)
def test_derived_arrays_are_read_only_too(name):
    """They are kept: a solver that wrote to them would change what the referee judges by."""
    with pytest.raises(ValueError, match="read-only"):
        getattr(triangle(), name)[0] = 0


def test_with_target_leaves_the_first_problem_as_it_was(rng):
    problem = random_problem(rng)
    other = problem.with_target(2 * problem.target)
    np.testing.assert_array_equal(other.target, 2 * problem.target)
    assert other.objective(other.target) == 0
    assert problem.objective(other.target) > 0
    np.testing.assert_array_equal(other.bounds, problem.bounds)


@pytest.mark.parametrize("per_element", [False, True])
def test_tightened_lowers_every_bound_and_nothing_else(rng, per_element):
    problem = random_problem(rng, per_element=per_element)
    wide = problem.bounds.copy()
    tight = problem.tightened(1e-3)
    np.testing.assert_allclose(tight.bounds, wide - 1e-3, rtol=1e-15)
    np.testing.assert_array_equal(problem.bounds, wide)
    np.testing.assert_array_equal(tight.target, problem.target)


def test_lower_bounds_are_violated_from_below(rng):
    rest, elements = square_grid(2, 1.0, "uniform")
    limits = StretchLimits.isotropic(1.1, 4, lower=0.9)
    target = np.column_stack([rest * [0.5, 1.3], np.zeros(len(rest))])
    problem = Problem(rest, elements, target, limits)
    assert not problem.convex
    np.testing.assert_array_equal(problem.lower_bounds, np.full(problem.rows, 0.9))
    violations = problem.violations(target).reshape(-1, 4)
    diagonal = np.hypot(0.5, 1.3) / np.sqrt(2)
    expected = [1.3 - 1.1, 0.0, 0.9 - 0.5, 0.0]  # weft, diagonal, warp, diagonal
    assert 0.9 < diagonal < 1.1
    np.testing.assert_allclose(violations, np.tile(expected, (len(elements), 1)), atol=1e-12)


def test_without_lower_bounds_a_problem_is_convex(rng):
    problem = random_problem(rng)
    assert problem.convex
    np.testing.assert_array_equal(problem.lower_bounds, np.zeros(problem.rows))


def test_tightened_raises_lower_bounds():
    limits = StretchLimits.orthotropic(1.1, 1.2, 1.3, lower=0.9)
    rest, elements = square_grid(1, 1.0, "uniform")
    problem = Problem(rest, elements, np.column_stack([rest, rest[:, 0]]), limits)
    np.testing.assert_allclose(problem.tightened(1e-3).lower_bounds, 0.901, rtol=1e-12)


def test_lower_bounds_are_for_as_many_elements_as_there_are():
    rest, elements = square_grid(1, 1.0, "uniform")
    limits = StretchLimits(np.eye(2), [1.1, 1.1], lower=np.full((3, 2), 0.9))
    with pytest.raises(ValueError, match=r"limits\.lower: 3 rows for 2 elements"):
        Problem(rest, elements, np.column_stack([rest, rest[:, 0]]), limits)


def test_tightened_shortens_the_reach_of_the_pins():
    problem = triangle(pinned=[0, 1], target=1.08 * triangle().target)
    assert problem.infeasible_pins() is None
    assert "vertices 0 and 1" in problem.tightened(0.05).infeasible_pins()
    assert problem.infeasible_pins() is None


# --- the matrices


@pytest.mark.parametrize("seed", SEEDS)
def test_the_deformation_gradient_of_an_affine_map_is_its_matrix(seed):
    rng = np.random.default_rng(seed)
    problem = random_problem(rng)
    A, c = rng.normal(size=(3, 2)), rng.normal(size=3)
    F = problem.deformation_gradients(problem.rest @ A.T + c)
    np.testing.assert_allclose(F, np.broadcast_to(A, F.shape), rtol=1e-8, atol=1e-9)


@pytest.mark.parametrize("seed", SEEDS)
def test_stretches_of_an_affine_map(seed):
    rng = np.random.default_rng(seed)
    problem = random_problem(rng)
    A = rng.normal(size=(3, 2))
    expected = np.tile(
        np.linalg.norm(problem.limits.directions @ A.T, axis=1), len(problem.elements)
    )
    np.testing.assert_allclose(problem.stretches(problem.rest @ A.T), expected, rtol=1e-9)


@pytest.mark.parametrize("seed", SEEDS)
def test_rows_of_g_give_the_deformed_directions(seed):
    rng = np.random.default_rng(seed)
    problem = random_problem(rng)
    x = rng.normal(size=problem.target.shape)
    F = problem.deformation_gradients(x)
    deformed = np.einsum("exc,mc->emx", F, problem.limits.directions).reshape(-1, 3)
    np.testing.assert_allclose(problem.G @ x, deformed, atol=1e-12 * np.abs(deformed).max())


@pytest.mark.parametrize("seed", SEEDS)
def test_a_translation_deforms_nothing(seed):
    problem = random_problem(np.random.default_rng(seed))
    size = np.abs(problem.gradients).max()
    np.testing.assert_allclose(problem.gradients.sum(axis=1), 0, atol=1e-14 * size)
    np.testing.assert_allclose(problem.G.sum(axis=1), 0, atol=1e-14 * size)


def test_areas_of_a_grid_sum_to_that_of_the_square():
    rest, elements = square_grid(5, 0.7, "alternating")
    problem = Problem(rest, elements, np.zeros((36, 3)), StretchLimits.isotropic(1.1), pinned=[0])
    assert problem.measures.sum() == pytest.approx(0.49, rel=1e-14)
    np.testing.assert_allclose(problem.measures, 0.49 / 50, rtol=1e-12)


def test_bounds_and_rows_are_ordered_by_element_then_direction():
    bounds = np.array([[1.1, 1.2], [1.3, 1.4]])
    problem = triangle(limits=StretchLimits.sampled([0.0, np.pi / 2], bounds))
    np.testing.assert_array_equal(problem.bounds, bounds.ravel())
    x = problem.target * [2, 3, 1]
    np.testing.assert_allclose(problem.stretches(x), [2, 3, 2, 3], rtol=1e-14)
    np.testing.assert_allclose(problem.violations(x), [0.9, 1.8, 0.7, 1.6], rtol=1e-14)


def test_the_objective_is_half_the_weighted_square_distance():
    problem = triangle(mass=[1.0, 2.0, 3.0, 4.0])
    x = problem.target + np.array([[1, 0, 0], [0, 2, 0], [0, 0, 3], [1, 1, 1]])
    assert problem.objective(x) == 0.5 * (1 * 1 + 2 * 4 + 3 * 9 + 4 * 3)
    assert triangle().objective(x) == 0.5 * (1 + 4 + 9 + 3)


@pytest.mark.parametrize("seed", SEEDS)
def test_free_and_pinned_are_all_the_vertices(seed):
    problem = random_problem(np.random.default_rng(seed))
    both = np.sort(np.concatenate([problem.free, problem.pinned]))
    np.testing.assert_array_equal(both, np.arange(problem.vertices))


# --- tetrahedra


@pytest.mark.parametrize("seed", SEEDS)
def test_stretches_of_an_affine_map_of_a_volume(seed):
    rng = np.random.default_rng(seed)
    problem = random_tetrahedra(rng)
    A, c = rng.normal(size=(3, 3)), rng.normal(size=3)
    x = problem.rest @ A.T + c
    F = problem.deformation_gradients(x)
    np.testing.assert_allclose(F, np.broadcast_to(A, F.shape), atol=1e-8)
    along = np.linalg.norm(problem.limits.directions @ A.T, axis=1)
    np.testing.assert_allclose(problem.stretches(x), np.tile(along, 5), rtol=1e-8)


def test_the_volume_of_a_tetrahedron():
    rest = np.vstack([np.zeros(3), np.diag([1.0, 2.0, 3.0])])
    assert Problem(rest, [[0, 1, 2, 3]], rest, AXES).measures == pytest.approx([1.0])


def test_pins_of_a_volume_pulled_too_far_are_named():
    rest = np.vstack([np.zeros(3), np.eye(3)])
    problem = Problem(rest, [[0, 1, 2, 3]], 1.12 * rest, AXES, pinned=[0, 2])
    assert "vertices 0 and 2" in problem.infeasible_pins()
    assert problem.with_target(1.099 * rest).infeasible_pins() is None


# --- invariances


@pytest.mark.parametrize("seed", SEEDS)
def test_rigid_motion_changes_neither_stretches_nor_objective(seed):
    rng = np.random.default_rng(seed)
    problem = random_problem(rng)
    x = problem.target + rng.normal(size=problem.target.shape)
    Q, shift = rotation(rng), rng.normal(size=3)
    other = moved(problem, Q, shift)
    np.testing.assert_allclose(
        other.stretches(x @ Q.T + shift), problem.stretches(x), rtol=1e-9, atol=1e-11
    )
    assert other.objective(x @ Q.T + shift) == pytest.approx(problem.objective(x), rel=1e-11)


@pytest.mark.parametrize("seed", SEEDS)
def test_vertex_numbers_change_neither_stretches_nor_objective(seed):
    rng = np.random.default_rng(seed)
    problem = random_problem(rng)
    order = rng.permutation(problem.vertices)
    other = renumbered(problem, order)
    x = rng.normal(size=problem.target.shape)
    np.testing.assert_allclose(other.stretches(x[order]), problem.stretches(x), rtol=1e-12)
    assert other.objective(x[order]) == pytest.approx(problem.objective(x), rel=1e-13)
    np.testing.assert_array_equal(order[other.free[:, None]].ravel(), order[other.free])
    np.testing.assert_array_equal(np.sort(order[other.free]), problem.free)


@pytest.mark.parametrize("seed", SEEDS)
def test_the_first_corner_of_an_element_does_not_matter(seed):
    rng = np.random.default_rng(seed)
    problem = random_problem(rng)
    turned = Problem(problem.rest, problem.elements[:, [2, 0, 1]], problem.target, problem.limits)
    mirrored = Problem(problem.rest, problem.elements[:, [1, 0, 2]], problem.target, problem.limits)
    expected = problem.stretches(problem.target)
    for other in (turned, mirrored):
        np.testing.assert_allclose(other.stretches(problem.target), expected, rtol=1e-9)
        np.testing.assert_allclose(other.measures, problem.measures, rtol=1e-11)


@pytest.mark.parametrize("unit", [1e-3, 1e3])
def test_the_unit_of_length_does_not_matter(rng, unit):
    problem = random_problem(rng)
    other = Problem(unit * problem.rest, problem.elements, unit * problem.target, problem.limits)
    np.testing.assert_allclose(
        other.stretches(other.target), problem.stretches(problem.target), rtol=1e-10
    )
    assert other.edge_length == pytest.approx(unit * problem.edge_length)


# --- pins farther apart than the limits allow


def pulled_grid(factor, pins, target_of=None, directions=4):
    rest, elements = square_grid(3, 0.3, "uniform")
    target = np.column_stack([rest, np.zeros(len(rest))])
    target[:, 0] *= factor
    limits = StretchLimits.isotropic(1.01, directions)
    return Problem(rest, elements, target, limits, pinned=pins)


@pytest.mark.parametrize("ends", [(0, 12), (3, 15), (4, 8)])
def test_pins_pulled_too_far_along_edges_are_named(ends):
    words = pulled_grid(1.015, list(ends)).infeasible_pins()
    assert words.startswith("infeasible")
    assert f"{ends[0]} and {ends[1]}" in words
    assert pulled_grid(1.0099999, list(ends)).infeasible_pins() is None


def test_the_message_says_how_far_and_how_far_is_allowed():
    words = pulled_grid(1.015, [12, 0]).infeasible_pins()
    assert f"{0.3 * 1.015:.6g} m" in words
    assert f"{0.3 * 1.01:.6g} m" in words


@pytest.mark.parametrize("bounds", [(1.1, 1.5), (1.5, 1.1)])
def test_a_shared_edge_is_as_short_as_its_stricter_triangle_makes_it(bounds):
    along_and_across = np.deg2rad([-45, 45])
    limits = StretchLimits.sampled(along_and_across, np.repeat(bounds, 2).reshape(2, 2))
    flat = triangle().target
    problem = triangle(limits=limits, pinned=[1, 2])
    assert problem.with_target(1.0999 * flat).infeasible_pins() is None
    assert "vertices 1 and 2" in problem.with_target(1.1001 * flat).infeasible_pins()


def test_the_worst_pair_among_many_pins_is_named():
    problem = pulled_grid(1.0, [0, 5, 12])
    target = problem.target.copy()
    target[5] += [0, 0, 10.0]
    assert "5" in problem.with_target(target).infeasible_pins().split(" m apart")[0]


@pytest.mark.parametrize("pins", [[], [3]])
def test_fewer_than_two_pins_are_never_too_far_apart(pins):
    assert pulled_grid(50.0, pins).infeasible_pins() is None


def test_pins_on_separate_pieces_are_never_too_far_apart():
    rest = np.array([[0, 0], [1, 0], [0, 1], [5, 0], [6, 0], [5, 1.0]])
    target = 9 * np.column_stack([rest, np.zeros(6)])
    pieces = [[0, 1, 2], [3, 4, 5]]
    problem = Problem(rest, pieces, target, StretchLimits.isotropic(1.01), pinned=[0, 3])
    assert problem.infeasible_pins() is None


def test_one_direction_does_not_limit_how_far_apart_pins_are():
    assert pulled_grid(50.0, [0, 12], directions=1).infeasible_pins() is None


@pytest.mark.parametrize("seed", range(20))
def test_pins_at_feasible_positions_are_never_called_infeasible(seed):
    """Nor at the limit: every vertex of a projected configuration may be pinned where it is."""
    problem, placed = random_placed_problem(np.random.default_rng(seed))
    everywhere = np.arange(problem.vertices)
    x = solve(problem.tightened(1e-6), "clarabel").positions
    assert problem.violations(x).max() == 0
    for positions in (placed, x):
        held = Problem(problem.rest, problem.elements, positions, problem.limits, pinned=everywhere)
        assert held.infeasible_pins() is None


@pytest.mark.parametrize("seed", range(20))
def test_edges_of_feasible_positions_are_within_their_longest(seed):
    problem = random_problem(np.random.default_rng(seed), directions=3 + seed % 4)
    x = solve(problem.tightened(1e-6), "clarabel").positions
    edges, longest = problem.longest_edges()
    length = np.linalg.norm(x[edges[:, 0]] - x[edges[:, 1]], axis=1)
    assert np.all(length <= longest * (1 + 1e-12))
    assert np.max(length / longest) > 0.9, "the check is idle: nothing is near its bound"


@pytest.mark.parametrize("seed", range(20))
def test_no_feasible_point_has_more_than_the_largest_objective(seed):
    problem, placed = random_placed_problem(np.random.default_rng(seed), pins=1 + seed % 3)
    turned = problem.target[problem.pinned[0]] + (placed - placed[problem.pinned[0]]) * [-1, -1, 1]
    assert problem.objective(placed) <= problem.largest_objective
    if len(problem.pinned) == 1:
        assert problem.objective(turned) <= problem.largest_objective


@pytest.mark.parametrize("seed", SEEDS)
def test_rest_by_corner_is_the_same_problem(seed):
    rng = np.random.default_rng(seed)
    shared = random_problem(rng) if seed % 2 else random_tetrahedra(rng)
    problem = Problem(
        shared.rest[shared.elements],
        shared.elements,
        shared.target,
        shared.limits,
        shared.pinned,
        shared.mass,
    )
    assert problem.vertices == shared.vertices
    np.testing.assert_array_equal(problem.G.toarray(), shared.G.toarray())
    np.testing.assert_array_equal(problem.measures, shared.measures)
    assert problem.edge_length == shared.edge_length
    for ours, theirs in zip(problem.longest_edges(), shared.longest_edges(), strict=True):
        np.testing.assert_array_equal(ours, theirs)


def test_each_element_may_have_a_frame_of_its_own():
    rng = np.random.default_rng(3)
    shared = triangle()
    turn = np.stack([rotation(rng)[:2, :2] for _ in range(2)])
    turn = np.linalg.qr(turn)[0]
    corners = np.einsum("ekc,ecd->ekd", shared.rest[shared.elements], turn) + rng.normal(
        size=(2, 1, 2)
    )
    problem = triangle(rest=corners)
    x = rng.normal(size=(4, 3))
    ours, theirs = (
        np.linalg.svd(p.deformation_gradients(x), compute_uv=False) for p in (problem, shared)
    )
    np.testing.assert_allclose(ours, theirs, rtol=1e-10)


def test_a_seam_joins_two_squares_of_cloth():
    # two unit squares, apart in the pattern and sewn along an edge: pins 2 b apart at most
    square = np.array([[[0.0, 0], [1, 0], [1, 1]], [[0, 0], [1, 1], [0, 1]]])
    rest = np.concatenate([square, square + 7.0])
    elements = [[0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4]]
    target = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0], [1, 1, 0], [2, 1, 0.0]])
    problem = Problem(rest, elements, target, StretchLimits.isotropic(1.1), pinned=[0, 2])
    np.testing.assert_allclose(problem.stretches(target), 1)
    assert problem.with_target(1.099 * target).infeasible_pins() is None
    assert "vertices 0 and 2" in problem.with_target(1.101 * target).infeasible_pins()
    found = solve(problem.with_target(1.05 * target), "clarabel").positions
    np.testing.assert_allclose(found, 1.05 * target, atol=1e-8)


@pytest.mark.parametrize(
    ("changes", "match"),
    [
        ({"rest": np.zeros((1, 3, 2))}, r"rest: shape \(1, 3, 2\) for elements of shape \(2, 3\)"),
        ({"rest": np.zeros((2, 3, 4))}, r"rest: shape \(2, 3, 4\); valid are"),
        ({"rest": np.zeros((2, 3, 2))}, r"elements\[0\] .* has no rest area"),
        ({"rest": np.ones((2, 3, 2)), "target": np.zeros(3)}, r"target: expected 2 dimensions"),
        ({"rest": np.ones((2, 3, 2)), "target": np.zeros((3, 3))}, r"elements\[1, 1\] is 3"),
        ({"rest": np.ones((2, 3, 2)), "target": np.zeros((4, 2))}, r"target: shape \(4, 2\)"),
        ({"rest": np.ones((2, 3, 2)), "mass": np.ones(5)}, r"mass: 5 entries for 4 vertices"),
    ],
)
def test_bad_rest_by_corner_is_named(changes, match):
    with pytest.raises(ValueError, match=match):
        triangle(**changes)


def test_a_new_target_of_another_size_is_refused_with_rest_by_corner():
    shared = triangle()
    problem = triangle(rest=shared.rest[shared.elements])
    with pytest.raises(ValueError, match=r"target: shape \(5, 3\)"):
        problem.with_target(np.zeros((5, 3)))


@pytest.mark.parametrize("seed", range(8))
def test_exact_limits_bound_the_singular_values(seed):
    problem, placed = random_placed_problem(np.random.default_rng(seed), exact=True)
    axes = np.broadcast_to(problem.limits.bounds, (len(problem.elements), 2))
    F = problem.deformation_gradients(problem.target)
    relative = np.linalg.svd(F / axes[:, None], compute_uv=False)[:, 0]
    assert problem.constraints == len(problem.elements) == problem.rows / 2
    np.testing.assert_allclose(problem.stretches(problem.target), relative * axes.min(axis=1))
    assert not np.any(problem.violations(placed))


@pytest.mark.parametrize("seed", range(8))
def test_exact_limits_hold_in_every_direction(seed):
    """||F d|| <= ||D^-1 d|| wherever ||F D||_2 <= 1, with equality in some direction."""
    rng = np.random.default_rng(seed)
    problem = random_problem(rng, exact=True, per_element=False)
    F = problem.deformation_gradients(problem.target)[0]
    F *= problem.bounds[0] / problem.stretches(problem.target)[0]
    angles = np.linspace(0, np.pi, 2000)
    d = np.column_stack([np.cos(angles), np.sin(angles)])
    admitted = np.linalg.norm(d * problem.limits.bounds, axis=1)
    ratio = np.linalg.norm(d @ F.T, axis=1) / admitted
    assert 1 - 1e-5 < ratio.max() < 1 + 1e-12


@pytest.mark.parametrize("exact", [False, True])
def test_dual_norms_are_dual_to_stretches(exact):
    """<Y, G x> <= sum |Y_i| stretch_i, with equality where Y is the stretches' gradient."""
    rng = np.random.default_rng(3)
    problem = random_problem(rng, exact=exact)
    x, stretches = problem.target, problem.stretches(problem.target)
    for _ in range(20):
        Y = rng.normal(size=(problem.rows, 3))
        assert np.sum(Y * (problem.G @ x)) <= problem.dual_norms(Y) @ stretches
    gradient = central_difference(lambda y: problem.kind.measure(y).sum(), problem.G @ x)
    assert np.sum(gradient * (problem.G @ x)) == pytest.approx(stretches.sum(), rel=1e-6)
    np.testing.assert_allclose(problem.dual_norms(gradient), 1, rtol=1e-6)


def test_tightened_exact_limits_keep_their_axes():
    problem = random_problem(np.random.default_rng(5), exact=True)
    tight = problem.tightened(1e-3)
    np.testing.assert_allclose(tight.bounds, problem.bounds - 1e-3, rtol=1e-12)
    np.testing.assert_allclose(tight.G.data, problem.G.data, rtol=1e-12)
    fresh = Problem(problem.rest, problem.elements, problem.target, tight.limits, problem.pinned)
    np.testing.assert_allclose(fresh.G.data, problem.G.data, rtol=1e-9)


def test_exact_limits_say_how_far_pins_may_be_apart():
    rest, elements = square_grid(2, 1.0, "uniform")
    target = np.column_stack([rest * [1.06, 1.0], np.zeros(len(rest))])
    corners = np.flatnonzero((rest[:, 1] == 0) & (rest[:, 0] != 0.5))
    for limit, found in ((1.05, "infeasible"), (1.07, None)):
        problem = Problem(rest, elements, target, StretchLimits.exact(limit, 2.0), corners)
        reason = problem.infeasible_pins()
        assert reason is None if found is None else reason.startswith(found)


def test_exact_limits_of_volumes():
    rest = np.vstack([np.zeros(3), np.eye(3)])
    target = rest @ np.diag([1.0, 1.2, 0.9])
    problem = Problem(rest, np.array([[0, 1, 2, 3]]), target, StretchLimits.exact(1.1, dim=3))
    np.testing.assert_allclose(problem.violations(target), [0.1])
    np.testing.assert_allclose(problem.dual_norms(np.diag([1.0, -2.0, 3.0])), [6.0])
