"""What an article takes of a results folder: tables, figures, and a sample that shows them all."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import chain
from pathlib import Path

import pandas as pd

from strainbench.bench.records import RecordsError
from strainbench.document import Picture, Prose, Table
from strainbench.document.latex import latex
from strainbench.report import load_runs
from strainbench.report.charts import (
    Chart,
    Target,
    draw,
    energy,
    growth,
    profiles,
    scores,
    sweep,
    work_precision,
)
from strainbench.report.paper import chosen_columns, chosen_methods, paper_tables
from strainbench.report.steps import newest_steps

FOLDER = "paper"
SHIFT = "shift "
SCORED = "share of cases solved to the optimum, and shifted geometric means of the time"
HELD = 12  # floats that LaTeX is given at a time
HEAD = r"""% How the tables and figures of this folder stand in an article of two columns.
\documentclass[twocolumn]{article}
\usepackage[margin=0.75in,columnsep=0.25in]{geometry}
\usepackage{booktabs,siunitx,graphicx}
\begin{document}"""


def write_paper(folder: Path, methods: str | None, columns: str | None) -> list[Path]:
    """Write table-*.tex, the figures as PDF, and article.tex, a sample that shows them all.

    Parameters
    ----------
    methods, columns : names with commas between; all methods if not given

    Raises
    ------
    ValueError
        For a name that means nothing here, or where there is nothing to show.
    """
    quantities = chosen_columns(columns)
    runs = chosen_methods(load_runs(folder), methods)
    if runs.empty:
        raise RecordsError(f"{folder} holds no method but the unlimited cloth: no table to write")
    written = folder / FOLDER
    written.mkdir(exist_ok=True)
    texts = {
        f"table-{k}.tex": latex([replace(table, label=f"strainbench-{k}")])
        for k, table in enumerate([*paper_tables(runs, quantities), *_scored(folder, runs)], 1)
    }
    figures = []
    for chart in charts(folder, runs):
        figures.append(Picture(Path(f"{chart.name}.pdf"), f"{chart.title}. {chart.caption}"))
        draw(chart, written / f"{chart.name}.pdf")
    texts["article.tex"] = "\n".join([HEAD, *_body(texts, figures), r"\end{document}", ""])
    for name, text in texts.items():
        (written / name).write_text(text, encoding="utf-8")
    return [written / name for name in (*texts, *(figure.path.name for figure in figures))]


def _scored(folder: Path, runs: pd.DataFrame) -> Iterator[Table]:
    """What share each method solves and how fast, narrow enough for a column."""
    for table in scores(runs, newest_steps(folder, runs)):
        header = [
            replace(c, name=c.name.removeprefix(SHIFT), above="ratio at a shift of")
            if c.name.startswith(SHIFT)
            else c
            for c in table.columns
        ]
        notes = [Prose(table.about.replace("`", ""))]
        yield replace(
            table, title=f"{table.title}: {SCORED}.", header=header, about="", notes=notes
        )


def charts(folder: Path, runs: pd.DataFrame) -> Iterator[Chart]:
    """All that there is to draw, energies of more than a second."""
    yield from work_precision(runs, Target.PAPER)
    yield from profiles(runs, newest_steps(folder, runs), Target.PAPER)
    yield from growth(runs, Target.PAPER)
    yield from energy(folder, runs, Target.PAPER, least=1.0)
    yield from chain(*sweep(runs, Target.PAPER).values())


def _body(tables: Iterable[str], figures: Sequence[Picture]) -> Iterable[str]:
    """Each table and figure, some at a time."""
    floats = [rf"\input{{{name.removesuffix('.tex')}}}" for name in tables]
    for place, text in enumerate([*floats, *(latex([figure]).strip() for figure in figures)]):
        yield text
        if place % HELD == HELD - 1:
            yield r"\clearpage"
