"""A hanging sheet made hard to project in one way at a time (nobody)."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import count

import numpy as np

from strainbench.arrays import FloatArray, IntArray
from strainbench.problem.grid import square_grid
from strainbench.scenario.scenario import Scenario, SheetScenario, StepReport
from strainbench.scenario.stage import NoAnswerError

SIDE = 0.5  # [m]
CENTRE = np.array([SIDE / 2, 1.1 * SIDE / 2, 0])  # of the candidate
SHRINKS = {"collapsed": (1, 1, 1), "flattened": (1, 0, 1), "inverted": (2, 2, 2)}
"""Cases whose candidate shrinks towards its centre, and how fast it does so along each axis."""
UNITS = {"millimetres": 1000.0, "kilometres": 0.001}
CASES = (
    *("slivers", "mass-ratio", "displaced", "fast-pins", "pulled-pins", *SHRINKS),
    *("shuffled", "rotated", *UNITS, "far"),
)
ASPECT, RATIO, MOVE, PULL, FAR = 100.0, 1e4, 2.0, 1.5, 1e6
"""What cases mean at severity 1: width of the wide cells over that of the narrow ones, heavy
masses over light ones, edges that the pins move in a step, limits by which they are pulled apart,
metres from the origin."""
CYCLE = (0.5, 1.0, 0.5, 0.0)  # of PULL, step by step
EASY = 0.1  # severity of the easier neighbours


@dataclass(frozen=True)
class Stress(SheetScenario):
    """A hanging sheet made hard to project in one way at a time (nobody).

    A square is held at two adjacent corners. Its candidate is 10% too long and thrown into waves
    that stretch it across by up to a third, and the same in each step, without material or time.
    But for `pulled-pins` no case is infeasible: the square as cut, moved with its pins, meets all
    limits. From `shuffled` on the cloth is the same, and only how it is written down differs.

    Parameters
    ----------
    case : slivers: every other column of cells is narrower, 100^severity times;
        mass-ratio: every other vertex is heavier, 10^(4 severity) times;
        displaced: each free vertex of the candidate lies severity edges of a cell off, in a
        direction of its own, drawn from `seed`;
        fast-pins: the sheet is flat at first; in each step the pins move 2 severity edges along
        its normal, and the rest of the candidate stays where the last projection left it;
        pulled-pins: the pins are pulled apart by 0.75, 1.5, 0.75 and 0 severity times what the
        limit allows, again and again: infeasible in the middle, and feasible again;
        collapsed, flattened, inverted: the candidate's free vertices lie severity of their way to
        its centre, of that to its middle line, or of that to the point opposite them;
        shuffled: so large a part of the vertices and of the elements, at most all, has its
        numbers drawn anew from `seed`;
        rotated: by severity radians about an axis drawn from `seed`;
        millimetres, kilometres: all lengths are in a unit 1000^severity times smaller, or larger;
        far: 10^(6 severity) m from the origin.
    severity : 1, or 0.1 for the easier neighbour.
    seed : of what is drawn.
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
        free = np.setdiff1d(np.arange(len(rest)), pinned)
        if self.case in SHRINKS:
            factors = 1 - self.severity * np.array(SHRINKS[self.case])
            positions[free] = CENTRE + factors * (positions[free] - CENTRE)
        if self.case == "displaced":
            positions += self._displacements(pinned)
        return self._written(rest, elements, positions, pinned)

    def _displacements(self, pinned: IntArray) -> FloatArray:
        """(n, 3) of severity edges, each in a direction of its own; none of the pins."""
        way = np.random.default_rng(self.seed).normal(size=((self.resolution + 1) ** 2, 3))
        way[pinned] = 0
        lengths = np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-300)
        displacements: FloatArray = self.severity * self.edge * way / lengths
        return displacements

    def _written(
        self, rest: FloatArray, elements: IntArray, positions: FloatArray, pinned: IntArray
    ) -> tuple[FloatArray, IntArray, FloatArray, IntArray]:
        """The same cloth in other numbers."""
        rng = np.random.default_rng(self.seed)
        if self.case == "shuffled":
            order = partly_shuffled(len(rest), self.severity, rng)
            place = np.argsort(order)  # of each vertex among the new ones
            elements = place[elements][partly_shuffled(len(elements), self.severity, rng)]
            return rest[order], elements, positions[order], place[pinned]
        if self.case == "rotated":
            from scipy.spatial.transform import Rotation  # long to import

            axis = rng.normal(size=3)
            turn = Rotation.from_rotvec(self.severity * axis / np.linalg.norm(axis))
            positions = turn.apply(positions)
        if self.case == "far":
            positions = positions + FAR**self.severity / np.sqrt(3)
        unit = UNITS.get(self.case, 1.0) ** self.severity
        return unit * rest, elements, unit * positions, pinned

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

    def moves(self, step: int) -> FloatArray:
        """(2, 3) or (3,) how far the pins are from where they start [m]."""
        if self.case == "fast-pins":
            return np.array([0, 0, step * MOVE * self.severity * self.edge])
        if self.case == "pulled-pins":
            strain = self.severity * PULL * self.limit * CYCLE[(step - 1) % len(CYCLE)]
            return 0.5 * SIDE * strain * np.array([[-1.0, 0, 0], [1, 0, 0]])
        return np.zeros(3)

    def play(self, project: Callable[[FloatArray], FloatArray]) -> Iterator[StepReport]:
        """The same projection in every step, or the moving pins."""
        _, _, positions, pinned = self.sheet()
        start = positions.copy()
        for step in count(1):
            candidate = positions.copy()
            candidate[pinned] = start[pinned] + self.moves(step)
            answer = self._answer(project, candidate)
            if self.case == "fast-pins":
                positions = answer
            yield StepReport()

    def _answer(
        self, project: Callable[[FloatArray], FloatArray], candidate: FloatArray
    ) -> FloatArray:
        """The projection; where none is to be had, the pins go on to where there is one again."""
        try:
            return project(candidate)
        except NoAnswerError:
            if self.case != "pulled-pins":
                raise
            return candidate


def partly_shuffled(number: int, part: float, rng: np.random.Generator) -> IntArray:
    """(number,) an order in which so large a part, at most all, has changed places."""
    order = np.arange(number)
    some = rng.permutation(number)[: round(min(part, 1.0) * number)]
    order[np.sort(some)] = some
    return order
