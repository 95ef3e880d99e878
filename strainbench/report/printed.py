"""Table 1 of Tang et al. (2022) in its own shape: the paper's numbers beside those of a folder."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from math import isfinite, nan
from statistics import fmean

import pandas as pd

from strainbench.bench.mode import replays
from strainbench.document import Column, Document, Prose, Table
from strainbench.report.measures import COUNT, NO_ANSWER, OUT_OF_TIME, VIOLATED, digits, distance_of
from strainbench.report.names import SPANNED, settings
from strainbench.report.numbers import power
from strainbench.report.rows import Row, rows_of

SIZES = (10, 20, 40, 60)
LIMITS = (0.01, 0.1)
EULER = "IE"
PAPER_SECONDS = {
    (EULER, 0.01): (0.017, 0.064, 0.361, 1.318),
    ("SOCP", 0.01): (0.108, 0.285, 1.289, 4.060),
    ("SOCP", 0.1): (0.107, 0.278, 1.242, 3.790),
    ("NLP", 0.01): (0.436, 21.009, nan, nan),
    ("NLP", 0.1): (0.405, 27.001, nan, nan),
    ("GS", 0.01): (0.422, 7.184, 54.725, 100.033),
    ("GS", 0.1): (0.016, 0.238, 6.311, 48.427),
}
"""Table 1 of the paper [s], by method and limit, at SIZES cells a side."""
STARRED = {
    ("NLP", 0.01): (20,),
    ("NLP", 0.1): (20,),
    ("GS", 0.01): (20, 40, 60),
    ("GS", 0.1): (60,),
}
"""Where some steps of the paper's did not converge."""
FAMILIES = {
    "SOCP": ("clarabel-paper", "clarabel-default", "clarabel", "cvxpy", "newton-ipm"),
    "NLP": ("ipopt-default-lbfgs", "ipopt-default", "ipopt"),
    "GS": ("gauss-seidel",),
}
"""Methods here by what the paper calls them, those nearest to its own first."""
SECONDS = (
    "Mean over all steps, without set-up, as in the paper; its own on an i9-7900X with MOSEK and "
    "Ipopt 3.14. `*`: not within the limits on some step; `(n)`: the mean over the n steps that "
    "were done before the clock or a failure ended the cell; `-`: none was."
)
RATIOS = (
    "Seconds over those of implicit Euler, the paper's over its own: unlike seconds, these "
    "compare across machines. Marks as above."
)
DISTANCES = (
    "Of the farthest vertex from the certified optimum, on the worst step; `<`: below what the "
    "reference itself is certain of. In brackets, how far limits are violated where they are not "
    "met, or the steps done."
)
NONE = "-"
Cells = dict[tuple[str, float, int], Row]
Shown = Callable[[Row], str]


def printed_tables(runs: pd.DataFrame) -> Document:
    """Tables of the swing's closed loops, one set for each choice of its other settings.

    Without any cells beside implicit Euler in such a set there is none of it.
    """
    sets = runs[(runs["scenario"] == "swing") & ~runs["mode"].map(replays)]
    sets = sets[sets["resolution"].isin(SIZES) & sets["limit"].isin(LIMITS)]
    others = sets["scenario_parameters"].map(_others)
    parts = [_tables(_cells(same)) for _, same in sets.groupby([others, "steps_asked"], sort=False)]
    return Document("Table 1, as the paper has it", [table for tables in parts for table in tables])


def _others(text: str) -> str:
    """Settings but for those of the table."""
    return json.dumps({k: v for k, v in settings(text).items() if k not in SPANNED}, sort_keys=True)


def _cells(same: pd.DataFrame) -> Cells:
    """By method, limit and size; the first of methods that have several."""
    found: Cells = {}
    for row in rows_of(same):
        found.setdefault((row["solver"], row["limit"], int(row["resolution"])), row)
    return found


def _tables(cells: Cells) -> list[Table]:
    """Seconds, ratios, distances; none where nothing stands beside implicit Euler."""
    if {name for name, *_ in cells} <= {"none"} or not any(name == "none" for name, *_ in cells):
        return []
    euler = _euler(cells)
    theirs = dict(zip(SIZES, PAPER_SECONDS[EULER, 0.01], strict=True))

    def ratio(row: Row) -> str:
        return _marked(row, row["solve_seconds_mean"] / euler.get(int(row["resolution"]), nan))

    return [
        Table(
            "Seconds a step",
            _header("s"),
            [
                ["", "implicit Euler, paper", *_texts(theirs)],
                ["", "implicit Euler", *_texts(euler)],
                *_lines(cells, lambda row: _marked(row, row["solve_seconds_mean"]), paper=dict.get),
            ],
            Prose(SECONDS),
        ),
        Table(
            "Times implicit Euler",
            _header(),
            list(_lines(cells, ratio, paper=lambda of, n: of[n] / theirs[n])),
            Prose(RATIOS),
        ),
        Table(
            "Distance from the optimum", _header("mm"), list(_lines(cells, _away)), Prose(DISTANCES)
        ),
    ]


def _euler(cells: Cells) -> dict[int, float]:
    """Seconds a step of implicit Euler by size: the mean of its runs, as no limit changes them."""
    runs = [(n, row["ie_seconds_mean"]) for (name, _, n), row in cells.items() if name == "none"]
    return {n: fmean(seconds for size, seconds in runs if size == n) for n, _ in runs}


def _header(unit: str = "") -> list[str | Column]:
    return ["limit", "method", *(Column(f"{n}×{n}", unit, right=True) for n in SIZES)]


def _lines(
    cells: Cells, shown: Shown, paper: Callable[..., float] | None = None
) -> Iterator[list[object]]:
    """For each limit and family the paper's line, where it is asked for, then those of here."""
    names = list(dict.fromkeys(name for name, *_ in cells if name != "none"))
    known = [name for family in FAMILIES.values() for name in family]
    families = {**FAMILIES, "": tuple(sorted(set(names).difference(known)))}
    for limit in LIMITS:
        first = f"{limit:.0%}"
        for family, methods in families.items():
            if paper and family:
                of = dict(zip(SIZES, PAPER_SECONDS[family, limit], strict=True))
                starred = STARRED.get((family, limit), ())
                yield [
                    first,
                    f"{family}, paper",
                    *_texts({n: paper(of, n) for n in SIZES}, starred),
                ]
                first = ""
            for name in methods:
                row = [cells.get((name, limit, n)) for n in SIZES]
                if any(cell is not None for cell in row):
                    yield [first, name, *("" if cell is None else shown(cell) for cell in row)]
                    first = ""


def _texts(values: dict[int, float], starred: tuple[int, ...] = ()) -> list[str]:
    """One for each size; a dash for what has no number."""
    texts = {n: digits(v, 3) + "*" * (n in starred) for n, v in values.items() if isfinite(v)}
    return [texts.get(n, NONE if n in values else "") for n in SIZES]


def _marked(row: Row, value: float) -> str:
    """A number with the mark of how its cell ended."""
    if not row["done"] or not isfinite(value):
        return NONE
    star = "*" if row["ending"] == VIOLATED or row["astray"] > 0 else ""
    steps = f" ({row['done']:.0f})" if row["ending"] in (OUT_OF_TIME, NO_ANSWER) else ""
    return digits(value, 3) + star + steps


def _away(row: Row) -> str:
    """Its distance, where it is within the limits."""
    if row["ending"] in COUNT:
        return distance_of(row)
    if row["ending"] in (OUT_OF_TIME, NO_ANSWER):
        return f"({row['done']:.0f})" if row["done"] else NONE
    return f"(by {power(row['max_violation'])})" if isfinite(row["max_violation"]) else NONE
