"""A folder of instances: written one by one, so that an interrupted one goes on where it ended."""

from __future__ import annotations

import csv
import hashlib
import io
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from strainbench import __version__
from strainbench.bench.cell import Cell
from strainbench.bench.recording import Recording
from strainbench.document import Table
from strainbench.document.writers import csv as as_csv
from strainbench.files import content_of as read_file
from strainbench.files import locked, open_folder, write_whole
from strainbench.problem.export import FORMATS, content_of
from strainbench.problem.limits import StretchLimits
from strainbench.problem.problem import Problem
from strainbench.studies.testset.certificates import Optimum, certified
from strainbench.studies.testset.papers import papers

INDEX, OPTIMA = "index.csv", "optima"
LONGEST_NAME = 80
COLUMNS = (
    *("name", "scene", "frame", "variables", "vertices", "elements", "constraints", "pins"),
    *("weights", "limits", "smallest_limit", "largest_limit", "status", "active", "optimum"),
    *("lower_bound", "relative_gap", "reason", "npz_sha256", "cbf_sha256", "optimum_sha256"),
    *("made_of", "version"),
)
Record = Callable[[Cell, int], Recording]


@dataclass(frozen=True)
class Wanted:
    """An instance to be made: its name, the scene with the solver before, and which projection."""

    name: str
    cell: Cell
    frame: int

    def made_of(self, formats: Sequence[str], scaled: bool) -> str:
        """A digest of what its files depend on."""
        parts = [self.cell.recording_key, self.cell.key, self.frame, *formats, scaled]
        return hashlib.sha256(" ".join(map(str, parts)).encode()).hexdigest()[:16]


def named(cell: Cell, frames: Sequence[int]) -> list[Wanted]:
    """Projections of a cell, named by its scene as it is labelled; a digest where that is long."""
    words = re.sub(r"[^A-Za-z0-9.=]+", "-", cell.scenario.label.replace("%", "pct")).strip("-.")
    if len(words) > LONGEST_NAME:
        words = f"{words[:LONGEST_NAME]}-{cell.key}"
    return [Wanted(f"{words}-{frame:03d}", cell, frame) for frame in frames]


@dataclass(frozen=True)
class Collection:
    """Instances and the folder that they go to.

    Parameters
    ----------
    formats : of FORMATS
    scaled : whether CBF has the units that solvers' defaults cope with
    """

    folder: Path
    title: str
    wanted: Sequence[Wanted]
    formats: Sequence[str] = tuple(FORMATS)
    scaled: bool = False

    def missing(self) -> list[Wanted]:
        """Those that are not there as they would be made now."""
        rows = self._rows()
        return [w for w in self.wanted if not self._is_there(w, rows.get(w.name))]

    def write(self, record: Record) -> Iterator[dict[str, object]]:
        """Make what is missing, a scene at a time; the row of each one that is done.

        Parameters
        ----------
        record : plays a cell's scene up to a projection
        """
        open_folder(self.folder / OPTIMA, "-o")
        with locked(self.folder):
            missing, rows = self.missing(), self._rows()
            for cell, last in _last_frames(missing).items():
                recording = record(cell, last)
                for wanted in (w for w in missing if w.cell == cell):
                    row = self._write_one(wanted, recording.frame(wanted.frame))
                    rows[wanted.name] = row
                    self._write_index(rows)
                    yield row
            self._write_index(rows)
            for name, text in papers(self.title, [*rows.values()], self.scaled).items():
                write_whole(self.folder / name, text.encode())

    def _write_one(self, wanted: Wanted, problem: Problem) -> dict[str, object]:
        where = f"{wanted.cell.scenario.label}, projection {wanted.frame}"
        about = f"{wanted.name}: {where}; strainbench {__version__}"
        optimum = certified(problem)
        row = _facts(problem) | _results(optimum)
        contents = {
            f"{kind}_sha256": (
                self.folder / f"{wanted.name}.{kind}",
                content_of(problem, kind, about, self.scaled),
            )
            for kind in self.formats
            if kind == "npz" or problem.convex
        }
        contents["optimum_sha256"] = self.folder / OPTIMA / f"{wanted.name}.npz", optimum.content()
        for column, (path, content) in contents.items():
            write_whole(path, content)
            row[column] = hashlib.sha256(content).hexdigest()
        row |= {"name": wanted.name, "scene": where.rpartition(",")[0], "frame": wanted.frame}
        row |= {"made_of": wanted.made_of(self.formats, self.scaled), "version": __version__}
        return {column: row.get(column, "") for column in COLUMNS}

    def _write_index(self, rows: Mapping[str, Mapping[str, object]]) -> None:
        """Those wanted in their order, then what else there is."""
        order = dict.fromkeys([*(w.name for w in self.wanted), *rows])
        lines = [[rows[name][c] for c in COLUMNS] for name in order if name in rows]
        write_whole(self.folder / INDEX, as_csv(Table("", COLUMNS, lines)).encode())

    def _rows(self) -> dict[str, dict[str, object]]:
        """The index as it is; one of another form counts as none."""
        text = read_file(self.folder / INDEX).decode(errors="replace")
        reader = csv.DictReader(io.StringIO(text))
        if tuple(reader.fieldnames or ()) != COLUMNS:
            return {}
        return {row["name"]: dict(row) for row in reader if None not in row.values()}

    def _is_there(self, wanted: Wanted, row: Mapping[str, object] | None) -> bool:
        """Whether its files are those of its row, and made of what it would be made of."""
        if row is None or row["made_of"] != wanted.made_of(self.formats, self.scaled):
            return False
        files = {f"{kind}_sha256": self.folder / f"{wanted.name}.{kind}" for kind in FORMATS}
        files["optimum_sha256"] = self.folder / OPTIMA / f"{wanted.name}.npz"
        return all(
            hashlib.sha256(read_file(path)).hexdigest() == row[column]
            for column, path in files.items()
            if row[column]
        )


def _last_frames(missing: Sequence[Wanted]) -> dict[Cell, int]:
    """Each cell, and how far it must be played."""
    last: dict[Cell, int] = {}
    for wanted in missing:
        last[wanted.cell] = max(wanted.frame, last.get(wanted.cell, 0))
    return last


def _facts(problem: Problem) -> dict[str, object]:
    """What can be said of a problem without solving it."""
    limits = problem.limits
    exact = isinstance(limits, StretchLimits) and limits.spectral
    return {
        "variables": 3 * len(problem.free),
        "vertices": problem.vertices,
        "elements": len(problem.elements),
        "constraints": problem.constraints,
        "pins": len(problem.pinned),
        "weights": "unweighted" if problem.mass is None else "mass",
        "limits": "exact" if exact else f"sampled {problem.rows // len(problem.elements)}",
        "smallest_limit": float(np.round(problem.bounds.min() - 1, 12)),
        "largest_limit": float(np.round(problem.bounds.max() - 1, 12)),
    }


def _results(optimum: Optimum) -> dict[str, object]:
    """What is certain of its optimum; nothing where there is none."""
    certain: dict[str, object] = {"status": optimum.status, "reason": optimum.infeasible}
    if optimum.infeasible:
        return certain
    numbers = {
        "optimum": optimum.objective,
        "lower_bound": optimum.lower_bound,
        "relative_gap": optimum.gap,
    }
    known = {name: value for name, value in numbers.items() if np.isfinite(value)}
    return certain | known | {"active": optimum.active}
