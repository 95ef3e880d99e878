"""Certify an answer of your own code: the referee asks for positions, and for nothing else.

A sheet is pulled to 120% in x. Your code shrinks it until no triangle is stretched by more than 1%:
once as a whole, once in x alone. Both meet the limits; only one is the closest such sheet. Of the
square's way back (1.2 - 1.01)^2 is needed, in x, and (1 - 1.01 / 1.2)^2 is not, in y: the gap that
the referee finds is the ratio of the two.
"""

import numpy as np
from scipy.spatial import Delaunay

from strainbench import Certificate, Problem, StretchLimits, certify

PULL, LIMIT = 1.2, 1.01


def main() -> tuple[Certificate, Certificate]:
    """The referee's findings on the sheet that was shrunk as a whole, and in x alone."""
    ticks = np.linspace(-0.5, 0.5, 9)
    rest = np.stack(np.meshgrid(ticks, ticks), axis=-1).reshape(-1, 2)  # (n, 2) [m]
    problem = Problem(
        rest=rest,
        elements=Delaunay(rest).simplices,
        target=np.column_stack([PULL * rest[:, 0], rest[:, 1], np.zeros(len(rest))]),
        limits=StretchLimits.isotropic(LIMIT),
    )
    whole = problem.target * (LIMIT / PULL)
    along = problem.target * [LIMIT / PULL, 1, 1]
    return certify(problem, whole), certify(problem, along)


if __name__ == "__main__":
    for name, found in zip(("as a whole", "in x alone"), main(), strict=True):
        print(
            f"{name}: {found.outcome}, violation {found.max_violation:.0e}, gap "
            f"{found.relative_gap:.3f}, at most {found.distance_bound:.3f} m from the closest"
        )
