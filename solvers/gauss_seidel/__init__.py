"""Gauss-Seidel projection, an element or a constraint at a time (Thomaszewski et al. 2009).

B. Thomaszewski, S. Pabst, W. Strasser, "Continuum-based strain limiting", Computer Graphics
Forum 28(2), Sec. 4, with the stop rule of Tang et al. 2022, Table 1: largest violation below the
tolerance, at most 1e5 sweeps. One sweep corrects, in mesh order and each from where the last
one left the vertices,

- `rows`: the stretch of one limited direction at a time;
- `elements`: the strain or the principal stretches of one element at a time.

The answer is a feasible point near the target, not the closest one.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from solvers.gauss_seidel.elements import Elements, refusal
from solvers.gauss_seidel.rows import Rows
from strainbench import Clock, Problem, Solution, Solver

VISITS_A_CHUNK = 3_000_000
"""Constraint visits between two looks at the clock: 20 ms at the 6 to 7 ns a row measured."""


@dataclass(frozen=True)
class GaussSeidel(Solver):
    """Gauss-Seidel projection of one constraint at a time (Thomaszewski et al. 2009, Sec. 4).

    | status | when |
    |---|---|
    | solved | the largest violation of the returned positions is below the tolerance |
    | iteration limit | it is not, after `max_sweeps` |
    | time limit | it is not, at the deadline |

    Parameters
    ----------
    constraint : what one step corrects. "directions" is the stretch in one limited direction,
        exactly (as Tang et al. 2022 compare it). "strain" is the paper's own: the entries of an
        element's corotated Cauchy strain. "principal" is that of H. Wang, J. O'Brien,
        R. Ramamoorthi, "Multi-resolution isotropic strain limiting", ACM Trans. Graph. 29(6),
        2010: an element's principal stretches.
    max_sweeps : over all constraints (Tang et al. 2022, Table 1: 1e5).
    """

    name = "gauss-seidel"
    variants = {"strain": {"constraint": "strain"}, "principal": {"constraint": "principal"}}
    takes_exact = True
    takes_lower = True

    constraint: str = "directions"
    max_sweeps: int = 100_000

    def __post_init__(self) -> None:
        if self.constraint not in ("directions", "strain", "principal"):
            valid = "directions, strain, principal"
            raise ValueError(f"constraint is {self.constraint!r}: valid are {valid}")

    def supports(self, problem: Problem) -> str | None:
        """A reason, where the limits cannot be put as limits on what one step corrects."""
        return super().supports(problem) or refusal(self.constraint, problem)

    def prepare(self, problem: Problem) -> Rows | Elements:
        """What a step needs that does not depend on the positions, and the compiled loops."""
        by_rows = self.constraint == "directions"
        state = Rows.of(problem) if by_rows else Elements.of(problem, self.constraint == "strain")
        state.sweep(problem, problem.target.copy(), 1.0, 0)
        return state

    def solve(
        self,
        problem: Problem,
        state: Rows | Elements,
        *,
        tolerance: float,
        monitor: Callable[..., None],
        deadline: Clock,
    ) -> Solution:
        """Sweeps from the target; the monitor sees sweeps 1, 2, 4, 8, ..."""
        x = problem.target.copy()
        done, mark = 0, 1
        chunk = max(1, VISITS_A_CHUNK // problem.rows)
        while not problem.violations(x).max() < tolerance:
            if done >= self.max_sweeps:
                return Solution(x, "iteration limit", done)
            if deadline.passed:
                return Solution(x, "time limit", done)
            sweeps = min(mark - done, chunk, self.max_sweeps - done)
            done += state.sweep(problem, x, tolerance, sweeps)
            if done == mark:
                monitor(x.copy(), iterations=done)
                mark *= 2
        return Solution(x, "solved", done)
