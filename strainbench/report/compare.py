"""Two results folders, cell by cell: what became faster or slower, better or worse."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from strainbench.bench.load import OTHER_WORK
from strainbench.bench.records import RecordsError, Row, latest_steps
from strainbench.document import Column, Document, Items, Part, Table
from strainbench.report.names import cells, digits
from strainbench.report.pair import SAME, Pair
from strainbench.report.spread import FEWEST, SHARE, interval, repeated
from strainbench.report.versions import shown_runs

MEASURES = ("outcome", "steps_done", "solve_seconds_mean", "max_violation", "relative_gap_max")
HEADER: tuple[str | Column, ...] = (
    *("mesh", "limit", Column("method", whole=True), "outcome", Column("A", "s", whole=True)),
    *(Column("B", "s", whole=True), Column("B/A", whole=True), "violation", "gap"),
)
NARROW = slice(2, 7)
"""Of the header's columns, those that stand on any terminal; a table a mesh and limit then."""
INTERVALS = (
    "Brackets hold the ratio with {share:.0%}, by a bootstrap over repeats; "
    "{apart} of {known} such intervals leave out 1."
)
NO_INTERVALS = (
    "Without three repeats on both sides nothing is known of a ratio's spread: --repeats 5."
)
CSV_HEADER = (
    *SAME,
    *(f"{name}_{side}" for name in MEASURES for side in "ab"),
    "seconds_ratio",
    "ratio_low",
    "ratio_high",
    "only_in",
    "note",
)


@dataclass(frozen=True)
class Comparison:
    """The cells of two folders, those that both have and those that one has."""

    names: tuple[str, str]
    pairs: Sequence[Pair]

    @property
    def matched(self) -> list[Pair]:
        """The cells in both."""
        return [p for p in self.pairs if p.a and p.b]

    def head(self) -> list[str]:
        """Lines above the tables: other machines first."""
        lines = []
        machines = ["; ".join(sorted({r["machine"] for r in rows})) for rows in self._sides()]
        if len(set(machines)) > 1:
            here, there = machines
            lines.append(
                f"The machines differ, so times do not compare: A on {here}; B on {there}."
            )
        elif elsewhere := sum(not p.in_one_place for p in self.matched):
            lines.append(f"{elsewhere} cells ran on other threads or machines: no ratio of times.")
        changed = sum(a["outcome"] != b["outcome"] for a, b in (p.both for p in self.matched))
        lines.append(
            f"A is {self.names[0]}, B is {self.names[1]}: {len(self.matched)} cells in both, "
            f"{changed} with another outcome."
        )
        ratios = np.array([p.ratio for p in self.matched if p.ratio > 0])
        if len(ratios):
            mean = float(np.exp(np.log(ratios).mean()))
            lines.append(
                f"Seconds, B/A: geometric mean {mean:.2f}, from {ratios.min():.2f} to "
                f"{ratios.max():.2f}, over the {len(ratios)} cells finished in both, "
                "on one machine and as many threads."
            )
            known = [p.interval for p in self.matched if p.ratio > 0 and p.interval]
            apart = sum(not low <= 1 <= high for low, high in known)
            about = INTERVALS.format(share=SHARE, apart=apart, known=len(known))
            lines.append(about if known else NO_INTERVALS)
        return [*lines, *self._older()]

    def _older(self) -> Iterator[str]:
        """Which side was measured by code that is not what is installed, and how it differs."""
        for side, rows in (("A", [p.a for p in self.pairs]), ("B", [p.b for p in self.pairs])):
            counts = Counter(row["older"] for row in rows if row and row["older"])
            yield from (f"{n} cells of {side} were measured {how}." for how, n in counts.items())

    def _sides(self) -> Iterator[list[Row]]:
        yield from (list(rows) for rows in zip(*(p.both for p in self.matched), strict=True))

    def changes(self) -> Table:
        """The cells whose outcome is another, the worse ones first."""
        changed = sorted((p for p in self.matched if p.changed), key=lambda p: not p.worse)
        header = ("cell", "", "outcome")
        lines = [[p.title, "worse" if p.worse else "better", p.outcomes] for p in changed]
        return Table("Another outcome", header, lines)

    def tables(self, narrow: bool = False) -> list[Table]:
        """The cells in both, those that are alike in a table.

        Parameters
        ----------
        narrow : a table for each mesh and limit, without accuracies, for which 80 columns do
        """
        alike: dict[tuple[str, ...], list[Pair]] = {}
        for pair in self.matched:
            about = (pair.mesh, pair.limit) if narrow else ()
            alike.setdefault((*pair.alike, *about), []).append(pair)
        kept = NARROW if narrow else slice(None)
        return [
            Table(
                pairs[0].about if narrow else pairs[0].group,
                HEADER[kept],
                [pair.cells()[kept] for pair in pairs],
            )
            for pairs in alike.values()
        ]

    def foot(self) -> list[str]:
        """Lines below the tables."""
        alone: dict[str, list[str]] = {}
        for pair in self.pairs:
            if not (pair.a and pair.b):
                side = f"only in {'A' if pair.a else 'B'}"
                about = f"{side}, {pair.group}, {cells(pair.mesh)}, {pair.limit}"
                alone.setdefault(about, []).append(pair.row["solver"])
        return [
            *(p.note for p in self.matched if p.note),
            *(f"{about}: {', '.join(solvers)}" for about, solvers in alone.items()),
            *self._disturbed(),
        ]

    def _disturbed(self) -> Iterator[str]:
        """Which side was measured beside other work."""
        for side, rows in (("A", [p.a for p in self.pairs]), ("B", [p.b for p in self.pairs])):
            loads = [float(row["load"]) for row in rows if row and row["load"]]
            if busy := [load for load in loads if load > OTHER_WORK]:
                load = f"load {max(busy):.1f} at most"
                yield f"{len(busy)} cells of {side} were measured beside other work: {load}"

    def document(self) -> Document:
        """All of it."""
        parts: list[Part] = [*self.head(), self.changes(), *self.tables(), Items(self.foot())]
        return Document("Two results folders, cell by cell", parts)

    def cells(self) -> Table:
        """One line a cell, those that one folder alone has too."""
        return Table("", CSV_HEADER, [_line(pair) for pair in self.pairs])


def _line(pair: Pair) -> list[object]:
    """The entries of CSV_HEADER."""
    sides = (pair.a, pair.b)
    alone = "" if pair.a and pair.b else "a" if pair.a else "b"
    return [
        *(pair.row[name] for name in SAME),
        *(row[name] if row else "" for name in MEASURES for row in sides),
        pair.ratio if pair.ratio > 0 else "",
        *(pair.interval or ("", "")),
        alone,
        pair.note,
    ]


def compare(first: Path, second: Path) -> Comparison:
    """The rows that both folders show, cell by cell, in the order of the first.

    Raises
    ------
    RecordsError
        If a folder holds no results, or damaged ones.
    """
    sides = []
    for folder in (first, second):
        rows = shown_runs(folder)
        if not rows:
            raise RecordsError(f"{folder} holds no results to compare")
        sides.append({tuple(row[name] for name in SAME): row for row in rows})
    a, b = sides
    precision = digits(row["scenario_parameters"] for side in sides for row in side.values())
    pairs = [Pair(a.get(key), b.get(key), precision) for key in dict.fromkeys([*a, *b])]
    return Comparison((str(first), str(second)), _with_intervals(pairs, first, second))


def _with_intervals(pairs: Sequence[Pair], first: Path, second: Path) -> list[Pair]:
    """The same, with what is known of each ratio's spread."""
    if not any(p.comparable and all(int(r["repeats"]) >= FEWEST for r in p.both) for p in pairs):
        return list(pairs)
    before, after = (repeated(latest_steps(folder)) for folder in (first, second))
    found = []
    for pair in pairs:
        if pair.comparable:
            a, b = pair.both
            sure = interval(before.get(a["cell"], ()), after.get(b["cell"], ()))
            pair = replace(pair, interval=sure)
        found.append(pair)
    return found
