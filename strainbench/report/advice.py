"""Which method reaches an accuracy within a time: from what was measured, and from that alone."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import pandas as pd

from strainbench.bench.cell import PluginRef
from strainbench.bench.mode import replays
from strainbench.bench.settings import Choices
from strainbench.document import Column, Document, Items, Part, Prose, Strong, Table
from strainbench.report.candidate import Candidate, Records
from strainbench.report.measures import factor_text
from strainbench.report.missing import Missing, labelled, missing_cells
from strainbench.report.question import Question

MISSES = 3  # that are named in words
ABOUT = Prose("""\
✓ optimal, ○ within the limits. Times are medians with quartiles over all that had something to do;
the accuracy is the worst of any projection, `<` where it is below what the reference itself is
certified to; × is the factor that is missing.""")


@dataclass(frozen=True)
class Advice:
    """What is to be said of one scene.

    Parameters
    ----------
    label : of the scene
    candidates : that count, those that meet both first
    left_out : rows that do not count, and why not
    missing : what was not measured, if anything
    elsewhere : where the scene was measured
    """

    question: Question
    label: str
    candidates: Sequence[Candidate]
    left_out: Mapping[str, str]
    missing: Missing | None
    elsewhere: Sequence[str]

    @property
    def found(self) -> list[Candidate]:
        """Those that meet both, the fastest first."""
        return [c for c in self.candidates if c.meets]

    @property
    def front(self) -> list[Candidate]:
        """Those that none is both faster and more accurate than."""
        every = self.candidates
        return [c for c in every if not any(other.dominates(c) for other in every)]

    def head(self) -> list[str]:
        """The answer, in sentences."""
        asked = f"{self.label}, {self.question}"
        if not self.candidates and not self.left_out:
            there = f"; there is {', '.join(self.elsewhere)}" if self.elsewhere else ""
            return [f"{asked}: not measured{there}."]
        words = "; ".join(map(self._words, self.found)) or "none of those measured"
        lines = [f"{asked}: {words}."]
        if misses := [c for c in self.candidates if not c.meets][:MISSES]:
            near = "; ".join(f"{c.name} takes {c.missing}" for c in misses)
            lines.append(f"Nearest misses: {near}.")
        if front := "; ".join(map(self._words, sorted(self.front, key=lambda c: c.time.median))):
            lines.append(f"Front, none both faster and more accurate: {front}.")
        return lines

    def _words(self, c: Candidate) -> str:
        """A candidate with its time and its accuracy."""
        asked, budget = self.question.accuracy, self.question.budget
        return f"{c.name} ({budget.text(c.time.median)} {budget.unit}, {c.accuracy} {asked.unit})"

    def table(self) -> Table:
        """All that count."""
        budget, accuracy = self.question.budget, self.question.accuracy
        numbers = (budget.unit, "quartiles", accuracy.unit, "× time", f"× {accuracy.unit}")
        header: list[str | Column] = ["", "method"]
        header += [Column(name, right=True, whole=True) for name in numbers]
        return Table(self.label, header, [self._line(c) for c in self.candidates], about=ABOUT)

    def _line(self, c: Candidate) -> list[str]:
        text = self.question.budget.text
        factors = [factor_text(factor) if factor > 1 else "" for factor in c.factors]
        quartiles = f"{text(c.time.low)}-{text(c.time.high)}"
        name = Strong(c.name) if c.meets else c.name
        return [c.sign, name, text(c.time.median), quartiles, c.accuracy, *factors]

    def foot(self) -> list[str]:
        """What stands behind the table, and what is not in it."""
        lines = [f"Left out: {name}: {fault}." for name, fault in self.left_out.items()]
        busy = [f"{c.name} (load {c.row['load']:.1f})" for c in self.candidates if c.disturbed]
        if busy:
            lines.append(f"Measured beside other work: {', '.join(busy)}.")
        for how, names in self._older().items():
            lines.append(f"Measured {how}: {', '.join(names)}.")
        if self.question.per == "step" and any(replays(c.row["mode"]) for c in self.candidates):
            lines.append("Replayed frames have no physics: their steps are projections alone.")
        if self.missing and (self.candidates or self.left_out):
            lines.append(f"Not measured: {', '.join(self.missing.solvers)}.")
        return [*lines, *([self.missing.command] if self.missing else [])]

    def _older(self) -> dict[str, list[str]]:
        older: dict[str, list[str]] = {}
        for c in self.candidates:
            if c.row["older"]:
                older.setdefault(c.row["older"], []).append(c.name)
        whole = len(self.candidates)
        return {how: ["all of it"] if len(n) == whole else n for how, n in older.items()}

    def document(self) -> Document:
        """All of it."""
        parts: list[Part] = [*self.head(), self.table(), Items(self.foot())]
        return Document(self.label, parts)

    def cells(self) -> Table:
        """A line a row that counts, numbers in SI units."""
        accuracy = self.question.accuracy
        header = ("scene", "solver", "how", "outcome", "seconds", "seconds_low", "seconds_high")
        lines = [
            [
                *(self.label, c.row["solver"], c.how, c.row["outcome"], *c.time[:3], c.reached),
                *(*c.factors, int(c.meets), int(c in self.front), c.row["cell"]),
            ]
            for c in self.candidates
        ]
        named = (accuracy.column, "time_factor", f"{accuracy.noun}_factor", "meets", "front")
        return Table("", (*header, *named, "cell"), lines)


def advise(
    question: Question,
    scenario: str,
    scene: PluginRef,
    chosen: Choices,
    records: Records,
    solvers: Iterable[str] | None = None,
) -> Advice:
    """The answer for one scene.

    Parameters
    ----------
    scenario : the word that names it
    chosen : the settings that were given
    solvers : names and files, all if None

    Raises
    ------
    ValueError
        For a method that nobody knows.
    """
    runs = records.runs
    words = labelled(solvers, runs)
    rows = records.about(scene)
    if solvers is not None:
        rows = rows[rows["solver"].isin(words)]
    every = list(records.candidates(rows, question))
    return Advice(
        question,
        scene.label,
        sorted((c for c in every if not c.fault), key=lambda c: c.rank),
        {c.name: c.fault for c in every if c.fault},
        missing_cells(scenario, scene, chosen, words, runs, rows),
        _elsewhere(runs[runs["scenario"] == scene.name]),
    )


def _elsewhere(runs: pd.DataFrame) -> list[str]:
    """Where a scene was measured, a few words each."""
    named = runs[["mesh", "bound"]].drop_duplicates()
    return [" at ".join(filter(None, words)) for words in named.itertuples(index=False)]
