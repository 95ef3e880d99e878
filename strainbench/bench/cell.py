"""A cell of the benchmark: one scenario, one solver, one mode; and its identity on disk."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from strainbench.bench.mode import window
from strainbench.fields import plain, restored
from strainbench.scenario.registry import find_scenario, scenarios_of
from strainbench.scenario.scenario import Scenario
from strainbench.solver.registry import find_solver, solvers_of
from strainbench.solver.solver import Solver
from strainbench.sources import closure, digest, plugin_files, plugin_source


@dataclass(frozen=True)
class PluginRef:
    """A solver or scenario that another process can load again.

    Parameters
    ----------
    name : its class's name in the suite
    label : with what sets it apart from the defaults
    parameters : all its fields, as JSON has them
    path : of the file that it came from, or None for one of ours
    source : that file or folder in words: from the project's top for one of ours
    content : digest of its source and of the files that its parameters name, when the run was
        planned: an edited file is another plug-in
    unavailable : why it cannot be loaded, or None
    """

    name: str
    label: str
    parameters: tuple[tuple[str, object], ...] = ()
    path: str | None = None
    source: str = ""
    content: str = ""
    unavailable: str | None = None

    @classmethod
    def of(
        cls, plugin: Solver | Scenario, path: str | None = None, label: str | None = None
    ) -> PluginRef:
        """A reference to `plugin`, from the file at `path` unless it is ours."""
        source = path or plugin_source(type(plugin))
        parameters = {name: plain(value) for name, value in plugin.parameters.items()}
        content = content_of(source, parameters.values())
        label = str(plugin.label) if label is None else label
        return cls(plugin.name, label, tuple(parameters.items()), path, source, content)

    def solver(self) -> Solver:
        """Load it as a solver; ValueError if its source was edited since."""
        self._check()
        if self.path is None:
            solver = find_solver(self.name)
        else:
            solver = next(c for c in solvers_of(self.path) if c.name == self.name)()
        known = [solver.parameters, *solver.variants.values()]
        return replace(solver, **self._settings(type(solver), known))

    def scenario(self) -> Scenario:
        """Load it as a scenario; ValueError if its source was edited since."""
        self._check()
        classes = scenarios_of(self.path) if self.path else [find_scenario(self.name)]
        scenario = next(c for c in classes if c.name == self.name)()
        return replace(scenario, **self._settings(type(scenario), [scenario.parameters]))

    def _check(self) -> None:
        if self.content != content_of(self.source, dict(self.parameters).values()):
            raise ValueError(f"{self.source}, or a file that it reads, was edited during the run")

    def _settings(self, kind: type, known: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
        values = {name: [k[name] for k in known if name in k] for name, _ in self.parameters}
        return restored(kind, dict(self.parameters), values)

    @property
    def identity(self) -> list[object]:
        """What sets it apart from any other."""
        return [self.name, dict(self.parameters), self.content]


def content_of(source: str, settings: Iterable[object]) -> str:
    """Digest of a plug-in's own source, what it imports from beside it, and the files it reads.

    Raises
    ------
    FileNotFoundError
        If the source is not there.
    """
    return digest([*closure(*plugin_files(source), suite=False), *_named_files(source, settings)])


def _named_files(source: str, settings: Iterable[object]) -> list[Path]:
    """The files that settings name, as they stand or in the data folder beside a plug-in."""
    words = [str(v) for v in settings if isinstance(v, str | Path) and str(v)]
    data = plugin_files(source)[0].parent / "data"
    places = ((file_named(word), file_named(str(data / word))) for word in words)
    return [found for place in places if (found := next(filter(None, place), None))]


def file_named(word: str) -> Path | None:
    """The file that a word names, ~ being the user's home, if there is one."""
    try:
        path = Path(word).expanduser()
        return path if path.is_file() else None
    except (OSError, RuntimeError, ValueError):  # too long, no such home, a null character
        return None


@dataclass(frozen=True)
class Cell:
    """What is run in one process.

    Parameters
    ----------
    mode : "simulate" (closed loop) or "replay" (every solver is fed the same recorded frames), of
        some steps alone as "replay:14-30"
    steps : time steps that are played or fed
    tolerance : aimed at by the solver
    time_limit : [s] for physics and solver together, or None
    threads : in the solver's BLAS, OpenMP, numba and rayon
    repeats : times that each projection is timed; the first answer counts
    patience : steps after the first that violates its limits with which it ends; None for all
    """

    scenario: PluginRef
    solver: PluginRef
    mode: str
    steps: int
    tolerance: float
    time_limit: float | None = None
    threads: int = 1
    repeats: int = 1
    patience: int | None = None

    @property
    def key(self) -> str:
        """A digest of what the cell's numbers depend on, its time limit and repeats apart."""
        plugins = [self.scenario.identity, self.solver.identity]
        early = [] if self.patience is None else [{"patience": self.patience}]
        return _digest([*plugins, self.mode, self.steps, self.tolerance, self.threads, *early])

    @property
    def recording_key(self) -> str:
        """A digest of what the replayed frames depend on: the scene, and all code behind them.

        Raises
        ------
        FileNotFoundError
            If a source is not there.
        """
        from strainbench.referee.reference import REFERENCE_SOLVER

        recorder = plugin_source(type(find_solver(REFERENCE_SOLVER)))
        sources = [f for s in (self.scenario.source, recorder) for f in plugin_files(s)]
        return _digest([self.scenario.identity, self.window[1], digest(closure(*sources))])

    @property
    def window(self) -> tuple[int, int]:
        """The first and the last step of the scene that it is about."""
        return window(self.mode, self.steps)

    @property
    def title(self) -> str:
        """For the progress bar."""
        return f"{self.scenario.label}, {self.solver.label}"


def _digest(content: object) -> str:
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()[:16]
