"""Hard input for newton-ipm: certified optimal or certified infeasible, by its own multipliers."""

from __future__ import annotations

import numpy as np
import pytest

from scenarios.drape import Drape
from solvers.newton_ipm import Iterate, NewtonIPM, State
from solvers.newton_ipm.drawn import FAR_OFF, LOST, Drawn
from strainbench import Problem, StretchLimits, certify, solve
from strainbench.problem.grid import square_grid
from strainbench.referee.reference import Reference
from strainbench.solver.solver import run_solver
from tests.problems import (
    central_difference,
    hard_problem,
    moved,
    random_placed_problem,
    random_problem,
    renumbered,
    rotation,
    scattered_triangles,
    stretched_cube,
)

KINDS = ["sampled", "exact"]
HARD = 24  # hard problems; `--problems N` takes N
CELLS, SIDE = 8, 0.5
EDGE = SIDE / CELLS
TOLERANCE = 1e-6


def pytest_generate_tests(metafunc):
    if "hard_seed" in metafunc.fixturenames:
        count = metafunc.config.getoption("problems")
        metafunc.parametrize("hard_seed", range(HARD if count is None else count))


def limits(kind, limit):
    return StretchLimits.exact(1 + limit) if kind == "exact" else StretchLimits.isotropic(1 + limit)


def flat(rest):
    """At rest in the horizontal plane."""
    return np.column_stack([rest[:, 0], np.zeros(len(rest)), rest[:, 1]])


def stretched(x, rng):
    return x * [1.1, 1, 1.05] + 0.01 * rng.normal(size=x.shape)


def sheet(kind, limit, candidate=stretched, pins="two", mass=None):
    """A square sheet with pins at rest, and `candidate(x, rng)` of its rest positions x."""
    rest, elements = square_grid(CELLS, SIDE, "alternating")
    x = flat(rest)
    target = candidate(x, np.random.default_rng(1))
    pinned = {"two": [0, CELLS * (CELLS + 1)], "one": [0], "none": [], "all": range(len(x))}[pins]
    pinned = np.array(pinned, dtype=np.int64)
    target[pinned] = x[pinned]
    return Problem(rest, elements, target, limits(kind, limit), pinned, mass)


def pulled(kind, limit, pins, positions):
    """A sheet of which some vertices are pinned where `positions` (x of the rest) has them."""
    rest, elements = square_grid(CELLS, SIDE, "alternating")
    return Problem(rest, elements, positions(flat(rest)), limits(kind, limit), np.array(pins))


def answer(problem, **settings):
    """Without what `solve` finds out before it asks a solver."""
    solver = NewtonIPM(**settings)
    return run_solver(solver, problem, solver.prepare(problem), TOLERANCE)


def assert_certified(problem, solution):
    assert solution.status == "solved"
    violations = problem.violations(solution.positions)
    assert violations.max() <= TOLERANCE
    found = Reference.verified(problem, np.full_like(problem.target, np.nan), solution.multipliers)
    priced = problem.objective(solution.positions) + found.multiplier_norms @ violations
    scale = max(found.lower_bound, problem.objective_floor)
    assert -1e-9 * scale <= priced - found.lower_bound <= TOLERANCE * scale


def assert_within_without_interior(problem, solution):
    """Close, by its own multipliers; the referee's price its violations higher."""
    assert solution.status == "stalled: limits without an interior"
    assert problem.violations(solution.positions).max() <= TOLERANCE
    found = Reference.verified(problem, np.full_like(problem.target, np.nan), solution.multipliers)
    assert problem.objective(solution.positions) == pytest.approx(found.lower_bound, rel=1e-2)


def assert_infeasible(problem, solution):
    assert solution.status == "infeasible"
    assert np.all(np.isnan(solution.positions))
    if problem.infeasible_pins() is None:
        found = Reference.verified(
            problem, np.full_like(problem.target, np.nan), solution.multipliers
        )
        assert found.lower_bound > problem.largest_objective


CANDIDATES = {
    "twice as long, half as wide": lambda x, rng: x * [2, 1, 0.5],
    "noise of an edge": lambda x, rng: x + EDGE * rng.normal(size=x.shape),
    "noise of ten edges": lambda x, rng: x + 10 * EDGE * rng.normal(size=x.shape),
    "mirrored": lambda x, rng: x * [-1, 1, 1],
    "one point": lambda x, rng: 0 * x,
    "one point off the pins": lambda x, rng: 0 * x + 1,
    "a line": lambda x, rng: x * [2, 0, 0],
    "pairs of vertices on one another": lambda x, rng: 1.2 * x[np.arange(len(x)) // 2 * 2],
    "10 m away": lambda x, rng: np.add(stretched(x, rng), [10, 0, 0]),
    "1000 m away": lambda x, rng: np.add(stretched(x, rng), [1000, 0, 0]),
}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("pins", ["two", "none"])
@pytest.mark.parametrize("limit", [1e-4, 1e-2])
@pytest.mark.parametrize("name", CANDIDATES)
def test_candidates(name, limit, pins, kind):
    problem = sheet(kind, limit, CANDIDATES[name], pins)
    assert_certified(problem, answer(problem))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("pins", ["two", "one", "none"])
@pytest.mark.parametrize("limit", [0.0, 1e-4, 1e-3, 5e-2])
def test_limits_down_to_none(limit, pins, kind):
    problem = sheet(kind, limit, pins=pins)
    if (kind, pins, limit) == ("exact", "two", 0.0):
        assert_within_without_interior(problem, answer(problem))
    else:
        assert_certified(problem, answer(problem))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("limit", [1e-3, 1e-2])
@pytest.mark.parametrize("pins", ["two", "none"])
def test_mass_ratios_of_a_million(pins, limit, kind):
    exponents = np.random.default_rng(2).uniform(-3, 3, (CELLS + 1) ** 2)
    exponents[:2] = -3, 3
    problem = sheet(kind, limit, pins=pins, mass=10**exponents)
    assert_certified(problem, answer(problem))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("mass", [1e-8, 1e8])
def test_the_unit_of_mass_does_not_matter(mass, kind):
    problem = sheet(kind, 1e-2, mass=np.full((CELLS + 1) ** 2, mass))
    assert_certified(problem, answer(problem))


CORNERS = [0, CELLS * (CELLS + 1)]
ENDS = [*range(CELLS + 1), *range(CELLS * (CELLS + 1), (CELLS + 1) ** 2)]


def taut(kind, limit, pins, spare):
    """Pins apart by almost what the limits allow, a part `spare` short of it."""

    def positions(x):
        target = x * [1.05, 1, 1]
        target[pins] = x[pins] * [(1 + limit) * (1 - spare), 1, 1]
        return target

    return pulled(kind, limit, pins, positions)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("limit", [1e-4, 1e-2])
@pytest.mark.parametrize("spare", [1e-3, 1e-6, 1e-9])
@pytest.mark.parametrize("pins", [CORNERS, ENDS])
def test_pins_barely_close_enough(pins, spare, limit, kind):
    problem = taut(kind, limit, pins, spare)
    assert_certified(problem, answer(problem))


@pytest.mark.parametrize("limit", [1e-4, 1e-2])
@pytest.mark.parametrize(
    ("kind", "pins"), [("sampled", CORNERS), ("sampled", ENDS), ("exact", ENDS)]
)
def test_pins_with_nothing_to_spare(kind, pins, limit):
    """No interior."""
    problem = taut(kind, limit, pins, 0.0)
    assert_certified(problem, answer(problem))


@pytest.mark.parametrize("limit", [1e-4, 1e-2])
def test_exact_limits_with_a_taut_edge_are_not_called_solved(limit):
    """The triangles along it cannot shear: even without the edge there is no interior."""
    problem = taut("exact", limit, CORNERS, 0.0)
    assert_within_without_interior(problem, answer(problem))


@pytest.mark.slow
@pytest.mark.parametrize("warm", [False, True])
def test_solved_is_what_the_referee_calls_optimal(hard_seed, warm):
    """Masses over up to 24 decades, pins at the limit, slivers, bounds an element, volumes."""
    rng = np.random.default_rng([8, hard_seed])
    problem = hard_problem(rng)
    solver = NewtonIPM(warm=warm)
    state = solver.prepare(problem)
    solution = run_solver(solver, problem, state, TOLERANCE)
    if warm:
        step = 1e-3 * np.ptp(problem.target) * rng.normal(size=problem.target.shape)
        step[problem.pinned] = 0
        problem = problem.with_target(problem.target + step)
        solution = run_solver(solver, problem, state, TOLERANCE)
    if solution.status == "solved":
        found = certify(problem, solution.positions, violation=TOLERANCE, gap=TOLERANCE)
        assert found.outcome == "optimal", found.reason
    else:
        assert solution.status.split(":")[0] in ("stalled", "infeasible", "iteration limit")


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("decades", [12, 18])
def test_masses_over_many_decades(decades, kind):
    """Residuals of light vertices, that count for nothing in the objective, must not stay."""
    exponents = np.random.default_rng(5).uniform(-decades / 2, decades / 2, (CELLS + 1) ** 2)
    problem = sheet(kind, 1e-2, mass=10**exponents)
    assert_certified(problem, answer(problem))


@pytest.mark.parametrize("kind", KINDS)
def test_a_mass_ratio_of_a_million_with_a_tight_limit_on_16_squares(kind):
    rest, elements = square_grid(16, SIDE, "alternating")
    rng = np.random.default_rng(6)
    target = stretched(flat(rest), rng)
    pinned = np.array([0, 16 * 17])
    target[pinned] = flat(rest)[pinned]
    mass = 10 ** rng.uniform(-3, 3, len(rest))
    problem = Problem(rest, elements, target, limits(kind, 1e-4), pinned, mass)
    assert_certified(problem, answer(problem))


def tee(up, limit, along=1.0):
    """Two corners at `along` of their largest distance, and the far side's middle pulled away."""
    middle = (CELLS // 2) * (CELLS + 1) + CELLS

    def positions(x):
        target = (1 + limit) * x
        target[CORNERS[1]] *= along
        centre = target[CORNERS].mean(axis=0)
        target[middle] = centre + np.array([0, 0, up * (1 + limit) * SIDE])
        return target

    return [*CORNERS, middle], positions


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("limit", [1e-4, 1e-2])
@pytest.mark.parametrize("along", [0.98, 0.999, 1.0])
@pytest.mark.parametrize("up", [1.02, 1.05])
def test_three_pins_that_only_together_are_too_far_apart(up, along, limit, kind):
    problem = pulled(kind, limit, *tee(up, limit, along))
    assert problem.infeasible_pins() is None
    assert_infeasible(problem, answer(problem))


@pytest.mark.parametrize("kind", KINDS)
def test_three_pins_that_are_close_enough(kind):
    problem = pulled(kind, 1e-2, *tee(0.97, 1e-2, along=0.98))
    assert_certified(problem, answer(problem))


@pytest.mark.parametrize("limit", [1e-4, 1e-2])
def test_pins_pulled_too_far_across_the_edges(limit):
    """No path along edges is as short as the straight line between them."""
    a, b = 0, 4 * (CELLS + 1) + CELLS
    problem = pulled("exact", limit, [a, b], lambda x: (1 + 2.5 * limit) * x)
    assert problem.infeasible_pins() is None
    assert_infeasible(problem, answer(problem))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("pins", [CORNERS, ENDS, [0, (CELLS + 1) ** 2 - 1]])
@pytest.mark.parametrize("too_far", [1e-6, 1.5e-2])
def test_pins_pulled_too_far(too_far, pins, kind):
    problem = pulled(kind, 1e-2, pins, lambda x: (1.01 + too_far) * x)
    assert_infeasible(problem, answer(problem))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("degrees", [20, 60, 180])
def test_twisted_past_what_it_can_follow(degrees, kind):
    def positions(x):
        angle = np.deg2rad(degrees) * x[:, 0] / SIDE
        across = x[:, 2] - SIDE / 2
        return np.column_stack([x[:, 0], np.sin(angle) * across, np.cos(angle) * across])

    problem = pulled(kind, 1e-2, ENDS, positions)
    assert_infeasible(problem, answer(problem))


@pytest.mark.parametrize("kind", KINDS)
def test_nothing_to_move(kind):
    problem = sheet(kind, 1e-2, pins="all")
    assert np.array_equal(answer(problem).positions, problem.target)
    solution = answer(problem.with_target(1.02 * problem.target))
    assert solution.status == "infeasible"
    assert np.all(np.isnan(solution.positions))


@pytest.mark.parametrize("warm", [False, True])
@pytest.mark.parametrize("kind", KINDS)
def test_a_feasible_candidate_comes_back_as_it_is(kind, warm):
    problem = sheet(kind, 1e-2, lambda x, rng: 0.9 * x, pins="none")
    solution = answer(problem, warm=warm)
    assert (solution.status, solution.iterations) == ("solved", 0)
    assert np.array_equal(solution.positions, problem.target)


@pytest.mark.parametrize("seed", range(4))
def test_a_single_triangle(seed):
    problem, exact = scattered_triangles(np.random.default_rng(seed), count=1, mass=seed % 2)
    assert_certified(problem, solution := answer(problem))
    assert solution.positions == pytest.approx(exact, abs=1e-5)


@pytest.mark.parametrize("bound", [1.0001, 1.01, 1.3])
def test_tetrahedra(bound):
    directions = np.random.default_rng(4).normal(size=(6, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    problem = stretched_cube(StretchLimits(directions, np.full(6, bound)))
    assert_certified(problem, answer(problem))


@pytest.mark.parametrize("exact", [False, True])
@pytest.mark.parametrize("seed", range(10))
def test_random_problems_agree_with_clarabel(seed, exact):
    """With bounds an element, curves, masses and pins drawn at random."""
    problem = random_problem(np.random.default_rng(seed), exact=exact)
    other = certify(problem, solve(problem, "clarabel-tight").positions)
    solver = NewtonIPM()
    solution = run_solver(solver, problem, solver.prepare(problem), 1e-8)
    assert problem.objective(solution.positions) == pytest.approx(other.lower_bound, rel=1e-7)


@pytest.mark.parametrize("kind", KINDS)
def test_a_warm_start_gives_the_same_answers(kind):
    problem = sheet(kind, 1e-2)
    solver = NewtonIPM(warm=True)
    state = solver.prepare(problem)
    for frame in range(4):
        target = problem.target * [1, 1, 1 + 0.01 * frame]
        target[problem.pinned] = problem.target[problem.pinned]
        problem_now = problem.with_target(target)
        warm = run_solver(solver, problem_now, state, 1e-9)
        cold = run_solver(NewtonIPM(), problem_now, NewtonIPM().prepare(problem), 1e-9)
        assert warm.positions == pytest.approx(cold.positions, abs=1e-6)


def iterate_of(problem, steps):
    iterate = Iterate(problem, State(problem), False, TOLERANCE)
    iterate.start()
    for _ in range(steps):
        iterate.measure()
        iterate.step()
    iterate.measure()
    return iterate


@pytest.mark.parametrize("exact", [False, True])
def test_the_matrix_is_the_derivative_of_the_condition_that_it_solves(exact):
    """Where s = q, a Newton step for fixed products makes K the derivative of r_d at l = mu/s."""
    rng = np.random.default_rng(8)
    problem, placed = random_placed_problem(rng, exact=exact, limit=0.05, pins=2)
    x = 0.9 * placed
    assert not np.any(problem.violations(x))
    state, mu = State(problem), 0.3
    cones, free = state.cones, problem.free

    def gradient(moved):
        """Of 1/2 ||x - target||_M^2 - mu log det of the slacks."""
        cones.place(problem.bounds, moved)
        cones.start(0.0, mu)
        Y, pull = np.zeros((problem.rows, 3)), np.zeros_like(moved)
        cones.measure(cones.at.y, Y, pull)
        return (problem.weights[:, None] * (moved - problem.target) + pull)[free].ravel()

    expected = central_difference(gradient, x, 1e-5 * problem.edge_length)[:, free].reshape(
        3 * len(free), -1
    )
    gradient(x)
    cones.assemble(state.matrix.mass())
    lower = state.matrix.lower.toarray()
    assert np.array_equal(lower, np.tril(lower))
    K = lower + np.tril(lower, -1).T
    assert np.abs(K - expected).max() < 1e-6 * np.abs(K).max()


@pytest.mark.parametrize("exact", [False, True])
@pytest.mark.parametrize("change", ["rigid motion", "order of vertices", "unit of length"])
def test_iterates_do_not_depend_on(change, exact):
    rng = np.random.default_rng(12)
    problem = random_problem(rng, exact=exact, limit=0.05, pins=2, mass=True)
    first = iterate_of(problem, 6).x
    if change == "rigid motion":
        Q, shift = rotation(rng), rng.normal(size=3)
        other, expected = moved(problem, Q, shift), first @ Q.T + shift
    elif change == "order of vertices":
        order = rng.permutation(problem.vertices)
        other, expected = renumbered(problem, order), first[order]
    else:
        other = Problem(
            1000 * problem.rest,
            problem.elements,
            1000 * problem.target,
            problem.limits,
            problem.pinned,
            problem.mass,
        )
        expected = 1000 * first
    found = iterate_of(other, 6).x
    assert found == pytest.approx(expected, abs=1e-7 * np.ptp(expected))


FRAMES = {  # iterations, cold and warm
    "sampled": ([20, 20, 20, 22, 20], [20, 6, 5, 7, 7]),
    "exact": ([15, 16, 15, 16, 17], [15, 4, 4, 4, 4]),
}
ITERATIONS = {  # of each candidate within 1%
    "sampled": [23, 16, 31, 23, 17, 24, 17, 16, 22, 17],
    "exact": [15, 16, 15, 17, 17, 15, 13, 22, 20, 16],
}


@pytest.mark.parametrize("warm", [False, True])
@pytest.mark.parametrize("kind", KINDS)
def test_frames_take_as_many_iterations_as_ever(kind, warm):
    problem, solver, found = sheet(kind, 1e-2), NewtonIPM(warm=warm), []
    state = solver.prepare(problem)
    for frame in range(5):
        target = problem.target * [1, 1, 1 + 0.01 * frame]
        target[problem.pinned] = problem.target[problem.pinned]
        solution = run_solver(solver, problem.with_target(target), state, TOLERANCE)
        found.append(solution.iterations)
    assert found == FRAMES[kind][warm]


@pytest.mark.parametrize("kind", KINDS)
def test_candidates_take_as_many_iterations_as_ever(kind):
    """Within one: far from the limits the last ones are rounding's."""
    found = [answer(sheet(kind, 1e-2, make)).iterations for make in CANDIDATES.values()]
    assert found == pytest.approx(ITERATIONS[kind], abs=1)


@pytest.mark.slow
def test_a_candidate_far_away_is_started_nearer():
    """From the candidate itself it takes 105, and jams at twice the cells."""
    scene = Drape(resolution=30, shape="anisotropic")
    problem, candidates = scene.problem(), []

    def keep(target):
        candidates.append(problem.with_target(target))
        return problem.target

    next(scene.play(keep))
    found = solve(candidates[0], "newton-ipm")
    assert candidates[0].violations(candidates[0].target).max() > 300
    assert (found.status, found.iterations) == ("solved", pytest.approx(35, abs=3))
    assert not np.any(candidates[0].violations(found.positions) > 1e-6)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("pins", ["two", "one", "none"])
def test_a_start_is_between_the_candidate_and_a_mesh_drawn_together(pins, kind):
    problem = sheet(kind, 1e-2, lambda x, rng: 30 * x, pins)
    drawn = Drawn(problem).start(problem.target, 0.99 * LOST)
    x = Drawn(problem).start(problem.target, float(problem.violations(problem.target).max()))
    assert np.array_equal(x[problem.held], problem.target[problem.held])
    pull, before = (
        abs(problem.G.T @ (problem.G @ y))[problem.free] for y in (drawn, problem.target)
    )
    assert pull.max() < 1e-8 * before.max()
    assert problem.violations(x).max() < FAR_OFF + problem.violations(drawn).max()


@pytest.mark.parametrize("violation", [0.1, FAR_OFF, 1e17, np.inf, np.nan])
def test_a_candidate_near_the_limits_or_lost_to_rounding_is_the_start(violation):
    problem = sheet("sampled", 1e-2)
    assert np.array_equal(Drawn(problem).start(problem.target, violation), problem.target)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("pins", ["two", "one", "none"])
@pytest.mark.parametrize("power", [2, 4, 8, 12, 15, 17, 20, 60, 140])
def test_limits_that_can_be_met_are_never_called_infeasible(power, pins, kind):
    problem = sheet(kind, 1e-2, lambda x, rng: 10.0**power * x, pins)
    found = answer(problem)
    if power < (6 if pins == "none" else 14):
        assert found.status == "solved"
    assert not found.status.startswith("infeasible")
