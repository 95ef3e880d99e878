"""Scene and solver meet: what either does wrong is told, and laid at the right door."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

from scenarios.stretch_square import StretchSquare
from scenarios.swing import Swing
from strainbench import Solution, Solver
from strainbench.scenario.scenario import StepReport
from strainbench.scenario.stage import Stage, StageError, Who
from strainbench.solver.registry import find_solver
from tests import misbehaving


@dataclass(frozen=True)
class Twice(StretchSquare):
    """Two steps, the second with two projections (nobody)."""

    name = "twice"

    def play(self, project):
        x = project(self.problem().target)
        x[:] = np.nan  # its own: neither the solver nor the stage sees this
        yield StepReport()
        for _ in range(2):
            project(self.problem().target)
        yield StepReport(time=np.float32(0.5), newton_converged=np.True_)


@dataclass(frozen=True)
class Wrong(StretchSquare):
    """A step that goes wrong (nobody)."""

    name = "wrong"
    how: str = "raises"

    def problem(self):
        return None if self.how == "has no problem" else super().problem()

    def play(self, project):
        target = super().problem().target
        if self.how == "cannot begin":
            raise ZeroDivisionError("by a scene")
        return self.go_wrong(project, target.copy())

    def go_wrong(self, project, target):
        if self.how == "raises":
            raise ZeroDivisionError("by a scene")
        if self.how == "explodes":
            target[3, 1] = np.inf
        project(target[:-1] if self.how == "shrinks" else target)
        yield {"tells": {}, "counts": StepReport(newton_iterations="many")}[self.how]


def small(kind=StretchSquare, **settings):
    return kind(resolution=3, **settings)


def fault_of(scenario, solver=None):
    """Whose it is, and why, playing one step."""
    with pytest.raises(StageError) as found:
        list(Stage.opened(scenario, solver or find_solver("none")).steps(1))
    assert str(found.value) == found.value.reason
    return found.value.who, found.value.reason


@pytest.mark.parametrize(
    ("how", "reason"),
    [
        ("has no problem", "its problem is None, not a Problem"),
        ("cannot begin", "ZeroDivisionError: by a scene"),
        ("raises", "ZeroDivisionError: by a scene"),
        ("explodes", "the simulation has left the finite numbers"),
        ("shrinks", "ValueError: target: shape (15, 3), but rest has 16 vertices"),
        ("tells", "the scene yields dict, not a StepReport"),
        ("counts", "the scene's newton_iterations is 'many': a number is valid"),
    ],
)
def test_a_scene_at_fault(how, reason):
    who, found = fault_of(small(Wrong, how=how))
    assert who is Who.SCENE
    assert reason in found


@pytest.mark.parametrize(
    ("kind", "reason"),
    [
        ("Raise", "ZeroDivisionError: by a solver"),
        ("RaiseSupports", "ZeroDivisionError: by a question"),
        ("RaisePrepare", "ZeroDivisionError: by a set-up"),
        ("Refuse", "refuse cannot take stretch-square: it takes none"),
        ("Nothing", "TypeError: nothing returned NoneType, not a Solution"),
        ("NaN", "positions that are not finite; it says 'solved'"),
        ("Shape", "positions of shape (15, 3), type float64"),
        ("Single", "positions of shape (16, 3), type float32"),
        ("NoPositions", "positions of shape (), type object"),
        ("Vandal", "ValueError: assignment destination is read-only"),
        ("TextDetails", "details['x'] is 'text': a number is valid"),
        ("ListDetails", "details is [1]: a dict of numbers is valid"),
        ("NegativeIterations", "iterations is -1: a whole number from 0 on is valid"),
        ("Mute", "a status that cannot be written (ValueError)"),
    ],
)
def test_a_solver_at_fault(kind, reason):
    assert fault_of(small(), getattr(misbehaving, kind)()) == (Who.SOLVER, reason)


def test_who_interrupts_is_not_blamed():
    stage = Stage.opened(small(), misbehaving.Interrupt())
    with pytest.raises(KeyboardInterrupt):
        next(stage.steps(1))


def test_what_a_caller_raises_comes_out_as_it_is():
    class Enough(Exception):  # noqa: N818
        pass

    def project(_):
        raise Enough

    stage = Stage.opened(small(), find_solver("none"))
    with pytest.raises(Enough):
        list(stage.steps(1, project))


def test_steps_are_counted_and_reports_are_plain_numbers():
    stage = Stage.opened(small(Twice), find_solver("none"))
    assert stage.step == 0
    solved = []

    def project(target):
        solved.append(stage.solve(target))
        return stage.accept(solved[-1])

    reports = list(stage.steps(2, project))
    assert [p.step for p in solved] == [1, 2, 2]
    assert (type(reports[1].time), reports[1].time) == (float, 0.5)
    assert reports[1].newton_converged is True
    assert stage.step == 2


def test_a_scene_may_end_unless_more_steps_were_asked_for():
    assert len(list(Stage.opened(small(Twice), find_solver("none")).steps())) == 2
    with pytest.raises(StageError, match="the scene has no more steps") as found:
        list(Stage.opened(small(Twice), find_solver("none")).steps(3))
    assert found.value.who is Who.SCENE


def test_each_has_positions_of_its_own():
    @dataclass(frozen=True)
    class Keeps(Solver):
        """Hands out what it keeps (nobody)."""

        name = "keeps"

        def prepare(self, problem):
            return problem.target.copy()

        def solve(self, problem, state, *, tolerance, monitor, deadline):
            assert np.all(np.isfinite(state))
            return Solution(state, "solved", 0)

    stage = Stage.opened(small(Twice), Keeps())
    assert len(list(stage.steps(2))) == 2
    np.testing.assert_array_equal(stage.positions, stage.problem.target)
    assert not stage.positions.flags.writeable


def test_the_last_projection_stays_when_the_next_has_no_answer():
    stage = Stage.opened(small(), find_solver("clarabel"))
    next(stage.steps(1))
    frame, answer = stage.frame, stage.positions
    lost = replace(stage.solve(frame.target), solution=Solution(np.full((16, 3), np.nan), "?", 0))
    with pytest.raises(StageError):
        stage.accept(lost)
    assert stage.frame is frame
    assert stage.positions is answer
    assert frame.violations(answer).max() < 1e-6 < frame.violations(frame.target).max()


def test_projections_are_timed_by_the_clock_that_is_given():
    ticks = iter(range(10))
    stage = Stage(small(), find_solver("none"), clock=lambda: float(next(ticks)))
    stage.set_up()
    projections = [stage.solve(stage.problem.target) for _ in range(2)]
    assert [(p.begin, p.end) for p in projections] == [(0, 1), (2, 3)]
    assert all(p.solution.seconds > 0 for p in projections)  # the solver's clock is another


def test_a_solver_is_told_how_long_it_has():
    class Slow(Solver):
        """Says how long it has (nobody)."""

        name = "slow"

        def solve(self, problem, state, *, tolerance, monitor, deadline):
            return Solution(problem.target, f"{deadline.remaining:.0f}", 0)

    stage = Stage.opened(small(), Slow())
    assert stage.solve(stage.problem.target, 7.0).solution.status == "7"
    assert stage.solve(stage.problem.target).solution.status == "inf"


def test_other_candidates_can_take_the_place_of_the_scenes():
    stage = Stage.opened(small(Swing), find_solver("none"))
    target = stage.problem.target + 1.0

    def play(project):
        project(target)
        yield StepReport()

    assert len(list(stage.steps(play=play))) == 1
    np.testing.assert_array_equal(stage.frame.target, target)
