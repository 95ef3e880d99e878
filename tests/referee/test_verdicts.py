"""A verdict on every valid problem and on whatever comes back, and never praise by accident."""

from __future__ import annotations

import numpy as np
import pytest

from strainbench import Problem, StretchLimits, certify, solve
from strainbench.referee.certificate import OUTCOMES
from strainbench.referee.reference import Reference, ReferenceSolver, reference_of
from strainbench.solver.registry import find_solver
from strainbench.solver.solver import Solution, Solver, run_solver
from tests.hard_problems import hard_problem
from tests.problems import random_problem, stretched_cube

SQUARE = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
TRIANGLES = [[0, 1, 2], [0, 2, 3]]
TETRAHEDRON = np.vstack([np.zeros(3), np.eye(3)])


def square(target=None, limits=None, pinned=(), mass=None, size=1.0):
    """The unit square of two triangles, its target twice as large unless given."""
    target = 2.0 * SQUARE if target is None else target
    target = size * np.column_stack([target, np.zeros(4)])
    limits = StretchLimits.isotropic(1.01) if limits is None else limits
    return Problem(size * SQUARE, TRIANGLES, target, limits, np.array(pinned, dtype=int), mass)


def tetrahedron(stretch, limits, pinned):
    """The unit tetrahedron, stretched along z."""
    target = TETRAHEDRON * [1.0, 1.0, stretch]
    return Problem(TETRAHEDRON, [[0, 1, 2, 3]], target, limits, pinned)


AXES = StretchLimits(np.eye(3), np.full(3, 1.01))
SOLVED = {
    "one direction": square(limits=StretchLimits.isotropic(1.01, directions=1), pinned=[0, 2]),
    "masses 1e24 apart": square(pinned=[0], mass=[1e12, 1e-12, 1e12, 1e-12]),
    "a heavy vertex": square(mass=[1e-12, 1e12, 1e-12, 1e-12]),
    "one free vertex of a volume": tetrahedron(2.0, AXES, [0, 1, 2]),
    "the same, exact": tetrahedron(2.0, StretchLimits.exact(1.01, dim=3), [0, 1, 2]),
    "a bound of 1e-14": square(SQUARE, StretchLimits.isotropic(1e-14), [0]),
    "a bound of 0.1": square(limits=StretchLimits.isotropic(0.1), pinned=[0]),
    "a bound of 1e6": square(1e7 * SQUARE, StretchLimits.isotropic(1e6), [0]),
    "small": square(size=1e-8, pinned=[0]),
    "large": square(size=1e8, pinned=[0]),
    "tiny": square(size=1e-150),
    "vast": square(size=1e150),
    "exact by element": square(limits=StretchLimits.exact(1.01, [1.2, 1.5]), pinned=[0]),
}
UNSOLVED = {
    "a target of 1e150": square(1e150 * SQUARE, pinned=[0]),
    "a target of 1e200": square(1e200 * SQUARE, pinned=[0]),
    "the same, exact": square(1e200 * SQUARE, StretchLimits.exact(1.01), [0]),
    "a tiny rest shape": Problem(
        1e-150 * SQUARE, TRIANGLES, np.eye(4, 3), StretchLimits.isotropic(1.01)
    ),
    "all pinned": square(pinned=[0, 1, 2, 3]),
    "all pinned, of a volume": tetrahedron(2.0, AXES, [0, 1, 2, 3]),
    "pins apart": tetrahedron(2.0, AXES, [0, 3]),
    "lower bounds": square(0 * SQUARE, StretchLimits.isotropic(1.01, lower=0.9), [0]),
    "lower bounds, all pinned": square(
        limits=StretchLimits.isotropic(1.01, lower=0.9), pinned=[0, 1, 2, 3]
    ),
    "lower bounds, 1e200": square(1e200 * SQUARE, StretchLimits.isotropic(1.01, lower=0.9)),
}


@pytest.mark.parametrize("kind", SOLVED)
def test_the_referee_finds_the_optimum_of(kind):
    problem = SOLVED[kind]
    reference = reference_of(problem)
    assert reference.failure is None
    assert certify(problem, reference.positions, reference=reference).outcome == "optimal"
    assert certify(problem, problem.target, reference=reference).outcome == "violated"
    assert 0 < reference.lower_bound <= problem.objective(reference.positions) * (1 + 1e-12)


@pytest.mark.parametrize("kind", UNSOLVED)
def test_there_is_a_verdict_on(kind):
    problem = UNSOLVED[kind]
    reference = reference_of(problem)
    for x in (problem.target, 0 * problem.target, np.ones((4, 3))):
        found = certify(problem, x, reference=reference)
        assert found.outcome in OUTCOMES[:3]
        if problem.convex:
            assert found.lower_bound <= found.objective or found.max_violation > 0
    assert certify(problem, problem.target, reference=reference).outcome == "violated"


@pytest.mark.parametrize("kind", {**SOLVED, **UNSOLVED})
def test_answers_that_overflow_are_violated(kind):
    """Sums of 1e308 with both signs are no numbers, and compare with none."""
    problem = {**SOLVED, **UNSOLVED}[kind]
    x = np.full((4, 3), 1e308) * np.sign(np.arange(12).reshape(4, 3) % 5 - 2.5)
    found = certify(problem, x)
    if len(problem.pinned) < 4:  # else pins count as lying at their targets
        assert found.outcome == "violated"
        assert not found.max_violation < 1e290
        assert not found.relative_gap < np.inf


def test_exact_positions_of_one_free_vertex_of_a_volume():
    found = solve(SOLVED["one free vertex of a volume"], "newton-ipm")
    assert found.status == "solved"
    assert np.allclose(found.positions[3], [0.0, 0.0, 1.01])


def test_the_lower_bound_of_tiny_multipliers_is_right():
    """At 1e-150 m the squares of multipliers vanish, but the bound scales as a length squared."""
    plain, tiny = reference_of(square()), reference_of(square(size=1e-150))
    assert tiny.lower_bound / 1e-300 == pytest.approx(plain.lower_bound, rel=1e-6)


@pytest.mark.parametrize(
    ("answer", "word"),
    [
        ([[0, 0, 0]] * 4, ""),
        (np.zeros((4, 3), dtype=np.float32), ""),
        (np.zeros((4, 3), dtype=np.longdouble), ""),
        (np.full((4, 3), np.longdouble("1e400")), "not finite"),
        (np.zeros((4, 3), dtype=object), "type object"),
        (np.zeros((4, 3), dtype=complex), "type complex"),
        (np.zeros((4, 3), dtype="m8[s]"), "type timedelta"),
        (np.full((4, 3), "0"), "type <U1"),
        (None, "shape"),
        ([[0, 0], [0]], "no array"),
        (np.full((4, 3), np.nan), "not finite"),
    ],
)
def test_whatever_comes_back(answer, word):
    found = certify(SOLVED["small"], answer)
    assert found.outcome == ("no answer" if word else "feasible")
    assert word in found.reason


def test_an_answer_that_raises_when_looked_at_is_none():
    class Lazy:
        def __array__(self, dtype=None, copy=None):
            raise RuntimeError("the device\nis gone")

    found = certify(square(), Lazy())
    assert (found.outcome, found.reason) == (
        "no answer",
        "positions that are no array: the device is gone",
    )


# --- a reference solver that fails


class Failing(Solver):
    """Raises (nobody)."""

    name = "failing"

    def solve(self, problem, state, *, tolerance, monitor, deadline):
        raise np.linalg.LinAlgError("SVD did not\nconverge")


class Useless(Solver):
    """Returns nothing (nobody)."""

    name = "useless"

    def solve(self, problem, state, *, tolerance, monitor, deadline):
        return Solution(np.full_like(problem.target, np.nan), "gave up", 0)


@pytest.fixture
def solvers(monkeypatch):
    """Sets the solvers that references are asked of."""

    def put(*names):
        monkeypatch.setattr(
            "strainbench.referee.reference._reference_solvers", lambda _: list(names)
        )

    return put


def test_why_the_reference_failed_is_said(solvers):
    solvers(Failing(), Useless())
    words = "failing: LinAlgError: SVD did not converge; useless: gave up"
    problem = square()
    violated = certify(problem, problem.target)
    assert violated.outcome == "violated"
    assert violated.reason.endswith(f"; the reference failed ({words})")
    within = certify(problem, 0.5 * problem.target)
    assert within.outcome == "feasible"
    assert words in within.reason
    for found in (violated, within):
        assert found.lower_bound == 0
        assert found.reference_error == np.inf


def test_bounds_without_a_reference_still_hold(solvers):
    """The objective itself bounds the distance of feasible positions: ||x - x*|| <= sqrt(2 f)."""
    problem = random_problem(np.random.default_rng(7), mass=False, pins=0)
    best = reference_of(problem).positions
    solvers(Failing())
    x = 0.5 * problem.target
    x = x if not problem.violations(x).any() else 0 * x
    found = certify(problem, x)
    assert found.distance_bound >= np.linalg.norm(x - best)
    assert found.distance_bound == pytest.approx(np.sqrt(2 * problem.objective(x)))


def test_another_solver_is_asked_where_one_fails(solvers):
    solvers(Failing(), find_solver("clarabel-tight"))
    assert reference_of(square()).failure is None


@pytest.mark.parametrize(
    ("seed", "name"), [(k, "clarabel") for k in (120, 1639, 1851, 1909)] + [(714, "cvxpy-default")]
)
def test_an_optimum_is_found_where_the_first_solvers_fail(seed, name):
    """They stall, or take limits far from the target for ones that cannot be met."""
    problem = hard_problem(np.random.default_rng([2026, seed]))
    reference = reference_of(problem)
    assert reference.failure is None
    answer = solve(problem, name)
    assert answer.status == "solved"
    assert certify(problem, answer.positions, reference=reference).outcome == "optimal"


def test_a_failure_that_is_kept_says_so_again(solvers):
    problem, kept = square(), {}
    solvers(Failing())
    first = ReferenceSolver(problem, kept)(problem).failure
    assert first
    solvers()
    assert ReferenceSolver(problem, kept)(problem).failure == first


def test_a_feasible_target_needs_no_reference(solvers):
    solvers(Failing())
    problem = square(SQUARE)
    assert certify(problem, problem.target).outcome == "optimal"


class PanicException(BaseException):
    """As pyo3 raises it."""


class Panics(Solver):
    """Panics (nobody)."""

    name = "panics"

    def solve(self, problem, state, *, tolerance, monitor, deadline):
        raise PanicException("called `unwrap()`\non `None`")


def test_a_panic_is_an_answer_of_nothing():
    found = run_solver(Panics(), square(), None, 1e-6)
    assert found.status == "panic: called `unwrap()` on `None`"
    assert np.isnan(found.positions).all()


def test_interrupts_are_not_caught(solvers):
    class Interrupted(Failing):
        def solve(self, problem, state, *, tolerance, monitor, deadline):
            raise KeyboardInterrupt

    solvers(Interrupted())
    with pytest.raises(KeyboardInterrupt):
        reference_of(square())


def test_multipliers_of_any_size_give_a_bound():
    problem = stretched_cube(AXES)
    best = reference_of(problem).lower_bound
    Y = np.random.default_rng(0).normal(size=(problem.rows, 3))
    nowhere = np.full_like(problem.target, np.nan)
    bounds = [
        Reference.verified(problem, nowhere, size * Y).lower_bound for size in (1, 1e-200, 1e200)
    ]
    assert np.allclose(bounds, bounds[0], rtol=1e-9)
    assert bounds[0] <= best
    assert isinstance(Reference.verified(problem, nowhere, np.full_like(Y, np.inf)), Reference)
