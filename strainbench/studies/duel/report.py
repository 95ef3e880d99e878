"""The outcome of a duel: a table for the terminal, Markdown, CSV."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from rich import box
from rich.table import Table

from strainbench import escape
from strainbench.bench.records import open_folder
from strainbench.report.table import machine_line, power
from strainbench.studies.duel.measure import FACTORISATION, IMPLICIT_EULER, Racer

EXPLANATION = (
    "One process, one thread; the methods take turns on each frame. Seconds are the median of all "
    "projections, with their quartiles; set-up is apart. Times faster is the first method's median "
    "over that of the row. Violation and gap are the referee's, the worst over the frames."
)
CSV_HEADER = (
    "method",
    "setup_seconds",
    "seconds",
    "first_quartile",
    "third_quartile",
    "times_faster",
    "iterations",
    "max_violation",
    "relative_gap",
    "per_factorisation",
    "per_implicit_euler",
    "projections",
    "says",
    "machine",
    "command",
)

HEADER = (
    "method",
    "set-up [s]",
    "projection [s]",
    "quartiles",
    "times faster",
    "iterations",
    "violation",
    "gap",
    "/ factor. + solve",
    "/ implicit Euler",
    "says",
)


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

    def rows(self) -> Iterator[dict[str, object]]:
        """One an entry, by the columns of CSV_HEADER; NaN where there is nothing."""
        nan = float("nan")
        units = {
            name: next((e.median for e in self.entries if e.label.startswith(name)), nan)
            for name in (FACTORISATION, IMPLICIT_EULER)
        }
        for entry in self.entries:
            values = (
                entry.label,
                entry.setup,
                entry.median,
                *entry.quartiles,
                self.entries[0].median / entry.median,
                entry.iterations,
                entry.worst_violation,
                entry.worst_gap,
                *(entry.median / seconds for seconds in units.values()),
                len(entry.seconds),
                "; ".join(entry.unsolved),
                next(iter(self.machines)),
                self.command,
            )
            yield dict(zip(CSV_HEADER, values, strict=True))

    def lines(self) -> list[tuple[str, ...]]:
        """Header and cells as text; columns of units only where these were measured."""
        table: list[tuple[str, ...]] = [HEADER]
        for row in self.rows():
            number = {k: v for k, v in row.items() if isinstance(v, float)}
            quartiles = [_text(number[k], ".3g") for k in ("first_quartile", "third_quartile")]
            table.append(
                (
                    str(row["method"]),
                    _text(number["setup_seconds"], ".3g"),
                    _text(number["seconds"], ".3g"),
                    " to ".join(quartiles),
                    _text(number["times_faster"], ".2f"),
                    _text(number["iterations"], "g"),
                    *(_power(number[k]) for k in ("max_violation", "relative_gap")),
                    *(_text(number[k], ".2f") for k in ("per_factorisation", "per_implicit_euler")),
                    str(row["says"]),
                )
            )
        kept = [c for c in zip(*table, strict=True) if c[0][0] != "/" or set(c[1:]) != {"-"}]
        return list(zip(*kept, strict=True))

    def table(self) -> Table:
        """For the terminal."""
        header, *lines = self.lines()
        grid = Table(title=escape.terminal(self.title), title_justify="left", box=box.MARKDOWN)
        for name in header:
            grid.add_column(name, no_wrap=True)
        for line in lines:
            grid.add_row(*map(escape.terminal, line))
        return grid

    def markdown(self) -> str:
        """All of it, with command and machine."""
        header, *lines = self.lines()
        rows = [header, ("---",) * len(header), *(map(escape.markdown, line) for line in lines)]
        parts = [
            f"# Duel: {escape.markdown(self.title)}",
            escape.code(self.command),
            EXPLANATION,
            "\n".join(f"| {' | '.join(row)} |" for row in rows),
            "\n".join(machine_line(name, facts) for name, facts in self.machines.items()),
        ]
        return "\n\n".join(parts) + "\n"

    def csv(self) -> str:
        """One line an entry."""
        buffer = io.StringIO()
        writer = csv.DictWriter(buffer, CSV_HEADER, lineterminator="\n")
        writer.writeheader()
        writer.writerows({k: escape.cell(v) for k, v in row.items()} for row in self.rows())
        return buffer.getvalue()


def _text(value: float, form: str) -> str:
    return "-" if value != value else format(value, form)


def _power(value: float) -> str:
    return "-" if value != value else power(value)


def check_ending(path: Path) -> None:
    """ValueError for a name whose ending says no form."""
    if path.suffix not in (".csv", ".md"):
        raise ValueError(f"-o {path}: a name that ends in .csv, .md is valid")
    open_folder(path.parent, "-o")


def write_outcome(outcome: Outcome, path: Path) -> None:
    """As CSV or Markdown, by what the name ends in."""
    check_ending(path)
    path.write_text(
        outcome.csv() if path.suffix == ".csv" else outcome.markdown(), encoding="utf-8"
    )
