"""The same step on finer meshes: sweeps, time and memory."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from multiprocessing import get_context
from pathlib import Path
from statistics import median
from time import thread_time

from strainbench.physics.solid import Solid, linearised_step
from strainbench.problem.problem import Problem
from strainbench.scenario.stage import Stage
from strainbench.solver.registry import find_solver
from strainbench.solver.solver import Solver, run_solver
from strainbench.studies.volumes.part import Cell, Part, Plan, numbers, scene_of

RESOLUTIONS, METHODS = (2, 4, 8), ("none", "lcp-qp", "lcp-pgs")
STEP, STEPS = 5e-3, 8  # [s]
WARM, TOLERANCE = 2, 1e-6
ROUNDS = 3  # of the step without limits and each method, in turn


@dataclass(frozen=True)
class Grown:
    """A step on a mesh."""

    resolution: int
    method: str
    tetrahedra: int
    unknowns: int
    rows: int
    count: int  # sweeps, or iterations
    converged: str  # yes or no
    ratio: float  # of its thread time, over that of the step without limits: median of ROUNDS
    megabytes: float  # of memory at most so far, the methods in this order, in the first round


def cells(_: Plan) -> Iterable[Cell]:
    """Meshes."""
    return ((resolution,) for resolution in RESOLUTIONS)


def grown(resolution: int) -> Iterator[Grown]:
    """In a process of its own, whose memory is that mesh's alone."""
    context = get_context("spawn")
    with ProcessPoolExecutor(1, context, max_tasks_per_child=1) as pool:
        yield from pool.submit(stepped, resolution).result()


def stepped(resolution: int) -> list[Grown]:
    """The last of a few steps of `beam` without limits, with them."""
    methods = {name: find_solver(name) for name in METHODS}
    once = {k: s if k == "none" else replace(s, rounds=1) for k, s in methods.items()}  # type: ignore[call-arg]
    small = _last(WARM)[1]
    for solver in once.values():  # imports and compiles
        solver.prepare(small)
        run_solver(solver, small, None, TOLERANCE)
    before = _peak()
    body, frame = _last(resolution)
    x = frame.linearise_at
    assert x is not None
    rounds = []
    for _ in range(ROUNDS):
        begin = thread_time()
        linearised_step(body, x, 0 * x, STEP)
        free = thread_time() - begin
        rounds.append([_with(s, frame, resolution, free, before) for s in once.values()])
    return [
        replace(same[0], ratio=median(each.ratio for each in same))
        for same in zip(*rounds, strict=True)
    ]


def _with(solver: Solver, frame: Problem, resolution: int, free: float, before: float) -> Grown:
    begin = thread_time()
    solution = run_solver(solver, frame, None, TOLERANCE)
    taken, details = thread_time() - begin, solution.details
    return Grown(
        resolution,
        solver.name,
        tetrahedra=len(frame.elements),
        unknowns=3 * len(frame.free),
        rows=int(details.get("rows", 0)),
        count=solution.iterations,
        converged="no" if details.get("unconverged") else "yes",
        ratio=taken / free,
        megabytes=_peak() - before,
    )


def _last(resolution: int) -> tuple[Solid, Problem]:
    """The body, and the problem of the last step."""
    scene = scene_of("beam", resolution=resolution, step=STEP, alpha=0.0)
    stage = Stage.opened(scene, find_solver("none"))
    for _ in stage.steps(STEPS):
        pass
    return scene.solid(), stage.frame


def _peak() -> float:
    """Most memory that the process had so far [MB], without its parent's; nan but on Linux."""
    status = Path("/proc/self/status")
    text = status.read_text(encoding="utf-8") if status.exists() else ""
    peak = re.search(r"VmHWM:\s+(\d+) kB", text)
    return int(peak[1]) / 1024 if peak else math.nan


PART = Part(
    "growth",
    1,
    cells,
    grown,
    "Growth",
    f"The anisotropic beam falls without limits for {STEPS - 1} steps of 5 ms, and the next one is "
    "solved within them, in one round, with up to 1000 sweeps to a residual of 1e-5. The ratio is "
    "of thread time to that of the step without limits, assembly and factorisation included: the "
    f"median of {ROUNDS} rounds in turn. Memory is what a process takes at most for the mesh, that "
    "step, and then with each method, in this order.",
    [
        *numbers(("cells across", "", "")),
        "method",
        *numbers(("tetrahedra", "", ""), ("unknowns", "", ""), ("rows", "", "")),
        *numbers(("sweeps or iterations", "", "")),
        "converged",
        *numbers(("ratio of times", "", ".2g"), ("memory", "MB", ".0f")),
    ],
)
