"""Scenarios by name, or by the path of a file."""

from __future__ import annotations

from strainbench.plugins import Listed, classes, load, load_file, method_and_paper, no_such, stems
from strainbench.scenario.scenario import Scenario


def list_scenarios() -> list[Listed]:
    """Every scenario."""
    found = [c for s in stems("scenarios") for c in classes(load("scenarios", s), Scenario)]
    return [Listed(c.name, *method_and_paper(c.__doc__)) for c in found]


def find_scenario(name: str) -> type[Scenario]:
    """The scenario class of a name; ValueError lists those there are."""
    for stem in stems("scenarios"):
        if stem.replace("_", "-") == name:
            return classes(load("scenarios", stem), Scenario)[0]
    raise no_such("scenario", name, (e.name for e in list_scenarios()))


def scenarios_of(path: str) -> list[type[Scenario]]:
    """The scenario classes of a file; see `strainbench.plugins.load_file`."""
    names = [stem.replace("_", "-") for stem in stems("scenarios")]
    return load_file(path, Scenario, names.__contains__)
