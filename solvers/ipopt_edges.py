"""Ipopt on the lengths of edges instead of directions (after Jin et al. 2017).

N. Jin, W. Lu, Z. Geng, R. P. Fedkiw, "Inequality cloth", SCA 2017: edges may shorten freely but
not stretch. Only that set is theirs; their solver, a relaxed active-set iteration, is not here.

    minimise s/2 ||x - target||_M^2  such that  l L_ij <= |x_i - x_j| <= b_ij  for every edge,

with rest lengths L_ij, and b_ij the largest length that the problem's limits leave the edge
(`strainbench.problem.reach.longest_edges`): b L_ij where the edge lies along a direction of
bound b.

It is another feasible set. Every point within the limits is in it, but three lengths say nothing
of the stretch in other directions: the triangle of a right-angled cell that is sheared along its
missing diagonal keeps all of them. So the referee, which judges the problem as given, finds
limits violated, and an objective below that of the projection.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from solvers.ipopt import Ipopt, Lengths, Structure
from strainbench import Clock, Problem, Solution, StretchLimits
from strainbench.solver.memory import Memory


@dataclass(frozen=True)
class IpoptEdges(Ipopt):
    """Edge lengths instead of directions, by Ipopt: a wider feasible set (Jin et al. 2017).

    Parameters
    ----------
    lower : least length of an edge over its rest length, 0 to 1. Above 0 the problem is not
        convex, and the answer a local minimum near the target.
    scaling, hessian : see `Ipopt`.
    """

    name = "ipopt-edges"
    takes_exact = True
    takes_lower = False

    lower: float = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0 <= self.lower <= 1:
            raise ValueError(f"lower is {self.lower}: a share of the rest length, 0 to 1, is valid")

    def supports(self, problem: Problem) -> str | None:
        """A reason, where the limits leave edges of any length or of none."""
        if refusal := super().supports(problem):
            return refusal
        lengths = self.lengths(problem)
        if len(lengths.upper) == 0:
            return "a single limited direction bounds the length of no edge"
        return (
            "lower edge lengths above the upper ones" if lengths.upper.min() < self.lower else None
        )

    def lengths(self, problem: Problem) -> Lengths:
        """The lengths of the edges over their rest lengths."""
        edges, longest = problem.longest_edges()
        unstretched = StretchLimits.exact(1.0, dim=problem.rest.shape[-1])
        rest = replace(problem, limits=unstretched).longest_edges()[1] if len(edges) else longest
        ends = np.array([1.0, -1.0]) / rest[:, None]
        return Lengths(edges, ends, np.full(len(edges), self.lower), longest / rest)

    def solve(
        self,
        problem: Problem,
        state: Memory[Structure],
        *,
        tolerance: float,
        monitor: Callable[..., None],
        deadline: Clock,
    ) -> Solution:
        """One run of Ipopt; its multipliers belong to other constraints than the problem's."""
        found = self._run(problem, state, tolerance, monitor, deadline)
        status = "solved for edge lengths" if found.status == "solved" else found.status
        return replace(found, status=status, multipliers=None)
