"""What a cell's records come to: its time, how it ended, numbers as texts.

Rows are those of `strainbench.report.load_runs` and `strainbench.report.steps.newest_steps`.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import floor, inf, isfinite, log10, nan
from typing import NamedTuple

import numpy as np
import pandas as pd

from strainbench.bench.columns import STEP_COLUMNS, WORDS
from strainbench.bench.ending import Ending
from strainbench.bench.failure import by_clock
from strainbench.report.numbers import power
from strainbench.report.rows import Row, rows_of
from strainbench.report.versions import NOT_INSTALLED

OPTIMAL, FEASIBLE, VIOLATED = "optimal", "feasible", "violated"
OUT_OF_TIME, NO_ANSWER = "out of time", "no answer"
ENDINGS = (OPTIMAL, FEASIBLE, VIOLATED, OUT_OF_TIME, NO_ANSWER)
"""The better the earlier."""
COUNT = (OPTIMAL, FEASIBLE)
"""Those of which times and distances count."""
SIGNS = {OPTIMAL: "✓", FEASIBLE: "○", VIOLATED: "✗", OUT_OF_TIME: "✗", NO_ANSWER: "✗"}
STEPS = ("steps_asked", "steps_done")
PHYSICS = ("newton_iterations", "newton_converged")
READ = (
    *("cell", "step", "outcome", "status", "seconds", "seconds_each", "active_constraints"),
    *PHYSICS,
)
ASKED = (
    *("cell", "outcome", "reason", "max_violation", *STEPS),
    *("solve_seconds_median", "solve_seconds_mean"),
)
"""Columns of steps, and of runs, that measures are taken of."""
STUCK = "its motion is stuck"
MANY_TIMES = 1e5
NEW = ("ending", "done", "astray", "why", "time", "time_low", "time_high", "time_count")
"""Columns that `measured` adds."""


class Quartiles(NamedTuple):
    """Of `n` values; NaN without any."""

    median: float
    low: float
    high: float
    n: int

    @classmethod
    def of(cls, values: Iterable[float]) -> Quartiles:
        """Of numbers, those that are none apart."""
        known = np.asarray(list(values), float)
        known = known[~np.isnan(known)]
        if not len(known):
            return cls(nan, nan, nan, 0)
        low, median, high = np.quantile(known, [0.25, 0.5, 0.75])
        return cls(float(median), float(low), float(high), len(known))


@dataclass(frozen=True)
class Finish:
    """How a cell ended: one of ENDINGS, steps done of those planned, why in at most four words.

    Parameters
    ----------
    astray : steps done of those that the clock ended that are not within the limits
    """

    ending: str
    done: int
    planned: int
    why: str = ""
    astray: int = 0

    @property
    def sign(self) -> str:
        """✓, ○ or ✗."""
        return SIGNS[self.ending]

    @property
    def counts(self) -> bool:
        """Whether its time and its distance count."""
        return self.ending in COUNT


def numbers(steps: pd.DataFrame) -> pd.DataFrame:
    """Rows of steps.csv with numbers as numbers."""
    columns = [c for c in STEP_COLUMNS if c in steps and c not in WORDS]
    parsed = {c: steps[c].replace("", nan).astype(object).astype(float) for c in columns}
    return steps.assign(**parsed)


def stuck(steps: pd.DataFrame) -> pd.Series[bool]:
    """Where the physics failed before its first iteration: the cloth stays where it was left."""
    iterations, converged = (steps.get(name, pd.Series("", steps.index)) for name in PHYSICS)
    return (iterations == 0) & (converged.astype(str) == "False")


def projections(steps: pd.DataFrame) -> pd.DataFrame:
    """Those that had something to do: with active constraints at the optimum, and not `stuck`."""
    return steps[(steps["active_constraints"] > 0) & ~stuck(steps)]


def timing(steps: pd.DataFrame) -> Quartiles:
    """Seconds a projection, over those that had something to do, all repeats of each."""
    return Quartiles.of(s for each in every_time(projections(steps)) for s in each)


def every_time(steps: pd.DataFrame) -> list[list[float]]:
    """For each projection all its seconds: one, or as many as it was repeated."""
    several = steps["seconds_each"] if "seconds_each" in steps else [""] * len(steps)
    return [
        [float(word) for word in each.split()] if each else [float(once)]
        for once, each in zip(steps["seconds"], several, strict=True)
    ]


def finish(run: Row, steps: pd.DataFrame) -> Finish:
    """How a cell ended; a projection that the clock cut off is no violation, a motion that is
    `stuck` no answer.

    Parameters
    ----------
    steps : of this cell
    """
    asked, done = (0 if pd.isna(run[name]) else int(run[name]) for name in STEPS)
    if run["outcome"] in COUNT:
        still = steps.loc[stuck(steps), "step"]
        if len(still):
            return Finish(NO_ANSWER, int(still.min()) - 1, asked, STUCK)
        return Finish(run["outcome"], done, asked)
    said = list(zip(steps["step"], steps["outcome"], steps["status"], strict=True))
    failed = {step for step, outcome, _ in said if outcome not in COUNT}
    cut_off = {step for step, _, status in said if cut_off_by_clock(status)}
    ended = Ending.of(run["reason"]) is Ending.TIME_LIMIT
    if ended or (run["outcome"] != NO_ANSWER and failed and failed <= cut_off):
        own = sorted(set(steps["step"]) - cut_off)
        whole = own[: max(done, 0)]  # not every solver says that it was cut off
        violated = {step for step, outcome, _ in said if outcome == VIOLATED}
        done = len(whole) if len(steps) else done
        astray = len(violated.intersection(whole))
        why = f"{done} of {asked}" + (f", {astray} violated" if astray else "")
        return Finish(OUT_OF_TIME, done, asked, why, astray)
    if run["outcome"] == NO_ANSWER:
        return Finish(NO_ANSWER, done, asked, cause(run["reason"]))
    return Finish(VIOLATED, done, asked, f"violates by {power(run['max_violation'])}")


def cut_off_by_clock(status: str) -> bool:
    """Whether an answer is what the clock left; MaxTime is what Clarabel calls it."""
    return by_clock(status) or status == "MaxTime"


def cause(reason: str) -> str:
    """Why there is no answer, in at most four words."""
    known = {Ending.UNAVAILABLE: NOT_INSTALLED, Ending.UNSUPPORTED: "refuses the problem"}
    ending = Ending.of(reason)
    if ending is not None:
        return known.get(ending, " ".join(ending.split()[:4]))
    if "not finite" in reason:
        return "not finite"
    return " ".join(reason.partition(":")[0].partition(" (")[0].split()[:4]) or NO_ANSWER


def measured(runs: pd.DataFrame, steps: pd.DataFrame) -> pd.DataFrame:
    """Runs with the columns NEW; a cell without steps has its row's own time.

    Parameters
    ----------
    steps : of all cells, as `newest_steps` has them
    """
    parsed = numbers(steps[[name for name in READ if name in steps]])
    own, none = dict(iter(parsed.groupby("cell"))), parsed.iloc[:0]
    asked = rows_of(runs[[*ASKED]])
    rows = [_measures(run, own.get(run["cell"], none)) for run in asked]
    return runs.assign(**pd.DataFrame(rows, columns=list(NEW), index=runs.index))


def _measures(run: Row, steps: pd.DataFrame) -> tuple[object, ...]:
    """The entries of NEW."""
    end, time = finish(run, steps), timing(steps)
    if steps.empty:
        own = (run["solve_seconds_median"], run["solve_seconds_mean"])
        time = Quartiles.of([s for s in own if s == s][:1])._replace(n=0)
    return (end.ending, end.done, end.astray, end.why, *time)


def digits(value: float, count: int = 2) -> str:
    """A number to `count` significant digits, zeros at the end kept, no powers of ten."""
    if value == 0 or not isfinite(value):
        return f"{value:g}"
    places = count - 1 - floor(log10(abs(float(f"{value:.{count - 1}e}"))))
    return f"{round(value, places):.{max(places, 0)}f}"


def factor_text(factor: float, count: int = 2) -> str:
    """Of how many times: significant digits, with a power of ten where there are very many."""
    if factor < MANY_TIMES or not isfinite(factor):
        return digits(factor, count)
    return f"{factor:.{count - 1}e}".replace("e+0", "e").replace("e+", "e")


def with_unit(value: float, units: Sequence[tuple[float, str]], count: int = 2) -> str:
    """A number in the largest unit of which there is at least one; units from large to small."""
    size, name = next((u for u in units if float(f"{abs(value):.1e}") >= u[0]), units[-1])
    return f"{digits(value / size, count)} {name}"


TIME = ((1.0, "s"), (1e-3, "ms"), (1e-6, "µs"))
LENGTH = ((1000.0, "m"), (10.0, "cm"), (1.0, "mm"), (1e-3, "µm"), (1e-6, "nm"))


def duration(seconds: float) -> str:
    """Two significant digits, in s, ms or µs."""
    return with_unit(seconds, TIME)


def length(mm: float) -> str:
    """Two significant digits, in m, cm, mm, µm or nm."""
    return with_unit(mm, LENGTH)


def distance_text(mm: float, error_mm: float) -> str:
    """Two significant digits in mm; below the error of the reference, that it is below it."""
    if mm != mm:
        return ""
    return f"<{digits(error_mm)}" if mm < error_mm else digits(mm)


def seconds_text(seconds: float) -> str:
    """Two significant digits; nothing where there are none."""
    return digits(seconds) if isfinite(seconds) else ""


def distance_of(row: Row) -> str:
    """A cell's largest distance in mm; nothing where it or the reference's error is unknown."""
    mm, error = 1000 * row["distance_max"], 1000 * row["reference_error_max"]
    return distance_text(mm, error) if isfinite(mm) and error != inf else ""
