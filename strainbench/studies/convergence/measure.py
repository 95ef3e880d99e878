"""Convergence on one frame: what each solver's iterates are worth, and when it had them.

The frame is recorded as `strainbench export` does, the projections before it answered by the
reference solver. Solvers run one at a time, each in a process of its own (see
`strainbench.studies.convergence.trace`); the referee measures what a process has kept once it has
ended.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from strainbench.arrays import FloatArray
from strainbench.bench.cell import Cell
from strainbench.bench.ending import Ending
from strainbench.bench.isolation import Running
from strainbench.bench.journal import read_events, read_frames
from strainbench.bench.machine import describe_machine, fixed_threads
from strainbench.bench.play import Task
from strainbench.bench.process import family
from strainbench.bench.records import (
    RecordsError,
    open_folder,
    read_rows,
    write_rows,
)
from strainbench.files import locked
from strainbench.problem.export import write_problem
from strainbench.problem.problem import Problem
from strainbench.referee.certificate import certify
from strainbench.referee.reference import content_key, reference_of
from strainbench.report.provenance import remember_study
from strainbench.studies.convergence.trace import trace_cell

CONVERGENCE = "convergence.csv"
MEASURES = ("max_violation", "relative_gap", "distance")
COLUMNS = (
    "problem",
    "scenario",
    "frame",
    "variables",
    "constraints",
    "reference_gap",
    "reference_error",
    "solver",
    "sampled_by",
    "setup_seconds",
    "tolerance",
    "seconds",
    "iterations",
    "status",
    *MEASURES,
    "ending",
    "time_limit",
    "machine",
)
CANDIDATE = "none"
"""The row of this name measures the candidate itself, where every solver starts."""
POLL_SECONDS = 0.02
Rows = list[dict[str, object]]


class Judged:
    """One problem, and the referee's measures of answers to it.

    Parameters
    ----------
    scenario, number : where it comes from
    """

    def __init__(self, problem: Problem, scenario: str, number: int) -> None:
        self.problem, self._reference = problem, reference_of(problem)
        self.facts: dict[str, object] = {
            "problem": content_key(problem),
            "scenario": scenario,
            "frame": number,
            "variables": 3 * len(problem.free),
            "constraints": problem.constraints,
            "reference_gap": self.measures(self._reference.positions)["relative_gap"],
            "reference_error": self._reference.error,
        }

    def measures(self, positions: FloatArray) -> dict[str, object]:
        """What the referee finds at `positions` (n, 3)."""
        found = certify(self.problem, positions, reference=self._reference)
        return {name: getattr(found, name) for name in MEASURES}


def converge(
    cells: Sequence[Cell],
    problem: Problem,
    number: int,
    folder: Path,
    memory_limit_mb: float,
    beside: Sequence[Problem] = (),
) -> Iterator[tuple[Cell, str]]:
    """Run every cell's solver on `problem`; yield each with how it ended, its rows written.

    Rows of other solvers on the same frame stay in the folder.

    Parameters
    ----------
    number : of the frame in its scene
    beside : other frames that the folder may hold

    Raises
    ------
    RecordsError
        If the folder cannot be written to, is in use, or holds another frame.
    """
    open_folder(folder)
    with locked(folder):
        check_folder(folder, [problem, *beside])
        yield from _converge(cells, problem, number, folder, memory_limit_mb)


def _converge(
    cells: Sequence[Cell], problem: Problem, number: int, folder: Path, memory_limit_mb: float
) -> Iterator[tuple[Cell, str]]:
    machine, about = describe_machine(threads=1)
    remember_study(folder, "convergence", machine, about)
    judged = Judged(problem, cells[0].scenario.label, number)
    facts = judged.facts | {"machine": machine}
    start = {"solver": CANDIDATE, "seconds": 0.0, "iterations": 0}
    keep(folder, [facts | start | judged.measures(problem.target)])
    with TemporaryDirectory() as scratch, fixed_threads(1):
        path = Path(scratch) / "frame.npz"
        write_problem(problem, path, "npz", cells[0].scenario.label)
        for k, cell in enumerate(cells):
            if cell.solver.label == CANDIDATE:
                yield cell, "the candidate itself"
                continue
            item = None
            if not cell.solver.unavailable:
                item = run_alone(cell, Path(scratch) / str(k), path, memory_limit_mb)
            rows = samples(judged, cell, item)
            keep(folder, [facts | row for row in rows])
            yield cell, str(rows[-1]["ending"])


def check_folder(folder: Path, problems: Sequence[Problem]) -> None:
    """RecordsError if `folder` holds the convergence on a frame other than these."""
    keys = {content_key(problem) for problem in problems}
    for row in read_rows(folder / CONVERGENCE, COLUMNS):
        if row["problem"] not in keys:
            raise RecordsError(
                f"{folder / CONVERGENCE} is about another frame ({row['scenario']}, projection "
                f"{row['frame']}): give another --results, or move it"
            )


def keep(folder: Path, rows: Rows) -> None:
    """Write down a solver's rows in place of those that it had on the frame."""
    path, own = folder / CONVERGENCE, {name: rows[0][name] for name in ("problem", "solver")}
    others = [r for r in read_rows(path, COLUMNS) if {k: r[k] for k in own} != own]
    write_rows(path, COLUMNS, [*others, *rows])


def run_alone(
    cell: Cell, folder: Path, frame: Path | None, memory_limit_mb: float, task: Task = trace_cell
) -> Running:
    """Run a cell in a process of its own, to its end."""
    with family() as ours:
        item = Running.start(ours, cell, folder, frame, memory_limit_mb, task)
        while not item.has_ended():
            if item.is_ready():
                item.release()
            time.sleep(POLL_SECONDS)
    return item


def samples(judged: Judged, cell: Cell, item: Running | None) -> Rows:
    """A cell's rows; a single one without measures where it kept nothing."""
    events = read_events(item.folder) if item else []
    by_name = {e["event"]: e for e in events}
    same = {
        "solver": cell.solver.label,
        "sampled_by": "iterates" if "iterate" in by_name else "tolerances",
        "setup_seconds": by_name.get("setup", {}).get("seconds", ""),
        "ending": _ending(cell, item, by_name),
        "time_limit": "" if cell.time_limit is None else cell.time_limit,
    }
    return [same | sample for sample in _measured(judged, item, events)] if item else [same]


def _measured(judged: Judged, item: Running, events: list[dict[str, Any]]) -> Rows:
    """All answers, or the last run's iterates and answer; one that says nothing without any."""
    kept = [e for e in events if e["event"] in ("iterate", "answer")]
    runs = [e["tolerance"] for e in kept if e["event"] == "iterate"]
    answers = read_frames(item.folder, len(kept))
    rows: Rows = [
        {k: v for k, v in event.items() if k in COLUMNS} | judged.measures(positions)
        for event, (_, positions) in zip(kept, answers, strict=True)
        if not runs or event["tolerance"] == runs[-1]
    ]
    return rows or [{}]


def _ending(cell: Cell, item: Running | None, events: dict[str, dict[str, Any]]) -> str:
    """Why a cell ended, in words."""
    if item is None:
        return f"{Ending.UNAVAILABLE}: {cell.solver.unavailable}"
    failure = item.ending or events.get("failed", {}).get("reason")
    status = events.get("answer", {}).get("status")
    return failure or (f"it says {status!r}" if status else Ending.SILENT)
