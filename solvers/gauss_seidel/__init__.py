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
from solvers.gauss_seidel.rows import Directions
from strainbench import Clock, Problem, Solution, Solver, section
from strainbench.solver.memory import Memory

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
    warm : start from the frame before: its positions, moved as the target has moved. A sweep
        knows of the target by where the first one starts alone, so that each frame adds to the
        error of the last, for fewer sweeps: on frames 10 to 30 of the swing at 20 cells, 1%,
        7,844 in place of 12,877 (medians), the farthest vertex 21 mm from the optimum in place of
        5. "strain" may not end within the limits where the frame before was far off. Started at
        the last positions as they were, any would stay there, and never see the target.
    max_sweeps : over all constraints (Tang et al. 2022, Table 1: 1e5).
    """

    name = "gauss-seidel"
    variants = {"strain": {"constraint": "strain"}, "principal": {"constraint": "principal"}}
    takes_exact = True
    takes_lower = True

    constraint: str = "directions"
    max_sweeps: int = 100_000
    warm: bool = False

    def __post_init__(self) -> None:
        if self.constraint not in ("directions", "strain", "principal"):
            valid = "directions, strain, principal"
            raise ValueError(f"constraint is {self.constraint!r}: valid are {valid}")

    def supports(self, problem: Problem) -> str | None:
        """A reason, where the limits cannot be put as limits on what one step corrects."""
        return super().supports(problem) or refusal(self.constraint, problem)

    def prepare(self, problem: Problem) -> Memory[Directions | Elements]:
        """What a step needs that does not depend on the positions, and the compiled loops."""
        by_rows = self.constraint == "directions"
        mesh = (
            Directions.of(problem) if by_rows else Elements.of(problem, self.constraint == "strain")
        )
        mesh.sweep(problem, problem.target.copy(), 1.0, 0)
        return Memory(mesh, self.warm)

    def solve(
        self,
        problem: Problem,
        state: Memory[Directions | Elements],
        *,
        tolerance: float,
        monitor: Callable[..., None],
        deadline: Clock,
    ) -> Solution:
        """Sweeps from the target, or the last answer; the monitor sees sweeps 1, 2, 4, 8, ..."""
        x, _ = state.start(problem)
        done, mark = 0, 1
        chunk = max(1, VISITS_A_CHUNK // problem.rows)
        while not problem.violations(x).max() < tolerance:
            if done >= self.max_sweeps:
                return Solution(x, "iteration limit", done)
            if deadline.passed:
                return Solution(x, "time limit", done)
            sweeps = min(mark - done, chunk, self.max_sweeps - done)
            with section("sweep"):
                done += state.mesh.sweep(problem, x, tolerance, sweeps)
            if done == mark:
                monitor(x.copy(), iterations=done)
                mark *= 2
        return state.keep(problem, Solution(x, "solved", done))
