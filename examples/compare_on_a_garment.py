"""Compare two methods on a garment: the closest sheet, and one that is only within the limits.

A skirt falls, and each step's candidate goes to both methods. The closest positions x* of a convex
set obey |y - target|^2 >= |x* - target|^2 + |y - x*|^2 for all others y in it (Pythagoras, with an
obtuse angle at x*), in the norm of the masses: what the other method is away, it pays in distance.
"""

from itertools import islice

import numpy as np
from numpy.typing import NDArray

from scenarios.garment import Garment
from strainbench import Certificate, certify, solve

Step = tuple[Certificate, Certificate, float]
"""Both answers to one candidate, and half the squared distance between them [kg m^2]."""


def main(steps: int = 4) -> list[Step]:
    """The skirt's steps; it lives on with the closest positions."""
    garment = Garment(resolution=3, limit=0.01)
    start, found = garment.problem(), []

    def project(target: NDArray[np.float64]) -> NDArray[np.float64]:
        problem = start.with_target(target)
        x, y = (solve(problem, name, 1e-7).positions for name in ("newton-ipm", "gauss-seidel"))
        between = 0.5 * float(np.sum(problem.weights[:, None] * (y - x) ** 2))
        found.append((certify(problem, x), certify(problem, y), between))
        return x

    list(islice(garment.play(project), steps))
    return found


if __name__ == "__main__":
    for closest, other, _ in main():
        print(
            f"closest: {closest.outcome}, {1e3 * closest.distance:.4f} mm off; "
            f"gauss-seidel: {other.outcome}, {1e3 * other.distance:.3f} mm off"
        )
