"""What one linearised step costs by projected Gauss-Seidel and by an interior point.

Part of `strainbench.studies.volumes`. Beams are played by lcp-qp; each step is then solved once
more by both methods, with the same rows.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise, product
from time import thread_time

import numpy as np
import pandas as pd

from strainbench.problem.problem import Problem
from strainbench.scenario.stage import Stage
from strainbench.solver.registry import find_solver
from strainbench.solver.solver import run_solver
from strainbench.studies.volumes.part import Part, numbers, scene_of

BOUNDS = (0, 5, 40, 160, 10**9)  # rows; the paper's words are of 5 and 40
LABELS = ("1 to 5", "6 to 40", "41 to 160", "above 160")
MATERIALS, STEPS = ("anisotropic", "isotropic"), (5e-3, 20e-3)  # [s]
LASTS = 0.24  # [s]
METHODS = ("lcp-pgs", "lcp-qp")


@dataclass(frozen=True)
class Sweeps:
    """Steps with so many rows: medians."""

    rows: str
    steps: int
    sweeps: float
    solved: float  # [%]
    iterations: float  # of the interior point
    ratio: float  # of times


def solved(frame: Problem) -> dict[str, float]:
    """Rows, counts and thread seconds of a step, by both methods."""
    found: dict[str, float] = {}
    for name in METHODS:
        solver = replace(find_solver(name), rounds=1)  # type: ignore[call-arg]
        state = solver.prepare(frame)
        begin = thread_time()
        solution = run_solver(solver, frame, state, 1e-6)
        found |= {f"{name} seconds": thread_time() - begin, f"{name} count": solution.iterations}
        found |= {"rows": solution.details["rows"], name: not solution.details["unconverged"]}
    return found


def swept() -> Iterator[Sweeps]:
    """All rows of the table."""
    steps = []
    for material, step in product(MATERIALS, STEPS):
        scene = scene_of("beam", material=material, step=step, alpha=0.0)
        stage = Stage.opened(scene, find_solver("lcp-qp"))
        steps += [solved(stage.frame) for _ in stage.steps(round(LASTS / step))]
    table = pd.DataFrame(steps)
    for label, (low, high) in zip(LABELS, pairwise(BOUNDS), strict=True):
        part = table[(table["rows"] > low) & (table["rows"] <= high)]
        if len(part):
            ratio = part["lcp-pgs seconds"] / part["lcp-qp seconds"]
            counts = (float(np.median(part[f"{name} count"])) for name in METHODS)
            sweeps, iterations = counts
            share = 100 * float(part["lcp-pgs"].mean())
            yield Sweeps(label, len(part), sweeps, share, iterations, float(ratio.median()))


PART = Part(
    "sweeps",
    0,
    lambda _: [()],
    swept,
    "What a linearised step costs",
    "Each step of both beams, of 5 and 20 ms and without damping, as lcp-qp plays them, in "
    "one round of lcp-pgs, up to 1000 sweeps to a residual of 1e-5, and of lcp-qp: medians, "
    "and how many of the steps Gauss-Seidel solves. The ratio is that of thread times, Gauss-"
    "Seidel's over the interior point's, in one process and one after the other.",
    [
        "rows",
        *numbers(("steps", "", ""), ("sweeps", "", ".0f"), ("solved", "%", ".0f")),
        *numbers(("iterations of lcp-qp", "", ".0f"), ("ratio of times", "", ".2g")),
    ],
)
