"""A body's steps from any start, by any method: what a scene does, without a scene."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from time import thread_time

import numpy as np

from strainbench.arrays import FloatArray
from strainbench.physics.solid import Solid, linearised_step
from strainbench.problem.problem import Problem
from strainbench.solver.registry import find_solver
from strainbench.solver.solver import Solution, run_solver

Frame = Callable[[FloatArray, FloatArray], Problem]
"""The problem of a step, of its candidate and of where it starts, (n, 3) each."""
TOLERANCE = 1e-6


@dataclass(frozen=True, eq=False)
class Stepped:
    """A step: its problem, what was made of it, and the thread time of that [s]."""

    frame: Problem
    solution: Solution
    seconds: float


def in_metric(body: Solid, problem: Problem, h: float) -> Frame:
    """Steps as the scenes of volumes project them: see `VolumeScenario.frame`."""
    return lambda target, start: problem.with_target(target, body.metric(start, h), start)


def march(
    body: Solid, frame: Frame, method: str, h: float, x: FloatArray, v: FloatArray
) -> Iterator[Stepped]:
    """Steps of h [s] from positions x and velocities v, (n, 3), pins held.

    They end after the first answer that is not finite. ValueError if the method cannot take them.
    """
    solver = find_solver(method)
    if refusal := solver.supports(frame(x, x)):
        raise ValueError(f"{method}: {refusal}")
    state = solver.prepare(frame(x, x))
    while np.all(np.isfinite(x)):
        problem = frame(linearised_step(body, x, v, h), x)
        begin = thread_time()
        solution = run_solver(solver, problem, state, TOLERANCE)
        yield Stepped(problem, solution, thread_time() - begin)
        x, v = solution.positions, (solution.positions - x) / h


def stretches(problem: Problem, x: FloatArray) -> FloatArray:
    """(e, 3) principal stretches of tetrahedra, the last one negative where inverted."""
    F = problem.deformation_gradients(x)
    s: FloatArray = np.array(np.linalg.svd(F, compute_uv=False), float)
    s[:, 2] *= np.where(np.linalg.det(F) < 0, -1.0, 1.0)
    return s
