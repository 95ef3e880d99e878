"""What the studies that are programs share: their start, a bar, and the file of what they print."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import typer
from rich.console import Console
from rich.progress import track

from strainbench.bench.machine import describe_machine
from strainbench.document import Code, Document, Table
from strainbench.report.machine import machine_section
from strainbench.report.output import write_output
from strainbench.report.provenance import remember_study
from strainbench.studies.threads import one_thread


def start(run: Callable[..., None]) -> None:
    """Run a study's program on the words of the command line, on one thread."""
    with one_thread():
        typer.run(run)


def watched(items: Iterable[Any], what: str, total: int) -> Iterable[Any]:
    """The items, with a bar on the error stream of a terminal; see `strainbench.progress.Track`."""
    console = Console(stderr=True)
    return track(
        items, what, total, console=console, transient=True, disable=not console.is_terminal
    )


def write_table(output: Path, study: str, title: str, found: Table) -> None:
    """The table as Markdown, with command and machine, or as CSV, with machines.json beside it.

    Parameters
    ----------
    study : its module in strainbench/studies
    """
    machine, facts = describe_machine(threads=1)
    command = shlex.join(["python", "-m", f"strainbench.studies.{study}", *sys.argv[1:]])
    about = machine_section({machine: facts})
    write_output(output, Document(title, [Code(command), found, about]), found)
    if output.suffix == ".csv":
        remember_study(output.parent, study, machine, facts, output.name)
