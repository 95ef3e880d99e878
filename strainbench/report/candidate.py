"""What was measured of a scene, as an answer to a question of accuracy and time."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import isfinite, prod
from pathlib import Path

import pandas as pd

from strainbench.bench.cell import PluginRef
from strainbench.bench.columns import STEP_COLUMNS
from strainbench.bench.load import OTHER_WORK
from strainbench.fields import default_of, plain
from strainbench.report.measures import (
    OUT_OF_TIME,
    READ,
    SIGNS,
    VIOLATED,
    Quartiles,
    factor_text,
    finish,
    numbers,
    projections,
    timing,
)
from strainbench.report.names import settings
from strainbench.report.question import DISTANCE, VIOLATION, Question
from strainbench.report.runs import load_runs
from strainbench.report.steps import newest_steps

UNLIMITED = "none"  # the solver that leaves candidates as they are
HOW = {
    "mode": "{}",
    "tolerance": "tolerance {:g}",
    "steps_asked": "{:.0f} steps",
    "threads": "{:.0f} threads",
    "repeats": "{:.0f} repeats",
    "folder": "{}",
}
"""What may set two rows of one method apart, and how it is said."""


@dataclass(frozen=True, eq=False)
class Candidate:
    """A row about the scene.

    Parameters
    ----------
    how : what sets it apart from other rows of its method
    time : seconds a projection, or a step, that had something to do
    reached : the largest of what is asked for; of a distance at least the reference's own error
    known : whether it is more than that error
    fault : why it does not count, or ""
    """

    question: Question
    row: pd.Series
    how: str
    time: Quartiles
    reached: float
    known: bool
    fault: str

    @property
    def sign(self) -> str:
        """Of its outcome."""
        return SIGNS[self.row["outcome"]]

    @property
    def factors(self) -> tuple[float, float]:
        """How many times the budget, and the accuracy asked for, it takes."""
        asked = self.question
        return self.time.median / asked.budget.most, self.reached / asked.accuracy.most

    @property
    def meets(self) -> bool:
        """Whether it is accurate enough and fast enough."""
        return not self.fault and max(self.factors) <= 1

    @property
    def rank(self) -> tuple[float, float]:
        """Those that meet both first, the faster the earlier; then by what is missing."""
        return prod(max(1.0, factor) for factor in self.factors), self.time.median

    @property
    def missing(self) -> str:
        """By which factors it fails, in words."""
        nouns = ("time", self.question.accuracy.noun)
        return " and ".join(
            f"{factor_text(factor, 2 if factor >= 1.1 else 3)}× the {noun}"
            for factor, noun in zip(self.factors, nouns, strict=True)
            if factor > 1
        )

    @property
    def name(self) -> str:
        """The method, and how it was run where that tells it apart."""
        return f"{self.row['solver']} ({self.how})" if self.how else str(self.row["solver"])

    @property
    def accuracy(self) -> str:
        """As it is shown; what is below the reference's own error reads so."""
        return ("" if self.known else "<") + self.question.accuracy.text(self.reached)

    @property
    def disturbed(self) -> bool:
        """Whether other work kept the machine busy meanwhile."""
        return bool(self.row["load"] > OTHER_WORK)

    def dominates(self, other: Candidate) -> bool:
        """Whether it is nowhere worse and somewhere better."""
        ours, theirs = (self.time.median, self.reached), (other.time.median, other.reached)
        return ours != theirs and all(a <= b for a, b in zip(ours, theirs, strict=True))


@dataclass(frozen=True)
class Records:
    """Results folders, read once: their rows, with the folder, and the steps of each cell."""

    runs: pd.DataFrame
    steps: Mapping[tuple[str, str], pd.DataFrame]

    @classmethod
    def of(cls, folders: Sequence[Path]) -> Records:
        """RecordsError where one holds no results."""
        runs = []
        steps: dict[tuple[str, str], pd.DataFrame] = {}
        for folder in dict.fromkeys(folders):
            rows = load_runs(folder)
            runs.append(rows.assign(folder=str(folder)))
            found = numbers(newest_steps(folder, rows)[[*READ, "ie_seconds"]]).groupby("cell")
            steps |= {(str(folder), str(cell)): part for cell, part in found}
        return cls(pd.concat(runs, ignore_index=True), steps)

    def about(self, scene: PluginRef) -> pd.DataFrame:
        """The rows of a scene; a setting that older rows do not name is at its default."""
        asked, kind = dict(scene.parameters), type(scene.scenario())
        same = [
            name.partition(" (")[0] == scene.name and _agree(asked, settings(text), kind)
            for name, text in zip(
                self.runs["scenario"], self.runs["scenario_parameters"], strict=True
            )
        ]
        return self.runs[same]

    def candidates(self, rows: pd.DataFrame, question: Question) -> Iterator[Candidate]:
        """An answer a row, but for the rows of no limits at all."""
        rows = rows[rows["solver"] != UNLIMITED]
        apart = [name for name in HOW if rows[name].nunique() > 1]
        for _, row in rows.iterrows():
            steps = self.steps.get((row["folder"], row["cell"]))
            how = ", ".join(HOW[name].format(row[name]) for name in apart)
            none = pd.DataFrame(columns=list(STEP_COLUMNS))
            yield _candidate(question, row, how, none if steps is None else steps)


def _agree(asked: Mapping[str, object], found: Mapping[str, object], kind: type) -> bool:
    known = all(asked.get(name) == value for name, value in found.items())
    fields = kind.__dataclass_fields__  # type: ignore[attr-defined]
    return known and all(
        value == plain(default_of(fields[name]))
        for name, value in asked.items()
        if name not in found
    )


def _candidate(question: Question, row: pd.Series, how: str, steps: pd.DataFrame) -> Candidate:
    time = Quartiles.of([])
    if len(steps):
        time = timing(steps) if question.per == "projection" else step_timing(row, steps)
    column = question.accuracy.column
    error = row["reference_error_max"] if column == DISTANCE else 0.0
    reached = max(row[column], error)
    known = bool(row[column] >= error)
    fault = _fault(question, row, steps, time, reached)
    return Candidate(question, row, how, time, reached, known, fault)


def step_timing(row: pd.Series, steps: pd.DataFrame) -> Quartiles:
    """Seconds a step that had something to do: its projections, and its physics where played."""
    physics = row["mode"] == "simulate"
    busy = steps[steps["step"].isin(projections(steps)["step"])].groupby("step")
    euler = busy["ie_seconds"].max().fillna(0.0) if physics else 0.0
    return Quartiles.of(busy["seconds"].sum() + euler)


def _fault(
    question: Question, row: pd.Series, steps: pd.DataFrame, time: Quartiles, reached: float
) -> str:
    """Why a row does not count, or ""; a violation asked for may be any."""
    end = finish(row, steps)
    if end.ending == OUT_OF_TIME:
        return f"out of time, {end.done} of {end.planned} steps"
    if not end.counts and not (end.ending == VIOLATED and question.accuracy.column == VIOLATION):
        return end.why
    if not isfinite(reached):
        return f"nothing is known of its {question.accuracy.noun}"
    return "" if time.median > 0 else "nothing had to be projected"
