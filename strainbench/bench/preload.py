"""What is loaded once and not for each cell: the suite, and each of its solvers."""

from __future__ import annotations

from pathlib import Path

from strainbench.bench.cell import Cell
from strainbench.bench.nursery import CAN_FORK, Load, Nursery
from strainbench.bench.process import Family, Starter, spawned
from strainbench.problem.grid import square_grid
from strainbench.problem.limits import StretchLimits
from strainbench.problem.problem import Problem
from strainbench.scenario.registry import find_scenario
from strainbench.solver.registry import find_solver
from strainbench.solver.solver import warm_up

STARTS = ("fork", "spawn")


class Nurseries:
    """Those of a run: one that has loaded the suite, and within it one for each of its solvers.

    Files of others are imported in their own cells alone.
    """

    def __init__(self, family: Family, folder: Path, start: str) -> None:
        self._family, self._folder = family, folder
        self._forks = start == "fork" and CAN_FORK
        self._known: dict[tuple[object, ...], Nursery] = {}
        self._count = 0

    def starter(self, cell: Cell) -> Starter:
        """How the process of a cell is started."""
        if not self._forks:
            return spawned
        suite = self._nursery(load_suite, cell.threads)
        if cell.solver.path is not None:
            return suite.forked
        return self._nursery(load_solver, cell.threads, cell.solver.name, within=suite).forked

    def _nursery(
        self, load: Load, threads: int, *args: object, within: Nursery | None = None
    ) -> Nursery:
        key = (threads, *args)
        if key not in self._known or self._known[key].dead:
            self._count += 1
            folder = self._folder / f"nursery-{self._count}"
            self._known[key] = Nursery.planted(self._family, folder, load, *args, within=within)
        return self._known[key]


def load_suite() -> None:
    """Import what all cells import, and load what their physics has compiled."""
    import strainbench.bench.play  # noqa: F401

    find_scenario("swing")().warm_up()


def load_solver(name: str) -> None:
    """Import a solver of the suite, and load what it has compiled."""
    solver = find_solver(name)
    rest, elements = square_grid(2, 1.0, "uniform")
    target = 1.1 * rest @ [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]
    toy = Problem(rest, elements, target, StretchLimits.isotropic(1.01))
    if not solver.supports(toy):
        warm_up(solver, toy, 1e-6)
