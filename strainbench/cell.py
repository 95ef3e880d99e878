"""A cell of the benchmark: one scenario, one solver, one mode; and its identity on disk."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from strainbench.discovery import find_scenario, find_solver, load_file
from strainbench.fields import plain, restored
from strainbench.scenario import Scenario
from strainbench.solver import Solver


@dataclass(frozen=True)
class PluginRef:
    """A solver or scenario that another process can load again.

    Parameters
    ----------
    name : its class's name in the suite
    label : with what sets it apart from the defaults
    parameters : all its fields, as JSON has them
    path : of the file that it came from, or None for one of ours
    content : digest of that file, and of files that its parameters name, when the run was
        planned: an edited file is another plug-in
    unavailable : why it cannot be loaded, or None
    """

    name: str
    label: str
    parameters: tuple[tuple[str, object], ...] = ()
    path: str | None = None
    content: str = ""
    unavailable: str | None = None

    @classmethod
    def of(
        cls, plugin: Solver | Scenario, path: str | None = None, label: str | None = None
    ) -> PluginRef:
        """A reference to `plugin`, from the file at `path` unless it is ours."""
        parameters = {name: plain(value) for name, value in plugin.parameters.items()}
        named = [v for v in parameters.values() if isinstance(v, str) and _is_file(v)]
        files = [*([path] if path else []), *named]
        content = _digest([Path(f).read_bytes().hex() for f in files]) if files else ""
        label = str(plugin.label) if label is None else label
        return cls(plugin.name, label, tuple(parameters.items()), path, content)

    def solver(self) -> Solver:
        """Load it as a solver."""
        if self.path is None:
            solver = find_solver(self.name)
        else:
            solver = next(c for c in load_file(self.path, Solver) if c.name == self.name)()
        known = [solver.parameters, *solver.variants.values()]
        return replace(solver, **self._settings(type(solver), known))

    def scenario(self) -> Scenario:
        """Load it as a scenario."""
        classes = load_file(self.path, Scenario) if self.path else [find_scenario(self.name)]
        scenario = next(c for c in classes if c.name == self.name)()
        return replace(scenario, **self._settings(type(scenario), [scenario.parameters]))

    def _settings(self, kind: type, known: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
        values = {name: [k[name] for k in known if name in k] for name, _ in self.parameters}
        return restored(kind, dict(self.parameters), values)

    @property
    def identity(self) -> list[object]:
        """What sets it apart from any other."""
        return [self.name, dict(self.parameters), self.content]


@dataclass(frozen=True)
class Cell:
    """What is run in one process.

    Parameters
    ----------
    mode : "simulate" (closed loop) or "replay" (every solver is fed the same recorded frames)
    steps : time steps
    tolerance : aimed at by the solver
    time_limit : [s] for physics and solver together, or None
    """

    scenario: PluginRef
    solver: PluginRef
    mode: str
    steps: int
    tolerance: float
    time_limit: float | None = None

    @property
    def key(self) -> str:
        """A digest of what the cell measures; the time limit is not part of it."""
        return _digest(
            [self.scenario.identity, self.solver.identity, self.mode, self.steps, self.tolerance]
        )

    @property
    def recording_key(self) -> str:
        """A digest of what the replayed frames depend on, the code that makes them included."""
        code = Path(__file__).parent
        sources = [*sorted((code / "physics").glob("*.py")), code / "scenario.py", code / "mesh.py"]
        if self.scenario.path is None:
            sources.append(code.parent / "scenarios" / f"{self.scenario.name.replace('-', '_')}.py")
        content = hashlib.sha256(b"".join(f.read_bytes() for f in sources)).hexdigest()
        return _digest([self.scenario.identity, self.steps, content])

    @property
    def title(self) -> str:
        """For the progress bar."""
        return f"{self.scenario.label}, {self.solver.label}"


def _is_file(text: str) -> bool:
    try:
        return Path(text).is_file()
    except (OSError, ValueError):  # too long for a name, or with a null character
        return False


def _digest(content: object) -> str:
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()[:16]
