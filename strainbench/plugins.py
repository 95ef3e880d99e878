"""Finding plug-ins: by name in a package of ours, or by the path of a file."""

from __future__ import annotations

import ast
import difflib
import hashlib
import importlib
import importlib.util
import inspect
import pkgutil
import re
import sys
import traceback
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any, TypeVar

from strainbench.beside import OURS, Beside
from strainbench.escape import plain

Plugin = TypeVar("Plugin")


class ShadowedError(ValueError):
    """Another package has the name of one of ours and is found before it."""


class UnavailableError(ValueError):
    """A plug-in of ours that needs what is not installed."""


@dataclass(frozen=True)
class Listed:
    """A line of `strainbench list`."""

    name: str
    method: str
    paper: str
    unavailable: str | None = None


class Library:
    """A package that is imported when something of it is first asked for.

    So that a solver is listed without it: cvxpy alone takes a second.

    Raises
    ------
    ModuleNotFoundError
        At once, if it is not installed.
    """

    def __init__(self, name: str) -> None:
        if importlib.util.find_spec(name) is None:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)
        self._name = name

    def __getattr__(self, name: str) -> Any:
        return getattr(importlib.import_module(self._name), name)


def _package(name: str) -> ModuleType:
    """The plug-in package `name`, which must be the one that lies beside strainbench."""
    package = importlib.import_module(name)
    beside = Path(__file__).resolve().parent.parent / name
    if Path(package.__path__[0]).resolve() != beside:
        raise ShadowedError(
            f"the package {name} was found at {package.__path__[0]}, not at {beside}: another "
            "package of that name is in the way; start strainbench from another folder, or in a "
            "virtual environment of its own"
        )
    return package


def load(package: str, stem: str) -> ModuleType:
    """Import a plug-in module; a missing third-party package makes it unavailable."""
    try:
        return importlib.import_module(f"{package}.{stem}")
    except ImportError as error:
        missing = (error.name or "").split(".")[0]
        if missing in ("", *OURS):
            raise
        raise UnavailableError(f"needs {missing}, which cannot be imported ({error})") from error


def classes(module: ModuleType, base: type[Plugin]) -> list[type[Plugin]]:
    """The concrete plug-in classes that a module defines itself."""
    return [
        c
        for c in vars(module).values()
        if inspect.isclass(c)
        and issubclass(c, base)
        and (c.__module__ + ".").startswith(module.__name__ + ".")
        and not inspect.isabstract(c)
    ]


def stems(package: str) -> list[str]:
    """The names of the modules of a plug-in package."""
    return sorted(m.name for m in pkgutil.iter_modules(_package(package).__path__))


def summary(package: str, stem: str) -> tuple[str, str]:
    """Method and paper of a module that cannot be imported, read from its text."""
    folder = Path(_package(package).__path__[0])
    path = (
        folder / f"{stem}.py" if (folder / f"{stem}.py").exists() else folder / stem / "__init__.py"
    )
    return method_and_paper(ast.get_docstring(ast.parse(path.read_bytes())))


def method_and_paper(docstring: str | None) -> tuple[str, str]:
    """The first line of a docstring, "method (paper)", as its two parts."""
    line = (docstring or "").strip().split("\n")[0].rstrip(".")
    match = re.fullmatch(r"(.*?)\s*\((.*)\)", line)
    return (match[1], match[2]) if match else (line, "")


def no_such(kind: str, name: str, valid: Iterable[str]) -> ValueError:
    """What there is to say of a name that nothing has."""
    known = list(valid)
    return ValueError(
        f"no {kind} called {name!r}; valid are {', '.join(known)}, or the path of a .py file"
        f"{nearest(name, known)}"
    )


def nearest(word: str, valid: Iterable[str]) -> str:
    """A word in brackets that one may have meant, or nothing."""
    close = difflib.get_close_matches(word.lower(), list(valid), n=1)
    return f" (did you mean {close[0]}?)" if close else ""


def load_file(path: str, base: type[Plugin], taken: Callable[[str], bool]) -> list[type[Plugin]]:
    """The plug-in classes that a file defines.

    Parameters
    ----------
    taken : whether a name is one of ours

    Raises
    ------
    ValueError
        One line: the file is not there, does not import, defines none, or takes a name of ours.
    """
    kind = base.__name__.lower()
    module = _execute(path)
    found = classes(module, base)
    if not found:
        halves = [f"{c.__name__} lacks {_lacking(c)}" for c in _halves(module, base)]
        wanted = f"a subclass of strainbench.{base.__name__}"
        raise ValueError(f"{path} defines no {kind}: {', '.join(halves) or wanted}")
    for c in found:
        name = getattr(c, "name", None)
        if not isinstance(name, str) or not name.strip():
            raise ValueError(f'{path}: the {kind} {c.__name__} has no name = "..."')
        if taken(name):
            ours = f"the name {name!r} is taken by our own {kind}"
            raise ValueError(f"{path}: {ours}; choose another")
    return found


def _execute(path: str) -> ModuleType:
    """The module of a file, run anew."""
    file = Path(path).resolve()
    if file.is_dir():
        inside = ", ".join(sorted(str(Path(path, f.name)) for f in file.glob("*.py"))[:3])
        such = f", such as {inside}" if inside else ""
        raise ValueError(f"{path} is a folder, no such file: the path of a .py file is valid{such}")
    if not file.is_file():
        raise ValueError(f"{path}: no such file")
    if file.suffix != ".py":
        raise ValueError(f"{path}: not a Python file")
    name = f"strainbench_file_{file.stem}_{hashlib.sha256(str(file).encode()).hexdigest()[:12]}"
    module = ModuleType(name)
    module.__file__ = str(file)
    sys.modules[name] = module  # where dataclasses look for it
    try:
        Beside(file).execute(module, compile(file.read_bytes(), str(file), "exec"))
    except KeyboardInterrupt:
        raise
    except BaseException as error:  # whatever a user's file raises, SystemExit too, is one line
        del sys.modules[name]
        raise ValueError(f"{path} does not import: {told(error, str(file))}") from error
    return module


def told(error: BaseException, file: str = "") -> str:
    """An exception in one line, with the last line of `file` that it passed through."""
    lines = [f.lineno for f in traceback.extract_tb(error.__traceback__) if f.filename == file]
    where = f" (line {lines[-1]})" if lines else ""
    try:
        words = plain(error)
    except Exception:
        words = "what it says cannot be shown"
    return f"{type(error).__name__}{': ' if words else ''}{words}{where}"


def _halves(module: ModuleType, base: type[Plugin]) -> list[type[Plugin]]:
    """The abstract plug-in classes that a module defines itself."""
    return [
        c
        for c in vars(module).values()
        if inspect.isclass(c) and issubclass(c, base) and c.__module__ == module.__name__
    ]


def _lacking(kind: type) -> str:
    """The methods that an abstract class leaves open."""
    return ", ".join(sorted(getattr(kind, "__abstractmethods__", ())))
