"""A cell played again up to the step in which it failed, and the projection that failed there."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from strainbench.arrays import FloatArray
from strainbench.bench.cell import Cell
from strainbench.bench.journal import (
    TARGETS,
    keep_targets,
    only,
    read_events,
    read_frames,
    read_targets,
)
from strainbench.bench.judge import judge
from strainbench.bench.machine import fixed_threads
from strainbench.bench.play import play_cell
from strainbench.bench.recording import recorder
from strainbench.problem.problem import Problem
from strainbench.scenario.stage import Stage
from strainbench.solver.registry import find_solver
from strainbench.studies.convergence.measure import run_alone

FAR = 1e3  # times the candidate's coordinates [m]: answers beyond are not drawn
SECONDS = 120.0  # for a cell that had no time limit
Row = Mapping[str, object]


@dataclass(frozen=True, eq=False)
class Replay:
    """What came of it.

    Parameters
    ----------
    row, steps : as runs.csv and steps.csv would have them
    number : the projection that the story is about, from 1 on
    problem : that projection, None where the scene asked for none
    positions : (n, 3) the answer to it; None without one that is finite and of this world
    """

    row: Row
    steps: list[dict[str, object]]
    number: int
    problem: Problem | None
    positions: FloatArray | None

    @property
    def step(self) -> dict[str, object]:
        """The projection's row, empty without an answer."""
        return self.steps[self.number - 1] if self.number <= len(self.steps) else {}


class _Reached(Exception):  # noqa: N818
    """Ends a scene at the projection that has no answer yet."""


def replay(cell: Cell, until: int | None, scratch: Path, memory_limit_mb: float) -> Replay:
    """Play a cell, in a process of its own, to the end of the step `until`, and judge it."""
    limit = SECONDS if cell.time_limit is None else cell.time_limit
    cell = replace(cell, steps=until or cell.steps, time_limit=limit, repeats=1, patience=None)
    with fixed_threads(cell.threads):
        recording = None
        if cell.mode == "replay":
            recording = run_alone(recorder(cell), scratch / "recording", None, memory_limit_mb)
            keep_targets(recording.folder)
        fed = None if recording is None else recording.folder
        item = run_alone(cell, scratch / "cell", fed, memory_limit_mb, play_cell)
    row, steps = judge(cell, item.folder, item.ending)
    first = _first(row, steps)
    frames = list(read_frames(item.folder, min(first, len(steps))))
    target: FloatArray | None
    if first <= len(frames):
        target, answer = frames[first - 1]
        finite = answer if _can_be_shown(answer, target) else None
    else:
        target, finite = _asked(cell, [x for _, x in frames], fed), None
    problem = None if target is None else cell.scenario.scenario().problem().with_target(target)
    return Replay(row, steps, first, problem, finite)


def _can_be_shown(answer: FloatArray, target: FloatArray) -> bool:
    return bool(np.abs(answer).max() <= FAR * max(1.0, np.abs(target).max()))


def _first(row: Row, steps: list[dict[str, object]]) -> int:
    """The first projection of the failure's kind; the one after all, where none is."""
    alike = (n for n, s in enumerate(steps, 1) if row["failure"] and s["failure"] == row["failure"])
    return next(alike, len(steps) + (1 if row["failure"] else 0)) or 1


def _asked(cell: Cell, answers: list[FloatArray], recording: Path | None) -> FloatArray | None:
    """The candidate after so many answers, or None if there is none."""
    if recording is not None:
        count = len(only(read_events(recording), "projection"))
        targets = list(read_targets(recording, count)) if (recording / TARGETS).exists() else []
        return targets[len(answers)] if len(answers) < len(targets) else None
    given, asked = iter(answers), list[FloatArray]()

    def project(target: FloatArray) -> FloatArray:
        answer = next(given, None)
        if answer is None:
            asked.append(target)
            raise _Reached
        return answer.copy()

    stage = Stage(cell.scenario.scenario(), find_solver("none"), cell.tolerance)
    try:
        for _ in stage.steps(cell.steps, project):
            pass
    except _Reached:
        return asked[0]
    return None
