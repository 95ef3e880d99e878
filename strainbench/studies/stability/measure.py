"""Running a map's cells, batch by batch, until its boundaries are known or its budget is spent.

All cells lie in one results folder, as those of `strainbench run`: what has finished is not run
again, and `strainbench report` reads it.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from math import nan
from pathlib import Path

import pandas as pd

from strainbench.bench.cell import Cell
from strainbench.bench.columns import STEP_COLUMNS, WORDS
from strainbench.bench.records import latest_runs, latest_steps
from strainbench.bench.runner import Runner, Settings
from strainbench.progress import Observer
from strainbench.report.measures import COUNT, finish, numbers, timing
from strainbench.studies.stability.axis import Axis
from strainbench.studies.stability.refine import Point, inferred, wanted

Planner = Callable[[Sequence[str]], list[Cell]]
"""The cells of all methods with so many further words of --set."""


@dataclass(frozen=True)
class Spot:
    """What became of one cell.

    Parameters
    ----------
    ending : one of `strainbench.report.measures.ENDINGS`
    why : in a few words, where it failed
    step : the first that did not end within the limits, or None
    share : of the steps asked for, those that did
    seconds : median of a projection that had something to do; NaN without any
    """

    cell: str
    ending: str
    why: str
    step: int | None
    share: float
    seconds: float

    @property
    def holds(self) -> bool:
        """Whether every step ended within the limits."""
        return self.ending in COUNT


@dataclass
class Map:
    """What is known of each method at the points of two axes.

    Attributes
    ----------
    spots : by method, and by index along x and y
    open : points that the refinement still asks for, where the budget ended it
    """

    x: Axis
    y: Axis
    spots: dict[str, dict[Point, Spot]] = field(default_factory=dict)
    open: int = 0

    @property
    def shape(self) -> Point:
        """Levels along x and y."""
        return len(self.x.words), len(self.y.words)

    def wanted(self, method: str) -> set[Point]:
        """The points to run next."""
        return wanted(self.shape, self._endings(method))

    def endings(self, method: str) -> dict[Point, str]:
        """Of all points, those between points that agree inferred."""
        return inferred(self.shape, self._endings(method))

    def _endings(self, method: str) -> dict[Point, str]:
        return {point: spot.ending for point, spot in self.spots.get(method, {}).items()}


def measure(
    x: Axis,
    y: Axis,
    planner: Planner,
    settings: Settings,
    budget: float,
    observer: Observer | None = None,
) -> Map:
    """The map of all methods that the planner has.

    Parameters
    ----------
    budget : [s] after which no further batch of cells is begun
    """
    until = time.monotonic() + budget
    plans: dict[Point, dict[str, Cell]] = {}

    def plan(point: Point) -> dict[str, Cell]:
        if point not in plans:
            cells = planner([x.setting(point[0]), y.setting(point[1])])
            plans[point] = {cell.solver.name: cell for cell in cells}
        return plans[point]

    plan((len(x.words) - 1, len(y.words) - 1))  # words that are wrong fail here
    methods = list(plan((0, 0)))
    found = Map(x, y, {method: {} for method in methods})
    while True:
        asked = {(method, point) for method in methods for point in found.wanted(method)}
        if not asked or time.monotonic() > until:
            found.open = len(asked)
            return found
        cells = {(method, point): plan(point)[method] for method, point in sorted(asked)}
        Runner(settings, observer).run(list(cells.values()))
        spots = read_spots(settings.folder, [cell.key for cell in cells.values()])
        for (method, point), cell in cells.items():
            found.spots[method][point] = spots[cell.key]


def read_spots(folder: Path, keys: Sequence[str]) -> dict[str, Spot]:
    """What became of the cells with these keys, which have all been run."""
    rows = latest_runs(folder)
    runs = pd.DataFrame([rows[key] for key in keys])
    counted = runs.columns.difference(WORDS)
    runs = runs.assign(**{c: pd.to_numeric(runs[c].replace("", nan)) for c in counted})
    steps = numbers(pd.DataFrame(latest_steps(folder), columns=list(STEP_COLUMNS)))
    own = dict(iter(steps.groupby("cell")))
    none = steps.iloc[:0]
    return {run["cell"]: _spot(run, own.get(run["cell"], none)) for _, run in runs.iterrows()}


def _spot(run: pd.Series, steps: pd.DataFrame) -> Spot:
    end, done = finish(run, steps), int(run["steps_done"])
    failed = steps.loc[~steps["outcome"].isin(COUNT), "step"]
    first = None if end.counts else int(failed.min()) if len(failed) else done + 1
    share = (done - failed.nunique()) / int(run["steps_asked"])
    return Spot(str(run["cell"]), end.ending, end.why, first, share, timing(steps).median)
