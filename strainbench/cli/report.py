"""The verbs that read results: report, compare."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from strainbench.cli.display import console, say, tracking
from strainbench.cli.options import LOCAL, Folder, TableFile
from strainbench.options import path


def report_results(results: Folder = LOCAL / "run") -> None:
    """Write tables (CSV, Markdown, LaTeX), charts and an HTML page from results."""
    from strainbench.files import disk_errors
    from strainbench.report import write_report

    with disk_errors(results), tracking() as track:
        paths = write_report(results, track)
    for written in paths:
        say(f"wrote {written}")


def compare_results(
    first: Annotated[Path, typer.Argument(parser=path("A"), help="folder of results, A")],
    second: Annotated[Path, typer.Argument(parser=path("B"), help="folder of results, B")],
    output: TableFile = None,
) -> None:
    """Compare two folders of results, cell by cell: ratios of times, changes in outcome."""
    from strainbench.document.writers import terminal
    from strainbench.report.compare import compare
    from strainbench.report.output import write_output

    found = compare(first, second)
    if output is not None:
        write_output(output, found.document(), found.cells())
    for line in found.head():
        say(line)
    for table in found.tables():
        console.print(terminal(table))
    for line in [*found.foot(), *([f"wrote {output}"] if output else [])]:
        say(line)
