"""The clauses of the contract on consecutive projections: what is kept from one to the next."""

from __future__ import annotations

from functools import cache

import numpy as np

from strainbench.arrays import FloatArray
from strainbench.problem.problem import Problem
from strainbench.referee.certificate import certify
from strainbench.referee.reference import REFERENCE_SOLVER, Reference, reference_of
from strainbench.scenario.registry import find_scenario
from strainbench.solver.registry import find_solver
from strainbench.solver.solver import Solution, Solver, run_solver, warm_twin
from strainbench.studies.contract.promises import Promise
from strainbench.studies.contract.solving import applies, demand, well_formed

TOLERANCE = 1e-6
COLD = "it has no field warm"
FRAMES = 10


@cache
def frames() -> list[tuple[Problem, Reference]]:
    """The swing's first ten projections at 6 cells, and their optima; the first is feasible."""
    scene = find_scenario("swing")(resolution=6)
    problems: list[Problem] = []
    problem = scene.problem()
    reference = find_solver(REFERENCE_SOLVER)
    state = reference.prepare(problem)

    def project(target: FloatArray) -> FloatArray:
        problems.append(problem.with_target(target))
        return run_solver(reference, problems[-1], state, TOLERANCE).positions

    playing = scene.play(project)
    while len(problems) < FRAMES:
        next(playing)
    return [(frame, reference_of(frame)) for frame in problems]


def project(solver: Solver, frame: Problem, state: object, promise: Promise) -> Solution:
    """One projection with a prepared solver."""
    return well_formed(frame, run_solver(solver, frame, state, TOLERANCE, promise.time_limit))


def _outcomes(promise: Promise) -> tuple[str, ...]:
    return ("optimal",) if promise.aim == "projection" else ("optimal", "feasible")


def _can_start_warm(solver: Solver, promise: Promise) -> Problem:
    """The first frame; the clause does not apply to a solver that starts cold alone."""
    applies(solver.starts_warm is not None, COLD)
    applies(promise.within, "it does not promise answers within the limits")
    first = frames()[0][0]
    applies(not solver.supports(first), str(solver.supports(first)))
    return first


def is_as_good_when_warm(solver: Solver, promise: Promise) -> str:
    """Ten frames of a swing, one after the other, end as well warm as cold."""
    first = _can_start_warm(solver, promise)
    pair = solver, warm_twin(solver)
    states = [each.prepare(first) for each in pair]
    counts = [0, 0]
    for number, (frame, optimum) in enumerate(frames(), start=1):
        for k, each in enumerate(pair):
            solution = project(each, frame, states[k], promise)
            found = certify(frame, solution.positions, reference=optimum)
            demand(
                found.outcome in _outcomes(promise),
                f"{each.label}, projection {number} of the swing: {found.outcome}, {found.reason}; "
                f"it says {solution.status!r}",
            )
            counts[k] += solution.iterations
    return f"{counts[1]} iterations warm, {counts[0]} cold"


def leaks_nothing(solver: Solver, promise: Promise) -> str:
    """Cold, a projection does not depend on those before; warm, the first one is as cold."""
    first = _can_start_warm(solver, promise)
    one, two = frames()[6][0], frames()[9][0]
    state = solver.prepare(first)
    alone, _, again = [project(solver, p, state, promise) for p in (one, two, one)]
    same = np.array_equal(alone.positions, again.positions)
    demand(same, "cold, its answer depends on the projections before: something is kept in state")
    warm = warm_twin(solver)
    state = warm.prepare(first)
    fresh, repeated = [project(warm, one, state, promise) for _ in range(2)]
    same = np.array_equal(fresh.positions, alone.positions)
    demand(same, "warm, its first answer is not that of a cold start")
    demand(
        repeated.iterations < fresh.iterations,
        f"warm, the same projection again takes {repeated.iterations} iterations after "
        f"{fresh.iterations}: fewer are valid",
    )
    return f"the same projection again takes {repeated.iterations} of {fresh.iterations} iterations"


def survives_an_absurd_frame(solver: Solver, promise: Promise) -> str:
    """A warm start is as good after a frame that is far away and torn."""
    _can_start_warm(solver, promise)
    warm, (frame, optimum) = warm_twin(solver), frames()[9]
    scattered = 0.1 * np.random.default_rng(0).normal(size=frame.target.shape)
    scattered[frame.pinned] = frame.target[frame.pinned]
    scattered[:, 0] += 100.0
    state = warm.prepare(frame)
    run_solver(warm, frame.with_target(scattered), state, TOLERANCE, promise.time_limit)
    solution = project(warm, frame, state, promise)
    found = certify(frame, solution.positions, reference=optimum)
    demand(
        found.outcome in _outcomes(promise),
        f"after a frame 100 m away: {found.outcome}, {found.reason}; it says {solution.status!r}",
    )
    return found.outcome


def has_a_twin_with_a_name(solver: Solver, promise: Promise) -> str:  # noqa: ARG001
    """The twin that starts warm has the name and "-warm"."""
    applies(solver.starts_warm is not None, COLD)
    applies(not solver.starts_warm, "it is the warm twin itself")
    label = warm_twin(solver).label
    demand(label == f"{solver.label}-warm", f"its warm twin is called {label!r}")
    return label
