"""Tables and charts from a results folder."""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from strainbench.bench.columns import WORDS
from strainbench.bench.records import RecordsError, read_machines
from strainbench.document import Document, Prose, Table
from strainbench.document.writers import csv, markdown
from strainbench.progress import Track, untracked
from strainbench.report.charts import draw_charts
from strainbench.report.energy import energy_table
from strainbench.report.failures import failures, failures_document
from strainbench.report.measures import measured
from strainbench.report.names import with_names
from strainbench.report.page import report_page
from strainbench.report.steps import newest_steps
from strainbench.report.sweep import BEYOND, sweep_tables
from strainbench.report.table import as_latex, as_markdown, tidy
from strainbench.report.versions import shown_runs


def load_runs(folder: Path) -> pd.DataFrame:
    """The row of each cell that is shown, numbers as numbers; see `strainbench.report.versions`.

    Raises
    ------
    RecordsError
        If there is nothing to report, or the records are damaged.
    """
    rows = shown_runs(folder)
    if not rows:
        raise RecordsError(f"{folder} holds no results: `strainbench run ... --results {folder}`")
    runs = pd.DataFrame(rows)
    for column in runs.columns.difference([*WORDS, "older"]):
        runs[column] = pd.to_numeric(runs[column])
    return with_names(runs)


def write_report(folder: Path, track: Track = untracked) -> list[Path]:
    """Write table1.csv, .md, .tex, what else there is to tell, the charts and index.html."""
    runs = load_runs(folder)
    machines = read_machines(folder)
    steps = newest_steps(folder, runs)
    charts = draw_charts(folder, measured(runs, steps), steps)
    texts = {
        "table1.csv": csv(Table.of(tidy(runs))),
        "table1.md": as_markdown(runs, machines),
        "table1.tex": as_latex(runs),
    }
    if swept := sweep_tables(runs):
        texts["sweeps.md"] = markdown(Document("Sweeps", [Prose(BEYOND), *swept]))
    failed = failures(folder, runs)
    if len(failed):
        texts["failures.csv"] = csv(Table.of(failed))
        texts["failures.md"] = markdown(failures_document(failed, runs, machines))
    if (energy := energy_table(folder, runs)).lines:
        texts["energy.md"] = markdown(energy)
    files = [*texts, *(path.name for path in charts)]
    texts["index.html"] = report_page(folder, runs, failed, machines, files, track)
    for name, text in texts.items():
        (folder / name).write_text(text, encoding="utf-8")
    return [*(folder / name for name in texts), *charts]
