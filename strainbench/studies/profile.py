"""Where a solver's time goes on one projection: its named sections, in units that mean something.

1. Record the projections up to the one asked for, those before answered by the reference solver.
2. Compile the solver; then, in each repeat, prepare it anew and project. A solver that starts warm
   is given the projection before first, off the clock.
3. Each repeat also has one numeric factorisation and one solve of the mesh's own matrix, the unit
   of `strainbench duel`: seconds over it are alike on fast machines and slow ones.

Sections are `strainbench.solver.sections`; what is left of a solve is shown as the rest.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from time import perf_counter

import numpy as np

from strainbench.bench.recording import Recording
from strainbench.document import Column, Prose, Table
from strainbench.progress import Track, untracked
from strainbench.solver.sections import Part, listening
from strainbench.solver.solver import Solution, Solver, run_solver, warm_up
from strainbench.studies.duel.measure import Factorisation
from strainbench.studies.threads import one_thread

PREPARE, SOLVE, REST = "prepare, once a mesh", "solve", "the rest"
UNNAMED = Prose(
    'No section of its solve has a name: `with section("..."):`, of `strainbench`, gives one.'
)


@dataclass(frozen=True)
class Turn:
    """One repeat: [s] of preparing and solving, the sections of each, and the answer."""

    setup: float
    preparing: Mapping[str, Part]
    answer: Solution
    solving: Mapping[str, Part]


@dataclass(frozen=True)
class Profile:
    """What was measured of a solver on one projection.

    Parameters
    ----------
    unit : name of the factorisation and solve
    unit_seconds : [s] of each
    """

    turns: Sequence[Turn]
    unit: str
    unit_seconds: Sequence[float]

    def table(self, title: str) -> Table:
        """A line for each part: calls, median seconds, their share, and units."""
        setup = [t.setup for t in self.turns]
        solve = [t.answer.seconds for t in self.turns]
        lines = [
            *self._lines(PREPARE, setup, [t.preparing for t in self.turns]),
            *self._lines(SOLVE, solve, [t.solving for t in self.turns]),
        ]
        header: list[str | Column] = [
            "part",
            Column("calls", right=True),
            Column("time", "ms", form=".4g", right=True),
            Column("share", "%", form=".1f", right=True),
            Column(self.unit, form=".3g", right=True),
        ]
        return Table(title, header, lines, notes=self._notes())

    def _lines(
        self, name: str, wholes: Sequence[float], parts: Sequence[Mapping[str, Part]]
    ) -> list[tuple[object, ...]]:
        """A whole, then its sections and the rest, if it has sections; medians over the turns."""
        unit, whole = float(np.median(self.unit_seconds)), float(np.median(wholes))

        def line(what: str, calls: int | None, seconds: Sequence[float]) -> tuple[object, ...]:
            median = float(np.median(seconds))
            share = 100 * median / whole if whole > 0 else None
            return what, calls, 1e3 * median, share, median / unit

        lines = [line(name, 1, wholes)]
        for part in dict.fromkeys(key for turn in parts for key in turn):
            found = [turn.get(part, Part()) for turn in parts]
            lines.append(line(f"- {part}", found[-1].calls, [p.seconds for p in found]))
        if len(lines) > 1:
            inside = [sum(p.seconds for p in turn.values()) for turn in parts]
            left = [max(0.0, w - i) for w, i in zip(wholes, inside, strict=True)]
            lines.append(line(f"- {REST}", None, left))
        return lines

    def _notes(self) -> list[str]:
        answer = self.turns[-1].answer
        notes = [
            f"Medians of {len(self.turns)} repeats, one thread; the last column is in units of one "
            f"{self.unit} of the mesh's matrix, {1e3 * np.median(self.unit_seconds):.3g} ms.",
            f"It says {str(answer.status)!r} after {answer.iterations} iterations.",
        ]
        return notes if any(t.solving for t in self.turns) else [*notes, UNNAMED]


def profile(
    solver: Solver,
    recording: Recording,
    number: int,
    repeats: int,
    tolerance: float,
    time_limit: float | None = None,
    track: Track = untracked,
) -> Profile:
    """Measure a solver on the projection `number` of a recording, counted from 1.

    Raises
    ------
    ValueError
        One line: the solver cannot take the scene.
    """
    problem = recording.problem
    if refusal := solver.supports(problem):
        raise ValueError(f"{solver.label} cannot take this scene: {refusal}")
    with one_thread():
        warm_up(solver, problem, tolerance)
        unit = Factorisation(problem)
        unit.take_turn()  # what its first one compiles or reads is no part of a unit
        unit.entry.seconds.clear()
        turns = []
        for _ in track(range(repeats), "repeats", repeats):
            turns.append(_turn(solver, recording, number, tolerance, time_limit))
            unit.take_turn()
    return Profile(turns, unit.entry.label, unit.entry.seconds)


def _turn(
    solver: Solver, recording: Recording, number: int, tolerance: float, time_limit: float | None
) -> Turn:
    with listening() as preparing:
        begin = perf_counter()
        state = solver.prepare(recording.problem)
        setup = perf_counter() - begin
    if solver.starts_warm and number > 1:
        run_solver(solver, recording.frame(number - 1), state, tolerance, time_limit)
    with listening() as solving:
        answer = run_solver(solver, recording.frame(number), state, tolerance, time_limit)
    return Turn(setup, preparing.parts, answer, solving.parts)
