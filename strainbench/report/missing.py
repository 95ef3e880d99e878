"""What was not measured of a scene, and how it would be."""

from __future__ import annotations

import shlex
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import pandas as pd

from strainbench.bench.cell import PluginRef
from strainbench.bench.plan import from_file
from strainbench.bench.settings import Choices, is_file
from strainbench.document import Code
from strainbench.fields import spelled
from strainbench.options import shown
from strainbench.plugins import UnavailableError, nearest, stems
from strainbench.report.candidate import UNLIMITED
from strainbench.solver.registry import find_solver

TIME_LIMIT = 60.0  # [s] a cell, where no row says another


@dataclass(frozen=True)
class Missing:
    """Cells that were not measured, as `strainbench run` takes them."""

    scenario: str
    solvers: Sequence[str]
    settings: Sequence[str]
    folder: str
    mode: str = "simulate"
    steps: int | None = None
    tolerance: float = 1e-6
    threads: int = 1
    repeats: int = 1
    time_limit: float = TIME_LIMIT

    @property
    def command(self) -> Code:
        """The line to type."""
        usual = {"steps": None, "tolerance": 1e-6, "threads": 1, "repeats": 1}
        options = [("--set", word) for word in self.settings]
        options += [("--solver", ",".join(self.solvers)), ("--mode", self.mode)]
        for name, value in usual.items():
            if (given := getattr(self, name)) != value:
                options.append((f"--{name}", f"{given:g}"))
        options += [("--time-limit", f"{self.time_limit:g}"), ("--results", self.folder)]
        words = [word for option in options for word in option]
        return Code(shlex.join(["strainbench", "run", self.scenario, *words]))


def missing_cells(
    scenario: str,
    scene: PluginRef,
    chosen: Choices,
    words: Mapping[str, str],
    runs: pd.DataFrame,
    rows: pd.DataFrame,
) -> Missing | None:
    """What is to be run, like the newest row of the scene, or of another setting of it.

    Parameters
    ----------
    words : of the methods asked for, by their labels
    runs, rows : all, and those about the scene
    """
    solvers = dict.fromkeys(w for label, w in words.items() if label not in set(rows["solver"]))
    if not solvers:
        return None
    settings = _settings(scene, chosen)
    alike = rows if len(rows) else runs[runs["scenario"] == scene.name]
    if not len(alike):
        return Missing(scenario, list(solvers), settings, str(runs["folder"].iloc[0]))
    row = alike.iloc[-1]
    return Missing(
        scenario,
        list(solvers),
        settings,
        str(row["folder"]),
        str(row["mode"]),
        int(row["steps_asked"]),
        float(row["tolerance"]),
        int(row["threads"]),
        int(row["repeats"]),
        float(row["time_limit"]) if row["time_limit"] > 0 else TIME_LIMIT,
    )


def _settings(scene: PluginRef, chosen: Choices) -> list[str]:
    """The settings that were given, at the scene's values, as `--set` takes them."""
    values = dict(scene.parameters)
    keys = dict.fromkeys([*chosen.get("", {}), *chosen.get(scene.name, {})])
    words = {key: spelled(values[key]) for key in keys}
    quoted = {
        k: f'"{w}"' if "," in w and isinstance(values[k], str) else w for k, w in words.items()
    }
    return [f"{key}={word}" for key, word in quoted.items()]


def labelled(words: Iterable[str] | None, runs: pd.DataFrame) -> dict[str, str]:
    """The labels of the methods that words mean, and the words; of None, of all our methods.

    Raises
    ------
    ValueError
        For a method that nobody knows.
    """
    ours = [stem.replace("_", "-") for stem in stems("solvers")]  # to import them takes seconds
    if words is None:
        return {name: name for name in ours if name != UNLIMITED}
    held = list(runs["solver"].unique())
    found: dict[str, str] = {}
    for word in words:
        if is_file(word):
            found |= {str(solver.label): word for solver in from_file(word)}
            continue
        if word not in (*held, *ours):
            _check_known(word, [*held, *ours], runs)
        found[word] = word
    return found


def _check_known(word: str, known: Sequence[str], runs: pd.DataFrame) -> None:
    try:
        find_solver(word)
    except UnavailableError:
        return
    except ValueError:
        folders = ", ".join(runs["folder"].unique())
        held = ", ".join(runs["solver"].unique())
        raise ValueError(
            f"--solver {shown(word)}: neither a solver of ours nor in {folders}; valid are {held}"
            f"{nearest(word, known)}"
        ) from None
