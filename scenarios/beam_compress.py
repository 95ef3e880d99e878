"""A soft beam, fixed at its foot, collapses under its weight (Hernandez et al. 2013, Fig. 4)."""

from __future__ import annotations

from dataclasses import dataclass

from scenarios.beam import beam, box
from strainbench.physics.solid import Solid
from strainbench.problem.principal import PrincipalLimits
from strainbench.scenario.volume import VolumeScenario


@dataclass(frozen=True)
class BeamCompress(VolumeScenario):
    """A soft beam, fixed at its foot, collapses under its weight (Hernandez et al. 2013, Fig. 4).

    The beam of the scene `beam`, upright, of 10 kPa and without damping. One transverse axis is
    limited, the other one and the vertical are free: what it may do until the first limit is
    violated tells the kinds of limits apart. `python -m strainbench.studies.volumes` tabulates it.

    Parameters
    ----------
    kind : hyperbolic, orthogonal, linear, ellipsoid, or isotropic, which limits all axes.
    """

    name = "beam-compress"
    needs = frozenset({"inertia", "gravity", "elasticity"})
    lasts = 0.3

    limit: float = 0.05
    kind: str = "hyperbolic"

    def solid(self) -> Solid:
        """The beam along the y axis, fixed at y = 0."""
        cells = self.resolution, 5 * self.resolution, self.resolution
        return beam(self, *box(cells, 1), axis=1)

    def principal(self) -> PrincipalLimits:
        """On the z axis alone, unless they are isotropic."""
        lower, upper = 1 - self.limit, 1 + self.limit
        if self.kind == "isotropic":
            return PrincipalLimits(self.kind, lower, upper)
        return PrincipalLimits(self.kind, (None, None, lower), (None, None, upper))
