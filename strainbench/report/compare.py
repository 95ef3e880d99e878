"""Two results folders, cell by cell: what became faster or slower, better or worse."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from strainbench.bench.records import RecordsError, Row
from strainbench.document import Column, Document, Items, Part, Table
from strainbench.report.names import cells, digits
from strainbench.report.pair import SAME, Pair
from strainbench.report.versions import shown_runs

MEASURES = ("outcome", "steps_done", "solve_seconds_mean", "max_violation", "relative_gap_max")
HEADER = (
    *("mesh", "limit", Column("method", whole=True), "outcome", Column("A", "s"), Column("B", "s")),
    *("B/A", "violation", "gap"),
)
CSV_HEADER = (
    *SAME,
    *(f"{name}_{side}" for name in MEASURES for side in "ab"),
    "seconds_ratio",
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
        return [*lines, *self._older()]

    def _older(self) -> Iterator[str]:
        """Which side was measured by code that is not what is installed, and how it differs."""
        for side, rows in (("A", [p.a for p in self.pairs]), ("B", [p.b for p in self.pairs])):
            counts = Counter(row["older"] for row in rows if row and row["older"])
            yield from (f"{n} cells of {side} were measured {how}." for how, n in counts.items())

    def _sides(self) -> Iterator[list[Row]]:
        yield from (list(rows) for rows in zip(*(p.both for p in self.matched), strict=True))

    def tables(self) -> list[Table]:
        """The cells in both, those that are alike in a table."""
        alike: dict[tuple[str, ...], list[Pair]] = {}
        for pair in self.matched:
            alike.setdefault(pair.alike, []).append(pair)
        return [
            Table(pairs[0].group, HEADER, [pair.cells() for pair in pairs])
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
        return [p.note for p in self.matched if p.note] + [
            f"{about}: {', '.join(solvers)}" for about, solvers in alone.items()
        ]

    def document(self) -> Document:
        """All of it."""
        parts: list[Part] = [*self.head(), *self.tables(), Items(self.foot())]
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
    return Comparison((str(first), str(second)), pairs)
