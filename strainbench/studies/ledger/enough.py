"""How much of the suite's own modelling a scene needs: directions, mesh, step.

    strainbench ledger swing --enough --set resolution=20 --steps 30

1. directions: the scene with ever more of them; how far the largest principal stretch of any
   triangle goes beyond the limit. Enough are those that keep it within `EXCESS` of the strain
2. mesh and step: the scene as it is, then with a half and a quarter of its cells, and with steps of
   twice, four and eight times their length over the same time. In each a projection that has
   something to do goes to all of `RACED`, and the motion on from the first of them, which is exact
3. a method is ahead of another where it is a factor `APART` better as the scene is, in the median
   distance from the exact answer, or in the median of the processor time. A level will do where
   whoever is ahead in the scene as it is is ahead there too, by whatever factor
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import permutations
from statistics import median
from time import thread_time

import numpy as np

from strainbench.arrays import FloatArray
from strainbench.bench.cell import Cell
from strainbench.scenario.cloth import ClothScenario
from strainbench.scenario.scenario import Scenario
from strainbench.scenario.stage import Stage, StageError
from strainbench.solver.registry import find_solver

DIRECTIONS = (2, 3, 4, 6, 8, 12, 18, 36)
EXCESS = 0.1  # of the limit's strain
RACED = ("newton-ipm", "clarabel", "gauss-seidel", "xpbd", "fast-projection")
APART = 2.0
COARSER, LONGER = (2, 4), (2, 4, 8)


@dataclass(frozen=True)
class Beyond:
    """How far the true stretch goes beyond the limit with so many sampled directions."""

    scene: str
    directions: int
    excess: float

    def enough(self, limit: float) -> bool:
        """Whether that is within `EXCESS` of the limit's strain."""
        return self.excess <= EXCESS * limit


@dataclass(frozen=True)
class Score:
    """A method's medians over the projections with something to do.

    distance_mm : from the exact answer, of the farthest vertex
    seconds : processor time
    """

    distance_mm: float
    seconds: float


@dataclass(frozen=True)
class Level:
    """A scene as it is, or coarser: its scores by method, empty where nothing had to be done.

    upset : pairs "a before b" of methods whose order does not hold
    """

    scene: str
    resolution: int
    step: float
    scores: Mapping[str, Score]
    upset: Sequence[str] = ()


def beyond(cell: Cell) -> Iterator[Beyond]:
    """The excess with each number of directions, with the cell's solver.

    Raises
    ------
    ValueError
        In one line: a scene whose limits are a curve, which has no single limit to go beyond.
    """
    scene = cell.scenario.scenario()
    if type(scene).limits is not Scenario.limits:
        raise ValueError(f"{scene.name}: its limits are a curve; scenes with one limit are valid")
    for m in DIRECTIONS:
        stage = Stage.opened(replace(scene, directions=m), cell.solver.solver(), cell.tolerance)
        stretches = [_stretch(stage) for _ in stage.steps(cell.steps)]
        yield Beyond(scene.name, m, max(0.0, max(stretches) - 1 - scene.limit))


def _stretch(stage: Stage) -> float:
    """The largest principal stretch where the scene is."""
    F = stage.problem.deformation_gradients(stage.positions)
    return float(np.linalg.norm(F, 2, axis=(1, 2)).max())


def levels(cell: Cell) -> Iterator[Level]:
    """The scene as it is, then coarser, then with longer steps."""
    scene = cell.scenario.scenario()
    as_it_is = level(scene, cell.steps, cell.tolerance)
    yield as_it_is
    for factor in COARSER:
        if scene.resolution >= 2 * factor:
            coarse = replace(scene, resolution=scene.resolution // factor)
            yield beside(level(coarse, cell.steps, cell.tolerance), as_it_is)
    if isinstance(scene, ClothScenario):
        for factor in LONGER:
            long = replace(scene, step=factor * scene.step)
            steps = max(1, cell.steps // factor)
            yield beside(level(long, steps, cell.tolerance), as_it_is)


def level(scene: Scenario, steps: int, tolerance: float) -> Level:
    """All methods' scores on the motion that the first leads to."""
    stages = {name: Stage.opened(scene, find_solver(name), tolerance) for name in RACED}
    for stage in stages.values():
        stage.warm_up(physics=False)
    found: dict[str, list[Score]] = {name: [] for name in RACED}
    exact = stages[RACED[0]]

    def project(target: FloatArray) -> FloatArray:
        if not exact.problem.violations(target).max() > tolerance:
            return exact.project(target)
        answers = {name: timed(stage, target) for name, stage in stages.items()}
        best = answers[RACED[0]][0]
        for name, (x, seconds) in answers.items():
            apart = np.linalg.norm(x - best, axis=1).max()
            found[name].append(Score(1000 * float(apart), seconds))
        return best

    for _ in exact.steps(steps, project):
        pass
    medians = {
        name: Score(median(s.distance_mm for s in each), median(s.seconds for s in each))
        for name, each in found.items()
        if each
    }
    return Level(scene.name, scene.resolution, getattr(scene, "step", float("nan")), medians)


def timed(stage: Stage, target: FloatArray) -> tuple[FloatArray, float]:
    """An answer, infinitely far where there is none, and its processor time [s]."""
    begin = thread_time()
    try:
        x = stage.project(target)
    except StageError:
        x = np.full_like(target, np.inf)
    return x, thread_time() - begin


def beside(coarse: Level, fine: Level) -> Level:
    """The coarse level with the pairs whose order in the fine one does not hold in it."""
    pairs = permutations(set(fine.scores) & set(coarse.scores), 2)
    upset = [
        f"{a} before {b} in {name}"
        for a, b in sorted(pairs)
        for name, key in (("distance", "distance_mm"), ("time", "seconds"))
        if a != RACED[0] or key == "seconds"
        if APART * getattr(fine.scores[a], key) < getattr(fine.scores[b], key)
        if not getattr(coarse.scores[a], key) < getattr(coarse.scores[b], key)
    ]
    if not coarse.scores:
        upset = ["nothing had to be projected"]
    return replace(coarse, upset=upset)
