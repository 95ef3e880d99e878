"""A scene played in process, closed loop, with one solver: the states that pictures show."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from strainbench.arrays import FloatArray
from strainbench.bench.cell import Cell
from strainbench.physics.energies.contact import Obstacle
from strainbench.problem.problem import Problem
from strainbench.progress import Track as Track
from strainbench.progress import untracked as untracked
from strainbench.scenario.cloth import ClothScenario
from strainbench.solver.solver import Solver, run_solver


@dataclass(frozen=True, eq=False)
class Frame:
    """The positions (n, 3) [m] after a step, at a time [s], None where a scene has no clock."""

    step: int
    time: float | None
    positions: FloatArray


@dataclass(frozen=True, eq=False)
class Film:
    """Frames of one scene and solver.

    Parameters
    ----------
    scene, solver : what the titles say
    interval : time between frames [s], or None
    stopped : why the last frames are missing, or ""
    obstacles : what the cloth is kept off
    """

    scene: str
    solver: str
    problem: Problem
    frames: list[Frame]
    interval: float | None
    stopped: str = ""
    obstacles: tuple[Obstacle, ...] = ()

    @cached_property
    def strains(self) -> list[FloatArray]:
        """(e,) largest principal strain of each element, for each frame."""
        return [principal_stretches(self.problem, f.positions)[:, 0] - 1 for f in self.frames]


def principal_stretches(problem: Problem, positions: FloatArray) -> FloatArray:
    """(e, dim) singular values of each deformation gradient, the largest first."""
    F = problem.deformation_gradients(positions)
    return np.asarray(np.linalg.svd(F, compute_uv=False), dtype=np.float64)


def shoot(cell: Cell, every: int = 1, track: Track = untracked) -> Film:
    """Play a cell and keep the start, every `every`-th step and the last one.

    A solver that fails ends the film early and is named in `stopped`.

    Raises
    ------
    ValueError
        If the solver does not take the scene's problem, or `every` is below 1.
    """
    if every < 1:
        raise ValueError(f"--every {every}: a whole number above 0 is valid")
    scenario, solver = cell.scenario.scenario(), cell.solver.solver()
    problem = scenario.problem()
    if refusal := solver.supports(problem):
        raise ValueError(f"{cell.solver.label} cannot take this scene: {refusal}")
    step: float | None = getattr(scenario, "step", None)  # a scene without inertia has no clock
    stage = _Stage(problem, solver, cell.tolerance)
    frames = [Frame(0, None if step is None else 0.0, problem.target)]
    stopped = ""
    steps = scenario.play(stage.project)
    for k in track(range(1, cell.steps + 1), f"playing {cell.title}", cell.steps):
        try:
            next(steps)
        except Exception as error:  # a failing solver is data here too: what was played is shown
            reason = str(error) if isinstance(error, _Cut) else f"{type(error).__name__}: {error}"
            stopped = f"{cell.solver.label} ended in step {k} of {cell.steps}: {reason}"
            break
        if k % every == 0 or k == cell.steps:
            frames.append(Frame(k, None if step is None else k * step, stage.positions))
    parameters: dict[str, Any] = dict(cell.scenario.parameters)
    scene = f"{scenario.name}, {parameters['resolution']}×{parameters['resolution']} cells"
    interval = None if step is None else every * step
    contact = scenario.contact() if isinstance(scenario, ClothScenario) else None
    obstacles = contact.obstacles if contact else ()
    return Film(scene, cell.solver.label, problem, frames, interval, stopped, obstacles)


class _Cut(Exception):  # noqa: N818
    """Ends a film early, with the reason."""


class _Stage:
    """Where candidates meet the solver; the last answer of a step is the step's state."""

    def __init__(self, problem: Problem, solver: Solver, tolerance: float) -> None:
        self._problem, self._solver, self._tolerance = problem, solver, tolerance
        self._state = solver.prepare(problem)
        self.positions = problem.target

    def project(self, target: FloatArray) -> FloatArray:
        """Limit one candidate."""
        if not np.all(np.isfinite(target)):
            raise _Cut("the simulation has left the finite numbers")
        problem = self._problem.with_target(target)
        solution = run_solver(self._solver, problem, self._state, self._tolerance)
        positions = np.asarray(solution.positions)
        if positions.shape != target.shape or not np.all(np.isfinite(positions)):
            raise _Cut(f"no usable positions; it says {str(solution.status)!r}")
        self.positions = positions
        return positions
