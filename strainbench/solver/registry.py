"""Solvers by name, with their variants and warm twins, or by the path of a file."""

from __future__ import annotations

from collections.abc import Iterator

from strainbench.plugins import (
    Listed,
    UnavailableError,
    classes,
    load,
    load_file,
    method_and_paper,
    no_such,
    stems,
    summary,
)
from strainbench.solver.solver import Solver, warm_twin


def _variants(solver: type[Solver]) -> Iterator[Solver]:
    yield solver()
    for settings in solver.variants.values():
        yield solver(**settings)


def _with_twins(solver: type[Solver]) -> Iterator[Solver]:
    """The variants, and those that start warm."""
    for variant in _variants(solver):
        yield variant
        if variant.starts_warm is False:
            yield warm_twin(variant)


def list_solvers() -> list[Listed]:
    """Every solver and variant, with the reason where one is unavailable."""
    entries = []
    for stem in stems("solvers"):
        try:
            found = classes(load("solvers", stem), Solver)
        except UnavailableError as error:
            entries.append(Listed(stem.replace("_", "-"), *summary("solvers", stem), str(error)))
            continue
        for solver in (v for c in found for v in _variants(c)):
            method, paper = method_and_paper(solver.__doc__)
            entries.append(Listed(solver.label, method, paper, solver.missing()))
    return entries


def _ours(name: str) -> Solver | None:
    """Our solver, variant or warm twin of that name, importing no more than may hold it."""
    for stem in sorted(stems("solvers"), key=len, reverse=True):
        if name != stem.replace("_", "-") and not name.startswith(stem.replace("_", "-") + "-"):
            continue
        try:
            module = load("solvers", stem)
        except UnavailableError as error:
            raise UnavailableError(f"solver {name} is unavailable: {error}") from error
        for solver in (v for c in classes(module, Solver) for v in _with_twins(c)):
            if solver.label == name:
                if missing := solver.missing():
                    raise UnavailableError(f"solver {name} is unavailable: {missing}")
                return solver
    return None


def find_solver(name: str) -> Solver:
    """The solver of a name or of a variant's name, and with "-warm", its warm twin.

    Raises
    ------
    UnavailableError
        If a package that it needs is missing.
    ValueError
        If there is none of that name; the message lists those there are.
    """
    if solver := _ours(name):
        return solver
    raise no_such("solver", name, (e.name for e in list_solvers()))


def solvers_of(path: str) -> list[type[Solver]]:
    """The solver classes of a file; see `strainbench.plugins.load_file`."""
    names = [stem.replace("_", "-") for stem in stems("solvers")]
    return load_file(path, Solver, lambda name: name in names or _ours(name) is not None)
