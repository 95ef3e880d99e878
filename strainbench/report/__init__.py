"""Tables and charts from a results folder."""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from strainbench import escape
from strainbench.bench.columns import WORDS
from strainbench.bench.records import RecordsError, read_machines
from strainbench.report.chart import speed_accuracy
from strainbench.report.energy import draw_energy, energy_markdown
from strainbench.report.failures import failures, failures_markdown
from strainbench.report.names import with_names
from strainbench.report.page import write_page
from strainbench.report.sweep import BEYOND, draw_sweeps, sweep_markdown
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


def write_report(folder: Path) -> list[Path]:
    """Write table1.csv, .md, .tex, the charts and index.html; return their paths."""
    runs = load_runs(folder)
    machines = read_machines(folder)
    paths = {n: folder / n for n in ("table1.csv", "table1.md", "table1.tex", "index.html")}
    tidy(runs).map(escape.cell).to_csv(paths["table1.csv"], index=False)
    markdown = as_markdown(runs, machines)
    paths["table1.md"].write_text(markdown, encoding="utf-8")
    if swept := sweep_markdown(runs):
        paths["sweeps.md"] = folder / "sweeps.md"
        paths["sweeps.md"].write_text(
            f"# Sweeps\n\n{BEYOND}\n\n" + "\n\n".join(swept) + "\n", encoding="utf-8"
        )
    failed = failures(folder, runs)
    if len(failed):
        paths |= {n: folder / n for n in ("failures.csv", "failures.md")}
        failed.map(escape.cell).to_csv(paths["failures.csv"], index=False)
        paths["failures.md"].write_text(failures_markdown(failed, runs, machines), encoding="utf-8")
    if table := energy_markdown(folder, runs):
        paths["energy.md"] = folder / "energy.md"
        paths["energy.md"].write_text(table, encoding="utf-8")
    paths["table1.tex"].write_text(as_latex(runs), encoding="utf-8")
    charts = speed_accuracy(runs, folder / "speed-accuracy") + draw_energy(folder, runs)
    charts += draw_sweeps(folder, runs)
    write_page(paths["index.html"], runs, machines, charts)
    return [*paths.values(), *charts]
