"""The results folder: runs.csv (a row a cell), steps.csv (a row a projection), machines.json."""

from __future__ import annotations

import csv
import io
import json
import math
import os
from collections.abc import Mapping, Sequence
from pathlib import Path

SCHEMA = 1
LONGEST_TEXT = 10_000  # characters of one field
RUNS, STEPS, MACHINES = "runs.csv", "steps.csv", "machines.json"

RUN_COLUMNS = (
    "schema",
    "cell",
    "finished_at",
    "scenario",
    "resolution",
    "limit",
    "directions",
    "integrator",
    "solver",
    "tolerance",
    "mode",
    "steps_asked",
    "steps_done",
    "outcome",
    "reason",
    "solve_seconds_mean",
    "solve_seconds_median",
    "setup_seconds",
    "ie_seconds_mean",
    "iterations_mean",
    "details_mean",
    "max_violation",
    "max_principal_stretch",
    "relative_gap_max",
    "distance_max",
    "distance_bound_max",
    "reference_error_max",
    "projections",
    "projections_violated",
    "projections_optimal",
    "newton_failures",
    "variables",
    "constraints",
    "nonzeros",
    "needs",
    "active_constraints_max",
    "peak_memory_mb",
    "blas_threads",
    "time_limit",
    "violation_threshold",
    "gap_threshold",
    "start_seconds",
    "play_seconds",
    "judge_seconds",
    "scenario_parameters",
    "solver_parameters",
    "machine",
    "threads",
    "solver_source",
    "scenario_source",
    "content",
    "suite",
)
STEP_COLUMNS = (
    "cell",
    "step",
    "projection",
    "outcome",
    "status",
    "seconds",
    "iterations",
    "max_violation",
    "max_principal_stretch",
    "objective",
    "lower_bound",
    "relative_gap",
    "distance",
    "distance_bound",
    "reference_error",
    "active_constraints",
    "details",
    "time",
    "ie_seconds",
    "newton_iterations",
    "newton_converged",
    "assembly_seconds",
    "factorisation_seconds",
    "line_search_seconds",
    "kinetic_energy",
    "gravity_energy",
    "membrane_energy",
    "bending_energy",
    "momentum_x",
    "momentum_y",
    "momentum_z",
    "pin_work",
    "contact_energy",
    "penetration",
    "equilibrium_residual",
    "equilibrium_distance",
)

Row = dict[str, str]


class RecordsError(ValueError):
    """A results folder that cannot be used, in one line."""


def open_folder(folder: Path, option: str = "--results") -> None:
    """Make sure that `folder`, given by `option`, can be written to; RecordsError if not."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        probe = folder / ".writable"
        probe.write_text("")
        probe.unlink()
    except OSError as error:
        raise RecordsError(
            f"{folder} cannot be written to ({error.strerror}): give {option} a folder of yours"
        ) from None


def read_rows(path: Path, columns: Sequence[str]) -> list[Row]:
    """The rows of a CSV of ours, as text.

    Raises
    ------
    RecordsError
        If the header or a line is not one of ours; the file is left as it is.
    """
    if not path.exists():
        return []
    text = path.read_bytes().decode(errors="replace")
    if not text:
        return []
    repair = "nothing was changed; mend or move the file, or give another --results"
    lines = list(csv.reader(io.StringIO(text, newline="")))
    if not lines or lines[0] != list(columns):
        raise RecordsError(
            f"{path}, line 1: the header is not that of schema {SCHEMA}, which starts "
            f"{','.join(columns[:4])}; {repair}"
        )
    for number, line in enumerate(lines[1:], start=2):
        if len(line) != len(columns):
            raise RecordsError(
                f"{path}, record {number} has {len(line)} fields where {len(columns)} are valid; "
                f"{repair}"
            )
    if not text.endswith("\n"):
        raise RecordsError(f"{path}: the last line is cut off; {repair}")
    rows = [dict(zip(columns, line, strict=True)) for line in lines[1:]]
    for number, row in enumerate(rows, start=2):
        if row.get("schema", str(SCHEMA)) != str(SCHEMA):
            found = f"schema {row['schema']!r} where {SCHEMA} is valid"
            raise RecordsError(f"{path}, record {number}: {found}; {repair}")
    return rows


def append_rows(path: Path, columns: Sequence[str], rows: Sequence[Mapping[str, object]]) -> None:
    """Append rows and flush them to the disk; numbers keep all their digits."""
    buffer = io.StringIO()
    writer = csv.DictWriter(buffer, columns, lineterminator="\n")
    if not path.exists() or path.stat().st_size == 0:
        writer.writeheader()
    writer.writerows({k: _plain(v) for k, v in row.items()} for row in rows)
    with path.open("a", encoding="utf-8", newline="") as file:
        file.write(buffer.getvalue())
        file.flush()
        os.fsync(file.fileno())


def _plain(value: object) -> object:
    """Text on one line, of sane length, that UTF-8 can hold; nothing for NaN."""
    if isinstance(value, float) and math.isnan(value):
        return ""
    if not isinstance(value, str):
        return value
    return " ".join(value.encode(errors="replace").decode().split())[:LONGEST_TEXT]


def latest_runs(folder: Path) -> dict[str, Row]:
    """The newest row of each cell in `folder`, in the order in which cells first ended."""
    return {row["cell"]: row for row in read_rows(folder / RUNS, RUN_COLUMNS)}


def remember_machine(folder: Path, name: str, facts: Mapping[str, object]) -> None:
    """Note the facts of a machine under its name."""
    path = folder / MACHINES
    machines = read_machines(folder)
    machines[name] = dict(facts)
    part = path.with_suffix(".part")
    part.write_text(json.dumps(machines, indent=2) + "\n")
    part.replace(path)


def read_machines(folder: Path) -> dict[str, dict[str, object]]:
    """Machine names and their facts."""
    path = folder / MACHINES
    if not path.exists():
        return {}
    try:
        machines = json.loads(path.read_bytes())
    except ValueError as error:
        raise RecordsError(f"{path}: not JSON ({error}); mend or move the file") from None
    if not isinstance(machines, dict) or not all(isinstance(f, dict) for f in machines.values()):
        raise RecordsError(f"{path}: not a table of machines and their facts; mend or move it")
    return machines
