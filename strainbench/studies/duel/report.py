"""The outcome of a duel: one table, read and as CSV."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import isnan

import numpy as np

from strainbench.document import Column, Document, Prose, Table
from strainbench.report.machine import machine_line
from strainbench.report.numbers import power
from strainbench.studies.duel.measure import FACTORISATION, IMPLICIT_EULER
from strainbench.studies.duel.racer import Racer

EXPLANATION = (
    "One thread; the methods take turns on each frame, in one process. Seconds are the median "
    "of all projections, with their quartiles; set-up is apart. Times faster is the first "
    "method's median over that of the row; CPU is the process's own time, which another's load "
    "changes less. Violation, gap and distance to the optimum are the referee's, the worst over "
    "the frames."
)
VERSIONS = (
    "Each version has a process of its own, and they take turns. Times faster is "
    "the other's CPU time over this one's in the same turn, the median of all turns; by the clock "
    "the same of seconds. Apart is how far the answers differ, the largest of all coordinates."
)
CSV_HEADER = (
    *("method", "setup_seconds", "seconds", "first_quartile", "third_quartile", "times_faster"),
    *("iterations", "max_violation", "relative_gap", "per_factorisation", "per_implicit_euler"),
    *("projections", "says", "machine", "command", "cpu_seconds", "distance_mm"),
)
HEADER = {
    "method": Column("method", whole=True),
    "setup_seconds": Column("set-up", "s", ".3g"),
    "seconds": Column("projection", "s", ".3g"),
    "quartiles": Column("quartiles"),
    "times_faster": Column("times faster", form=".2f"),
    "iterations": Column("iterations", form="g"),
    "max_violation": Column("violation", form=power),
    "relative_gap": Column("gap", form=power),
    "distance_mm": Column("distance", "mm", ".1g"),
    "per_factorisation": Column("/ factor. + solve", form=".2f"),
    "per_implicit_euler": Column("/ implicit Euler", form=".2f"),
    "cpu_seconds": Column("CPU", "s", ".3g"),
    "says": Column("says"),
}
COMPARED = (
    Column("method", whole=True),
    Column("times faster", form=".2f"),
    Column("quartiles"),
    Column("by the clock", form=".2f"),
    Column("iterations", form="g"),
    Column("before", form="g"),
    Column("apart", "m", power),
)
UNITS = {"per_factorisation": FACTORISATION, "per_implicit_euler": IMPLICIT_EULER}
"""Columns of ratios to the time of something else, and how its entry begins."""


@dataclass(frozen=True)
class Outcome:
    """What a duel measured, and where.

    Parameters
    ----------
    title : the scene and its frames
    command : that made it
    machines : name and facts
    """

    title: str
    command: str
    machines: Mapping[str, Mapping[str, object]]
    entries: Sequence[Racer]

    @property
    def units(self) -> dict[str, float]:
        """[s] of what times are compared with; NaN where it was not measured."""
        return {
            name: next((e.median for e in self.entries if e.label.startswith(start)), float("nan"))
            for name, start in UNITS.items()
        }

    def rows(self) -> Iterator[dict[str, object]]:
        """One an entry, by the columns of CSV_HEADER; NaN where there is nothing."""
        for entry in self.entries:
            values = (
                entry.name,
                entry.setup,
                entry.median,
                *entry.quartiles,
                self.entries[0].median / entry.median,
                entry.iterations,
                entry.worst_violation,
                entry.worst_gap,
                *(entry.median / seconds for seconds in self.units.values()),
                len(entry.seconds),
                "; ".join(entry.unsolved),
                next(iter(self.machines)),
                self.command,
                entry.median_cpu,
                1e3 * entry.worst_distance,
            )
            yield dict(zip(CSV_HEADER, values, strict=True))

    def table(self) -> Table:
        """To be read; columns of units only where these were measured."""
        missing = {name for name, seconds in self.units.items() if isnan(seconds)}
        if not any(entry.cpu for entry in self.entries):
            missing.add("cpu_seconds")
        shown = {name: column for name, column in HEADER.items() if name not in missing}
        rows = (row | {"quartiles": _quartiles(row)} for row in self.rows())
        return Table(
            self.title,
            list(shown.values()),
            [[row[name] for name in shown] for row in rows],
            about=Prose(EXPLANATION),
            command=self.command,
            nothing="-",
        )

    @property
    def pairs(self) -> list[tuple[Racer, Racer]]:
        """The same solver of this version and of another, where there are two."""
        raced = [entry for entry in self.entries if entry.version]
        half = len(raced) // 2
        return list(zip(raced[:half], raced[half:], strict=True))

    def versions(self) -> Table:
        """How much faster each solver became, turn by turn."""
        versions = " over ".join(entry.version for entry in self.pairs[0])
        lines = [_compared(*pair) for pair in self.pairs]
        return Table(versions, COMPARED, lines, about=Prose(VERSIONS), nothing="-")

    def document(self) -> Document:
        """All of it, with command and machine."""
        machines = [machine_line(name, facts) for name, facts in self.machines.items()]
        tables = [replace(self.table(), title=""), *([self.versions()] if self.pairs else [])]
        return Document(f"Duel: {self.title}", [*tables, *machines])

    def cells(self) -> Table:
        """One line an entry."""
        return Table("", CSV_HEADER, [list(row.values()) for row in self.rows()])


def _compared(here: Racer, there: Racer) -> list[object]:
    """A line of the table of versions."""
    cpu, clock = (np.divide(*t) for t in ((there.cpu, here.cpu), (there.seconds, here.seconds)))
    first, third = np.percentile(cpu, [25, 75])
    apart = max(
        float(np.abs(answer.positions - there.answers[k].positions).max())
        for k, answer in here.answers.items()
    )
    quartiles = f"{first:.2f} to {third:.2f}"
    faster = float(np.median(cpu)), quartiles, float(np.median(clock))
    return [here.label, *faster, here.iterations, there.iterations, apart]


def _quartiles(row: Mapping[str, object]) -> str:
    ends = (HEADER["seconds"].text(row[f"{name}_quartile"], "-") for name in ("first", "third"))
    return " to ".join(ends)
