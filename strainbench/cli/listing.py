"""What `strainbench list` shows: methods, scenes, and the fields of one."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields
from typing import Any

from strainbench.bench.cell import PluginRef
from strainbench.bench.plan import from_file, with_defaults
from strainbench.bench.settings import is_file
from strainbench.document import Column, Table
from strainbench.fields import hints, spelled, words
from strainbench.options import shown
from strainbench.plugins import Listed, UnavailableError, nearest
from strainbench.scenario.registry import find_scenario, list_scenarios, scenarios_of
from strainbench.scenario.scenario import Scenario
from strainbench.solver.registry import find_solver, list_solvers
from strainbench.solver.solver import Solver

FIELD = re.compile(r"(\w+(?:, \w+)*) : ?(.*)")
UNIT = re.compile(r"\[([^\[\]]+)\]")


@dataclass(frozen=True)
class FieldEntry:
    """A field of a plug-in; the unit is "" where it has none."""

    name: str
    kind: str
    default: str
    unit: str
    about: str


def tables(word: str | None) -> Iterator[Table]:
    """All solvers and scenarios, one of the two, or the fields of what `word` names.

    Raises
    ------
    ValueError
        If it names nothing.
    """
    every = {"solvers": list_solvers, "scenarios": list_scenarios}
    if word is None or word in every:
        for title, entries in every.items():
            if word in (None, title):
                yield overview(title, entries())
        return
    for plugin in found(word):
        yield details(plugin)


def found(word: str) -> list[Solver | Scenario]:
    """The plug-ins of a name or a file, with their defaults."""
    if is_file(word):
        return in_file(word)
    scenes = [entry.name for entry in list_scenarios()]
    if word in scenes:
        return [find_scenario(word)()]
    try:
        return [find_solver(word)]
    except UnavailableError:
        raise
    except ValueError:
        names = [*scenes, *(entry.name for entry in list_solvers())]
        valid = "valid are solvers, scenarios, the name of one, or the path of a .py file"
        raise ValueError(f"list {shown(word)}: {valid}{nearest(word, names)}") from None


def in_file(path: str) -> list[Solver | Scenario]:
    """All that a file defines."""
    made: list[Solver | Scenario] = []
    try:
        made += from_file(path)
    except ValueError as error:
        if "defines no solver" not in str(error):
            raise
        return [kind() for kind in with_defaults(path, scenarios_of(path))]
    try:
        made += [kind() for kind in with_defaults(path, scenarios_of(path))]
    except ValueError as error:
        if "defines no scenario" not in str(error):
            raise
    return made


def overview(title: str, entries: Sequence[Listed]) -> Table:
    """Name, whether it can be used, and below each other method, paper, why it cannot."""
    lines = []
    for e in entries:
        lines.append([e.name, "no" if e.unavailable else "yes", e.method])
        lines += [["", "", text] for text in (e.paper, e.unavailable) if text]
    about = "method, paper" if title == "solvers" else "scene, paper"
    return Table(title, [Column("name", whole=True), Column("available", whole=True), about], lines)


def details(plugin: Solver | Scenario) -> Table:
    """The fields of one."""
    kind = "scenario" if isinstance(plugin, Scenario) else "solver"
    ref = PluginRef.of(plugin)
    name = ref.name if kind == "scenario" else ref.label
    head = (inspect.getdoc(plugin) or "").split("\n")[0]
    lines = [
        [f.name, f.default, f.unit, "; ".join(part for part in (f.kind, f.about) if part)]
        for f in described(plugin)
    ]
    title = f"{kind} {name}: {head}" + ("" if lines else " It has no settings.")
    return Table(title, [Column("--set", whole=True), "default", "unit", "what"], lines)


def described(plugin: Solver | Scenario) -> list[FieldEntry]:
    """The fields with types, defaults and what the docstrings say of them."""
    types, about = hints(type(plugin)), documented(type(plugin))
    entries = []
    for f in fields(plugin):
        text = about.get(f.name, "")
        value = getattr(plugin, f.name)
        default = f"{value:.6g}" if isinstance(value, float) else spelled(value)
        unit = " or ".join(dict.fromkeys(UNIT.findall(text)))
        kind = "" if types[f.name] is Any else words(types[f.name])
        entries.append(FieldEntry(f.name, kind, default or '""', unit, text))
    return entries


def documented(kind: type) -> dict[str, str]:
    """What the `Parameters` of the docstrings of a class and its bases say of each name."""
    about: dict[str, str] = {}
    for c in reversed(kind.__mro__):
        text = inspect.cleandoc(vars(c).get("__doc__") or "")
        about |= _parameters(text.partition("Parameters\n----------\n")[2])
    return about


def _parameters(section: str) -> dict[str, str]:
    """The entries of a numpydoc section: names, a colon, a text that goes on indented."""
    about: dict[str, str] = {}
    names: list[str] = []
    for line in section.split("\n"):
        if match := FIELD.fullmatch(line):
            names = match[1].split(", ")
            about |= dict.fromkeys(names, match[2])
        elif line.startswith(" "):
            about |= {name: f"{about[name]} {line.strip()}" for name in names}
        else:
            break
    return about
