"""The verbs that read results: report, compare."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from strainbench.cli.display import console, errors, say, tracking
from strainbench.cli.options import LOCAL, Columns, FailOn, Folder, Methods, Paper, TableFile
from strainbench.options import WrongWordError, path

if TYPE_CHECKING:
    from strainbench.report.compare import Comparison

BENCHMARKS = ".json"
WIDE = 130  # columns for a comparison with all that there is to say


def report_results(
    results: Folder = LOCAL / "run",
    paper: Paper = False,
    methods: Methods = None,
    columns: Columns = None,
) -> None:
    """Write tables (CSV, Markdown, LaTeX), charts and an HTML page from results.

    Of the JSON that pytest-benchmark writes, its tables, which are shown too, and a chart.
    """
    from strainbench.files import disk_errors

    if not paper and not (methods is None and columns is None):
        raise WrongWordError("--methods, --columns choose what --paper writes: valid with it alone")
    place = results.parent if results.suffix == BENCHMARKS else results
    with disk_errors(place), tracking() as track:
        if results.suffix == BENCHMARKS:
            paths = _perf(results)
        elif paper:
            from strainbench.report.article import write_paper

            paths = write_paper(results, methods, columns)
        else:
            from strainbench.report import write_report

            paths = write_report(results, track)
    for written in paths:
        say(f"wrote {written}")


def _perf(file: Path) -> list[Path]:
    """The report of pytest-benchmark's measurements."""
    from strainbench.document.writers import terminal
    from strainbench.report.perf import ABOUT, read_perf, tables, write_perf

    for table in tables(read_perf(file)):
        console.print(terminal(table))
    say(" ".join(ABOUT.split()))
    return write_perf(file)


def compare_results(
    first: Annotated[Path, typer.Argument(parser=path("A"), help="folder of results, A")],
    second: Annotated[Path, typer.Argument(parser=path("B"), help="folder of results, B")],
    output: TableFile = None,
    fail_on: FailOn = None,
) -> None:
    """Compare two folders of results, cell by cell: changes in outcome, ratios of times."""
    from strainbench.report.compare import compare
    from strainbench.report.gate import Gate
    from strainbench.report.output import write_output

    gates = [Gate.read(word) for word in fail_on or []]
    found = compare(first, second)
    if output is not None:
        write_output(output, found.document(), found.cells())
    _show(found)
    if output is not None:
        say(f"wrote {output}")
    failures = [line for gate in gates for line in gate.failures(found.matched)]
    for line in failures:
        say(f"strainbench: {line}", errors)
    if failures:
        raise typer.Exit(1)


def _show(found: Comparison) -> None:
    """What changed first; ratios on narrow terminals without the accuracies beside."""
    from strainbench.document.writers import terminal

    for line in found.head():
        say(line)
    changes, narrow = found.changes(), console.width < WIDE
    for table in [*([changes] if changes.lines else []), *found.tables(narrow)]:
        console.print(terminal(table))
    if narrow:
        say(f"Violations and gaps: -o FILE, or a terminal of {WIDE} columns.")
    for line in found.foot():
        say(line)
