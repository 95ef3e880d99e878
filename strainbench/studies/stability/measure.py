"""Running a map's cells, batch by batch, until its boundaries are known or its budget is spent.

All cells lie in one results folder, as those of `strainbench run`: what has finished is not run
again, and `strainbench report` reads it.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import nan

import pandas as pd

from strainbench.bench.cell import Cell
from strainbench.bench.columns import RUN_COLUMNS, STEP_COLUMNS, WORDS
from strainbench.bench.records import latest_runs, latest_steps
from strainbench.bench.runner import Runner, Settings
from strainbench.progress import Observer
from strainbench.report.measures import COUNT, finish, numbers, timing
from strainbench.studies.stability.axis import Axis
from strainbench.studies.stability.refine import Point, coarseness, inferred, wanted

LONG, FEWEST = 2.0, 40
"""Seconds of a scene's time, and steps: within the longer of them outcomes settle. Counts run out
by step 21, cloth explodes by step 40 (swing, 10 squares)."""
BATCH = 16  # cells a job at most between two looks at the budget
PATIENCE = 2  # steps after the first that violates its limits
Planner = Callable[[Sequence[str]], list[Cell]]
"""The cells of all methods with so many further words of --set."""
Row = Mapping[str, object]


@dataclass(frozen=True)
class Spot:
    """What became of one cell.

    Parameters
    ----------
    ending : one of `strainbench.report.measures.ENDINGS`
    why : in a few words, where it failed
    failure : its kind (`strainbench.bench.failure`), or "" of what is optimal
    step : the first that did not end within the limits, or None
    time : of the scene at that step's end [s]; NaN where it has no end, or no time passes
    share : of the steps that were begun, those that failed
    seconds : median of a projection that had something to do; NaN without any
    """

    cell: str
    ending: str
    why: str
    failure: str
    step: int | None
    time: float
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
    lasts : how long its cells are, in words
    open : points that the refinement still asks for, where the budget ended it
    """

    x: Axis
    y: Axis
    spots: dict[str, dict[Point, Spot]] = field(default_factory=dict)
    open: int = 0
    lasts: str = ""

    @property
    def counted(self) -> str:
        """How many cells were run, and how many that saved, in words."""
        run = sum(len(spots) for spots in self.spots.values())
        whole = self.shape[0] * self.shape[1] * len(self.spots)
        saved = "" if self.open else f": {100 * (1 - run / whole):.0f}% were saved"
        return f"{run} cells were run of the {whole} of the full grids{saved}"

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
    budget : [s] after which no further batch of cells is begun; what the folder has costs none
    """
    until = time.monotonic() + budget
    plans: dict[Point, dict[str, Cell]] = {}
    swept = any("." in axis.key for axis in (x, y))

    def plan(point: Point) -> dict[str, Cell]:
        if point not in plans:
            cells = planner([x.setting(point[0]), y.setting(point[1])])
            plans[point] = {_method(cell, swept): cell for cell in cells}
        return plans[point]

    plan((len(x.words) - 1, len(y.words) - 1))  # words that are wrong fail here
    methods = list(plan((0, 0)))
    found = Map(x, y, {method: {} for method in methods})
    runner = _Noting(settings, observer)

    def batches() -> Iterator[list[Cell]]:
        while asked := {(method, point) for method in methods for point in found.wanted(method)}:
            cells = {(method, point): plan(point)[method] for method, point in asked}
            batch = [at for at, cell in cells.items() if runner.is_finished(cell)]
            if not batch:
                if time.monotonic() > until:
                    found.open = len(asked)
                    return
                batch = sorted(
                    asked, key=lambda at: (-coarseness(found.shape, at[1]), at[1], at[0])
                )[: BATCH * settings.jobs]
            yield [cells[at] for at in batch]
            spots = runner.spots([cells[at].key for at in batch])
            for method, point in batch:
                found.spots[method][point] = spots[cells[method, point].key]

    runner.run_batches(batches())
    return found


def lasting(cells: Sequence[Cell]) -> list[Cell]:
    """The same cells, each as long as its outcome needs to settle: LONG or FEWEST steps."""
    found = []
    for cell in cells:
        step = dict(cell.scenario.parameters).get("step")
        passes = isinstance(step, int | float) and step > 0
        steps = max(FEWEST, round(LONG / float(str(step)))) if passes else FEWEST
        found.append(replace(cell, steps=steps))
    return found


def _method(cell: Cell, swept: bool) -> str:
    """What a method is called in all cells of a map, also where a setting of its own is swept."""
    return cell.solver.label.partition("[")[0] if swept else cell.solver.label


class _Noting(Runner):
    """A runner that notes what it writes: reading the folder again costs more the more it has."""

    def __init__(self, settings: Settings, observer: Observer | None) -> None:
        super().__init__(settings, observer)
        self._noted: dict[str, tuple[Row, Sequence[Row]]] = {}

    def write(self, cell: Cell, row: dict[str, object], steps: Sequence[dict[str, object]]) -> None:
        """Append a cell's rows, and keep them."""
        super().write(cell, row, steps)
        self._noted[cell.key] = row, steps

    def spots(self, keys: Sequence[str]) -> dict[str, Spot]:
        """What became of the cells with these keys, which have all been run."""
        if not self._noted.keys() >= set(keys):
            self._read()
        runs = _table([self._noted[key][0] for key in keys], RUN_COLUMNS)
        counted = runs.columns.difference(WORDS)
        runs = runs.assign(**{c: pd.to_numeric(runs[c].replace("", nan)) for c in counted})
        steps = {key: numbers(_table(self._noted[key][1], STEP_COLUMNS)) for key in keys}
        return {run["cell"]: _spot(run, steps[run["cell"]]) for _, run in runs.iterrows()}

    def _read(self) -> None:
        """Note what the folder has."""
        steps: dict[str, list[Row]] = {}
        for row in latest_steps(self.settings.folder):
            steps.setdefault(row["cell"], []).append(row)
        rows = latest_runs(self.settings.folder)
        self._noted = {key: (row, steps.get(key, [])) for key, row in rows.items()}


def _table(rows: Sequence[Row], columns: Sequence[str]) -> pd.DataFrame:
    """Rows as a file would have them: what has no value is empty."""
    return pd.DataFrame(rows, columns=columns, dtype=object).fillna("")


def _spot(run: pd.Series, steps: pd.DataFrame) -> Spot:
    end, done = finish(run, steps), int(run["steps_done"])
    failed = steps.loc[~steps["outcome"].isin(COUNT)]
    each = set(failed["step"]) | (set() if end.counts or len(failed) else {done + 1})
    first = int(min(each)) if each else None
    begun, there = set(steps["step"]) | each, steps[steps["step"] == first]
    time = float(there["time"].max()) if len(there) else nan
    failure = next(iter(failed["failure"]), "") or run["failure"]
    share, seconds = len(each) / max(1, len(begun)), timing(steps).median
    return Spot(str(run["cell"]), end.ending, end.why, failure, first, time, share, seconds)
