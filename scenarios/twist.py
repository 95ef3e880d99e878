"""A sheet whose clamped ends turn against each other, past what it can follow (nobody)."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from strainbench.arrays import FloatArray, IntArray
from strainbench.problem.grid import square_grid
from strainbench.problem.problem import Problem
from strainbench.scenario.scenario import FEWEST_STEPS, Scenario, SheetScenario, StepReport

SIDE = 0.5  # [m]


@dataclass(frozen=True)
class Twist(SheetScenario):
    """A sheet whose clamped ends turn against each other, past what it can follow (nobody).

    A square of side L lies in the horizontal plane, two opposite ends pinned; each turns by half
    the angle theta about the sheet's long axis, in opposite senses. No time stepping is needed:
    in each step the pins turn, the rest of the candidate stays where the last projection left it.

    The scene is infeasible by design. The ends of an edge line at the distance y from the axis
    lie on two circles of radius y, L apart, so they are sqrt(L^2 + (2 y sin(theta/2))^2) from each
    other. The line y = L/2 has the farthest ends; its edges grow to L_max = (1 + limit) L together
    where one of the limited directions runs along them (an even number of `directions`), and
    otherwise to what `longest_edges` says. So no positions can meet the limits from

        sin(theta/2) = sqrt((L_max/L)^2 - 1)

    on: 16.3 degrees at 1%. At even resolutions the angle is sharp: feasible positions were found
    at 0.999 of it. At odd ones two corner triangles have two pins and a vertex on a taut outer
    line, hence no freedom left, and their diagonals are overstretched a little before.

    Parameters
    ----------
    turn_rate : of the ends against each other [degrees/s].
    step : [s] between projections.
    """

    name = "twist"
    needs = frozenset()
    about = "an infeasible step"

    turn_rate: float = 90.0
    step: float = 1 / 60

    def __post_init__(self) -> None:
        super().__post_init__()
        if not np.isfinite(self.turn_rate):
            raise ValueError(f"turn_rate is {self.turn_rate}: a finite number is valid")
        if not 0 < self.step < float("inf"):
            raise ValueError(f"step is {self.step}: a number of seconds above 0 is valid")

    def easier(self) -> Scenario | None:
        """See the base class: a quarter of the angle, where the first step is past the limit."""
        past = np.deg2rad(abs(self.turn_rate)) * self.step >= self.infeasible_angle
        return replace(self, turn_rate=self.turn_rate / 4) if past else super().easier()

    @property
    def first_step(self) -> float:
        """See the base class; infinite where the ends never turn too far."""
        turn = abs(self.turn_rate) * self.step
        return max(1.0, np.ceil(np.rad2deg(self.infeasible_angle) / turn)) if turn else np.inf

    @property
    def usual_steps(self) -> int:
        """See the base class: one step past the limit, beyond which many methods do not go."""
        first = self.first_step
        return max(FEWEST_STEPS, int(first) + 1) if np.isfinite(first) else FEWEST_STEPS

    def has_begun(self, frame: Problem) -> bool:
        """See the base class."""
        return frame.infeasible_pins() is not None

    def sheet(self) -> tuple[FloatArray, IntArray, FloatArray, IntArray]:
        """See the base class; the axis is x."""
        rest, elements = square_grid(self.resolution, SIDE, "alternating")
        positions = np.column_stack([rest[:, 0], np.zeros(len(rest)), rest[:, 1] - SIDE / 2])
        ends = np.arange(self.resolution + 1)
        return rest, elements, positions, np.concatenate([ends, ends + len(rest) - len(ends)])

    def pin_positions(self, angle: float) -> FloatArray:
        """(p, 3) the pins [m], the ends turned against each other by `angle` [rad]."""
        _, _, positions, pinned = self.sheet()
        x, _, z = positions[pinned].T
        turn = np.where(x > SIDE / 2, angle / 2, -angle / 2)
        return np.column_stack([x, z * np.sin(turn), z * np.cos(turn)])

    @property
    def infeasible_angle(self) -> float:
        """The angle [rad] from which on no positions meet the limits; infinite if there is none."""
        edges, lengths = self.problem().longest_edges()
        rest = self.sheet()[0]
        outer = np.all(rest[edges][..., 1] == 0, axis=1)
        stretch = float(np.sum(lengths[outer])) / SIDE
        sine = np.sqrt(stretch**2 - 1)
        return 2 * float(np.arcsin(sine)) if sine <= 1 else float("inf")

    def play(self, project: Callable[[FloatArray], FloatArray]) -> Iterator[StepReport]:
        """Turn the pins, project, and so on."""
        _, _, positions, pinned = self.sheet()
        steps = 0
        while True:
            steps += 1
            candidate = positions.copy()
            time = steps * self.step
            candidate[pinned] = self.pin_positions(np.deg2rad(self.turn_rate) * time)
            positions = project(candidate)
            yield StepReport(time=time)
