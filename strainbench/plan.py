"""From the words of a command line to cells: the cross product of all that is given."""

from __future__ import annotations

import csv
import warnings
from collections.abc import Iterable, Sequence
from dataclasses import fields
from itertools import product
from pathlib import Path
from types import UnionType
from typing import Any, Union, get_args, get_origin, get_type_hints

from strainbench.cell import Cell, PluginRef
from strainbench.discovery import (
    UnavailableError,
    find_scenario,
    find_solver,
    list_solvers,
    load_file,
)
from strainbench.scenario import Scenario, SceneWarning
from strainbench.solver import Solver, warm_twin

MODES = ("simulate", "replay")
STARTS = ("cold", "warm")
Choices = dict[str, dict[str, list[str]]]
"""Values by owner ("" where none was named) and key."""


def is_file(word: str) -> bool:
    """Whether a word means a file rather than a name."""
    return word.endswith(".py") or "/" in word


def parse_settings(words: Iterable[str]) -> Choices:
    """`key=v1,v2` and `owner.key=v1,v2`, where the owner is a scenario or a solver."""
    choices: Choices = {}
    for word in words:
        key, equals, values = word.partition("=")
        owner, _, name = key.rpartition(".")
        if not equals or not name or not values:
            raise ValueError(f"--set {word}: KEY=VALUE or KEY=VALUE1,VALUE2 is valid")
        choices.setdefault(owner, {}).setdefault(name, []).extend(split_values(values))
    return choices


def split_values(text: str) -> list[str]:
    """Values between commas; one in double quotes, or that is a file as it stands, keeps its own.

    >>> split_values('"a,b.obj",c.obj')
    ['a,b.obj', 'c.obj']
    """
    if "," in text and Path(text).expanduser().is_file():
        return [text]
    try:
        return next(csv.reader([text], strict=True))
    except csv.Error as error:
        valid = 'V1,V2 or "V1,V2" for one value with a comma is valid'
        raise ValueError(f"--set ...={text!r}: {valid} ({error})") from None


def parse_value(owner: str, key: str, hint: Any, text: str) -> object:
    """A value of a field's type; percentages are numbers too: 1% is 0.01."""
    kinds = get_args(hint) if get_origin(hint) in (UnionType, Union) else (hint,)
    try:
        if type(None) in kinds and text.lower() == "none":
            return None
        if bool in kinds:
            return {"true": True, "false": False}[text.lower()]
        if int in kinds and (str not in kinds or text.lstrip("-").isdigit()):
            return int(text)
        if float in kinds:
            return float(text[:-1]) / 100 if text.endswith("%") else float(text)
    except (KeyError, ValueError):
        names = " or ".join("none" if k is type(None) else k.__name__ for k in kinds)
        raise ValueError(f"--set {owner}.{key}={text}: the value must be {names}") from None
    return text


def variations(plugin: type[Scenario] | Solver, choices: Choices, shared: bool) -> list[Any]:
    """A plug-in with every combination of the values chosen for its fields."""
    kind = plugin if isinstance(plugin, type) else type(plugin)
    base: dict[str, Any] = {} if isinstance(plugin, type) else plugin.parameters
    chosen = dict(choices.get("", {})) if shared else {}
    chosen |= choices.get(kind.name, {})
    hints = get_type_hints(kind)
    names = [f.name for f in fields(kind)]
    for key in chosen:
        if key not in names:
            raise ValueError(f"{kind.name} has no setting {key!r}; valid are {', '.join(names)}")
    values = [[parse_value(kind.name, k, hints[k], v) for v in vs] for k, vs in chosen.items()]
    combinations: list[dict[str, Any]] = [
        dict(zip(chosen, combination, strict=True)) for combination in product(*values)
    ]
    try:
        return [kind(**{**base, **settings}) for settings in combinations]
    except ValueError as error:
        raise ValueError(f"{kind.name}: {error}") from None


def plan_scenarios(words: Sequence[str], choices: Choices) -> list[PluginRef]:
    """The scenarios named, or given as files, with every combination of settings."""
    refs = []
    for word in words:
        classes = load_file(word, Scenario) if is_file(word) else [find_scenario(word)]
        path = str(Path(word).resolve()) if is_file(word) else None
        scenes: list[Scenario] = [s for c in classes for s in variations(c, choices, True)]
        refs += [PluginRef.of(s, path) for s in scenes]
        for note in dict.fromkeys(note for s in scenes for note in s.notes()):
            warnings.warn(note, SceneWarning, stacklevel=2)
    return refs


def plan_solvers(words: Sequence[str], choices: Choices, starts: Sequence[str]) -> list[PluginRef]:
    """The solvers named, or given as files; "all" is every one of ours, unavailable ones too."""
    names = [n for w in words for n in ([w] if is_file(w) else w.split(","))]
    if "all" in names:
        ours = [e.name for e in list_solvers()]
        names = [n for name in names for n in (ours if name == "all" else [name])]
    refs: list[PluginRef] = []
    for name in dict.fromkeys(names):
        path = str(Path(name).resolve()) if is_file(name) else None
        try:
            found = from_file(name) if path else [find_solver(name)]
        except UnavailableError as error:
            refs += [PluginRef(name, name, unavailable=str(error))] if "cold" in starts else []
            continue
        varied = [v for s in found for v in variations(s, choices, False)]
        refs += [PluginRef.of(v, path) for s in varied for v in by_start(s, starts)]
    return list(dict.fromkeys(refs))


def by_start(solver: Solver, starts: Sequence[str]) -> list[Solver]:
    """The solver as it was named for "cold", and its warm twin, if it has one, for "warm"."""
    cold = [solver] if "cold" in starts else []
    can = solver.starts_warm is not None and "warm" in starts
    return [*cold, warm_twin(solver)] if can else cold


def never_warm(solvers: Sequence[str]) -> list[str]:
    """The names of those solvers that have no warm twin."""
    refs = plan_solvers(solvers, {}, ("cold",))
    return [ref.label for ref in refs if "warm" not in dict(ref.parameters)]


def from_file(path: str) -> list[Solver]:
    """The solvers of a file, as they are by default."""
    found = []
    for kind in load_file(path, Solver):
        try:
            found.append(kind())
        except TypeError as error:
            raise ValueError(f"{path}: every field needs a default ({error})") from None
    return found


def steps_for(scene: PluginRef, duration: float) -> int:
    """The time steps of a scene that come nearest to `duration` [s], at least one."""
    step = dict(scene.parameters).get("step")
    if not isinstance(step, int | float):
        raise ValueError(f"--duration {duration:g}: no time passes in {scene.name}; give --steps")
    return max(1, round(duration / step))


def plan(
    scenarios: Sequence[str],
    solvers: Sequence[str],
    settings: Sequence[str],
    mode: str,
    steps: int,
    tolerances: Sequence[float],
    time_limit: float | None,
    duration: float | None = None,
    starts: Sequence[str] = ("cold",),
) -> list[Cell]:
    """All cells of a run; with a `duration` [s] each has its own number of steps, and not `steps`.

    Parameters
    ----------
    starts : of STARTS; solvers that cannot start warm do so "cold" alone, see `never_warm`.

    Raises
    ------
    ValueError
        One line that names the wrong word and what is valid.
    """
    if mode not in MODES:
        raise ValueError(f"--mode {mode}: valid are {', '.join(MODES)}")
    if steps < 1:
        raise ValueError(f"--steps {steps}: a whole number above 0 is valid")
    times = (("--time-limit", [time_limit]), ("--duration", [duration]))
    for name, values in (("--tolerance", tolerances), *times):
        for value in values:
            if value is not None and not 0 < value < float("inf"):
                raise ValueError(f"{name} {value}: a number above 0 is valid")
    if not starts or not set(starts) <= set(STARTS):
        raise ValueError(f"--start {','.join(starts)}: valid are cold, warm and cold,warm")
    choices = parse_settings(settings)
    scenes = plan_scenarios(scenarios, choices)
    methods = plan_solvers(solvers, choices, starts)
    if not methods:
        raise ValueError(f"--start warm: {', '.join(solvers)} cannot start from the frame before")
    owners = {ref.name for ref in [*scenes, *methods]}
    for owner in choices:
        if owner and owner not in owners:
            valid = ", ".join(sorted(owners))
            raise ValueError(f"--set {owner}.…: {owner!r} is not in this run; valid are {valid}")
    counts = {s: steps if duration is None else steps_for(s, duration) for s in scenes}
    cells = [
        Cell(scene, method, mode, counts[scene], tolerance, time_limit)
        for scene, method, tolerance in product(scenes, methods, tolerances)
    ]
    return list({cell.key: cell for cell in cells}.values())


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
    scenario: str, solvers: str, settings: Sequence[str], steps: int, tolerance: float
) -> list[Cell]:
    """The same; ValueError for an unavailable solver, with the reason."""
    cells = plan_scene(scenario, [solvers], settings, steps, tolerance)
    for cell in cells:
        if cell.solver.unavailable:
            raise ValueError(cell.solver.unavailable)
    return cells


def plan_one(
    scenario: str, solver: str, settings: Sequence[str], steps: int, tolerance: float
) -> Cell:
    """The same with a single solver; ValueError names those that the words give."""
    cells = plan_available(scenario, solver, settings, steps, tolerance)
    if len(cells) > 1:
        labels = ", ".join(cell.solver.label for cell in cells)
        raise ValueError(f"--solver and --set give {len(cells)} solvers ({labels}): one is valid")
    return cells[0]
