"""A cell by the words of a command line, and as it was from its row in runs.csv."""

from __future__ import annotations

import json
import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TypeVar

from strainbench.bench.cell import Cell, PluginRef, content_of
from strainbench.bench.records import RecordsError, latest_runs
from strainbench.document import Table
from strainbench.fields import same, spelled
from strainbench.options import shown
from strainbench.plugins import nearest
from strainbench.scenario.registry import find_scenario, scenarios_of
from strainbench.scenario.scenario import Scenario
from strainbench.solver.registry import find_solver, solvers_of
from strainbench.solver.solver import Solver
from strainbench.sources import plugin_source

Plugin = TypeVar("Plugin", Solver, Scenario)
SHORTEST = 4  # characters of a key
Row = Mapping[str, str]


def rows_of(folder: Path) -> Sequence[Row]:
    """The newest row of each cell; RecordsError if there is none."""
    rows = list(latest_runs(folder).values())
    if not rows:
        raise RecordsError(f"{folder} holds no results: `strainbench run ... --results {folder}`")
    return rows


def listed(folder: Path) -> Table:
    """The cells that failed, with the numbers that `choose` takes."""
    lines = [
        [number, row["scenario"], row["resolution"], row["limit"], row["solver"], *_failure(row)]
        for number, row in enumerate(rows_of(folder), start=1)
        if row["outcome"] != "optimal"
    ]
    columns = ["cell", "scene", "resolution", "limit", "method", "failure", "since step", "key"]
    return Table("Cells that are not optimal", columns, lines)


def _failure(row: Row) -> tuple[str, str, str]:
    return row["failure"] or row["outcome"], row["failure_step"], row["cell"]


def choose(folder: Path, word: str) -> Row:
    """The row of a cell: by its number, the beginning of its key, or its method if that is one.

    Raises
    ------
    ValueError
        One line that says what is valid.
    """
    rows = rows_of(folder)
    if word.isdecimal() and 1 <= int(word) <= len(rows):
        return rows[int(word) - 1]
    keyed = [row for row in rows if len(word) >= SHORTEST and row["cell"].startswith(word)]
    found = keyed or [row for row in rows if word in (row["solver"], _title(row))]
    if len(found) == 1:
        return found[0]
    if found:
        numbers = ", ".join(str(rows.index(row) + 1) for row in found)
        raise ValueError(f"CELL {shown(word)} is {len(found)} cells: one of {numbers} is valid")
    methods = dict.fromkeys(row["solver"] for row in rows)
    raise ValueError(
        f"CELL {shown(word)}: {folder} has no such cell; a number from 1 to {len(rows)}, a key "
        f"such as {rows[0]['cell']}, or a method of {', '.join(methods)} is valid"
        f"{nearest(word, methods)}"
    )


def _title(row: Row) -> str:
    """What progress and lines of `run` call it, its further settings apart."""
    limit = 100 * float(row["limit"] or "nan")
    return f"{row['scenario']} {row['resolution']} at {limit:.12g}%, {row['solver']}"


def cell_of(row: Row) -> Cell:
    """The cell of a row, with the code of today.

    Raises
    ------
    UnavailableError
        If its solver is not installed.
    ValueError
        One line: a plug-in that is not there any more, or has other settings.
    """
    limit = float(row["time_limit"]) if row["time_limit"] else None
    numbers = int(row["steps_asked"]), float(row["tolerance"]), limit, int(row["threads"] or 1)
    return Cell(_scene(row), _solver(row), row["mode"], *numbers)


def _scene(row: Row) -> PluginRef:
    path = _outside(row["scenario_source"])
    kinds = scenarios_of(path) if path else [find_scenario(row["scenario"])]
    kind = _named(kinds, row["scenario"], path)
    ref = _ref(kind, row["scenario_parameters"], path)
    return PluginRef.of(ref.scenario(), path)


def _solver(row: Row) -> PluginRef:
    path, name = _outside(row["solver_source"]), row["solver"].partition("[")[0]
    if path is None:
        kind: type[Solver] = type(find_solver(name))
    else:
        kind = _named(solvers_of(path), name.partition(" (")[0].removesuffix("-warm"), path)
    ref = _ref(kind, row["solver_parameters"], path)
    return PluginRef.of(ref.solver(), path, row["solver"])


def _outside(source: str) -> str | None:
    """The path of a plug-in that is none of ours."""
    return source if Path(source).is_absolute() else None


def _named(kinds: Sequence[type[Plugin]], name: str, path: str | None) -> type[Plugin]:
    """The class of that name, or of the longest that it begins with, as those of variants do."""
    fitting = [kind for kind in kinds if name.startswith(kind.name)]
    if not fitting:
        raise ValueError(f"{path}: it has no {name} any more, with which the cell was run")
    return max(fitting, key=lambda kind: len(kind.name))


def _ref(kind: type[Scenario | Solver], parameters: str, path: str | None) -> PluginRef:
    """A plug-in with the settings of a row, and the source of today."""
    settings = json.loads(parameters or "{}")
    source = path or plugin_source(kind)
    content = content_of(source, settings.values())
    return PluginRef(kind.name, kind.name, tuple(settings.items()), path, source, content)


def command(cell: Cell) -> str:
    """What repeats a cell, as typed."""
    scene = cell.scenario.scenario()
    run = ["strainbench", "run", cell.scenario.path or scene.name, *_method(cell)]
    run += [w for key, word in _set(scene) for w in ("--set", f"{key}={word}")]
    mode = [] if cell.mode == "simulate" else ["--mode", cell.mode]
    limit = [] if cell.time_limit is None else ["--time-limit", f"{cell.time_limit:g}"]
    run += [*mode, "--steps", str(cell.steps), "--tolerance", f"{cell.tolerance:g}", *limit]
    return shlex.join(run)


def on_frame(cell: Cell, frame: Path) -> str:
    """What solves a saved projection with the same method, as typed."""
    run = ["strainbench", "run", "instance", "--set", f"path={frame}", *_method(cell)]
    return shlex.join([*run, "--tolerance", f"{cell.tolerance:g}"])


def _method(cell: Cell) -> list[str]:
    """The words for a solver and what is set of it."""
    solver = cell.solver.solver()
    words = ["--solver", cell.solver.path or solver.name]
    words += ["--start", "warm"] if solver.starts_warm else []
    own = [f"{solver.name}.{key}={word}" for key, word in _set(solver) if key != "warm"]
    return [*words, *(w for setting in own for w in ("--set", setting))]


def _set(plugin: Scenario | Solver) -> list[tuple[str, str]]:
    """What is not as by default."""
    default = type(plugin)().parameters
    return [(k, spelled(v)) for k, v in plugin.parameters.items() if not same(v, default[k])]
