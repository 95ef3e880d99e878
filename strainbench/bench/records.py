"""The results folder: runs.csv (a row a cell), steps.csv (a row a projection), machines.json.

Each row is one line. Text that a spreadsheet would take for a formula is written with an
apostrophe before it, which reading takes away. While the rows of a cell are written, `.pending`
holds the sizes of both files before: a process that dies meanwhile leaves a row in both or in none.
"""

from __future__ import annotations

import csv
import io
import json
import logging
import math
import re
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path

from strainbench.bench.columns import FACTS, PROSE, RUN_COLUMNS, STEP_COLUMNS, WORDS
from strainbench.bench.faults import NO_HEADER, header_fault, record_fault, value_fault
from strainbench.bench.faults import SCHEMA as SCHEMA
from strainbench.escape import quoted, unquoted
from strainbench.files import DiskError as DiskError
from strainbench.files import RecordsError as RecordsError
from strainbench.files import (
    append_whole,
    check_held,
    content_of,
    cut,
    disk_errors,
    uninterrupted,
    write_whole,
)
from strainbench.files import open_folder as open_folder

LONGEST_TEXT = 10_000  # characters of what is said in words
RUNS, STEPS, MACHINES, PENDING = "runs.csv", "steps.csv", "machines.json", ".pending"

REPAIR = "nothing was changed; mend or move the file, or give another --results"

Row = dict[str, str]
log = logging.getLogger(__name__)
csv.field_size_limit(2**31 - 1)  # whatever a plug-in had to say


def read_rows(path: Path, columns: Sequence[str]) -> list[Row]:
    """The rows of a CSV of ours, as text; columns that an older one lacks are empty.

    An unfinished last line, and steps whose cell has no row yet, are left out with a word.

    Raises
    ------
    RecordsError
        If the header or a line is not one of ours; the file is left as it is.
    """
    rows, rest = _parsed(path, columns)
    if rest:
        _say(f"{path}: its last line is unfinished and left out")
    return rows


def _parsed(path: Path, columns: Sequence[str]) -> tuple[list[Row], bytes]:
    """The rows of a file, and an unfinished line at its end."""
    content, rest = _finished(path)
    if not content and not ",".join(columns).encode().startswith(rest):
        raise RecordsError(f"{path}, line 1: {NO_HEADER}; {REPAIR}")
    if not content:
        return [], rest
    header, *records = csv.reader(io.StringIO(_decoded(path, content), newline=""))
    if fault := header_fault(header, records, columns):
        raise RecordsError(f"{path}, {fault}; {REPAIR}")
    rows = []
    for number, record in enumerate(records, start=2):
        fault = record_fault(header, record)
        row = dict.fromkeys(columns, "") | dict(zip(header, record, strict=False))
        if fault := fault or value_fault(row):
            raise RecordsError(f"{path}, record {number}{fault}; {REPAIR}")
        rows.append({name: unquoted(v) if name in WORDS else v for name, v in row.items()})
    return rows, rest


def _finished(path: Path) -> tuple[bytes, bytes]:
    """The lines of a file that count, and an unfinished one at its end."""
    content = content_of(path)
    content = content[: _unsettled(path.parent).get(path.name, len(content))]
    end = content.rfind(b"\n") + 1
    return content[:end], content[end:]


def _decoded(path: Path, content: bytes) -> str:
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = 1 + content[: error.start].count(b"\n")
        raise RecordsError(f"{path}, line {line}: not text in UTF-8; {REPAIR}") from None


@cache  # once a process, however often a file is read
def _say(line: str) -> None:
    log.warning(line)


def append_rows(path: Path, columns: Sequence[str], rows: Sequence[Mapping[str, object]]) -> None:
    """Append rows, all or none of them, and flush them to the disk; numbers keep all their digits.

    A file with an older header, or an unfinished last line, is rewritten without.

    Raises
    ------
    RecordsError
        If a value is not one that could be read back, or the disk refuses.
    """
    _prepare(path, columns)
    content = _as_csv(columns, rows, header=not (path.exists() and path.stat().st_size))
    if content:
        append_whole(path, content)


def write_rows(path: Path, columns: Sequence[str], rows: Sequence[Mapping[str, object]]) -> None:
    """The same in place of the rows that a file has: the old ones or the new ones are there."""
    write_whole(path, _as_csv(columns, rows, header=True))


def _as_csv(columns: Sequence[str], rows: Sequence[Mapping[str, object]], header: bool) -> bytes:
    buffer = io.StringIO()
    writer = csv.DictWriter(buffer, columns, lineterminator="\n")
    if header:
        writer.writeheader()
    for row in rows:
        texts = {name: _as_text(name, value) for name, value in row.items()}
        if fault := value_fault(texts):
            raise RecordsError(f"a row to be written{fault}")
        writer.writerow({k: quoted(v) if k in WORDS else v for k, v in texts.items()})
    return buffer.getvalue().encode()


def _as_text(name: str, value: object) -> str:
    """Text on one line that UTF-8 can hold; nothing for NaN and None."""
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return ""
    text = str(value).encode(errors="replace").decode()
    if name in PROSE:
        return " ".join(text.split())[:LONGEST_TEXT]
    return re.sub(r"[\r\n]+", " ", text)


def _prepare(path: Path, columns: Sequence[str]) -> None:
    """Make a file ready to be appended to: an older header becomes today's, rows end whole."""
    with disk_errors(path.parent):
        if not path.exists() or not (size := path.stat().st_size):
            return
        with path.open("rb") as file:
            header = file.readline()
    if header == ",".join(columns).encode() + b"\n" and content_of(path, size - 1) == b"\n":
        return
    rows, rest = _parsed(path, columns)
    if rest:
        _say(f"{path}: its last line was unfinished and is cut away")
    write_rows(path, columns, rows)


def write_cell(
    folder: Path, row: Mapping[str, object], steps: Sequence[Mapping[str, object]]
) -> None:
    """Append a cell's row and those of its steps to a folder that is locked: all, or none."""
    check_held(folder)
    paths = {folder / STEPS: STEP_COLUMNS, folder / RUNS: RUN_COLUMNS}
    with uninterrupted(), disk_errors(folder):
        for path, columns in paths.items():
            append_rows(path, columns, [])
        sizes = {path.name: path.stat().st_size for path in paths}
        write_whole(folder / PENDING, json.dumps(sizes).encode())
        try:
            for (path, columns), rows in zip(paths.items(), (steps, [row]), strict=True):
                append_rows(path, columns, rows)
        finally:
            settle(folder)


def settle(folder: Path) -> None:
    """Take back step rows whose cell got no row in runs.csv."""
    with disk_errors(folder):
        for name, size in _unsettled(folder).items():
            if (folder / name).stat().st_size > size:
                cut(folder / name, size)
        (folder / PENDING).unlink(missing_ok=True)


def _unsettled(folder: Path) -> dict[str, int]:
    """Sizes up to which files count while a cell's rows are not all there; else none."""
    path = folder / PENDING
    content = content_of(path)
    try:
        sizes = {str(name): int(size) for name, size in json.loads(content or b"{}").items()}
    except (ValueError, AttributeError, TypeError):
        raise RecordsError(f"{path}: not a note of ours; {REPAIR}") from None
    written = content_of(folder / RUNS, sizes.get(RUNS, 0))
    return {} if written.endswith(b"\n") else sizes


def mend(folder: Path) -> None:
    """Cut away, with a word, what a dead run left unfinished in a folder that is locked.

    Raises
    ------
    RecordsError
        If there is other damage; nothing is changed then.
    """
    paths = {folder / STEPS: STEP_COLUMNS, folder / RUNS: RUN_COLUMNS}
    for path, columns in paths.items():
        _parsed(path, columns)
    if _unsettled(folder):
        _say(f"{folder}: the rows of a cell were unfinished and are cut away")
    settle(folder)
    for path, columns in paths.items():
        _prepare(path, columns)


def latest_runs(folder: Path) -> dict[str, Row]:
    """The newest row of each cell in `folder`, in the order in which cells first ended."""
    return {row["cell"]: row for row in read_rows(folder / RUNS, RUN_COLUMNS)}


def latest_steps(folder: Path) -> list[Row]:
    """The projections of each cell's newest run; of a cell without a row, none."""
    blocks: dict[str, list[Row]] = {
        cell: [] for cell, row in latest_runs(folder).items() if row["projections"] != "0"
    }
    for row in read_rows(folder / STEPS, STEP_COLUMNS):
        block = blocks.get(row["cell"], [])
        if row["projection"] == "1":
            block.clear()
        block.append(row)
    return [row for block in blocks.values() for row in block]


def remember_machine(folder: Path, name: str, facts: Mapping[str, object]) -> None:
    """Note the facts of a machine under its name."""
    machines = _machines(folder)
    machines[name] = dict(facts)
    write_whole(folder / MACHINES, json.dumps(machines, indent=2).encode() + b"\n")


def read_machines(folder: Path) -> dict[str, dict[str, object]]:
    """Machine names and their facts.

    Raises
    ------
    RecordsError
        If the file is damaged, or a machine lacks one of FACTS.
    """
    machines = _machines(folder)
    for name, facts in machines.items():
        if missing := [key for key in FACTS if key not in facts]:
            raise RecordsError(
                f"{folder / MACHINES}: {name} lacks {', '.join(missing)}; mend or move the file"
            )
    return machines


def _machines(folder: Path) -> dict[str, dict[str, object]]:
    path = folder / MACHINES
    content = content_of(path) if path.exists() else b"{}"
    try:
        machines = json.loads(content.decode("utf-8-sig"))
    except (ValueError, RecursionError) as error:
        raise RecordsError(f"{path}: not JSON ({error}); mend or move the file") from None
    if not isinstance(machines, dict) or not all(isinstance(f, dict) for f in machines.values()):
        raise RecordsError(f"{path}: not a table of machines and their facts; mend or move it")
    return machines
