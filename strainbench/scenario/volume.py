"""A body of tetrahedra, stepped by backward Euler (Hernandez et al. 2013, section 4)."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from math import ceil
from time import perf_counter
from typing import ClassVar

import numpy as np

from strainbench.arrays import FloatArray
from strainbench.physics.implicit_euler import NewtonSettings, minimise_step
from strainbench.physics.solid import Solid, linearised_step
from strainbench.problem.principal import PrincipalLimits
from strainbench.problem.problem import Problem
from strainbench.scenario.scenario import FEWEST_STEPS, Scenario, StepReport

INTEGRATORS = ("linearised", "nonlinear")


@dataclass(frozen=True)
class VolumeScenario(Scenario):
    """A body of tetrahedra, stepped by backward Euler (Hernandez et al. 2013, section 4).

    Each step is projected in the norm of its own metric A, with limits on principal stretches that
    methods of one step linearise where it starts. `directions` has no meaning. Elastic energy is
    reported as that of the membrane.

    Parameters
    ----------
    resolution : cells across the body, five tetrahedra each.
    limit : strain of the limited axes, above as below.
    step : time step [s].
    integrator : "linearised" as in the paper, or "nonlinear", the minimising implicit Euler of the
        cloth scenes, which knows no damping.
    young : Young's modulus [Pa].
    alpha, beta : Rayleigh damping by masses [1/s] and by stiffness [s].
    """

    lasts: ClassVar[float] = 0.0

    resolution: int = 2
    step: float = 5e-3
    integrator: str = "linearised"
    young: float = 1e4
    alpha: float = 0.0
    beta: float = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.integrator not in INTEGRATORS:
            valid = ", ".join(INTEGRATORS)
            raise ValueError(f"integrator is {self.integrator!r}: valid are {valid}")
        if not 0 < self.step < np.inf:
            raise ValueError(f"step is {self.step}: a number of seconds above 0 is valid")
        for name in ("alpha", "beta"):
            if self.integrator == "nonlinear" and getattr(self, name) != 0:
                value = getattr(self, name)
                raise ValueError(f"{name} is {value}: 0 is valid with the nonlinear integrator")
        _ = self.principal()  # names what is wrong before anything runs

    @abstractmethod
    def solid(self) -> Solid:
        """The body at rest."""

    @abstractmethod
    def principal(self) -> PrincipalLimits:
        """The limits."""

    @cached_property
    def _body(self) -> Solid:
        return self.solid()

    @property
    def usual_steps(self) -> int:
        """See the base class."""
        return max(FEWEST_STEPS, ceil(self.lasts / self.step))

    def problem(self) -> Problem:
        """The projection at the start, in the norm of the masses."""
        body = self._body
        return Problem(
            body.rest, body.elements, body.rest, self.principal(), body.pinned, body.mass
        )

    def frame(self, problem: Problem, target: FloatArray, start: FloatArray) -> Problem:
        """In the norm of the step's metric, and linearised where it starts."""
        return problem.with_target(target, self._body.metric(start, self.step), start)

    def play(self, project: Callable[[FloatArray], FloatArray]) -> Iterator[StepReport]:
        """Time steps from rest; see the base class."""
        body = self._body
        at_rest = body.rest[body.pinned]
        return self._steps(project, np.zeros_like(body.rest), lambda time: at_rest)  # noqa: ARG005

    def _steps(
        self,
        project: Callable[[FloatArray], FloatArray],
        v: FloatArray,
        pins: Callable[[float], FloatArray],
    ) -> Iterator[StepReport]:
        """Time steps from velocities v (n, 3), with pins (p, 3) where they are at a time."""
        body, h, time, x = self._body, self.step, 0.0, self._body.rest.copy()
        while True:
            begin, iterations, converged = perf_counter(), 1, True
            if self.integrator == "linearised":
                candidate = linearised_step(body, x, v, h, pins(time + h))
            else:
                start = x.copy()
                start[body.pinned] = pins(time + h)
                candidate, newton = minimise_step(body, start, x + h * v, h, NewtonSettings())
                iterations, converged = newton.iterations, newton.converged
            seconds = perf_counter() - begin
            limited = project(candidate)
            x, v, time = limited, (limited - x) / h, time + h
            yield self._report(x, v, time, seconds, iterations, converged)

    def _report(
        self,
        x: FloatArray,
        v: FloatArray,
        time: float,
        seconds: float,
        iterations: int,
        converged: bool,
    ) -> StepReport:
        energies, _ = self._body.potential(x)
        mass = self._body.mass[:, None]
        momentum = np.sum(mass * v, axis=0)
        return StepReport(
            time=time,
            ie_seconds=seconds,
            newton_iterations=iterations,
            newton_converged=converged,
            kinetic_energy=0.5 * float(np.sum(mass * v**2)),
            gravity_energy=energies["gravity"],
            membrane_energy=energies["corotational"],
            momentum_x=float(momentum[0]),
            momentum_y=float(momentum[1]),
            momentum_z=float(momentum[2]),
        )
