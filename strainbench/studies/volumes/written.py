"""The study's folder: rows as CSV, and all of them as a document."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import pandas as pd
import typer

from strainbench.bench.machine import describe_machine
from strainbench.bench.records import open_folder, read_machines, remember_machine
from strainbench.document import Code, Document, Table
from strainbench.document.writers import csv, markdown
from strainbench.files import locked, write_whole
from strainbench.report.provenance import remember_study
from strainbench.studies.volumes import (
    beams,
    certificates,
    cousin,
    fig4,
    growth,
    press,
    pressed_by_load,
    pressed_past,
    repeated,
    sweeps,
    violation,
)
from strainbench.studies.volumes.part import Cell, Part, Plan

PARTS = (
    *(fig4.PART, fig4.FREE_PART, fig4.ENFORCED_PART),
    *(violation.PART, violation.TIGHT_PART, sweeps.PART, growth.PART, cousin.PART),
    *(cousin.BEAM_PART, beams.PART, repeated.PART, press.PART, pressed_by_load.PART),
    *(pressed_past.PART, certificates.PART),
)


NAMES = tuple(part.name for part in PARTS)


def measured(part: Part, plan: Plan, folder: Path) -> list[dict[str, object]]:
    """Rows of the plan's cells, those that the folder has from there; then its others.

    The file is written after each cell, and in that order in the end.
    """
    file = folder / f"{part.name}.csv"
    before = known = _read(file)
    found = list[dict[str, object]]()
    for cell in part.cells(plan):
        own = [row for row in known if _is_of(row, cell)]
        known = [row for row in known if row not in own]
        found += own or [_said(part.name, asdict(row)) for row in part.rows(*cell)]
        if not own:
            _write(file, found + known)
    if found + known != before:
        _write(file, found + known)
    return found + known


def _write(file: Path, rows: list[dict[str, object]]) -> None:
    write_whole(file, csv(Table.of(pd.DataFrame(rows))).encode())


def _read(file: Path) -> list[dict[str, object]]:
    """Rows of a CSV file, texts as texts; none where there is no file."""
    if not file.exists():
        return []
    frame = pd.read_csv(file)
    texts = [name for name in frame if not pd.api.types.is_numeric_dtype(frame[name])]
    rows: list[dict[str, object]] = frame.fillna(dict.fromkeys(texts, "")).to_dict("records")
    return rows


def _is_of(row: dict[str, object], cell: Cell) -> bool:
    """Whether the row's first columns are the cell's."""
    return all(
        abs(float(a) - b) < 1e-9 if isinstance(b, float | int) else a == b  # type: ignore[arg-type]
        for a, b in zip(row.values(), cell, strict=False)
    )


def _said(name: str, row: dict[str, object]) -> dict[str, object]:
    typer.echo(f"{name}: " + ", ".join(f"{k} {v}" for k, v in row.items()))
    return row


def document(folder: Path, about: str, command: str) -> Document:
    """All parts that the folder has."""
    rows = ((part, _read(folder / f"{part.name}.csv")) for part in PARTS)
    tables = [part.table(pd.DataFrame(known)) for part, known in rows if known]
    return Document("Limits on principal stretches of volumes", [Code(command), about, *tables])


def write(folder: Path, plan: Plan, parts: Sequence[str], command: str) -> None:
    """Measure what the folder has not, and write rows and tables to it.

    A file that is begun notes the sources that it is measured with; one that goes on keeps its.
    """
    open_folder(folder, "-o")
    asked = [part for part in PARTS if part.name in parts]
    with locked(folder):
        begun = [file for part in asked if not (file := folder / f"{part.name}.csv").exists()]
        try:
            for part in asked:
                measured(part, plan, folder)
        finally:
            name, facts = describe_machine(1)
            if name not in read_machines(folder):
                remember_machine(folder, name, facts)
            for file in filter(Path.exists, begun):
                remember_study(folder, "volumes", name, facts, file.name)
        told = document(folder, f"Measured on {', '.join(read_machines(folder))}.", command)
        write_whole(folder / "volumes.md", markdown(told).encode())


def main(
    step: Annotated[str, typer.Option(help="time steps [ms], with commas")] = "5,20",
    resolution: Annotated[str, typer.Option(help="cells across the beam, with commas")] = "2",
    part: Annotated[str, typer.Option(help=f"of {', '.join(NAMES)}, with commas; all")] = "",
    output: Annotated[Path, typer.Option("--output", "-o")] = Path("results/local/volumes"),
) -> None:
    """Tabulate what limits on principal stretches forbid, and how well they are held."""
    steps = _numbers("--step", step, "milliseconds with commas, such as 5,20,", below=1000.0)
    cells = _numbers(
        "--resolution", resolution, "whole numbers with commas, such as 2,4,", whole=True
    )
    parts = part.split(",") if part else NAMES
    for word in set(parts) - set(NAMES):
        raise SystemExit(f"--part {word}: valid are {', '.join(NAMES)}")
    words = f" --part {part}" if part else ""
    command = (
        f"python -m strainbench.studies.volumes --step {step} --resolution {resolution}{words}"
    )
    plan = Plan([1e-3 * h for h in steps], [int(k) for k in cells])
    try:
        write(output, plan, parts, command)
    except ValueError as error:
        raise SystemExit(f"strainbench.studies.volumes: {error}") from None


def _numbers(
    option: str, given: str, valid: str, below: float = float("inf"), whole: bool = False
) -> list[float]:
    """Numbers above 0 in a text with commas; SystemExit with one line for others."""
    try:
        found = [float(word) for word in given.split(",")]
        if all(0 < k < below and (k == int(k) or not whole) for k in found):
            return found
    except (ValueError, OverflowError):
        pass
    raise SystemExit(f"{option} {given}: {valid} are valid")
