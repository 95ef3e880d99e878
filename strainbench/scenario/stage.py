"""The stage, on which a scene and a solver meet: the closed loop of the two, with its checks.

    stage = Stage.opened(scenario, solver)
    for report in stage.steps(10):
        print(report.time, stage.positions)

The scene's mesh is asked for once, and the solver prepared for it. In each step the scene proposes
candidates, the solver limits them, and the scene goes on from the answers. What either does that it
must not is a `StageError`, which says whose fault it is.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, fields, replace
from enum import StrEnum
from itertools import count, islice
from numbers import Integral, Real
from typing import Any

import numpy as np

from strainbench.arrays import FloatArray, read_only
from strainbench.physics.integrators import Project
from strainbench.plugins import told
from strainbench.problem.problem import Problem
from strainbench.scenario.scenario import Scenario, StepReport
from strainbench.solver.solver import Solution, Solver, run_solver, warm_up

LONGEST_STATUS = 1000  # characters
UNLIMITED = "none"  # the solver that leaves candidates as they are
Play = Callable[[Project], Iterator[StepReport]]
"""What `Scenario.play` is."""


class Who(StrEnum):
    """Whose fault it is."""

    SCENE = "the scene"
    SOLVER = "the solver"


class StageError(ValueError):
    """Ends a play: who is to blame, and why in one line."""

    def __init__(self, who: Who, reason: str) -> None:
        super().__init__(reason)
        self.who, self.reason = who, reason


class NoAnswerError(StageError):
    """Positions that are not finite: a scene may catch it, and go on without them."""


@dataclass(frozen=True, eq=False)
class Projection:
    """A candidate, and what a solver made of it.

    Parameters
    ----------
    step : of the scene, from 1 on
    frame : the problem, its target the candidate
    solution : in plain numbers and words; its positions as they came
    begin, end : by the stage's clock [s]
    """

    step: int
    frame: Problem
    solution: Solution
    begin: float
    end: float

    @property
    def fits(self) -> bool:
        """Whether the positions are doubles, one for each of the candidate's."""
        x = self.solution.positions
        return x.shape == self.frame.target.shape and x.dtype == np.float64

    @property
    def fault(self) -> str:
        """Why the scene cannot go on from the answer, or ""."""
        x = self.solution.positions
        if not self.fits:
            return f"positions of shape {x.shape}, type {x.dtype}"
        if not np.all(np.isfinite(x)):
            return f"positions that are not finite; it says {self.solution.status!r}"
        return ""


class Stage:
    """A scene and the solver that limits its candidates.

    Parameters
    ----------
    tolerance : aimed at by the solver
    clock : what projections are timed by, beside the solver's own clock

    Attributes
    ----------
    problem : the scene's, at the start
    step : in which the scene is, from 1 on; 0 before
    frame, positions : the last projection that has an answer, and that; at the start the scene's
        own; both read-only

    Raises
    ------
    StageError
        If the scene has no problem.
    """

    def __init__(
        self,
        scenario: Scenario,
        solver: Solver,
        tolerance: float = 1e-6,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.scenario, self.solver, self.tolerance = scenario, solver, tolerance
        self.clock, self.step = clock, 0
        self.state: Any = None
        with blamed(Who.SCENE):
            self.problem = scenario.problem()
        if not isinstance(self.problem, Problem):
            raise StageError(Who.SCENE, f"its problem is {_short(self.problem)}, not a Problem")
        self.frame, self.positions = self.problem, self.problem.target

    @classmethod
    def opened(cls, scenario: Scenario, solver: Solver, tolerance: float = 1e-6) -> Stage:
        """A stage that is set up; StageError too if the solver does not take the scene."""
        stage = cls(scenario, solver, tolerance)
        if refusal := stage.refusal():
            reason = f"{solver.label} cannot take {scenario.name}: {refusal}"
            raise StageError(Who.SOLVER, reason)
        stage.set_up()
        return stage

    def refusal(self) -> str | None:
        """Why the solver does not take the scene, or None."""
        if not self.scenario.projects and self.solver.name != UNLIMITED:
            return f"it takes no projection; the solver {UNLIMITED} alone is valid"
        with blamed(Who.SOLVER):
            return self.solver.supports(self.problem)

    def warm_up(self, physics: bool = True) -> None:
        """Compile what either compiles on first use; the scene's part only with `physics`."""
        with blamed(Who.SOLVER):
            warm_up(self.solver, self.problem, self.tolerance)
        if physics:
            with blamed(Who.SCENE):
                self.scenario.warm_up()

    def set_up(self) -> None:
        """Let the solver prepare for the mesh."""
        with blamed(Who.SOLVER):
            self.state = self.solver.prepare(self.problem)

    def solve(self, target: FloatArray, time_limit: float | None = None) -> Projection:
        """Hand the solver a candidate (n, 3), with so many seconds for it."""
        with blamed(Who.SCENE):
            if not np.all(np.isfinite(target)):
                raise StageError(Who.SCENE, "the simulation has left the finite numbers")
            frame = self.scenario.frame(self.problem, target, self.positions)
        with blamed(Who.SOLVER):
            begin = self.clock()
            solution = run_solver(self.solver, frame, self.state, self.tolerance, time_limit)
            end = self.clock()
            return Projection(self.step, frame, plain_solution(solution), begin, end)

    def accept(self, projection: Projection) -> FloatArray:
        """The answer (n, 3) for the scene to go on from, its own."""
        if projection.fault:
            kind = NoAnswerError if projection.fits else StageError
            raise kind(Who.SOLVER, projection.fault)
        answer = projection.solution.positions
        self.frame, self.positions = projection.frame, read_only(answer.copy())
        return answer.copy()

    def project(self, target: FloatArray) -> FloatArray:
        """Limit one candidate."""
        return self.accept(self.solve(target))

    def steps(
        self,
        number: int | None = None,
        project: Project | None = None,
        play: Play | None = None,
        first: int = 1,
    ) -> Iterator[StepReport]:
        """The scene's reports on its steps, in plain numbers.

        Parameters
        ----------
        number : of steps; None is all that the scene has
        project : limits a candidate, by way of `solve` and `accept`; what it raises passes as it is
        play : in place of the scene's own
        first : the number of its first step
        """
        gate = _Gate(project or self.project)
        with blamed(Who.SCENE):
            playing = iter((play or self.scenario.play)(gate))
        over: Any = object()
        for self.step in islice(count(first), number):
            with blamed(Who.SCENE, gate):
                report = next(playing, over)
            if report is not over:
                yield plain_report(report)
            elif number is None:
                return
            else:
                raise StageError(Who.SCENE, "the scene has no more steps")


class _Gate:
    """Where candidates leave the scene; it remembers what came of the last one, if an error."""

    def __init__(self, project: Project) -> None:
        self._project = project
        self.error: BaseException | None = None

    def __call__(self, target: FloatArray) -> FloatArray:
        try:
            return self._project(target)
        except BaseException as error:
            self.error = error
            raise


@contextmanager
def blamed(who: Who, gate: _Gate | None = None) -> Iterator[None]:
    """Turn an error within into a StageError, unless it is one or has come in by the gate."""
    try:
        yield
    except StageError:
        raise
    except Exception as error:
        if gate and error is gate.error:
            raise
        raise StageError(who, told(error)) from error


def plain_report(report: StepReport) -> StepReport:
    """A scene's report on a step, all numbers."""
    if not isinstance(report, StepReport):
        reason = f"the scene yields {type(report).__name__}, not a StepReport"
        raise StageError(Who.SCENE, reason)
    with blamed(Who.SCENE):
        found = {f.name: getattr(report, f.name) for f in fields(StepReport)}
        plain = {k: _number(Who.SCENE, v, f"the scene's {k}") for k, v in found.items()}
    return StepReport(**plain)  # type: ignore[arg-type]


def plain_solution(solution: Solution) -> Solution:
    """The same with plain iterations, status and details, and an array of positions."""
    who, details = Who.SOLVER, solution.details
    iterations = _number(who, solution.iterations, "iterations")
    if iterations != iterations // 1 or iterations < 0:
        valid = "a whole number from 0 on is valid"
        raise StageError(who, f"iterations is {_short(iterations)}: {valid}")
    if not isinstance(details, Mapping):
        raise StageError(who, f"details is {_short(details)}: a dict of numbers is valid")
    return replace(
        solution,
        positions=np.asarray(solution.positions),
        iterations=int(iterations),
        status=_words(solution.status),
        details={str(k): _number(who, v, f"details[{_short(k)}]") for k, v in details.items()},
    )


def _words(status: object) -> str:
    try:
        return str(status)[:LONGEST_STATUS]
    except Exception as error:  # of a solver's own type
        reason = f"a status that cannot be written ({told(error)})"
        raise StageError(Who.SOLVER, reason) from None


def _number(who: Who, value: object, what: str) -> float:
    """A real number as JSON can hold it."""
    if isinstance(value, bool | np.bool_):
        return bool(value)
    try:
        if isinstance(value, Integral) and abs(int(value)) < 2**63:
            return int(value)
        if isinstance(value, Real):
            return float(value)
    except OverflowError:
        pass  # a whole number of more digits than floats reach
    raise StageError(who, f"{what} is {_short(value)}: a number is valid")


def _short(value: object) -> str:
    try:
        return repr(value)[:80]
    except Exception as error:  # a plug-in's own type
        return f"a {type(value).__name__} ({told(error)[:80]})"
