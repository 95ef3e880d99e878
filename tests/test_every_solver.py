"""The contract that every solver keeps; new solvers are found by themselves."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from strainbench import Problem, StretchLimits, certify, solve
from strainbench.plugins import UnavailableError
from strainbench.referee.reference import reference_of
from strainbench.scenario.registry import find_scenario
from strainbench.solver.registry import find_solver, list_solvers
from strainbench.solver.solver import run_solver, warm_twin
from tests.problems import random_problem

NAMES = [e.name for e in list_solvers() if not e.unavailable]
ROUGH = ["cvxpy-scs", "cvxpy-scs-default", "linearized-qp-default", "linearized-qp-plain"]
"""Solvers that often end with limits violated."""
EDGES = ["ipopt-edges"]
"""They limit the lengths of edges: another set of positions than the problem's."""
FIXED_COUNT = ["augmented-lagrangian-arcsim", "xpbd-20", "xpbd-compliant"]
"""Variants as they are used elsewhere: so many iterations, wherever these end."""
LIMITING = [n for n in NAMES if n not in ["none", *EDGES, *ROUGH, *FIXED_COUNT]]
TO_OPTIMALITY = [
    "admm",
    "augmented-lagrangian",
    "clarabel",
    "clarabel-default",
    "cvxpy",
    "dykstra",
    "dykstra-plain",
    "ipopt",
    "linearized-qp",
    "newton-ipm",
    "qoco",
]
"""Solvers of the projection itself; the others stop at a point within the limits."""
UNSCALED = [
    "clarabel-default",
    "clarabel-paper",
    "cvxpy-default",
    "cvxpy-ecos-default",
    "cvxpy-qoco-default",
    "ipopt-default",
    "ipopt-default-lbfgs",
    "qoco-default",
]
"""Out of the box: an objective known to 1e-8 of its size leaves positions uncertain by 1e-4."""

CAN_START_WARM = [
    n for n in LIMITING if find_solver(n).name == n and find_solver(n).starts_warm is not None
]
"""As they are by default: the variants start in the same way."""


def exactness(name):
    return 5e-4 if name in UNSCALED else 5e-6


def available(name):
    try:
        return find_solver(name)
    except UnavailableError as error:
        pytest.skip(str(error))


def answer(problem, name, **options):
    """The solver's solution; the test is skipped, with the reason, where it refuses the limits."""
    solver = available(name)
    if reason := solver.supports(problem):
        pytest.skip(f"{name}: {reason}")
    return solve(problem, solver, **options)


def stretched_triangle(limit=1.1, mass=None):
    """One limited direction, no pins: the projection is known in closed form."""
    rest = np.array([[0.0, 0.0], [1.0, 0.0], [0.2, 0.8]])
    target = np.column_stack([1.5 * rest, [0.0, 0.3, -0.1]])
    limits = StretchLimits.sampled([0.3], [limit])
    return Problem(rest, np.array([[0, 1, 2]]), target, limits, mass=mass)


def closest(problem):
    """Closed form: one constraint, x = t - M^-1 g (|y| - b) / (g' M^-1 g) y / |y|."""
    g = problem.row_coefficients[0]
    y = g @ problem.target
    length = np.linalg.norm(y)
    step = g / problem.weights
    return problem.target - np.outer(step, y / length) * (length - problem.bounds[0]) / (g @ step)


@pytest.mark.parametrize("name", NAMES)
def test_label_and_docstring(name):
    solver = available(name)
    assert solver.label == name
    assert solver.__doc__.split("\n")[0].rstrip(".").endswith(")")


@pytest.mark.parametrize("name", LIMITING)
@pytest.mark.parametrize("mass", [None, np.array([1.0, 2.0, 5.0])])
def test_a_single_stretched_triangle_has_its_analytic_projection(name, mass):
    problem = stretched_triangle(mass=mass)
    solution = answer(problem, name)
    assert solution.positions == pytest.approx(closest(problem), abs=exactness(name))


@pytest.mark.parametrize("name", LIMITING)
@pytest.mark.parametrize("seed", range(6))
def test_answers_lie_within_the_limits(name, seed):
    rng = np.random.default_rng(seed)
    problem = random_problem(rng, directions=4, limit=0.02)
    solution = answer(problem, name)
    found = certify(problem, solution.positions)
    assert found.outcome in ("optimal", "feasible"), (found.reason, solution.status)
    if name in TO_OPTIMALITY:
        assert found.relative_gap < 1e-3, solution.status


@pytest.mark.parametrize("name", ROUGH)
@pytest.mark.parametrize("seed", range(3))
def test_rough_settings_claim_no_more_than_they_reach(name, seed):
    problem = random_problem(np.random.default_rng(seed), directions=4, limit=0.02)
    solution = solve(problem, available(name), time_limit=1.0)
    violation = problem.violations(solution.positions).max()
    assert np.isfinite(violation)
    assert solution.status != "solved" or violation <= 1e-6


@pytest.mark.parametrize("name", TO_OPTIMALITY)
@pytest.mark.parametrize("seed", range(6))
def test_solvers_of_the_projection_agree(name, seed):
    problem = random_problem(np.random.default_rng(100 + seed), directions=3, limit=0.05)
    reference = solve(problem, "clarabel").positions
    positions = answer(problem, name).positions
    assert np.abs(positions - reference).max() < 1e-3 * problem.edge_length


@pytest.mark.parametrize("name", NAMES)
def test_a_feasible_target_is_its_own_answer(name):
    problem = stretched_triangle(limit=2.0)
    solution = answer(problem, name)
    assert np.abs(solution.positions - problem.target).max() < exactness(name)
    outcomes = ["optimal", "feasible"] if name in UNSCALED else ["optimal"]
    assert certify(problem, solution.positions).outcome in outcomes


@pytest.mark.parametrize("name", [*LIMITING, *EDGES, *FIXED_COUNT])
def test_rigid_motion_of_the_target_moves_the_answer(name):
    problem = random_problem(np.random.default_rng(5), directions=4, limit=0.05)
    rotation = Rotation.random(rng=np.random.default_rng(1)).as_matrix()
    moved = problem.with_target(problem.target @ rotation.T + [1.0, -2.0, 0.5])
    expected = answer(problem, name).positions @ rotation.T + [1.0, -2.0, 0.5]
    assert answer(moved, name).positions == pytest.approx(expected, abs=10 * exactness(name))


@pytest.mark.parametrize("name", NAMES)
def test_pins_stay_and_the_problem_is_not_changed(name):
    problem = random_problem(np.random.default_rng(7), directions=4, limit=0.05)
    before = problem.target.copy()
    solution = answer(problem, name)
    assert np.array_equal(problem.target, before)
    assert solution.positions[problem.pinned] == pytest.approx(before[problem.pinned], abs=1e-12)


@pytest.mark.parametrize("name", [*TO_OPTIMALITY, "clarabel-paper"])
def test_multipliers_are_stationary(name):
    problem = random_problem(np.random.default_rng(9), directions=4, limit=0.05)
    solution = answer(problem, name)
    force = (problem.weights[:, None] * (problem.target - solution.positions))[problem.free]
    assert solution.multipliers is not None
    back = (problem.G.T @ solution.multipliers)[problem.free]
    assert np.abs(back - force).max() < 1e-2 * np.abs(force).max()


@pytest.mark.parametrize("name", NAMES)
def test_iterates_are_shown_with_the_iterations_that_they_took(name):
    """Those of a whole number of iterations, rising, the last one at most half of them back."""
    problem = random_problem(np.random.default_rng(11), directions=4, limit=0.02)
    shown = []

    def watch(seconds, iterations, positions, multipliers):
        assert np.shape(positions) == problem.target.shape
        shown.append((iterations, seconds))

    solution = answer(problem, name, watch=watch)
    counts, seconds = zip(*shown, strict=True) if shown else ((), ())
    assert list(counts) == sorted(set(counts))
    assert list(seconds) == sorted(seconds)
    if shown:
        assert counts[-1] <= solution.iterations <= 2 * counts[-1] + 1


# --- warm starts


@pytest.fixture(scope="module")
def frames():
    """The swing's first ten projections at 6 cells, and their optima; the first is feasible."""
    scene, problems = find_scenario("swing")(resolution=6), []
    problem = scene.problem()
    reference = find_solver("newton-ipm")
    state = reference.prepare(problem)

    def project(target):
        problems.append(problem.with_target(target))
        return run_solver(reference, problems[-1], state, 1e-6).positions

    for step, _ in enumerate(scene.play(project), start=1):
        if step == 10:
            return [(frame, reference_of(frame)) for frame in problems]


@pytest.mark.parametrize("name", CAN_START_WARM)
def test_warm_answers_are_as_good_as_cold_ones(name, frames):
    cold = available(name)
    warm = warm_twin(cold)
    states = cold.prepare(frames[0][0]), warm.prepare(frames[0][0])
    for frame, optimum in frames:
        for solver, state in zip((cold, warm), states, strict=True):
            solution = run_solver(solver, frame, state, 1e-6)
            found = certify(frame, solution.positions, reference=optimum)
            outcomes = ["optimal"] if name in TO_OPTIMALITY else ["optimal", "feasible"]
            assert found.outcome in outcomes, (solver.label, found.reason, solution.status)


def test_the_interior_point_gains_though_the_first_frames_are_hardly_stretched(frames):
    """A warm start from one of them is worse than none, and must not spoil those after it."""
    cold = find_solver("newton-ipm")
    totals = []
    for solver in (cold, warm_twin(cold)):
        state = solver.prepare(frames[0][0])
        counts = [run_solver(solver, frame, state, 1e-6).iterations for frame, _ in frames]
        totals.append(sum(counts[6:]))
    assert totals[1] < totals[0]


@pytest.mark.parametrize("name", CAN_START_WARM)
def test_nothing_leaks_between_frames_but_into_a_warm_start(name, frames):
    cold, (first, _), (second, _) = available(name), frames[6], frames[9]
    state = cold.prepare(first)
    alone, _, again = [run_solver(cold, p, state, 1e-6) for p in (first, second, first)]
    assert np.array_equal(alone.positions, again.positions)
    warm = warm_twin(cold)
    state = warm.prepare(first)
    alone_warm, again_warm = [run_solver(warm, first, state, 1e-6) for _ in range(2)]
    assert np.array_equal(alone_warm.positions, alone.positions)
    assert again_warm.iterations < alone_warm.iterations


@pytest.mark.parametrize("name", CAN_START_WARM)
def test_a_warm_start_survives_an_absurd_frame_before(name, frames):
    warm, (frame, optimum) = warm_twin(available(name)), frames[9]
    scattered = 0.1 * np.random.default_rng(0).normal(size=frame.target.shape)
    scattered[frame.pinned] = frame.target[frame.pinned]
    scattered[:, 0] += 100.0
    state = warm.prepare(frame)
    run_solver(warm, frame.with_target(scattered), state, 1e-6)
    found = certify(frame, run_solver(warm, frame, state, 1e-6).positions, reference=optimum)
    assert found.outcome in (["optimal"] if name in TO_OPTIMALITY else ["optimal", "feasible"])


@pytest.mark.parametrize("name", CAN_START_WARM)
def test_a_warm_twin_has_a_name_of_its_own(name):
    twin = find_solver(f"{name}-warm")
    assert twin == warm_twin(available(name))
    assert twin.label == f"{name}-warm"
    assert twin.label not in NAMES
