"""A scene played in process, closed loop, with one solver: the states that pictures show."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from strainbench.arrays import FloatArray
from strainbench.bench.cell import Cell
from strainbench.physics.energies.contact import Obstacle
from strainbench.problem.kinds import Sampled
from strainbench.problem.problem import Problem
from strainbench.progress import Track as Track
from strainbench.progress import untracked as untracked
from strainbench.scenario.cloth import ClothScenario
from strainbench.scenario.stage import Stage, StageError, Who

KEPT = 1e-4  # strain beyond a limit that is told as a power of ten


@dataclass(frozen=True, eq=False)
class State:
    """The positions (n, 3) [m] after a step, at a time [s], None where a scene has no clock."""

    step: int
    time: float | None
    positions: FloatArray


@dataclass(frozen=True, eq=False)
class Film:
    """States of one scene and solver.

    Parameters
    ----------
    scene, solver : what the titles say
    interval : time between states [s], or None
    stopped : why the last states are missing, or ""
    obstacles : what the cloth is kept off
    """

    scene: str
    solver: str
    problem: Problem
    states: list[State]
    interval: float | None
    stopped: str = ""
    obstacles: tuple[Obstacle, ...] = ()

    @cached_property
    def strains(self) -> list[FloatArray]:
        """(e,) largest principal strain of each element, for each frame."""
        return [principal_stretches(self.problem, f.positions)[:, 0] - 1 for f in self.states]

    def inside(self, index: int) -> float:
        """How deep the deepest vertex of a state lies inside an obstacle [m]; 0 if none does."""
        x = self.states[index].positions
        return float(np.max([-o.distances(x)[0] for o in self.obstacles], initial=0.0))


def principal_stretches(problem: Problem, positions: FloatArray) -> FloatArray:
    """(e, dim) singular values of each deformation gradient, the largest first."""
    F = problem.deformation_gradients(positions)
    return np.asarray(np.linalg.svd(F, compute_uv=False), dtype=np.float64)


def measured(problem: Problem, positions: FloatArray) -> str:
    """What was limited and how well, and how far the cloth is stretched in any direction."""
    kind, bounds = problem.kind, problem.kind.bounds
    ends = (
        [f"{100 * s:.3g}%" for s in _ends(kind.strains)] if len(kind.strains) else ["what is far"]
    )
    limits = " to ".join(dict.fromkeys(ends))
    excess = float(problem.violations(positions).max())
    kept = f"up to {100 * excess:.2f}% beyond" if excess >= KEPT else f"within {excess:.0e} of"
    largest = float(principal_stretches(problem, positions).max())
    sampled = isinstance(kind, Sampled)
    between = sampled and np.ptp(bounds) == 0 and largest > bounds.max() + excess
    rest = "between them up to" if between else "largest strain"
    count = len(kind.directions)
    what = f"{count} sampled direction{'s' * (count > 1)}" if sampled else "principal stretch"
    return f"{what} {kept if excess else 'within'} {limits}; {rest} {100 * (largest - 1):.2f}%"


def _ends(values: FloatArray) -> tuple[float, float]:
    """The least and the largest."""
    return float(values.min()), float(values.max())


def shoot(cell: Cell, every: int = 1, track: Track = untracked) -> Film:
    """Play a cell and keep the start, every `every`-th step and the last one.

    A solver or a scene that fails ends the film early and is named in `stopped`.

    Raises
    ------
    ValueError
        If the solver does not take the scene's problem, or `every` is below 1.
    """
    if every < 1:
        raise ValueError(f"--every {every}: a whole number above 0 is valid")
    scenario = cell.scenario.scenario()
    stage = Stage.opened(scenario, cell.solver.solver(), cell.tolerance)
    step: float | None = getattr(scenario, "step", None)  # a scene without inertia has no clock
    states = [State(0, None if step is None else 0.0, stage.positions)]
    stopped = ""
    try:
        for _ in track(stage.steps(cell.steps), f"playing {cell.title}", cell.steps):
            k = stage.step
            if k % every == 0 or k == cell.steps:
                states.append(State(k, None if step is None else k * step, stage.positions))
    except StageError as error:  # a failing solver is data here too: what was played is shown
        who = cell.solver.label if error.who is Who.SOLVER else error.who
        stopped = f"{who} ended in step {stage.step} of {cell.steps}: {error}"
    scene = f"{scenario.name}, {scenario.resolution}×{scenario.resolution} cells"
    interval = None if step is None else every * step
    contact = scenario.contact() if isinstance(scenario, ClothScenario) else None
    obstacles = contact.obstacles if contact else ()
    return Film(scene, cell.solver.label, stage.problem, states, interval, stopped, obstacles)
