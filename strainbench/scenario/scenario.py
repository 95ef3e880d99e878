"""What a scene is: its mesh, limits, pins, physics, and nothing that it does not need."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, fields, replace
from typing import ClassVar

import numpy as np

from strainbench.arrays import FloatArray, IntArray
from strainbench.fields import same, spelled
from strainbench.problem.grid import lumped_areas
from strainbench.problem.limits import StretchLimits
from strainbench.problem.problem import Problem
from strainbench.progress import SceneWarning as SceneWarning

EASY_LIMIT = 0.01  # tighter ones are checked on this one
FEWEST_STEPS = 10  # of a run that is not told how many


@dataclass(frozen=True)
class StepReport:
    """What the physics of one time step cost, whether it converged, and where it left the cloth.

    Energies are in J, with the velocities after the projection; heights count from y = 0. The
    momentum is in kg m/s. `pin_work` [J] is the work of the forces that hold the pins, as the
    minimisations of the step find them; it is 0 for pins that do not move. `penetration` [m] is
    the depth of the deepest vertex inside an obstacle, after the projection. Of a scene at rest,
    `equilibrium_residual` is the force that is left, relative to the weight, and
    `equilibrium_distance` [m] how far the farthest vertex is from a certified equilibrium.
    """

    time: float = 0.0  # [s], at the end of the step
    ie_seconds: float = 0.0  # in implicit Euler's Newton solver
    newton_iterations: int = 0
    newton_converged: bool = True
    assembly_seconds: float = 0.0  # of ie_seconds: of Hessians
    factorisation_seconds: float = 0.0  # and the solves with the factors
    line_search_seconds: float = 0.0  # energies and gradients
    kinetic_energy: float = float("nan")
    gravity_energy: float = float("nan")
    membrane_energy: float = float("nan")
    bending_energy: float = float("nan")
    momentum_x: float = float("nan")
    momentum_y: float = float("nan")
    momentum_z: float = float("nan")
    pin_work: float = 0.0
    contact_energy: float = 0.0
    penetration: float = 0.0
    equilibrium_residual: float = float("nan")
    equilibrium_distance: float = float("nan")


@dataclass(frozen=True)
class Scenario(ABC):
    """A scene: a frozen dataclass whose fields can be set from the command line.

    The first line of the docstring reads "scene (paper)". `needs` names the physics that the
    scene cannot do without; what it does not need is not built. `about` names what the scene waits
    for, if it waits for anything: a run in which that has not happened says so. `omits` says of
    physics that would move it why what the scene models has none.

    Parameters
    ----------
    resolution : cells a side.
    limit : largest strain allowed; 0.01 is 1%, and 0 lets nothing stretch at all.
    directions : sampled directions an element, or "exact" for a limit on the largest singular
        value.
    """

    name: ClassVar[str]
    needs: ClassVar[frozenset[str]]
    about: ClassVar[str] = ""
    omits: ClassVar[Mapping[str, str]] = {}

    resolution: int = 20
    limit: float = 0.01
    directions: int | str = 4

    def __post_init__(self) -> None:
        if self.resolution < 1:
            raise ValueError(f"resolution is {self.resolution}: a whole number above 0 is valid")
        if not 0 <= self.limit < 1:
            raise ValueError(
                f"limit is {self.limit}: a strain between 0 and 1 is valid, 0.01 or 1% for 1%, "
                f"0 for no stretch"
            )
        if self.directions != "exact" and (isinstance(self.directions, str) or self.directions < 1):
            valid = "a whole number above 0, or exact, is valid"
            raise ValueError(f"directions is {self.directions}: {valid}")

    @abstractmethod
    def problem(self) -> Problem:
        """The projection at the start: mesh, limits, pins, and the initial positions as target."""

    @abstractmethod
    def play(self, project: Callable[[FloatArray], FloatArray]) -> Iterator[StepReport]:
        """Run the scene, step by step, with `project` limiting each candidate."""

    def warm_up(self) -> None:
        """Compile what `play` compiles on first use, off the clock."""
        next(replace(self, resolution=2).play(lambda target: target))

    def frame(
        self,
        problem: Problem,
        target: FloatArray,
        start: FloatArray,  # noqa: ARG002
    ) -> Problem:
        """The projection of a candidate (n, 3) that a step from positions `start` has proposed.

        Parameters
        ----------
        problem : the scene's own
        start : (n, 3) the answer to the candidate before, at first the scene's positions [m]
        """
        return problem.with_target(target)

    def easier(self) -> Scenario | None:
        """The neighbour on which a failure here is checked; None where this one is easy itself."""
        return replace(self, limit=EASY_LIMIT) if self.limit < EASY_LIMIT else None

    def notes(self) -> list[str]:
        """What a user should know of this scene, such as odd things in its files; a line each."""
        return []

    @property
    def projects(self) -> bool:
        """Whether candidates are to be projected; where not, the solver "none" alone fits."""
        return True

    @property
    def first_step(self) -> float:
        """The step in which what the scene is about begins, as far as that is known."""
        return 1

    @property
    def usual_steps(self) -> int:
        """Time steps of a run that is not told how many: enough for what the scene is about."""
        return FEWEST_STEPS

    def has_begun(self, frame: Problem) -> bool:  # noqa: ARG002
        """Whether what the scene is about happens in this projection."""
        return True

    @property
    def parameters(self) -> dict[str, object]:
        """The fields and their values."""
        return {f.name: getattr(self, f.name) for f in fields(self)}

    def sampled_angles(self) -> FloatArray:
        """(directions,) equally spaced in [-pi/2, pi/2) [rad]."""
        if isinstance(self.directions, str):
            raise ValueError(f"directions is exact: {self.name} samples a curve of limits")
        return -np.pi / 2 + np.pi * np.arange(self.directions) / self.directions

    @property
    def label(self) -> str:
        """Name, resolution and limit, then what else differs from the defaults."""
        return self.labelled({})

    def labelled(self, words: Mapping[str, str]) -> str:
        """The same; what was set in `words` is there as it was spelled, defaults too."""
        default = type(self)().parameters
        others = "".join(
            f", {k}={words.get(k) or spelled(v)}"
            for k, v in self.parameters.items()
            if k not in ("resolution", "limit") and (k in words or not same(v, default[k]))
        )
        return f"{self.name} {self.resolution} at {100 * self.limit:.12g}%{others}"

    def limits(self) -> StretchLimits:
        """The same bound in all directions."""
        if isinstance(self.directions, str):
            return StretchLimits.exact(1 + self.limit)
        bounds = np.full(self.directions, 1 + self.limit)
        return StretchLimits.sampled(self.sampled_angles(), bounds)

    def curve(self) -> tuple[FloatArray, FloatArray] | None:
        """Angles (a,) [rad] and bounds (a,) of the curve that `limits` samples, for polar plots.

        None where a scene has limits of its own and does not say.
        """
        if type(self).limits is not Scenario.limits:
            return None
        angles = np.linspace(-np.pi / 2, np.pi / 2, 180, endpoint=False)
        return angles, np.full(len(angles), 1 + self.limit)


@dataclass(frozen=True)
class SheetScenario(Scenario):
    """A sheet of triangles, without physics of its own.

    Parameters
    ----------
    norm : "mass", or "unweighted" as printed in Eq. 5. Without a material the masses are those
        of a sheet of 1 kg/m^2: a factor common to all changes no projection.
    """

    norm: str = "mass"

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.norm not in ("unweighted", "mass"):
            raise ValueError(f"norm is {self.norm!r}: valid are unweighted, mass")

    @abstractmethod
    def sheet(self) -> tuple[FloatArray, IntArray, FloatArray, IntArray]:
        """Rest positions (n, 2), triangles (e, 3), initial positions (n, 3), pins (p,)."""

    def mass(self) -> FloatArray:
        """(n,) [kg], lumped at the vertices."""
        return lumped_areas(*self.sheet()[:2])

    def problem(self) -> Problem:
        """The projection, with the sheet's initial positions as its target."""
        rest, elements, positions, pinned = self.sheet()
        mass = self.mass() if self.norm == "mass" else None
        return Problem(rest, elements, positions, self.limits(), pinned, mass)
