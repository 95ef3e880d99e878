"""Which source files a module depends on, from its import statements, and their digest.

Followed are imports of the suite's own packages and of modules that lie beside the importing file;
a name that a package only passes on leads to the module that defines it.
"""

from __future__ import annotations

import ast
import hashlib
import inspect
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
SUITE = Path(__file__).resolve().parent
PACKAGES = ("strainbench", "solvers", "scenarios")
TELLING = ("cli", "document", "render", "report", "studies", "__init__.py")
"""Rooms that show what was measured, and the face with the version: no number of a row depends on
them, so a release alone makes no row older."""

Import = tuple[int, str, str]
"""Level (0 is absolute), module, and the name taken from it, or "" for the module itself."""


def closure(*files: Path, suite: bool = True) -> list[Path]:
    """`files` and all that they import of ours and from beside them, in a fixed order.

    Parameters
    ----------
    suite : whether the files of `strainbench` itself count, or only plug-ins' own
    """
    found: set[Path] = set()
    waiting = [file.resolve() for file in files]
    while waiting:
        file = waiting.pop()
        if file in found or (not suite and file.is_relative_to(SUITE)):
            continue
        found.add(file)
        for statement in _imports(file.read_bytes()):
            waiting += _modules(file, *statement)
    return sorted(found)


def digest(files: Iterable[Path]) -> str:
    """Of the contents alone: 16 hexadecimal digits, wherever the files lie."""
    contents = (hashlib.sha256(file.read_bytes()).digest() for file in files)
    return hashlib.sha256(b"".join(sorted(contents))).hexdigest()[:16]


def plugin_source(kind: type) -> str:
    """The file or folder of a plug-in of ours, from the project's top; else its class's file."""
    package, _, rest = kind.__module__.partition(".")
    if package not in PACKAGES:
        return inspect.getfile(kind)
    target = Path(package, rest.split(".")[0])
    return (target if (ROOT / target).is_dir() else target.with_suffix(".py")).as_posix()


def plugin_files(source: str) -> list[Path]:
    """The files of a plug-in's source: itself, or all modules in the folder."""
    path = ROOT / source
    return sorted(path.rglob("*.py")) if path.is_dir() else [path]


@cache
def suite_digest() -> str:
    """Of the suite's own source, without the rooms that only tell what it measured."""
    return digest(f for f in SUITE.rglob("*.py") if f.relative_to(SUITE).parts[0] not in TELLING)


@cache
def _imports(source: bytes) -> tuple[Import, ...]:
    """Import statements anywhere in a text; none in one that does not parse."""
    try:
        tree = ast.parse(source)
    except (SyntaxError, ValueError):
        return ()
    found: list[Import] = []
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found += [(0, alias.name, "") for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            found += [(node.level, node.module or "", alias.name) for alias in node.names]
    return tuple(found)


def _modules(file: Path, level: int, module: str, name: str) -> Iterator[Path]:
    """The files behind one import in `file`: none for packages from elsewhere."""
    parts = module.split(".") if module else []
    for folder in [file.parents[level - 1]] if level else _path(file, parts[0]):
        target = folder.joinpath(*parts)
        if name and (inner := _file(target / name)):
            yield inner
        elif found := _file(target):
            yield from _defining(found, name) if found.name == "__init__.py" else [found]
        else:
            continue
        return


def _path(file: Path, package: str) -> list[Path]:
    """Where an absolute import in `file` looks: beside it, and beside its outermost package.

    Ours, which may be installed where all packages are, import none that lies beside them.
    """
    if package in PACKAGES:
        return [ROOT]
    outside = next(folder for folder in file.parents if not (folder / "__init__.py").is_file())
    if outside != ROOT:
        return [file.parent, outside]
    return [ROOT] if package == file.relative_to(ROOT).parts[0] or file.parent == ROOT else []


def _defining(package: Path, name: str) -> Iterator[Path]:
    """The module that a package takes `name` from, or the package's own file."""
    passed_on = [i for i in _imports(package.read_bytes()) if name and i[2] == name]
    modules = [file for i in passed_on for file in _modules(package, *i)]
    yield from modules or [package]


def _file(module: Path) -> Path | None:
    """The file of a module or package at this path without suffix."""
    candidates = (module.with_name(module.name + ".py"), module / "__init__.py")
    return next((file for file in candidates if file.is_file()), None)
