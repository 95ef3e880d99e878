"""Finding solvers and scenarios: by name in the plug-in packages, or by the path of a file."""

from __future__ import annotations

import ast
import hashlib
import importlib
import importlib.util
import inspect
import pkgutil
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import TypeVar

from strainbench.scenario import Scenario
from strainbench.solver import Solver, method_and_paper

OURS = ("strainbench", "solvers", "scenarios")
Plugin = TypeVar("Plugin", Solver, Scenario)


class UnavailableError(ValueError):
    """A plug-in of ours that needs what is not installed."""


@dataclass(frozen=True)
class Entry:
    """A line of `strainbench list`."""

    name: str
    method: str
    paper: str
    unavailable: str | None = None


def _package(name: str) -> ModuleType:
    """The plug-in package `name`, which must be the one that lies beside strainbench."""
    package = importlib.import_module(name)
    beside = Path(__file__).resolve().parent.parent / name
    if Path(package.__path__[0]).resolve() != beside:
        raise ImportError(
            f"the package {name} was found at {package.__path__[0]}, not at {beside}: "
            f"another package of that name is in the way"
        )
    return package


def _load(package: str, stem: str) -> ModuleType:
    """Import a plug-in module; a missing third-party package makes it unavailable."""
    try:
        return importlib.import_module(f"{package}.{stem}")
    except ImportError as error:
        missing = (error.name or "").split(".")[0]
        if missing in ("", *OURS):
            raise
        raise UnavailableError(f"needs {missing}, which cannot be imported ({error})") from error


def _classes(module: ModuleType, base: type[Plugin]) -> list[type[Plugin]]:
    """The concrete plug-in classes that a module defines itself."""
    return [
        c
        for c in vars(module).values()
        if inspect.isclass(c)
        and issubclass(c, base)
        and (c.__module__ + ".").startswith(module.__name__ + ".")
        and not inspect.isabstract(c)
    ]


def _stems(package: str) -> list[str]:
    return sorted(m.name for m in pkgutil.iter_modules(_package(package).__path__))


def _summary(package: str, stem: str) -> tuple[str, str]:
    """Method and paper of a module that cannot be imported, read from its text."""
    folder = Path(_package(package).__path__[0])
    path = (
        folder / f"{stem}.py" if (folder / f"{stem}.py").exists() else folder / stem / "__init__.py"
    )
    return method_and_paper(ast.get_docstring(ast.parse(path.read_text())))


def _variants(solver: type[Solver]) -> Iterator[Solver]:
    yield solver()
    for settings in solver.variants.values():
        yield solver(**settings)


def list_solvers() -> list[Entry]:
    """Every solver and variant, with the reason where one is unavailable."""
    entries = []
    for stem in _stems("solvers"):
        try:
            classes = _classes(_load("solvers", stem), Solver)
        except UnavailableError as error:
            entries.append(Entry(stem.replace("_", "-"), *_summary("solvers", stem), str(error)))
            continue
        for solver in (v for c in classes for v in _variants(c)):
            method, paper = method_and_paper(solver.__doc__)
            entries.append(Entry(solver.label, method, paper, solver.missing()))
    return entries


def list_scenarios() -> list[Entry]:
    """Every scenario."""
    classes = [c for s in _stems("scenarios") for c in _classes(_load("scenarios", s), Scenario)]
    return [Entry(c.name, *method_and_paper(c.__doc__)) for c in classes]


def _ours(name: str) -> Solver | None:
    """Our solver or variant of that name, importing no more than may hold it."""
    for stem in sorted(_stems("solvers"), key=len, reverse=True):
        if name != stem.replace("_", "-") and not name.startswith(stem.replace("_", "-") + "-"):
            continue
        try:
            module = _load("solvers", stem)
        except UnavailableError as error:
            raise UnavailableError(f"solver {name} is unavailable: {error}") from error
        for solver in (v for c in _classes(module, Solver) for v in _variants(c)):
            if solver.label == name:
                if missing := solver.missing():
                    raise UnavailableError(f"solver {name} is unavailable: {missing}")
                return solver
    return None


def find_solver(name: str) -> Solver:
    """The solver of a name or of a variant's name.

    Raises
    ------
    UnavailableError
        If a package that it needs is missing.
    ValueError
        If there is none of that name; the message lists those there are.
    """
    if solver := _ours(name):
        return solver
    valid = ", ".join(e.name for e in list_solvers())
    raise ValueError(f"no solver called {name!r}; valid are {valid}, or the path of a .py file")


def find_scenario(name: str) -> type[Scenario]:
    """The scenario class of a name; ValueError lists those there are."""
    for stem in _stems("scenarios"):
        if stem.replace("_", "-") == name:
            return _classes(_load("scenarios", stem), Scenario)[0]
    valid = ", ".join(e.name for e in list_scenarios())
    raise ValueError(f"no scenario called {name!r}; valid are {valid}, or the path of a .py file")


def load_file(path: str, base: type[Plugin]) -> list[type[Plugin]]:
    """The solver or scenario classes that a file defines.

    Raises
    ------
    ValueError
        One line: the file is not there, does not import, defines none, or takes a name of ours.
    """
    file = Path(path).resolve()
    kind = base.__name__.lower()
    if not file.is_file():
        raise ValueError(f"{path}: no such file")
    digest = hashlib.sha256(str(file).encode()).hexdigest()[:12]
    name = f"strainbench_file_{file.stem}_{digest}"
    spec = importlib.util.spec_from_file_location(name, file)
    if spec is None or spec.loader is None:
        raise ValueError(f"{path}: not a Python file")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except Exception as error:  # whatever a user's file raises becomes one line
        del sys.modules[name]
        raise ValueError(f"{path} does not import: {type(error).__name__}: {error}") from error
    classes = _classes(module, base)
    if not classes:
        raise ValueError(f"{path} defines no {kind}: a subclass of strainbench.{base.__name__}")
    for c in classes:
        if not isinstance(getattr(c, "name", None), str):
            raise ValueError(f'{path}: the {kind} {c.__name__} has no name = "..."')
        if c.name in [t.replace("_", "-") for t in _stems(f"{kind}s")] or _ours(c.name):
            taken = f"the name {c.name!r} is taken by our own {kind}"
            raise ValueError(f"{path}: {taken}; choose another")
    return classes
