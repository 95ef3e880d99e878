"""What a solver is, and how one is run: prepared once a mesh, timed on each projection."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields, replace
from time import perf_counter
from typing import Any, ClassVar

import numpy as np

from strainbench.arrays import FloatArray
from strainbench.fields import same, spelled
from strainbench.problem.contact import rubs
from strainbench.problem.grid import square_grid
from strainbench.problem.problem import Problem

Watch = Callable[[float, int, FloatArray, FloatArray | None], None]
"""Called with seconds and iterations so far, the positions (n, 3) and perhaps the multipliers
(rows, 3); the arrays are the solver's own, and change after the call."""


@dataclass(frozen=True)
class Solution:
    """What a solver returns; the suite adds the seconds it measured.

    Parameters
    ----------
    positions : (n, 3) [m]; NaN where the solver has no answer.
    status : in the solver's own words, "solved" where it claims success; never believed.
    iterations : of the solver's outer loop.
    multipliers : (rows, 3), optional; Y with G^T Y = M (target - x) on the free vertices, so
        that (G x)_i and Y_i point the same way where constraint i is active.
    details : further numbers worth recording, e.g. seconds spent in a modelling layer.
    seconds, setup_seconds : measured by the suite: the solve, and `prepare`.
    """

    positions: FloatArray
    status: str
    iterations: int
    multipliers: FloatArray | None = None
    details: Mapping[str, float] = field(default_factory=dict)
    seconds: float = float("nan")
    setup_seconds: float = float("nan")


class Clock:
    """Solve time, which stands still while a monitor looks at an iterate.

    Attributes
    ----------
    paused : seconds that monitors took
    """

    def __init__(self, time_limit: float | None = None, watch: Watch | None = None) -> None:
        self._limit = float("inf") if time_limit is None else time_limit
        self._watch = watch
        self._iterations = 0
        self.paused = 0.0
        self._start = perf_counter()

    @property
    def elapsed(self) -> float:
        """Seconds on the clock."""
        return perf_counter() - self._start - self.paused

    @property
    def remaining(self) -> float:
        """Seconds left; infinite without a limit, negative once it has passed."""
        return self._limit - self.elapsed

    @property
    def passed(self) -> bool:
        """Whether the deadline has passed: a solver then returns what it has."""
        return self.remaining <= 0

    def monitor(
        self,
        positions: FloatArray,
        multipliers: FloatArray | None = None,
        iterations: int | None = None,
    ) -> None:
        """Show an iterate to whoever watches, off the clock.

        Parameters
        ----------
        iterations : done so far, where the solver does not show the iterate of each.
        """
        if self._watch is None:
            return
        start = perf_counter()
        self._iterations = self._iterations + 1 if iterations is None else iterations
        seconds = start - self._start - self.paused
        self._watch(seconds, self._iterations, positions, multipliers)
        self.paused += perf_counter() - start


@dataclass(frozen=True)
class Solver(ABC):
    """A projection method: a frozen dataclass whose fields are its parameters.

    The first line of the docstring reads "method (paper)"; `strainbench list` shows both.
    `name` is lower case with hyphens. `variants` names other settings worth showing beside the
    defaults: {"default": {"scaling": "default"}} adds the solver `<name>-default`.
    A field `warm: bool = False` says that the method can start from the frame before, which it
    then keeps in its `state` (`strainbench.solver.memory`): `--start warm` sets it.
    `takes_exact` says that the method has a form for exact limits, `takes_lower` that it has one
    for lower bounds, which are not convex, `takes_principal` for limits on principal stretches,
    `takes_metric` that it projects in any norm, `takes_contact` that it keeps vertices off planes,
    `takes_friction` that these rub; other kinds of limits name the declaration that they need
    (`strainbench.problem.kinds`).
    """

    name: ClassVar[str]
    variants: ClassVar[Mapping[str, Mapping[str, object]]] = {}
    takes_exact: ClassVar[bool] = False
    takes_lower: ClassVar[bool] = False
    takes_principal: ClassVar[bool] = False
    takes_metric: ClassVar[bool] = False
    takes_contact: ClassVar[bool] = False
    takes_friction: ClassVar[bool] = False

    def supports(self, problem: Problem) -> str | None:
        """None, or the reason why this method cannot take the problem."""
        for declaration, reason in problem.kind.needs.items():
            if not getattr(self, declaration, False):
                return reason
        if problem.metric is not None and not self.takes_metric:
            return "it projects in norms of masses alone, not in that of a metric"
        if problem.contact and not self.takes_contact:
            return "it has no rows for contact with planes"
        if rubs(problem.contact) and not self.takes_friction:
            return "it has no friction, with which a step is no projection"
        return None

    def missing(self) -> str | None:
        """None, or what these parameters need that is not installed."""
        return None

    def prepare(self, problem: Problem) -> Any:  # noqa: ARG002
        """What is worth computing once a mesh; `solve` gets it back as `state`."""
        return None

    @abstractmethod
    def solve(
        self,
        problem: Problem,
        state: Any,
        *,
        tolerance: float,
        monitor: Callable[..., None],
        deadline: Clock,
    ) -> Solution:
        """Project, aiming for a max violation and a relative gap below `tolerance`.

        `monitor(positions)` shows an iterate, off the clock, with `iterations=k` if not each is
        shown; `deadline.passed` says when to stop and `deadline.remaining` how many seconds are
        left. The problem is read-only.
        """

    @property
    def starts_warm(self) -> bool | None:
        """Whether it starts from the frame before; None where it cannot."""
        warm = self.parameters.get("warm")
        return warm if isinstance(warm, bool) else None

    @property
    def parameters(self) -> dict[str, object]:
        """The fields and their values."""
        return {f.name: getattr(self, f.name) for f in fields(self)}

    @property
    def label(self) -> str:
        """The name, with the variant's where one matches, else with what differs from default.

        A solver that starts warm has its cold twin's label and "-warm".
        """
        if self.starts_warm:
            return replace(self, warm=False).label + "-warm"  # type: ignore[call-arg]
        default = type(self)().parameters
        changed = {k: v for k, v in self.parameters.items() if not same(v, default[k])}
        if not changed:
            return self.name
        for variant, settings in self.variants.items():
            if same(changed, {k: v for k, v in settings.items() if not same(v, default[k])}):
                return f"{self.name}-{variant}"
        return self.name + "[" + ",".join(f"{k}={spelled(v)}" for k, v in changed.items()) + "]"


def warm_twin(solver: Solver) -> Solver:
    """The same, starting from the frame before."""
    return replace(solver, warm=True)  # type: ignore[call-arg]


def check_threads(threads: int) -> None:
    """ValueError for anything but a number of threads."""
    whole = isinstance(threads, (int, np.integer)) and not isinstance(threads, bool)
    if not whole or threads < 1:
        raise ValueError(f"threads is {threads!r}: a whole number of at least 1 is valid")


def run_solver(
    solver: Solver,
    problem: Problem,
    state: Any,
    tolerance: float,
    time_limit: float | None = None,
    watch: Watch | None = None,
    now: Callable[[], float] = perf_counter,
) -> Solution:
    """One timed projection with a prepared solver.

    `now` is bound here, out of the way of a plug-in that replaces this module's clock.

    Raises
    ------
    TypeError
        If the solver returns anything but a Solution.
    """
    clock = Clock(time_limit, watch)
    begin = now()
    try:
        solution = solver.solve(
            problem, state, tolerance=tolerance, monitor=clock.monitor, deadline=clock
        )
    except BaseException as error:
        if type(error).__name__ != "PanicException":  # of pyo3, which shows no class to import
            raise
        words = " ".join(str(error).split())
        solution = Solution(np.full_like(problem.target, np.nan), f"panic: {words}", 0)
    seconds = now() - begin - (clock.paused if watch else 0.0)
    if not isinstance(solution, Solution):
        raise TypeError(f"{solver.name} returned {type(solution).__name__}, not a Solution")
    s = solution  # perhaps of a class with a mind of its own
    return Solution(s.positions, s.status, s.iterations, s.multipliers, s.details, seconds)


def held_still(problem: Problem, tolerance: float) -> Solution:
    """The answer where no vertex is free: the target, if it is within the limits."""
    within = problem.violations(problem.target).max() <= tolerance
    status = "solved" if within else "infeasible"
    return Solution(problem.target.copy(), status, 0, np.zeros((problem.rows, 3)))


def warm_up(solver: Solver, problem: Problem, tolerance: float) -> None:
    """Compile what is compiled on first use, on four triangles with limits like the problem's.

    Volumes are left to compile on the clock's first projection.
    """
    if problem.rest.shape[-1] != 2:
        return
    rest, elements = square_grid(2, 1.0, "uniform")
    limits = problem.limits.first()
    bounds = max(1.0, float(limits.bounds.max()))  # those of other kinds may be no stretches
    toy = Problem(
        rest=rest,
        elements=elements,
        target=np.column_stack([2 * bounds * rest, 0.1 * rest[:, 0]]),
        limits=limits,
        pinned=np.array([0]) if len(problem.pinned) else np.array([], dtype=np.int64),
        mass=None if problem.mass is None else np.linspace(1.0, 2.0, len(rest)),
    )
    run_solver(solver, toy, solver.prepare(toy), tolerance, time_limit=60.0)
