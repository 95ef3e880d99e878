"""The numbers that README.md and results/README.md say were found, and where each can stand.

A *finding* is a number in the cell of a table, or in a sentence one with a decimal point, an
exponent, or what was counted (times, mm, s, iterations ...), outside of code. What stands in the
head of a column or in the first cell of a line is a setting, a power of ten in a sentence a
threshold, and what is *the paper's* is quoted. A finding belongs to the records that its own
paragraph or item links to, else to those of its section; a link to a section of results/README.md
leads to that section's. It is *found* where a number of them is the same at the precision at which
it is told: in the rows of the methods that its line or sentence names, where there are some. A
ratio (times, %) may be the quotient of such a number and another of the same column.

What a command shown in the same paragraph prints, or in a section that links to no record, is left
to that command: somebody would have to run it.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd

from strainbench.report.cited import tables
from strainbench.report.measures import numbers
from strainbench.report.runs import load_runs
from strainbench.report.steps import newest_steps

ROOT = Path(__file__).parent.parent
RESULTS = ROOT / "results"
NUMBER = r"(?<![\w.,/×-])-?\d+(?:,\d{3})*(?:\.\d+)?(?:e-?\d+)?(?![\w/]|\.\d)"
COUNTED = r"(?= (?:times|mm|ms|m|s|mJ|GB|MB|iterations|sweeps|units)\b)"
COHERENT = 2
"""Numbers of a line about methods that a row has to have, where one has so many."""
COMMAND = re.compile(r"`(?:strainbench|make|python|pytest)\b[^`]*`")
MEASURED = (
    *("time", "solve_seconds_mean", "setup_seconds", "iterations_mean", "peak_memory_mb"),
    *("max_violation", "max_principal_stretch", "min_principal_stretch"),
    *("relative_gap_max", "distance_max", "steps_done", "projections_violated"),
)
"""Columns of runs that texts tell; with all others any number would stand somewhere."""
OF_STEPS = ("penetration", "equilibrium_residual", "equilibrium_distance", "total")
ENERGIES = [f"{name}_energy" for name in ("kinetic", "gravity", "membrane", "bending")]
AS_THEY_ARE = {"steps.csv", "times.csv", "failures.csv", "runs.csv", "table1.csv"}
"""CSV that is not read: too long, or read as a folder of runs."""


@dataclass(frozen=True)
class Finding:
    """A number as it is told, and the context that says where it can stand."""

    text: str
    told: str
    names: frozenset[str]
    sources: tuple[Path, ...]
    ratio: bool = False
    line: tuple[str, ...] = ()
    """The numbers of its line, if it stands in a table: a row of a record shares two of them."""

    @property
    def found(self) -> bool:
        """Whether it stands in the records."""
        rows = [row for source in self.sources for row in rows_of(source, self.names)]
        alike = [sum(stands(text, row) for text in self.line) for row in rows]
        most = max(alike, default=0)
        least = min(most, COHERENT) if self.names else 0
        near = [row for row, n in zip(rows, alike, strict=True) if n >= least]
        return any(stands(self.text, row) for row in near) or (self.ratio and self.is_quotient)

    @property
    def is_quotient(self) -> bool:
        """Whether it is that of two numbers of one column, one at least of a named row."""
        columns = (c for source in self.sources for c in columns_of(source, self.names))
        return any(stands(self.text, quotients(*column)) for column in columns)


def stands(text: str, values: np.ndarray) -> bool:
    """Whether one of some numbers is that of a text, at its precision; signs may be left out."""
    value, half = float(text.replace(",", "")), precision(text)
    signed = values if value < 0 else np.abs(values)
    return bool((np.abs(signed - value) <= half).any())


def precision(text: str) -> float:
    """Half a unit of the last digit that is told: of 340 the 4."""
    digits, _, power = text.lstrip("-").replace(",", "").partition("e")
    decimals = len(digits.partition(".")[2])
    zeros = 0 if decimals else len(digits) - len(digits.rstrip("0"))
    last = -decimals if decimals else min(zeros, max(len(digits) - 2, 0))
    return 0.5000001 * 10.0 ** (last + int(power or 0))


def quotients(some: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Of each of some numbers and another, either way."""
    with np.errstate(all="ignore"):
        one = np.divide.outer(some, others).ravel()
        return np.concatenate([one, 1 / one])


@cache
def rows_of(source: Path, names: frozenset[str]) -> list[np.ndarray]:
    """The numbers of each row of a record, or of those that are named, where some are."""
    rows = [row for table in contents(source) for _, row in chosen(table, names).iterrows()]
    found = [np.array([n for cell in row for n in numbers_in(cell)]) for row in rows]
    if source.suffix == ".md":
        return found
    other_unit = 1e3 if source.is_dir() else 1e-3  # runs are in m, s and J, studies in mm
    return [np.concatenate([row, other_unit * row]) for row in found]


@cache
def columns_of(source: Path, names: frozenset[str]) -> list[tuple[np.ndarray, np.ndarray]]:
    """The columns of a record, of named rows; and of those or, where one is named, of all."""
    found = []
    for table in contents(source):
        rows = chosen(table, names)
        for k in range(len(table.columns)):
            some, whole = (
                np.array([n for cell in cells.iloc[:, k] for n in numbers_in(cell)])
                for cells in (rows, rows if len(names) > 1 else table)
            )
            found.append((some, whole))
    return found


def chosen(table: pd.DataFrame, names: frozenset[str]) -> pd.DataFrame:
    """The rows that are named, or all where none is."""
    named = [any(is_of(cell, names) for cell in row) for row in table.itertuples(index=False)]
    return table[named] if any(named) else table


def is_of(cell: object, names: frozenset[str]) -> bool:
    """Whether a cell names one of some methods, with settings or not, or a variant in a file."""
    word = re.split(r"[\s\[]", str(cell))[0]
    after = word not in method_names() and any(word.startswith(f"{name}-") for name in names)
    return word in names or after


@cache
def contents(source: Path) -> list[pd.DataFrame]:
    """The tables of a record; of runs what texts tell of them, of a text what a command printed."""
    if source.is_dir():
        runs = load_runs(source)
        return [runs[["solver", *(name for name in MEASURED if name in runs)]], of_steps(source)]
    if source.suffix != ".md":
        return tables(source)
    printed = re.findall(r"^```.*?\n(.*?)^```", source.read_text(), re.DOTALL | re.MULTILINE)
    return [*tables(source), *(pd.DataFrame({"": text.splitlines()}) for text in printed)]


def of_steps(folder: Path) -> pd.DataFrame:
    """What a scene alone knows of each cell: largest and last."""
    runs = load_runs(folder)
    steps = numbers(newest_steps(folder, runs))
    steps["total"] = steps[ENERGIES].sum(axis=1)
    cells = steps.groupby("cell")[[*OF_STEPS]].agg(["max", "last"])
    cells.columns = [" ".join(column) for column in cells.columns]
    return cells.join(runs.set_index("cell")["solver"]).reset_index(drop=True)


def numbers_in(cell: object) -> list[float]:
    """All numbers in a cell."""
    if isinstance(cell, int | float | np.number):
        return [] if pd.isna(cell) else [float(cell)]
    texts = re.findall(r"-?\d[\d,]*\.?\d*(?:e[-+]?\d+)?", str(cell))
    return [float(text.replace(",", "")) for text in texts]


@cache
def method_names() -> frozenset[str]:
    """What solvers are called."""
    from strainbench.solver.registry import list_solvers

    names = {entry.name for entry in list_solvers()}
    return frozenset(names | {f"{name}-warm" for name in names})


def findings(path: Path) -> Iterator[Finding]:
    """All of a text."""
    sections = re.split(r"^#+ (.*)$", path.read_text(encoding="utf-8"), flags=re.MULTILINE)
    for body in sections[2::2]:
        body = re.sub(r"```.*?```", "", body, flags=re.DOTALL)
        whole = records(path, body)
        for block in re.split(r"\n\n+|\n(?=- )", body):
            own = records(path, block) or whole
            if own and not COMMAND.search(block.partition("|")[0]):
                yield from in_table(block, own) if "\n|" in f"\n{block}" else in_words(block, own)


def in_table(block: str, sources: tuple[Path, ...]) -> Iterator[Finding]:
    """The numbers of a table's cells, but of lines that say how something is measured."""
    for line in [line for line in block.splitlines() if line.startswith("|")][2:]:
        name, *cells = line.strip("|").split("|")
        texts = tuple(text for cell in cells for text in re.findall(NUMBER, plain(cell)))
        for text in () if COMMAND.search(line) else texts:
            yield Finding(text, line, named(name), sources, "times" in name, texts)


def in_words(block: str, sources: tuple[Path, ...]) -> Iterator[Finding]:
    """The numbers of a paragraph or an item that are more than settings."""
    for sentence in re.split(r"(?<=[.:;])\s+", " ".join(block.split())):
        words = plain(sentence)
        for match in re.finditer(rf"({NUMBER})({COUNTED})?", words):
            text, counted = match.groups()
            threshold = re.fullmatch(r"\d+|1e-?\d+", text)
            if words.startswith("%", match.end()):  # a limit
                continue
            if "paper's" not in sentence and (counted is not None or not threshold):
                ratio = words.startswith(" times", match.end())
                yield Finding(text, sentence, named(sentence), sources, ratio)


def plain(text: str) -> str:
    """Without code, the targets of links, and the names of figures, sections and schemes."""
    text = re.sub(r"`[^`]*`|\]\([^)]*\)|!\[[^]]*|[*]", "", text)
    return re.sub(r"(?:Figs?\.|section|Table|Python|line) [\d.]+", "", text)


def named(text: str) -> frozenset[str]:
    """The methods that a line or sentence is about."""
    words = set(re.findall(r"[\w-]+", re.sub(r"\]\([^)]*\)", "", text).lower()))
    return frozenset(words & method_names())


def records(path: Path, text: str) -> tuple[Path, ...]:
    """The records that a text links to, by itself or by a section of results/README.md."""
    found: dict[Path, None] = {}
    for target in re.findall(r"\]\(([\w./#-]+)\)", text):
        file, _, anchor = target.partition("#")
        linked = (path.parent / file).resolve() if file else path
        if anchor and linked == RESULTS / "README.md":
            found |= dict.fromkeys(records(linked, section(linked, anchor)))
        elif linked.is_relative_to(RESULTS) and linked.parent != RESULTS:
            found |= dict.fromkeys(beside(linked))
    return tuple(found)


def section(path: Path, anchor: str) -> str:
    """The text below a heading."""
    parts = re.split(r"^#+ (.*)$", path.read_text(encoding="utf-8"), flags=re.MULTILINE)
    anchors = [re.sub(r"[^\w-]", "", name.lower().replace(" ", "-")) for name in parts[1::2]]
    return parts[2::2][anchors.index(anchor)]


def beside(linked: Path) -> Iterable[Path]:
    """A linked table of a study, or with its folder what a run has left there."""
    folder = linked if linked.is_dir() else linked.parent
    rows = [folder] if (folder / "runs.csv").exists() else []
    files = sorted(p for form in ("*.csv", "*.md") for p in folder.glob(form))
    return rows + [p for p in files if p.name not in AS_THEY_ARE]
