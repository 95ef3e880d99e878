"""What a scene is: its mesh, limits, pins, physics, and nothing that it does not need."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields, replace
from time import perf_counter
from typing import ClassVar

import numpy as np

from strainbench.limits import FloatArray, StretchLimits
from strainbench.physics.cloth import Cloth, Material
from strainbench.physics.implicit_euler import NewtonSettings, minimise_step
from strainbench.physics.integrators import INTEGRATORS, Motion
from strainbench.problem import IntArray, Problem


@dataclass(frozen=True)
class StepReport:
    """What the physics of one time step cost and whether it converged."""

    ie_seconds: float  # in implicit Euler's Newton solver
    newton_iterations: int
    newton_converged: bool
    assembly_seconds: float = 0.0  # of ie_seconds: of Hessians
    factorisation_seconds: float = 0.0  # and the solves with the factors
    line_search_seconds: float = 0.0  # energies and gradients


@dataclass(frozen=True)
class Scenario(ABC):
    """A scene: a frozen dataclass whose fields can be set from the command line.

    The first line of the docstring reads "scene (paper)". `needs` names the physics that the
    scene cannot do without; what it does not need is not built.

    Parameters
    ----------
    resolution : cells a side.
    limit : largest strain allowed; 0.01 is 1%.
    directions : sampled directions an element.
    """

    name: ClassVar[str]
    needs: ClassVar[frozenset[str]]

    resolution: int = 20
    limit: float = 0.01
    directions: int = 4

    def __post_init__(self) -> None:
        if self.resolution < 1:
            raise ValueError(f"resolution is {self.resolution}: a whole number above 0 is valid")
        if not 0 < self.limit < 1:
            raise ValueError(
                f"limit is {self.limit}: a strain between 0 and 1 is valid, 0.01 or 1% for 1%"
            )
        if self.directions < 1:
            raise ValueError(f"directions is {self.directions}: a whole number above 0 is valid")

    @abstractmethod
    def problem(self) -> Problem:
        """The projection at the start: mesh, limits, pins, and the initial positions as target."""

    @abstractmethod
    def play(self, project: Callable[[FloatArray], FloatArray]) -> Iterator[StepReport]:
        """Run the scene, step by step, with `project` limiting each candidate."""

    def warm_up(self) -> None:
        """Compile what `play` compiles on first use, off the clock."""
        next(replace(self, resolution=2).play(lambda target: target))

    @property
    def parameters(self) -> dict[str, object]:
        """The fields and their values."""
        return {f.name: getattr(self, f.name) for f in fields(self)}

    def limits(self) -> StretchLimits:
        """The same bound in all directions."""
        return StretchLimits.isotropic(1 + self.limit, self.directions)


@dataclass(frozen=True)
class ClothScenario(Scenario):
    """A sheet of cloth that moves under gravity, stepped by one of the paper's schemes.

    Parameters
    ----------
    integrator : "sap" (implicit Euler, then the projection).
    step : time step [s].
    norm : "unweighted" as printed in Eq. 5, or "mass".
    """

    integrator: str = "sap"
    step: float = 1 / 60
    norm: str = "unweighted"

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.integrator not in INTEGRATORS:
            valid = ", ".join(INTEGRATORS)
            raise ValueError(f"integrator is {self.integrator!r}: valid are {valid}")
        if not 0 < self.step < float("inf"):
            raise ValueError(f"step is {self.step}: a number of seconds above 0 is valid")
        if self.norm not in ("unweighted", "mass"):
            raise ValueError(f"norm is {self.norm!r}: valid are unweighted, mass")

    @abstractmethod
    def sheet(self) -> tuple[FloatArray, IntArray, FloatArray, IntArray]:
        """Rest positions (n, 2), triangles (e, 3), initial positions (n, 3), pins (p,)."""

    def material(self) -> Material:
        """The constants of Tang et al. 2022, section 5."""
        return Material()

    def cloth(self) -> Cloth:
        """The sheet's masses and energies."""
        rest, elements, _, pinned = self.sheet()
        return Cloth(rest, elements, self.material(), pinned)

    def problem(self) -> Problem:
        """The projection, with the sheet's initial positions as its target."""
        rest, elements, positions, pinned = self.sheet()
        mass = self.cloth().mass if self.norm == "mass" else None
        return Problem(rest, elements, positions, self.limits(), pinned, mass)

    def play(self, project: Callable[[FloatArray], FloatArray]) -> Iterator[StepReport]:
        """Time steps from rest; see the base class."""
        cloth = self.cloth()
        positions = self.sheet()[2]
        motion = Motion(positions, np.zeros_like(positions), 0.0)
        scheme = INTEGRATORS[self.integrator]
        settings = NewtonSettings()
        _ = cloth.linear_solver  # sparsity and ordering, once a mesh: part of no step
        seconds: list[float] = []
        reports = []

        def minimise(start: FloatArray, inertial: FloatArray, h: float) -> FloatArray:
            begin = perf_counter()
            found, report = minimise_step(cloth, start, inertial, h, settings)
            seconds.append(perf_counter() - begin)
            reports.append(report)
            return found

        while True:
            seconds.clear()
            reports.clear()
            motion = scheme(motion, self.step, minimise, project)
            yield StepReport(
                sum(seconds),
                sum(r.iterations for r in reports),
                all(r.converged for r in reports),
                sum(r.assembly_seconds for r in reports),
                sum(r.factorisation_seconds for r in reports),
                sum(r.line_search_seconds for r in reports),
            )
