"""From the words of a command line to cells: the cross product of all that is given."""

from __future__ import annotations

import json
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import MISSING, fields, replace
from itertools import product
from math import isqrt
from pathlib import Path
from typing import TypeVar

import psutil

from strainbench.bench.cell import Cell, PluginRef
from strainbench.bench.mode import checked, steps_of
from strainbench.bench.settings import Choices, blaming, combinations, is_file, parse_settings
from strainbench.fields import default_of
from strainbench.options import MOST, shown
from strainbench.plugins import UnavailableError
from strainbench.progress import SceneWarning
from strainbench.scenario.registry import find_scenario, scenarios_of
from strainbench.scenario.scenario import Scenario
from strainbench.solver.registry import find_solver, list_solvers, solvers_of
from strainbench.solver.solver import Solver, warm_twin

Plugin = TypeVar("Plugin", Solver, Scenario)
STARTS = ("cold", "warm")
BYTES_A_CELL = 472
"""Of a square of two triangles, at least: its vertex, its indices, its rows of the constraints."""


def plan_scenarios(words: Sequence[str], choices: Choices) -> list[PluginRef]:
    """The scenarios named, or given as files, with every combination of settings."""
    refs: list[PluginRef] = []
    notes: list[str] = []
    for word in words:
        file = word if is_file(word) else None
        path = str(Path(word).resolve()) if file else None
        for kind in with_defaults(word, scenarios_of(word)) if file else [find_scenario(word)]:
            for settings, spelling in combinations(kind, choices, True, file or ""):
                with blaming(kind.name, file):
                    scene = kind(**settings)
                    check_size(scene)
                    label = scene.labelled(spelling) if spelling else None
                    refs.append(PluginRef.of(scene, path, label))
                    notes += scene.notes()
    for note in dict.fromkeys(notes):
        warnings.warn(note, SceneWarning, stacklevel=2)
    return refs


def check_size(scene: Scenario) -> None:
    """ValueError for a resolution at which the arrays alone are larger than the machine."""
    need = BYTES_A_CELL * scene.resolution**2
    total = psutil.virtual_memory().total
    if need > total:
        raise ValueError(
            f"resolution is {scene.resolution}: its arrays need {need / 1e9:.0f} GB or more and "
            f"this machine has {total / 1e9:.0f}; up to {isqrt(total // BYTES_A_CELL)} is valid"
        )


def split_names(words: Sequence[str]) -> list[str]:
    """The names and paths of a command line; a comma is between two unless a file has it."""
    return [n for w in words for n in ([w] if is_file(w) and Path(w).exists() else w.split(","))]


def plan_solvers(words: Sequence[str], choices: Choices, starts: Sequence[str]) -> list[PluginRef]:
    """The solvers named, or given as files; "all" is every one of ours, unavailable ones too."""
    names = split_names(words)
    if "all" in names:
        ours = [e.name for e in list_solvers()]
        names = [n for name in names for n in (ours if name == "all" else [name])]
    refs: list[PluginRef] = []
    found: list[tuple[str | None, Solver]] = []
    for name in dict.fromkeys(names):
        try:
            made = from_file(name) if is_file(name) else [find_solver(name)]
        except UnavailableError as error:
            refs += [PluginRef(name, name, unavailable=str(error))] if "cold" in starts else []
            continue
        found += [(name if is_file(name) else None, solver) for solver in made]
    for file, solver in found:
        others = {f and Path(f).resolve() for f, s in found if s.name == solver.name}
        where = (
            f" ({'/'.join(Path(file).resolve().parts[-2:])})" if file and len(others) > 1 else ""
        )
        refs += _varied(solver, choices, starts, file, where)
    return list({json.dumps([r.name, r.label, r.identity]): r for r in refs}.values())


def _varied(
    solver: Solver, choices: Choices, starts: Sequence[str], file: str | None, where: str
) -> list[PluginRef]:
    """References to a solver with every combination of settings, cold and warm.

    The label is what was typed: its name, or its variant's, and all that was set.
    """
    path = str(Path(file).resolve()) if file else None
    refs = []
    with blaming(solver.name, file):
        label = str(solver.label).removesuffix("-warm" if solver.starts_warm else "") + where
    for settings, spelling in combinations(type(solver), choices, False, file or ""):
        shown = ",".join(f"{k}={w}" for k, w in spelling.items() if k != "warm")
        named = f"{label}[{shown}]" if shown else label
        with blaming(solver.name, file):
            for s in by_start(replace(solver, **settings), starts):
                refs.append(PluginRef.of(s, path, named + ("-warm" if s.starts_warm else "")))
    return refs


def by_start(solver: Solver, starts: Sequence[str]) -> list[Solver]:
    """The solver as it was named for "cold", and its warm twin, if it has one, for "warm"."""
    cold = [solver] if "cold" in starts else []
    can = solver.starts_warm is not None and "warm" in starts
    return [*cold, warm_twin(solver)] if can else cold


def never_warm(solvers: Sequence[str]) -> list[str]:
    """The names of those solvers that have no warm twin."""
    refs = plan_solvers(solvers, {}, ("cold",))
    return [ref.label for ref in refs if "warm" not in dict(ref.parameters)]


def from_file(file: str) -> list[Solver]:
    """The solvers of a file, as they are by default."""
    found = []
    for kind in with_defaults(file, solvers_of(file)):
        with blaming(kind.name, file):
            found.append(kind())
    return found


def with_defaults(file: str, classes: list[type[Plugin]]) -> list[type[Plugin]]:
    """The plug-ins of a file; ValueError names the fields without a default."""
    for kind in classes:
        with blaming(kind.name, file):
            bare = ", ".join(f.name for f in fields(kind) if f.init and default_of(f) is MISSING)
        if bare:
            has_none = f"{bare} of {kind.__name__} has none"
            raise ValueError(f"{file}: every field needs a default; {has_none}")
    return classes


def steps_for(scene: PluginRef, duration: float | None) -> int:
    """The time steps of a scene that come nearest to `duration` [s], at least one, or its own."""
    if duration is None:
        return scene.scenario().usual_steps
    step = dict(scene.parameters).get("step")
    if not isinstance(step, int | float):
        raise ValueError(f"--duration {duration:g}: no time passes in {scene.name}; give --steps")
    steps = max(1.0, duration / step)
    if steps > MOST:
        raise ValueError(f"--duration {duration:g}: {steps:.3g} steps of {scene.name} are too many")
    return round(steps)


def plan(
    scenarios: Sequence[str],
    solvers: Sequence[str],
    settings: Sequence[str],
    mode: str,
    steps: int | None,
    tolerances: Sequence[float],
    time_limit: float | None,
    duration: float | None = None,
    starts: Sequence[str] = ("cold",),
    threads: int = 1,
    repeats: int = 1,
) -> list[Cell]:
    """All cells of a run; each scene has its own number of steps with a `duration` [s], and where
    neither that nor `steps` is given.

    Parameters
    ----------
    mode : see `strainbench.bench.mode`
    starts : of STARTS; solvers that cannot start warm do so "cold" alone, see `never_warm`.

    Raises
    ------
    ValueError
        One line that names the wrong word and what is valid.
    """
    mode = checked(mode)
    steps = steps_of(mode, steps, duration)
    _check_starts(starts)
    for name, count in (("--steps", steps), ("--threads", threads), ("--repeats", repeats)):
        _check_numbers({name: [count]}, "a whole number")
    times = {"--time-limit": [time_limit], "--duration": [duration]}
    _check_numbers({"--tolerance": tolerances, **times}, "a number")
    choices = parse_settings(settings)
    scenes = plan_scenarios(scenarios, choices)
    methods = plan_solvers(solvers, choices, starts)
    if not methods:
        raise ValueError(f"--start warm: {', '.join(solvers)} cannot start from the frame before")
    _check_owners(choices, [*scenes, *methods])
    counted = [
        (scene, steps if steps and duration is None else steps_for(scene, duration))
        for scene in scenes
    ]
    cells = [
        Cell(scene, method, mode, count, tolerance, time_limit, threads, repeats)
        for (scene, count), method, tolerance in product(counted, methods, tolerances)
    ]
    return list({cell.key: cell for cell in cells}.values())


def _check_starts(starts: Sequence[str]) -> None:
    if not starts or not set(starts) <= set(STARTS):
        raise ValueError(f"--start {shown(','.join(starts))}: valid are cold, warm and cold,warm")


def _check_numbers(options: Mapping[str, Sequence[float | None]], what: str) -> None:
    for name, values in options.items():
        for value in values:
            if value is not None and not 0 < value < float("inf"):
                raise ValueError(f"{name} {value}: {what} above 0 is valid")


def _check_owners(choices: Choices, refs: Sequence[PluginRef]) -> None:
    """ValueError for settings of who is not in the run."""
    owners = {ref.name for ref in refs}
    for owner in choices:
        if owner and owner not in owners:
            valid = ", ".join(sorted(owners))
            raise ValueError(f"--set {owner}.…: {owner!r} is not in this run; valid are {valid}")


def plan_scene(
    scenario: str,
    solvers: Sequence[str],
    settings: Sequence[str],
    steps: int,
    tolerance: float,
    time_limit: float | None = None,
) -> list[Cell]:
    """One scene with one set of values, and its solvers, from the words of a command line.

    Raises
    ------
    ValueError
        One line: a wrong word, or several scenes.
    """
    cells = plan([scenario], solvers, settings, "simulate", steps, [tolerance], time_limit)
    scenes = {str(cell.scenario.identity) for cell in cells}
    if len(scenes) > 1:
        raise ValueError(
            f"--set and {scenario} give {len(scenes)} scenes: one at a time, "
            "so one value a setting is valid"
        )
    return cells


def plan_available(
    scenario: str,
    solvers: Sequence[str],
    settings: Sequence[str],
    steps: int,
    tolerance: float,
    time_limit: float | None = None,
) -> list[Cell]:
    """The same; ValueError for an unavailable solver, with the reason."""
    cells = plan_scene(scenario, solvers, settings, steps, tolerance, time_limit)
    for cell in cells:
        if cell.solver.unavailable:
            raise ValueError(cell.solver.unavailable)
    return cells


def plan_one(
    scenario: str, solver: str, settings: Sequence[str], steps: int, tolerance: float
) -> Cell:
    """The same with a single solver; ValueError names those that the words give."""
    cells = plan_available(scenario, [solver], settings, steps, tolerance)
    if len(cells) > 1:
        labels = ", ".join(cell.solver.label for cell in cells)
        raise ValueError(f"--solver and --set give {len(cells)} solvers ({labels}): one is valid")
    return cells[0]
