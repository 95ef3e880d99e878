"""Add a solver: `strainbench run swing --solver examples/add_a_solver.py` finds the class below.

With a multiplier Y_i for each limit |(G x)_i| <= b_i the dual to maximise is the least value over x
of f(x) + <Y, G x> - sum b_i |Y_i|. It is taken at x = target - M^-1 G^T Y, the gradient of the
smooth part is G x, and the proximal step of the rest shortens each Y_i by b_i / L.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from scenarios.stretch_square import StretchSquare
from strainbench import Certificate, Problem, Solution, Solver, certify, solve


@dataclass(frozen=True)
class DualAscent(Solver):
    """Accelerated proximal gradient ascent on the dual (Beck and Teboulle 2009)."""

    name = "dual-ascent"
    iterations: int = 20_000

    def solve(
        self, problem: Problem, state: None, *, tolerance: float, monitor: Any, deadline: Any
    ) -> Solution:
        """Ascend until the violation and the duality gap are below the tolerance."""
        G, b, target = problem.G, problem.bounds[:, None], problem.target
        W = np.zeros((problem.vertices, 1))  # M^-1, and 0 at the pins
        W[problem.free, 0] = 1 / problem.weights[problem.free]
        L = (abs(G) @ (W * (abs(G).T @ np.ones_like(b)))).max()  # at least ||G W G^T||
        Y = V = np.zeros((problem.rows, 3))
        for k in range(self.iterations):
            x = target - W * (G.T @ Y)
            monitor(x, Y)
            gap = np.sum(b[:, 0] * np.linalg.norm(Y, axis=1)) - np.sum(Y * (G @ x))
            if problem.violations(x).max() < tolerance and gap <= tolerance * problem.objective(x):
                return Solution(x, "solved", k, Y)
            if deadline.passed:
                return Solution(x, "time limit", k, Y)
            Z = V + G @ (target - W * (G.T @ V)) / L
            shorter = 1 - b / (L * np.linalg.norm(Z, axis=1, keepdims=True) + 1e-300)
            Y, last = np.maximum(shorter, 0) * Z, Y
            V = Y + k / (k + 3) * (Y - last)
        return Solution(x, "iteration limit", self.iterations, Y)


def main() -> Certificate:
    """What the referee thinks of it, on a square that is pulled to a rectangle."""
    problem = StretchSquare(resolution=6).problem()
    return certify(problem, solve(problem, DualAscent()).positions)


if __name__ == "__main__":
    found = main()
    print(f"{found.outcome}: violation {found.max_violation:.0e}, gap {found.relative_gap:.0e}")
