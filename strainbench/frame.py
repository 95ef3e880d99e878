"""One projection of a scene: the K-th that it asks for, everything before it solved."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from strainbench.cell import Cell, PluginRef
from strainbench.discovery import find_solver
from strainbench.limits import FloatArray
from strainbench.problem import Problem
from strainbench.reference import REFERENCE_SOLVER
from strainbench.solver import run_solver


def recorder(cell: Cell) -> Cell:
    """The same scene with the reference solver, which records what others are fed."""
    reference = PluginRef.of(find_solver(REFERENCE_SOLVER))
    return replace(cell, solver=reference, mode="simulate", tolerance=1e-6, time_limit=None)


class _Reached(Exception):  # noqa: N818
    """Ends a scene at the projection that was asked for."""


def record(
    cell: Cell,
    number: int,
    progress: Callable[[int], None] = lambda _: None,
) -> Problem:
    """The problem of a scene's projection `number`, counted from 1, which is not solved itself.

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
    scenario, solver = cell.scenario.scenario(), cell.solver.solver()
    problem = scenario.problem()
    if refusal := solver.supports(problem):
        raise ValueError(f"{solver.label} cannot take this scene: {refusal}")
    state = solver.prepare(problem)
    targets: list[FloatArray] = []

    def project(target: FloatArray) -> FloatArray:
        targets.append(target)
        progress(len(targets))
        if len(targets) == number:
            raise _Reached
        solution = run_solver(solver, problem.with_target(target), state, cell.tolerance)
        if not np.all(np.isfinite(solution.positions)):
            raise ValueError(
                f"--frame {number}: {solver.label} has no answer to projection {len(targets)}; "
                f"it says {str(solution.status)!r}"
            )
        return solution.positions

    try:
        for _ in scenario.play(project):
            pass
    except _Reached:
        return problem.with_target(targets[-1])
    raise ValueError(
        f"--frame {number}: {scenario.name} asks for {len(targets)} projections, "
        f"so 1 to {len(targets)} are valid"
    )
