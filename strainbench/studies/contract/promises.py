"""What a solver is held to: what it aims at, and how exactly."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

from strainbench.solver.solver import Solver

Aim = Literal["projection", "limits", "fixed", "edges", "nothing"]


@dataclass(frozen=True)
class Promise:
    """What a solver is held to.

    Parameters
    ----------
    aim : "projection", the optimum; "limits", some positions within them; "fixed", where so many
        iterations end; "edges", limits on edge lengths, which are another set; "nothing"
    rough : it may end beyond the limits, but must not say "solved" there
    exactness : of positions that are known otherwise [m], on meshes of about a metre
    multipliers : it must return them
    time_limit : [s] of each of its solves, or None
    """

    aim: Aim = "limits"
    rough: bool = False
    exactness: float = 5e-6
    multipliers: bool = False
    time_limit: float | None = None

    @property
    def within(self) -> bool:
        """Whether its answers lie within the limits."""
        return self.aim in ("projection", "limits") and not self.rough


OPTIMAL = Promise("projection")
ROUGH = ("cvxpy-scs", "cvxpy-scs-default", "linearized-qp-default", "linearized-qp-plain")
"""Solvers that often end with limits violated."""
FIXED_COUNT = ("augmented-lagrangian-arcsim", "xpbd-20", "xpbd-compliant")
"""Variants as they are used elsewhere: so many iterations, wherever these end."""
TO_OPTIMALITY = (
    "admm",
    "augmented-lagrangian",
    "clarabel",
    "clarabel-default",
    "cvxpy",
    "dykstra",
    "dykstra-plain",
    "ipopt",
    "linearized-qp",
    "newton-ipm",
    "qoco",
    "sequential-cuts",
    "sequential-cuts-polar",
)
"""Solvers of the projection itself; the others stop at a point within the limits."""
UNSCALED = (
    "clarabel-default",
    "clarabel-paper",
    "cvxpy-default",
    "cvxpy-ecos-default",
    "cvxpy-qoco-default",
    "ipopt-default",
    "ipopt-default-lbfgs",
    "qoco-default",
)
"""Out of the box: an objective known to 1e-8 of its size leaves positions uncertain by 1e-4."""
EDGES, NOTHING = ("ipopt-edges", "ipopt-edges-default", "ipopt-edges-default-lbfgs"), "none"
MULTIPLIERS = (*TO_OPTIMALITY, "clarabel-paper")


def promise_of(solver: Solver) -> Promise:
    """What one of ours is held to, and what any other is if it says nothing."""
    label = solver.label.removesuffix("-warm")
    promise = Promise(rough=label in ROUGH, multipliers=label in MULTIPLIERS)
    if label in UNSCALED:
        promise = replace(promise, exactness=5e-4)
    aims: dict[str, Aim] = {
        **dict.fromkeys(TO_OPTIMALITY, "projection"),
        **dict.fromkeys(FIXED_COUNT, "fixed"),
        **dict.fromkeys(EDGES, "edges"),
        NOTHING: "nothing",
    }
    return replace(promise, aim=aims.get(label, "limits"))
