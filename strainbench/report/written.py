"""All that a report is, written into its results folder."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from strainbench.bench.records import read_machines
from strainbench.document import Document, Prose, Table
from strainbench.document.writers import csv, markdown
from strainbench.progress import Track, untracked
from strainbench.report.charts import Makers, chart_sheets
from strainbench.report.drawing import drawn_beside
from strainbench.report.failures import failures, failures_document
from strainbench.report.local import local_table
from strainbench.report.page import report_page
from strainbench.report.page.races import with_cases
from strainbench.report.paper import as_latex, chosen_methods
from strainbench.report.printed import printed_tables
from strainbench.report.runs import load_runs
from strainbench.report.steps import newest_steps
from strainbench.report.sweep import BEYOND
from strainbench.report.table import as_markdown, tidy


def write_report(folder: Path, track: Track = untracked) -> list[Path]:
    """Write table1.csv, .md, .tex, what else there is to tell, the charts and index.html."""
    runs = load_runs(folder)
    make = Makers.of(folder, with_cases(runs), newest_steps(folder, runs))
    sheets = chart_sheets(folder, make)
    charts = [Path(path) for sheet in sheets for path in sheet.paths]
    with drawn_beside(sheets):
        texts = _texts(folder, runs, make, [path.name for path in charts], track)
        for name, text in texts.items():
            (folder / name).write_text(text, encoding="utf-8")
    return [*(folder / name for name in texts), *charts]


def _texts(
    folder: Path, runs: pd.DataFrame, make: Makers, charts: Sequence[str], track: Track
) -> dict[str, str]:
    """All but the charts' files, by name."""
    machines = read_machines(folder)
    texts = {
        "table1.csv": csv(Table.of(tidy(runs))),
        "table1.md": as_markdown(runs, machines),
        "table1.tex": as_latex(chosen_methods(runs, None)),
    }
    if (printed := printed_tables(runs)).parts:
        texts["table1-paper.md"] = markdown(printed)
    if swept := make.swept():
        texts["sweeps.md"] = markdown(Document("Sweeps", [Prose(BEYOND), *swept]))
    failed = failures(folder, runs)
    if len(failed):
        texts["failures.csv"] = csv(Table.of(failed))
        texts["failures.md"] = markdown(failures_document(failed, runs, machines))
    if (energy := make.energies()).lines:
        texts["energy.md"] = markdown(energy)
    if (local := local_table(folder, runs)).lines:
        texts["local.md"] = markdown(local)
    files = [*texts, *charts]
    texts["index.html"] = report_page(folder, runs, failed, machines, files, make, track)
    return texts
