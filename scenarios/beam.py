"""A beam of tetrahedra, fixed at one end, bends under gravity (Hernandez et al. 2013, Fig. 2)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from strainbench.arrays import FloatArray, IntArray
from strainbench.physics.solid import Solid, SolidMaterial
from strainbench.problem.grid import box_grid
from strainbench.problem.principal import PrincipalLimits
from strainbench.scenario.volume import VolumeScenario
from strainbench.scenario.volumefile import read_volume

LENGTH, WIDTH = 1.0, 0.2  # [m]
YOUNG = {"stiff": 2e5, "anisotropic": 5e3, "isotropic": 5e3}  # [Pa]
UNLIMITED = 10.0
"""A stretch that no beam comes to, where a problem needs a limit and the material has none."""


@dataclass(frozen=True)
class Beam(VolumeScenario):
    """A beam of tetrahedra, fixed at one end, bends under gravity (Hernandez et al. 2013, Fig. 2).

    It is 1 m long and .2 m wide, of 1000 kg/m^3; at resolution 2 it has 99 vertices and 200
    tetrahedra. The figure shows three materials: "stiff", 200 kPa without limits; "anisotropic",
    5 kPa, its length free and both other axes limited; "isotropic", 5 kPa, limited in all
    directions. Damping is ours, so that it comes to rest.

    Parameters
    ----------
    material : "anisotropic", "isotropic" or "stiff".
    kind : of the anisotropic limits: hyperbolic, orthogonal, linear or ellipsoid.
    young : Young's modulus [Pa]; if not given, that of the material.
    alpha : damping by masses [1/s].
    path : a file of tetrahedra in place of the beam (Gmsh, VTU, MEDIT ...), in metres, fixed where
        its x is least; `resolution` then has no meaning.
    """

    name = "beam"
    needs = frozenset({"inertia", "gravity", "elasticity"})
    lasts = 1.2

    limit: float = 0.04
    young: float = None  # type: ignore[assignment] # resolved below
    alpha: float = None  # type: ignore[assignment]
    material: str = "anisotropic"
    kind: str = "hyperbolic"
    path: str = ""

    def __post_init__(self) -> None:
        if self.material not in YOUNG:
            raise ValueError(f"material is {self.material!r}: valid are {', '.join(YOUNG)}")
        if self.young is None:
            object.__setattr__(self, "young", YOUNG[self.material])
        if self.alpha is None:
            object.__setattr__(self, "alpha", 2.0 if self.integrator == "linearised" else 0.0)
        super().__post_init__()
        if self.path:
            _ = self._body  # a bad file is named before anything runs

    def solid(self) -> Solid:
        """The beam along the x axis, fixed at x = 0."""
        cells = 5 * self.resolution, self.resolution, self.resolution
        return beam(self, *(read_volume(self.path) if self.path else box(cells, 0)), axis=0)

    def principal(self) -> PrincipalLimits:
        """Those of the material."""
        if self.material == "stiff":
            return PrincipalLimits("isotropic", None, UNLIMITED)
        lower, upper = 1 - self.limit, 1 + self.limit
        if self.material == "isotropic":
            return PrincipalLimits("isotropic", lower, upper)
        return PrincipalLimits(self.kind, (None, lower, lower), (None, upper, upper))


def box(cells: tuple[int, int, int], axis: int) -> tuple[FloatArray, IntArray]:
    """The beam's mesh, of so many cells, its length along an axis."""
    size = np.full(3, WIDTH)
    size[axis] = LENGTH
    return box_grid(cells, size)


def beam(scene: VolumeScenario, rest: FloatArray, elements: IntArray, axis: int) -> Solid:
    """A body of a scene's material, fixed where an axis is least."""
    material = SolidMaterial(scene.young, alpha=scene.alpha, beta=scene.beta)
    along = rest[:, axis] - rest[:, axis].min()
    return Solid(rest, elements, material, np.flatnonzero(along <= 1e-9 * along.max()))
