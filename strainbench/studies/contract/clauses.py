"""The clauses of the contract on single projections: each says what it found, or what is broken."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from strainbench.arrays import FloatArray
from strainbench.plugins import method_and_paper
from strainbench.referee.certificate import certify
from strainbench.solver.solve import solve
from strainbench.solver.solver import Solver
from strainbench.studies.contract.promises import UNSCALED, Promise
from strainbench.studies.contract.solving import (
    BrokenError,
    answer,
    apart,
    applies,
    closest,
    demand,
    drawn,
    stretched_triangle,
)

MASSES = (None, np.array([1.0, 2.0, 5.0]))
DRAWS = range(6)
NOT_WITHIN = "it does not promise answers within the limits"
NOT_OPTIMAL = "it does not promise the projection itself"
SOLVED = "solved"


def has_a_docstring_and_a_label(solver: Solver, promise: Promise) -> str:  # noqa: ARG001
    """The docstring's first line is "method (paper)"."""
    line = (solver.__doc__ or "").split("\n")[0]
    paper = method_and_paper(solver.__doc__)[1]
    demand(bool(paper), f'the docstring begins with {line!r}: "method (paper)" is valid')
    demand(solver.label.startswith(solver.name), f"its label {solver.label!r} is not its name")
    return line


def projects_a_triangle(solver: Solver, promise: Promise) -> str:
    """One stretched triangle with one limit ends at its projection, known in closed form."""
    applies(promise.within, NOT_WITHIN)
    worst = 0.0
    for mass in MASSES:
        problem = stretched_triangle(mass=mass)
        found = answer(solver, problem, promise)
        off = apart(found.positions, closest(problem))
        words = "without masses" if mass is None else "with masses of 1, 2 and 5"
        demand(
            off <= promise.exactness,
            f"{words}, {off:.1e} m from the projection, which is known in closed form; "
            f"up to {promise.exactness:.0e} is valid; it says {found.status!r}",
        )
        worst = max(worst, off)
    return f"{worst:.1e} m from it"


def stays_within_the_limits(solver: Solver, promise: Promise) -> str:
    """Six irregular meshes end within the limits; at the optimum where that is promised."""
    applies(promise.within, NOT_WITHIN)
    violation, gap = 0.0, 0.0
    for seed in DRAWS:
        problem = drawn(seed, limit=0.02)
        solution = answer(solver, problem, promise)
        found = certify(problem, solution.positions)
        where = f"random mesh {seed} ({3 * len(problem.free)} variables, 2%)"
        said = f"it says {solution.status!r} after {solution.iterations} iterations"
        demand(
            found.outcome in ("optimal", "feasible"),
            f"{where}: {found.outcome}, {found.reason}; {said}",
        )
        if promise.aim == "projection":
            far = f"{where}: relative gap {found.relative_gap:.1e}; below 1e-3 is valid; {said}"
            demand(found.relative_gap < 1e-3, far)
        violation, gap = max(violation, found.max_violation), max(gap, found.relative_gap)
    return f"violation {violation:.1e} and relative gap {gap:.1e} at most"


def claims_what_it_reaches(solver: Solver, promise: Promise) -> str:
    """Where it says "solved", the limits hold."""
    applies(promise.aim in ("projection", "limits"), "it has another aim than the limits")
    said = []
    for seed in range(3):
        problem = drawn(seed, limit=0.02)
        applies(not solver.supports(problem), str(solver.supports(problem)))
        solution = solve(problem, solver, time_limit=promise.time_limit or 1.0)
        violation = float(problem.violations(solution.positions).max())
        finite = np.isfinite(violation)
        demand(finite or not promise.rough, f"random mesh {seed}: positions that are not finite")
        demand(
            solution.status != SOLVED or violation <= 1e-6,
            f"random mesh {seed}: it says 'solved' with a violation of {violation:.1e}",
        )
        said.append(str(solution.status))
    return f"it says {', '.join(dict.fromkeys(said))}"


def agrees_with_another(solver: Solver, promise: Promise) -> str:
    """Six projections are where another solver's are."""
    applies(promise.aim == "projection", NOT_OPTIMAL)
    worst = 0.0
    for seed in DRAWS:
        problem = drawn(100 + seed, directions=3)
        reference = solve(problem, "clarabel").positions
        off = apart(answer(solver, problem, promise).positions, reference) / problem.edge_length
        demand(
            off < 1e-3,
            f"random mesh {100 + seed}: {off:.1e} edges from Clarabel's; below 1e-3 is valid",
        )
        worst = max(worst, off)
    return f"{worst:.1e} edges from Clarabel's at most"


def leaves_what_is_within(solver: Solver, promise: Promise) -> str:
    """A target within the limits is its own answer."""
    problem = stretched_triangle(limit=2.0)
    solution = answer(solver, problem, promise)
    off = apart(solution.positions, problem.target)
    demand(
        off < promise.exactness,
        f"it moves a target that is within the limits by {off:.1e} m; "
        f"below {promise.exactness:.0e} is valid",
    )
    outcomes = ("optimal", "feasible") if solver.label in UNSCALED else ("optimal",)
    found = certify(problem, solution.positions)
    demand(found.outcome in outcomes, f"the referee calls it {found.outcome}: {found.reason}")
    return f"moved by {off:.1e} m"


def moves_with_the_target(solver: Solver, promise: Promise) -> str:
    """A rigid motion of the target moves the answer alike."""
    applies(promise.aim != "nothing" and not promise.rough, NOT_WITHIN)
    problem = drawn(5)
    rotation = Rotation.random(rng=np.random.default_rng(1)).as_matrix()

    def moved(x: FloatArray) -> FloatArray:
        turned: FloatArray = x @ rotation.T + [1.0, -2.0, 0.5]
        return turned

    expected = moved(answer(solver, problem, promise).positions)
    again = answer(solver, problem.with_target(moved(problem.target)), promise).positions
    allowed = np.maximum(10 * promise.exactness, 1e-6 * np.abs(expected))
    off = np.abs(again - expected)
    demand(
        bool(np.all(off <= allowed)),
        f"turned and shifted, the answer is {off.max():.1e} m from where it was, moved alike; "
        f"up to {10 * promise.exactness:.0e} is valid",
    )
    return f"{off.max():.1e} m apart"


def keeps_pins_and_problem(solver: Solver, promise: Promise) -> str:
    """Pins stay where they are, and the problem as it is."""
    problem = drawn(7)
    before = problem.target.copy()
    solution = answer(solver, problem, promise)
    demand(np.array_equal(problem.target, before), "it changes problem.target")
    off = np.abs(solution.positions - before)[problem.pinned]
    demand(
        bool(np.all(off <= 1e-12)),
        f"it moves a pin by {off.max(initial=0.0):.1e} m: solution.positions[problem.pinned] must "
        "be problem.target[problem.pinned]",
    )
    return f"{len(problem.pinned)} pins"


def has_stationary_multipliers(solver: Solver, promise: Promise) -> str:
    """Multipliers, where it gives them, pull back what the target pulls."""
    applies(promise.aim in ("projection", "limits"), "it has another aim than the limits")
    problem = drawn(9)
    solution = answer(solver, problem, promise)
    Y = solution.multipliers
    applies(Y is not None or promise.multipliers, "it gives none, and need not")
    if Y is None:
        raise BrokenError("it gives no multipliers")
    shape = np.shape(Y)
    demand(shape == (problem.rows, 3), f"of shape {shape}: {(problem.rows, 3)} is valid")
    applies(promise.multipliers or promise.aim == "projection", NOT_OPTIMAL)
    force = (problem.weights[:, None] * (problem.target - solution.positions))[problem.free]
    off = float(np.abs((problem.G.T @ Y)[problem.free] - force).max() / np.abs(force).max())
    demand(
        off < 1e-2,
        f"G^T Y is {off:.1e} of the largest force from M (target - x); below 1e-2 is valid",
    )
    return f"G^T Y is M (target - x) to {off:.1e}"


def shows_its_iterates(solver: Solver, promise: Promise) -> str:
    """Iterates are shown in their order, with the iterations that they took, to half-way at least.

    Those of a whole number of iterations, rising, the last one at most half of them back.
    """
    problem = drawn(11, limit=0.02)
    shown: list[tuple[int, float]] = []

    def watch(
        seconds: float,
        iterations: int,
        positions: FloatArray,
        multipliers: FloatArray | None,  # noqa: ARG001
    ) -> None:
        shape = np.shape(positions)
        demand(shape == problem.target.shape, f"monitor is shown positions of shape {shape}")
        shown.append((iterations, seconds))

    solution = answer(solver, problem, promise, watch)
    if not shown:
        return "none: `converge` cannot draw it"
    counts = [count for count, _ in shown]
    seconds = [at for _, at in shown]
    demand(
        counts == sorted(set(counts)),
        f"monitor is told of iterations {counts[:8]}..., which do not rise",
    )
    demand(seconds == sorted(seconds), "the seconds of its iterates do not rise")
    demand(
        counts[-1] <= solution.iterations <= 2 * counts[-1] + 1,
        f"the last iterate shown is that of iteration {counts[-1]} of {solution.iterations}; "
        "at most half of them back is valid",
    )
    return f"{len(shown)}, the last one of iteration {counts[-1]} of {solution.iterations}"
