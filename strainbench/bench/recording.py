"""Projections of a scene: the first K that it asks for, those before the last solved."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from strainbench.arrays import FloatArray
from strainbench.bench.cell import Cell, PluginRef
from strainbench.bench.mode import SIMULATE
from strainbench.files import locked, open_folder
from strainbench.problem.problem import Problem
from strainbench.referee.reference import REFERENCE_SOLVER
from strainbench.scenario.stage import Stage, StageError, Who
from strainbench.solver.registry import find_solver


def recorder(cell: Cell) -> Cell:
    """The same scene with the reference solver, which records what others are fed."""
    reference = PluginRef.of(find_solver(REFERENCE_SOLVER))
    last = cell.window[1]
    played = replace(cell, solver=reference, mode=SIMULATE, steps=last, tolerance=1e-6)
    return replace(played, time_limit=None, repeats=1)


class _Reached(Exception):  # noqa: N818
    """Ends a scene at the projection that was asked for."""


@dataclass(frozen=True, eq=False)
class Recording:
    """What a scene asks of its projection, from the first on.

    Parameters
    ----------
    problem : the scene's mesh, limits and pins
    targets : (k, n, 3) candidates [m]
    step_seconds : (steps,) in implicit Euler, of each step ended before the last candidate
    """

    problem: Problem
    targets: FloatArray
    step_seconds: FloatArray

    def frame(self, number: int) -> Problem:
        """The projection of this number, counted from 1."""
        return self.problem.with_target(self.targets[number - 1])


def record(
    cell: Cell,
    number: int,
    progress: Callable[[int], None] = lambda _: None,
) -> Problem:
    """The problem of a scene's projection `number` alone; see `record_all`."""
    return record_all(cell, number, progress).frame(number)


def record_all(
    cell: Cell,
    number: int,
    progress: Callable[[int], None] = lambda _: None,
) -> Recording:
    """A scene's projections up to `number`, counted from 1, which is not solved itself.

    Parameters
    ----------
    cell : the scene, and the solver that answers the projections before
    progress : told how many projections the scene has asked for

    Raises
    ------
    ValueError
        One line: the scene does not ask for so many, or the solver cannot take it so far.
    """
    if number < 1:
        raise ValueError(f"--frame {number}: a whole number above 0 is valid")
    stage = Stage.opened(cell.scenario.scenario(), cell.solver.solver(), cell.tolerance)
    targets: list[FloatArray] = []
    seconds: list[float] = []

    def project(target: FloatArray) -> FloatArray:
        targets.append(target)
        progress(len(targets))
        if len(targets) == number:
            raise _Reached
        return stage.project(target)

    try:
        for report in stage.steps(project=project):
            seconds.append(report.ie_seconds)
    except _Reached:
        return Recording(stage.problem, np.stack(targets), np.array(seconds))
    except StageError as error:
        raise ValueError(f"--frame {number}: {_failed(stage, error, len(targets))}") from error
    raise ValueError(
        f"--frame {number}: {stage.scenario.name} asks for {len(targets)} projections, "
        f"so 1 to {len(targets)} are valid"
    )


def _failed(stage: Stage, error: StageError, asked: int) -> str:
    """In words what ended a recording after so many candidates."""
    if error.who is Who.SCENE:
        return f"{stage.scenario.name} ended after {asked} projections: {error}"
    return f"{stage.solver.label} has no answer to projection {asked}: {error}"


def recorded(
    cell: Cell,
    number: int,
    folder: Path,
    progress: Callable[[int], None] = lambda _: None,
) -> Recording:
    """The same without times, from `folder` where it was kept there before."""
    file = folder / f"{cell.recording_key}-{number}.npy"
    if not file.exists():
        recording = record_all(cell, number, progress)
        open_folder(folder)
        with locked(folder):
            part = file.with_suffix(".part.npy")
            np.save(part, recording.targets)
            part.replace(file)
    return Recording(cell.scenario.scenario().problem(), np.load(file), np.empty(0))
