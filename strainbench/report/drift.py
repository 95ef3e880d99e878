"""Cells that keep the limits and drift: their closed loop leaves that of an optimal cell."""

from __future__ import annotations

import numpy as np
import pandas as pd

from strainbench.bench.failure import FAILURES, Failure
from strainbench.report.measures import OPTIMAL, numbers

DRIFT = 0.05  # of the range of heights that the optimal cell's centre of mass goes through
LOOP = ["scenario_parameters", "scenario", "steps_asked"]


def with_drift(runs: pd.DataFrame, steps: pd.DataFrame) -> pd.DataFrame:
    """Runs, where those that are feasible and drift are told so, and from which step on.

    The records have no positions; the height of the centre of mass is the energy of gravity. The
    reference is the closed loop of a cell that is optimal on every step of the same scene; without
    one in the folder nothing is known.

    Parameters
    ----------
    steps : of these cells, as `newest_steps` has them
    """
    kinds = runs["failure"].to_numpy(copy=True)
    since = runs["failure_step"].to_numpy(dtype=float, copy=True)
    closed = runs["mode"] == "simulate"
    loops = runs[closed].assign(place=np.flatnonzero(closed))
    for _, alike in loops.groupby(LOOP):
        tame = alike[alike["failure"] == Failure.NOT_OPTIMAL]
        best = alike.loc[alike["outcome"] == OPTIMAL, "cell"]
        if tame.empty or best.empty:
            continue
        heights = _heights(steps, [*tame["cell"], best.iloc[0]])
        for cell, place in zip(tame["cell"], tame["place"], strict=True):
            step = _leaves(heights.get(cell), heights.get(best.iloc[0]))
            if step is not None:
                kinds[place], since[place] = Failure.DRIFTS.value, step
    return runs.assign(**dict(zip(FAILURES, (kinds, since), strict=True)))


def _heights(steps: pd.DataFrame, cells: list[str]) -> dict[str, pd.Series]:
    """The energy of gravity after each step of these cells."""
    parsed = numbers(steps.loc[steps["cell"].isin(cells), ["cell", "step", "gravity_energy"]])
    known = parsed.dropna(subset=["gravity_energy"])
    return {
        str(cell): rows.groupby("step")["gravity_energy"].last()
        for cell, rows in known.groupby("cell")
    }


def _leaves(heights: pd.Series | None, reference: pd.Series | None) -> int | None:
    """The first step in which a loop is DRIFT away from its reference, if there is one."""
    if heights is None or reference is None or not np.ptp(reference) > 0:
        return None
    apart = (heights - reference).abs() / np.ptp(reference)
    beyond = apart[apart > DRIFT]
    return int(beyond.index[0]) if len(beyond) else None
