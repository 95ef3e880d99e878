"""A sheet of cloth, stepped by one of the paper's schemes (Tang et al. 2022, section 4)."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from math import ceil
from time import perf_counter
from typing import ClassVar

import numpy as np

from strainbench.arrays import FloatArray
from strainbench.physics.body import gravity_of
from strainbench.physics.cloth import Cloth, Material
from strainbench.physics.constrained import constrained_step
from strainbench.physics.energies.contact import Contact
from strainbench.physics.implicit_euler import NewtonReport, NewtonSettings, minimise_step
from strainbench.physics.integrators import CONSTRAINED, INTEGRATORS, Motion
from strainbench.problem.problem import Problem
from strainbench.scenario.scenario import FEWEST_STEPS, SheetScenario, StepReport


@dataclass(frozen=True)
class ClothScenario(SheetScenario):
    """A sheet of cloth, stepped by one of the paper's schemes.

    Gravity, membrane and bending are built where they are in `needs`; without "inertia" each step
    starts at rest. `begins` is when what the scene is about begins, and `lasts` how long a run
    shows it, both in seconds of its time.

    Parameters
    ----------
    integrator : sap, sar, bap or bar as in the paper, or sar-projected, bar-bdf2 or bar-stable,
        our variants of them: `strainbench.physics.integrators`. Or constrained: the limits are kept
        by each step itself, a reference that takes no projection.
    step : time step [s].
    norm : "unweighted" as printed in Eq. 5, or "mass".
    """

    about: ClassVar[str] = "contact"
    begins: ClassVar[float] = 0.0
    lasts: ClassVar[float] = 0.0

    norm: str = "unweighted"
    integrator: str = "sap"
    step: float = 1 / 60

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.integrator not in INTEGRATORS:
            valid = ", ".join(INTEGRATORS)
            raise ValueError(f"integrator is {self.integrator!r}: valid are {valid}")
        if not 0 < self.step < float("inf"):
            raise ValueError(f"step is {self.step}: a number of seconds above 0 is valid")

        if not self.projects and self.directions == "exact":
            raise ValueError("integrator constrained: directions exact has none; a number has")

    @property
    def projects(self) -> bool:
        """See the base class."""
        return self.integrator != CONSTRAINED

    @property
    def first_step(self) -> float:
        """See the base class."""
        return max(1, ceil(self.begins / self.step))

    @property
    def usual_steps(self) -> int:
        """See the base class."""
        return max(FEWEST_STEPS, ceil(self.lasts / self.step))

    def has_begun(self, frame: Problem) -> bool:
        """See the base class: whether a vertex is in an obstacle's margin, if there are any."""
        contact = self.contact()
        return contact is None or contact.touches(frame.target)

    def material(self) -> Material:
        """The constants of Tang et al. 2022, section 5; without the energies not needed."""
        return Material().only(self.needs)

    def contact(self) -> Contact | None:
        """What the sheet is kept off, or None."""
        return None

    def force(
        self,
        positions: FloatArray,  # noqa: ARG002
        velocities: FloatArray,  # noqa: ARG002
        time: float,  # noqa: ARG002
    ) -> FloatArray | None:
        """(n, 3) explicit forces [N] besides gravity, or None if there are none.

        Parameters
        ----------
        positions : (n, 3) [m], at the start of the sub-step.
        velocities : (n, 3) [m/s], at the start of the step.
        time : [s], at the end of the sub-step.
        """
        return None

    def cloth(self) -> Cloth:
        """The sheet's masses and energies."""
        rest, elements, _, pinned = self.sheet()
        gravity = gravity_of(self.needs)
        return Cloth(rest, elements, self.material(), pinned, self.contact(), gravity)

    def mass(self) -> FloatArray:
        """(n,) [kg], lumped at the vertices."""
        return self.cloth().mass

    def pin_positions(self, time: float) -> FloatArray | None:  # noqa: ARG002
        """(p, 3) where the pins are at `time` [m], or None if they never move."""
        return None

    def play(self, project: Callable[[FloatArray], FloatArray]) -> Iterator[StepReport]:
        """Time steps from rest; see the base class."""
        cloth = self.cloth()
        positions = self.sheet()[2]
        motion = Motion(positions, np.zeros_like(positions), 0.0)
        scheme, problem = INTEGRATORS[self.integrator], self.problem()
        _ = cloth.linear_solver  # sparsity and ordering, once a mesh: part of no step
        while True:
            step = _Step(self, cloth, problem, motion.velocities)
            motion = scheme(motion, self.step, step.minimise, project)
            yield step.report(motion)
            if "inertia" not in self.needs:
                motion = Motion(motion.positions, np.zeros_like(positions), motion.time)


class _Step:
    """The minimisations of one time step, and what they cost."""

    def __init__(
        self, scene: ClothScenario, cloth: Cloth, problem: Problem, velocities: FloatArray
    ) -> None:
        self.scene, self.cloth, self.velocities = scene, cloth, velocities
        self.problem = problem
        self.settings = NewtonSettings()
        self.seconds, self.pin_work = 0.0, 0.0
        self.newton: list[NewtonReport] = []

    def minimise(
        self, start: FloatArray, inertial: FloatArray, step: float, time: float
    ) -> FloatArray:
        """The candidate of a sub-step, with the pins where the scene has them at `time`."""
        begin = perf_counter()
        pinned, first = self.cloth.pinned, start.copy()
        where = self.scene.pin_positions(time)
        first[pinned] = start[pinned] if where is None else where
        push = self.scene.force(start, self.velocities, time)
        if push is not None:
            inertial = inertial + step**2 * push / self.cloth.mass[:, None]
        found, limits_force, report = self._minimum(first, inertial, step)
        self.seconds += perf_counter() - begin
        self.newton.append(report)
        if where is not None:
            inertia = self.cloth.mass[:, None] * (found - inertial) / step**2
            force = (self.cloth.potential(found)[1] + inertia + limits_force)[pinned]
            self.pin_work += float(np.sum(force * (found - start)[pinned]))
        return found

    def _minimum(
        self, first: FloatArray, inertial: FloatArray, step: float
    ) -> tuple[FloatArray, FloatArray, NewtonReport]:
        """Positions, and the gradient of the limits' terms there (n, 3) [N], if they play a part.

        Raises
        ------
        ArithmeticError
            If a constrained step is unsolved: nothing goes on from it.
        """
        if self.scene.projects:
            found, newton = minimise_step(self.cloth, first, inertial, step, self.settings)
            return found, np.zeros_like(found), newton
        found, report = constrained_step(self.cloth, self.problem, first, inertial, step)
        if not report.converged:
            raise ArithmeticError(f"the constrained step is unsolved: {report.reason}")
        G = self.problem.G
        return found, G.T @ (report.multipliers[:, None] * (G @ found)), report

    def report(self, motion: Motion) -> StepReport:
        """The step's costs, and energy and momentum after it."""
        mass, v = self.cloth.mass[:, None], motion.velocities
        energies, _ = self.cloth.potential(motion.positions)
        contact = self.cloth.contact
        momentum = np.sum(mass * v, axis=0)
        return StepReport(
            time=motion.time,
            ie_seconds=self.seconds,
            newton_iterations=sum(r.iterations for r in self.newton),
            newton_converged=all(r.converged for r in self.newton),
            assembly_seconds=sum(r.assembly_seconds for r in self.newton),
            factorisation_seconds=sum(r.factorisation_seconds for r in self.newton),
            line_search_seconds=sum(r.line_search_seconds for r in self.newton),
            kinetic_energy=0.5 * float(np.sum(mass * v**2)),
            gravity_energy=energies["gravity"],
            membrane_energy=energies["membrane"],
            bending_energy=energies["bending"],
            momentum_x=float(momentum[0]),
            momentum_y=float(momentum[1]),
            momentum_z=float(momentum[2]),
            pin_work=self.pin_work,
            contact_energy=energies.get("contact", 0.0),
            penetration=contact.penetration(motion.positions) if contact else 0.0,
        )
