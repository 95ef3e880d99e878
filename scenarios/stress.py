"""A hanging sheet made hard to project in one way at a time (nobody)."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from strainbench.arrays import FloatArray, IntArray
from strainbench.problem.grid import square_grid
from strainbench.scenario.scenario import Scenario, SheetScenario, StepReport

SIDE = 0.5  # [m]
CASES = ("slivers", "mass-ratio", "displaced", "fast-pins")
ASPECT, RATIO, MOVE = 100.0, 1e4, 2.0
"""What the cases mean at severity 1: width of the wide cells over that of the narrow ones, heavy
masses over light ones, edges that the pins move in a step."""
EASY = 0.1  # severity of the easier neighbours


@dataclass(frozen=True)
class Stress(SheetScenario):
    """A hanging sheet made hard to project in one way at a time (nobody).

    A square is held at two adjacent corners. Its candidate is 10% too long and thrown into waves
    that stretch it across by up to a third, and the same in each step, without material or time.
    No case is infeasible: the square as cut, moved with its pins, meets all limits.

    Parameters
    ----------
    case : slivers: every other column of cells is narrower, 100^severity times;
        mass-ratio: every other vertex is heavier, 10^(4 severity) times;
        displaced: each free vertex of the candidate lies severity edges of a cell off, in a
        direction of its own, drawn from `seed`;
        fast-pins: the sheet is flat at first; in each step the pins move 2 severity edges along
        its normal, and the rest of the candidate stays where the last projection left it.
    severity : 1, or 0.1 for the easier neighbour.
    seed : of the directions of `displaced`.
    """

    name = "stress"
    needs = frozenset()

    resolution: int = 10
    case: str = "slivers"
    severity: float = 1.0
    seed: int = 0

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.case not in CASES:
            raise ValueError(f"case is {self.case!r}: valid are {', '.join(CASES)}")
        if not 0 <= self.severity < float("inf"):
            raise ValueError(f"severity is {self.severity}: a number from 0 on is valid")
        if self.seed < 0:
            raise ValueError(f"seed is {self.seed}: a whole number from 0 on is valid")
        if self.case == "mass-ratio" and self.norm != "mass":
            raise ValueError(f"norm is {self.norm!r}: without masses there is no case mass-ratio")

    def easier(self) -> Scenario | None:
        """See the base class."""
        return replace(self, severity=EASY) if self.severity > EASY else super().easier()

    def sheet(self) -> tuple[FloatArray, IntArray, FloatArray, IntArray]:
        """See the base class; the positions are the candidate, or for fast-pins its start."""
        rest, elements = square_grid(self.resolution, SIDE, "alternating")
        pinned = np.array([0, self.resolution * (self.resolution + 1)])
        if self.case == "slivers":
            wide = np.arange(self.resolution) % 2 == 0
            ticks = np.append(0.0, np.cumsum(np.where(wide, 1.0, ASPECT**-self.severity)))
            rest[:, 0] = np.repeat(SIDE * ticks / ticks[-1], self.resolution + 1)
        x, y = rest.T
        if self.case == "fast-pins":
            return rest, elements, np.column_stack([x, y, 0 * x]), pinned
        wave = 0.07 * y * np.sin(4 * np.pi * x / SIDE)
        positions = np.column_stack([x, 1.1 * y, wave])
        if self.case == "displaced":
            way = np.random.default_rng(self.seed).normal(size=positions.shape)
            way[pinned] = 0
            lengths = np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-300)
            positions += self.severity * self.edge * way / lengths
        return rest, elements, positions, pinned

    @property
    def edge(self) -> float:
        """Of a cell [m]."""
        return SIDE / self.resolution

    def mass(self) -> FloatArray:
        """See the base class."""
        mass = super().mass()
        if self.case == "mass-ratio":
            i, j = np.divmod(np.arange(len(mass)), self.resolution + 1)
            mass *= np.where((i + j) % 2 == 1, RATIO**self.severity, 1.0)
        return mass

    def play(self, project: Callable[[FloatArray], FloatArray]) -> Iterator[StepReport]:
        """The same projection in every step, or the moving pins."""
        _, _, positions, pinned = self.sheet()
        move = MOVE * self.severity * self.edge if self.case == "fast-pins" else 0.0
        start, height = positions.copy(), 0.0
        while True:
            height += move
            candidate = positions.copy()
            candidate[pinned] = start[pinned] + [0, 0, height]
            answer = project(candidate)
            if move:
                positions = answer
            yield StepReport()
