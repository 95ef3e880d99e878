"""Sequential convex programming within cuts (Kovalsky et al. 2014).

S. Kovalsky, N. Aigerman, R. Basri, Y. Lipman, "Controlling singular values with semidefinite
programming", ACM Trans. Graph. 33(4), 2014. Lower bounds on stretch are not convex. At positions
x_k within the limits they are replaced by convex ones that are stricter and touch them at x_k
(`solvers.sequential_cuts.cuts`); the projection under these, a cone program, is x_{k+1}. Isotropic
limits on principal stretches have convex ones of their own (`solvers.sequential_cuts.halfspaces`).

x_k is itself admissible to that program, so that the objective never rises, and every iterate is
within the limits. Restrictions and limits have the same gradients at x_k: where the positions
rest, they meet the KKT conditions, if the last restriction has an interior. That is a local
optimum at best.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from solvers.sequential_cuts.cuts import RESTRICTIONS
from solvers.sequential_cuts.principal import PrincipalProgram
from solvers.sequential_cuts.program import Program, Restricted
from solvers.sequential_cuts.rounds import Limit, Run
from solvers.sequential_cuts.starts import STARTS, begun, candidate, rest
from strainbench import Clock, Problem, Solution, Solver
from strainbench.arrays import FloatArray
from strainbench.problem.principal import PrincipalLimits
from strainbench.solver.claim import claimed
from strainbench.solver.solver import held_still


@dataclass(frozen=True)
class SequentialCuts(Solver):
    """Sequential convex programming within cuts (Kovalsky et al. 2014).

    Of several starts the answer with the least objective. A start that is not within the limits is
    brought there first: the same programs with one slack on all lower bounds, at a price. Where no
    start gets there the rest shape, moved rigidly, is the last. A problem that says where its step
    begins has that as its first start, and no other where that comes within the limits.

    Of limits on principal stretches it takes isotropic ones, in any metric, beside planes without
    friction, and counts the programs, several a round, as iterations. A round is kept if it is
    within the limits, to the tolerance, and gains.

    | status | when |
    |---|---|
    | solved | positions rest, within the limits |
    | iteration limit | they do not yet; they are within the limits all the same |
    | time limit | the same, or no start came within the limits in time |
    | stalled | a round gains nothing, and the KKT conditions do not hold |
    | no start within the limits | nothing within them was found; perhaps there is nothing |

    Details: `rounds` of the answer, `starts` that came within the limits, and `stationarity`, the
    answer's own KKT residual with the multipliers of its last round. Without lower bounds on
    stretch there is one round, and the answer is the optimum.

    Parameters
    ----------
    restriction : "rows" bounds u . (G x)_i from below, u the direction of (G x_k)_i, a half-space
        for each sampled direction. "polar" bounds the smallest singular value of triangles by the
        largest of their lower bounds, with second-order cones: a stricter limit, whose answers the
        referee, which knows the sampled limits, calls no local optima.
    starts : of accordion, candidate and rest, with colons between. Flat sheets never leave their
        plane by themselves, hence the noise in the last two and the folds of the first.
    max_rounds : of each start.
    warm : start from the last answer alone, where it is within the limits and the pins rest.
    """

    name = "sequential-cuts"
    takes_lower = True
    takes_principal = True
    takes_metric = True
    takes_contact = True
    variants = {"polar": {"restriction": "polar"}}

    restriction: str = "rows"
    starts: tuple[str, ...] = ("accordion", "candidate")
    max_rounds: int = 60
    warm: bool = False

    def __post_init__(self) -> None:
        if self.restriction not in RESTRICTIONS:
            valid = ", ".join(RESTRICTIONS)
            raise ValueError(f"restriction is {self.restriction!r}: valid are {valid}")
        for name in self.starts:
            if name not in STARTS:
                raise ValueError(f"starts has {name!r}: valid are {', '.join(STARTS)}")
        if self.max_rounds < 1:
            raise ValueError(f"max_rounds is {self.max_rounds}: a number above 0 is valid")

    def supports(self, problem: Problem) -> str | None:
        """A reason by kind: of limits on stretch, or on principal ones."""
        if refusal := super().supports(problem):
            return refusal
        kind = problem.kind
        if not isinstance(kind, PrincipalLimits):
            return self._supports_stretch(problem)
        if kind.name != "isotropic":
            return f"it cuts singular values: {kind.name} limits depend on their axes too"
        if self.restriction != "rows":
            return "restriction=polar is that of limits on stretch: rows is valid"
        return None

    def _supports_stretch(self, problem: Problem) -> str | None:
        """The polar restriction bounds both principal stretches of triangles alike."""
        if problem.metric is not None:
            return "under limits on stretch it projects in norms of masses alone"
        if problem.contact:
            return "under limits on stretch it has no rows for contact with planes"
        if problem.convex or self.restriction == "rows":
            return None
        if problem.rest.shape[-1] != 2:
            return "restriction=polar is that of triangles: rows is valid"
        lower = problem.lower_bounds.reshape(len(problem.elements), -1)
        if lower.shape[1] == 1 or np.ptp(lower, axis=1).any():
            return "restriction=polar has one lower bound for all directions: rows is valid"
        return None

    def prepare(self, problem: Problem) -> State:
        """The programs' patterns, and what is kept from frame to frame."""
        if isinstance(problem.kind, PrincipalLimits):
            return State(PrincipalProgram(slack=False), PrincipalProgram(slack=True))
        cuts = RESTRICTIONS[self.restriction](problem)
        return State(
            Program(problem, cuts, slack=False),
            None if problem.convex else Program(problem, cuts, slack=True),
        )

    def solve(
        self,
        problem: Problem,
        state: State,
        *,
        tolerance: float,
        monitor: Callable[..., None],
        deadline: Clock,
    ) -> Solution:
        """The best answer of all starts."""
        if len(problem.free) == 0:
            return held_still(problem, tolerance)
        run = Run(problem, Limit(tolerance, self.max_rounds, deadline, monitor))
        if isinstance(problem.kind, PrincipalLimits) and run.within(problem.target):
            return Solution(problem.target.copy(), "solved", 0, details={"unconverged": 0.0})
        if state.repair is not None:
            return state.keep(self._best(run, state, state.repair), self.warm)
        if (last := state.serving(run)) is not None:
            again = claimed(problem, replace(last, iterations=0), tolerance)
            if again.status == "solved":
                return again
        return state.keep(claimed(problem, run.optimum(state.program), tolerance), self.warm)

    def _best(self, run: Run, state: State, repair: Restricted) -> Solution:
        """The least objective of all starts that come within the limits."""
        problem, found, lost = run.problem, [], []
        for start in self._starts(run, state):
            x, reason = run.repaired(repair, start)
            if reason:
                lost.append(Solution(x, reason, run.count))
            else:
                found.append(run.descent(state.program, x))
            if run.limit.deadline.passed:
                break
        if not found:
            return replace(lost[0], iterations=run.count, details={"unconverged": 1.0})
        best = min(found, key=lambda solution: problem.objective(solution.positions))
        unconverged = float(best.status != "solved")
        details = {**best.details, "starts": float(len(found)), "unconverged": unconverged}
        return replace(best, iterations=run.count, details=details)

    def _starts(self, run: Run, state: State) -> Iterator[FloatArray]:
        """The last answer alone, or the step's begin, if these serve; the rest shape in need."""
        if (last := state.serving(run)) is not None:
            yield last.positions
            return
        if (start := begun(run.problem)) is not None:
            yield start
            if run.descents:
                return
        for name in self.starts:
            if (start := STARTS[name](run.problem)) is not None:
                yield start
        if run.descents == 0:
            at_rest = rest(run.problem)
            yield candidate(run.problem) if at_rest is None else at_rest


class State:
    """The programs of a mesh, and the last answer where starts are warm."""

    def __init__(self, program: Restricted, repair: Restricted | None) -> None:
        self.program, self.repair = program, repair
        self.last: Solution | None = None

    def serving(self, run: Run) -> Solution | None:
        """The last answer, if it is within the limits and the pins rest."""
        if self.last is None:
            return None
        held, x = run.problem.held, self.last.positions
        rests = np.array_equal(x[held], run.problem.target[held])
        return self.last if rests and run.within(x) else None

    def keep(self, solution: Solution, warm: bool) -> Solution:
        """Remember a solution that claims success, forget the last after any other; return it."""
        if warm:
            self.last = solution if solution.status == "solved" else None
        return solution
