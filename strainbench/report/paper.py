"""Tables for papers: methods against meshes, with what their notes have to explain."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import pandas as pd

from strainbench.bench.mode import replays
from strainbench.document import Between, Column, Prose, Span, Strong, Table
from strainbench.document.latex import PAGE, latex, width
from strainbench.report.lines import accuracy_of, milliseconds, ranked, time_of
from strainbench.report.measures import COUNT, FEASIBLE, OPTIMAL, OUT_OF_TIME, VIOLATED
from strainbench.report.names import HOW, cells
from strainbench.report.numbers import power
from strainbench.report.rows import Row, rows_of
from strainbench.report.table import UNCONSTRAINED, Group, groups


@dataclass(frozen=True)
class Quantity:
    """What is said of a cell: its columns, their texts, and its words in caption and note."""

    columns: Sequence[Column]
    texts: Callable[[Row], Sequence[str]]
    words: str
    note: str


def _right(name: str, unit: str = "") -> Column:
    return Column(name, unit, right=True)


QUANTITIES = {
    "seconds": Quantity(
        [_right("time", "ms"), Column("")],
        time_of,
        "time a projection",
        "Time: median over projections with active constraints.",
    ),
    "mean": Quantity(
        [_right("mean", "ms")],
        lambda row: [milliseconds(row["solve_seconds_mean"])],
        "mean time a step",
        "Mean: time over all steps, those with nothing to move too.",
    ),
    "violation": Quantity(
        [_right("viol.")],
        lambda row: accuracy_of(row)[:1],
        "violation",
        "Violation: largest excess of a stretch over its bound, worst step.",
    ),
    "gap": Quantity(
        [_right("gap")],
        lambda row: accuracy_of(row)[1:2],
        "relative gap",
        "Gap: objective above a certified lower bound, relative, worst step.",
    ),
    "mm": Quantity(
        [_right("dist.", "mm")],
        lambda row: accuracy_of(row)[2:],
        "distance to the optimum",
        "Distance: farthest vertex, worst step.",
    ),
}
"""What `--columns` names."""
USUAL = ("seconds", "mm")
KINDS = {
    OPTIMAL: "",
    FEASIBLE: "within the limits, but not the projection",
    VIOLATED: "limits violated, or out of time",
}
"""The three groups of methods, by the best that they come to on any mesh, and their words."""
NOT_RUN = "not run"
SMALL = ("no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten")


def as_latex(runs: pd.DataFrame, columns: Sequence[str] = USUAL) -> str:
    """Floats for an article, which needs booktabs and siunitx."""
    return latex(paper_tables(runs, columns))


def paper_tables(runs: pd.DataFrame, columns: Sequence[str] = USUAL) -> list[Table]:
    """A table a group of runs and limit; meshes that are too many for a page go on in the next."""
    chosen = [QUANTITIES[name] for name in columns]
    sheets = [
        Sheet(group, limit, rows, chosen)
        for group in groups(runs)
        for limit, rows in group.by_limit()
    ]
    return [table for sheet in sheets for table in sheet.tables(sheet.meshes)]


def chosen_columns(text: str | None) -> Sequence[str]:
    """The names of quantities, with commas between; the usual ones if not given.

    Raises
    ------
    ValueError
        For a name that is none, or none at all.
    """
    if text is None:
        return USUAL
    names = [name.strip() for name in text.split(",")]
    for name in names:
        if name not in QUANTITIES:
            valid = ", ".join(QUANTITIES)
            raise ValueError(f"--columns {text}: no column called {name!r}; valid are {valid}")
    return list(dict.fromkeys(names))


def chosen_methods(runs: pd.DataFrame, text: str | None) -> pd.DataFrame:
    """The runs of some methods, their names with commas between; all but `none` if not given.

    Raises
    ------
    ValueError
        For a name that no run has.
    """
    there = list(dict.fromkeys(runs["solver"]))
    if text is None:
        return runs[runs["solver"] != UNCONSTRAINED]
    names = [name.strip() for name in re.split(r",(?![^\[]*\])", text)]  # settings have commas too
    for name in names:
        if name not in there:
            valid = ", ".join(there)
            raise ValueError(f"--methods {text}: no method called {name!r}; valid are {valid}")
    return runs[runs["solver"].isin(names)]


@dataclass(frozen=True)
class Sheet:
    """What one table is about: cells alike but for mesh and method."""

    group: Group
    limit: str
    runs: pd.DataFrame
    chosen: Sequence[Quantity]

    @property
    def meshes(self) -> list[str]:
        """Those that some cell has."""
        return [mesh for mesh in self.group.meshes if mesh in set(self.runs["mesh"])]

    @property
    def columns(self) -> list[Column]:
        """Those of one mesh."""
        return [column for quantity in self.chosen for column in quantity.columns]

    def tables(self, meshes: Sequence[str]) -> Iterator[Table]:
        """One table if its columns fit a page, else two."""
        table = self.table(meshes)
        if width(table) <= PAGE or len(meshes) == 1:
            yield table
        else:
            half = (len(meshes) + 1) // 2
            yield from self.tables(meshes[:half])
            yield from self.tables(meshes[half:])

    def table(self, meshes: Sequence[str]) -> Table:
        """Methods in their groups, by time."""
        header = [Column("method")]
        for mesh in meshes:
            header += [
                Column(c.name, c.unit, right=c.right, above=cells(mesh)) for c in self.columns
            ]
        lines: list[list[str]] = []
        here = self.runs[self.runs["mesh"].isin(meshes)]
        on_mesh = {mesh: rows_of(ranked(here[here["mesh"] == mesh])) for mesh in meshes}
        for kind, methods in _kinds(here, meshes).items():
            if methods and KINDS[kind]:
                lines.append([Span.of(KINDS[kind], len(header))])
            lines += [list(self.line(method, on_mesh)) for method in methods]
        return Table(self.caption(), header, lines, notes=self.notes(lines, here))

    def line(self, method: str, on_mesh: Mapping[str, Sequence[Row]]) -> Iterator[str]:
        """A method on each mesh, of whose cells the best is the first; what failed has its reason
        instead of numbers."""
        yield method
        for rows in on_mesh.values():
            row = next((row for row in rows if row["solver"] == method), None)
            if row is None:
                yield Span.of(NOT_RUN, len(self.columns))
                continue
            if row["ending"] not in COUNT:
                yield Span.of(failure(row), len(self.columns))
                continue
            best = row["ending"] == OPTIMAL and rows[0]["solver"] == method
            for quantity in self.chosen:
                first, *others = quantity.texts(row)
                yield from (Strong(first) if best and first else first, *others)

    def caption(self) -> str:
        """What is measured, and of what."""
        first = self.runs.iloc[0]
        what = ", ".join(quantity.words for quantity in self.chosen)
        count, threads = int(first["steps_asked"]), int(first["threads"])
        replayed = "replayed " if replays(first["mode"]) else ""
        about = [
            f"{first['scenario']}",
            f"{self.limit} limit" if self.limit else "",
            f"{_few(count)} {replayed}{_step(first)}{'s' if count > 1 else ''}",
            f"{_few(threads)} thread{'s' if threads > 1 else ''}",
            *(f"{limit:g} s a cell" for limit in self.runs["time_limit"].dropna().unique()),
            first["apart"].removesuffix(HOW["steps_asked"].format(count)).removesuffix(", "),
        ]
        return f"{what.capitalize()}: {', '.join(filter(None, about))}."

    def notes(self, lines: Sequence[Sequence[str]], here: pd.DataFrame) -> list[str]:
        """A sentence for each quantity and each mark that the lines have."""
        texts = [text for line in lines for text in line]
        first = here.iloc[0]
        violation, gap = (power(first[f"{name}_threshold"]) for name in ("violation", "gap"))
        marks = {
            "Small: third quartile over first.": any(isinstance(t, Between) for t in texts),
            "<: below the error of the reference.": any(t.startswith("<") for t in texts),
            f"Optimal: violation at most {violation}, relative gap at most {gap} on every step.": (
                OPTIMAL in set(here["ending"])
            ),
            "Bold: fastest optimal method.": any(isinstance(t, Strong) for t in texts),
            "local: limits from below, of whose optimum nothing is known.": "local" in texts,
            "×: not counted, with what went wrong.": any(t.startswith("×") for t in texts),
        }
        told = [quantity.note for quantity in self.chosen] + [
            t for t, there in marks.items() if there
        ]
        return [Prose(text) for text in told]


def failure(row: Row) -> str:
    """What went wrong in a cell, in a few words."""
    if row["ending"] == OUT_OF_TIME:
        return f"× {row['done']:.0f} of {row['steps_asked']:.0f} {_step(row)}s"
    return f"× {row['why']}"


def _step(row: Row) -> str:
    """What a cell's steps are called."""
    return "frame" if replays(row["mode"]) else "step"


def _few(count: int) -> str:
    return SMALL[count] if count < len(SMALL) else str(count)


def _kinds(runs: pd.DataFrame, meshes: Sequence[str]) -> dict[str, list[str]]:
    """The methods of each group, by their time on the first mesh on which they come to it."""
    kind = runs["ending"].where(runs["ending"].isin(COUNT), VIOLATED)
    order = runs.assign(kind=kind.map(list(KINDS).index), at=runs["mesh"].map(meshes.index))
    order["late"] = order["time"].fillna(order["solve_seconds_mean"])
    best = order.sort_values(["kind", "at", "late"], kind="stable").drop_duplicates("solver")
    return {name: list(best[best["kind"] == place]["solver"]) for place, name in enumerate(KINDS)}
