"""All that a report is, written into its results folder."""

from __future__ import annotations

from pathlib import Path

from strainbench.bench.records import read_machines
from strainbench.document import Document, Prose, Table
from strainbench.document.writers import csv, markdown
from strainbench.progress import Track, untracked
from strainbench.report.charts import draw_charts
from strainbench.report.energy import energy_table
from strainbench.report.failures import failures, failures_document
from strainbench.report.local import local_table
from strainbench.report.page import report_page
from strainbench.report.paper import as_latex, chosen_methods
from strainbench.report.runs import load_runs
from strainbench.report.steps import newest_steps
from strainbench.report.sweep import BEYOND, sweep_tables
from strainbench.report.table import as_markdown, tidy


def write_report(folder: Path, track: Track = untracked) -> list[Path]:
    """Write table1.csv, .md, .tex, what else there is to tell, the charts and index.html."""
    runs = load_runs(folder)
    machines = read_machines(folder)
    charts = draw_charts(folder, runs, newest_steps(folder, runs))
    texts = {
        "table1.csv": csv(Table.of(tidy(runs))),
        "table1.md": as_markdown(runs, machines),
        "table1.tex": as_latex(chosen_methods(runs, None)),
    }
    if swept := sweep_tables(runs):
        texts["sweeps.md"] = markdown(Document("Sweeps", [Prose(BEYOND), *swept]))
    failed = failures(folder, runs)
    if len(failed):
        texts["failures.csv"] = csv(Table.of(failed))
        texts["failures.md"] = markdown(failures_document(failed, runs, machines))
    if (energy := energy_table(folder, runs)).lines:
        texts["energy.md"] = markdown(energy)
    if (local := local_table(folder, runs)).lines:
        texts["local.md"] = markdown(local)
    files = [*texts, *(path.name for path in charts)]
    texts["index.html"] = report_page(folder, runs, failed, machines, files, track)
    for name, text in texts.items():
        (folder / name).write_text(text, encoding="utf-8")
    return [*(folder / name for name in texts), *charts]
