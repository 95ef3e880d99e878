"""A finger is pressed against a table (Hernandez et al. 2013, Fig. 3)."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from math import cos, radians, sin

import numpy as np

from strainbench import sparse as sp
from strainbench.arrays import FloatArray, IntArray
from strainbench.physics.energies.energy import Energy
from strainbench.physics.pattern import Blocks
from strainbench.physics.solid import Solid, SolidMaterial
from strainbench.problem.contact import Plane
from strainbench.problem.grid import halved
from strainbench.problem.principal import PrincipalLimits
from strainbench.problem.problem import Problem
from strainbench.scenario.scenario import StepReport
from strainbench.scenario.volume import VolumeScenario

LENGTH, RADIUS, LAYERS = 0.07, 0.008, 19  # [m]
BONE = 15  # layers that it reaches into
TILT, SPEED = radians(10), 0.02  # [m/s]
RATE = 100.0  # [N/s] at which a load grows
RIGID = 1e4  # a bone to the flesh around it
PRESSES = {
    "flat": ((0.0, -1.0, 0.0), (-sin(TILT), cos(TILT), 0.0)),
    "side": ((0.0, 0.0, -1.0), (-sin(TILT), 0.0, cos(TILT))),
    "tip": ((1.0, 0.0, 0.0), (-1.0, 0.0, 0.0)),
}
"""Where the finger goes, and the normal of the table."""
SHARES = (0.2, 1.0, 0.08)
"""Of the largest limit by axis: 5%, 25% and 2% in the paper."""
MATERIALS = ("anisotropic", "isotropic")


@dataclass(frozen=True)
class Finger(VolumeScenario):
    """A finger is pressed against a table (Hernandez et al. 2013, Fig. 3).

    It is 70 mm long, 16 mm thick, of 1000 kg/m^3, its length along x and its nail up, along y; at
    resolution 1 it has 141 vertices and 348 tetrahedra, one more than the paper's. Its base and a
    bone along its centre, up to 52.6 mm, move towards a plane at 20 mm/s and stop at a depth, or
    are one rigid piece that a load pushes towards it, free to go along that line alone; its limits
    are 5%, 25% and 2% along x, y and z, or 25% in all directions. Mesh, bone, speed, tilt and
    friction are ours, as the paper does not say them, and there is no gravity.

    Parameters
    ----------
    resolution : 1, or a power of two: each tetrahedron is cut into eight once or more.
    limit : the largest strain, that along y; those along x and z are 1/5 and 2/25 of it.
    press : "flat", down, or "side", along -z, both on a plane tilted by 10 degrees that the tip
        meets first, or "tip", along x.
    material : "anisotropic" or "isotropic" limits.
    kind : of the anisotropic ones: hyperbolic, orthogonal, linear or ellipsoid.
    friction : Coulomb's coefficient; methods other than lcp-pgs take 0 alone.
    depth : how far the finger goes on from its first touch [m]. Where it isn't flat the
        anisotropic limits leave it 1 mm or so: further no step meets them.
    force : the load on the bone [N], along the way it goes, which grows by 100 N/s from 0. Nothing
        is pinned then, so that a step from within the limits has an answer, to go no further. 0
        is to a depth.
    """

    name = "finger"
    needs = frozenset({"inertia", "elasticity"})

    resolution: int = 1
    limit: float = 0.25
    young: float = 2e6
    press: str = "flat"
    material: str = "anisotropic"
    kind: str = "hyperbolic"
    friction: float = 0.5
    depth: float = 1e-3
    force: float = 0.0

    def __post_init__(self) -> None:
        for name, valid in (("press", tuple(PRESSES)), ("material", MATERIALS)):
            if getattr(self, name) not in valid:
                raise ValueError(f"{name} is {getattr(self, name)!r}: valid are {', '.join(valid)}")
        if self.resolution & (self.resolution - 1):
            raise ValueError(f"resolution is {self.resolution}: a power of two is valid")
        if not 0 < self.depth < LENGTH:
            raise ValueError(f"depth is {self.depth}: a length above 0, up to {LENGTH}, is valid")
        if not 0 <= self.force < np.inf:
            raise ValueError(f"force is {self.force}: a load from 0 on is valid")
        super().__post_init__()
        _ = self.table()

    @property
    def lasts(self) -> float:  # type: ignore[override]
        """[s] until its load or its depth is reached."""
        return self.force / RATE if self.force else self.depth / SPEED

    def solid(self) -> Solid:
        """The finger from x = 0 on."""
        rest, elements = finger_mesh()
        for _ in range(self.resolution.bit_length() - 1):
            rest, elements = halved(rest, elements)
        across = np.hypot(rest[:, 1], rest[:, 2])
        inner = (across < 1e-9) & (rest[:, 0] < (BONE + 1e-6) * _ticks()[1])
        moved = np.flatnonzero(inner | (rest[:, 0] == 0))
        material = SolidMaterial(self.young, alpha=self.alpha, beta=self.beta)
        if not self.force:
            return Solid(rest, elements, material, moved, gravity=np.zeros(3))
        bone = Bone(moved[None], rest[moved], self._towards, RIGID * self.young * RADIUS)
        return Boned(rest, elements, material, moved[:0], gravity=np.zeros(3), bone=bone)

    @property
    def _towards(self) -> FloatArray:
        """(3,) where the finger goes."""
        return np.array(PRESSES[self.press][0])

    def principal(self) -> PrincipalLimits:
        """Those of the material."""
        if self.material == "isotropic":
            return PrincipalLimits("isotropic", 1 - self.limit, 1 + self.limit)
        strains = self.limit * np.array(SHARES)
        return PrincipalLimits(self.kind, (1 - strains).tolist(), (1 + strains).tolist())

    def table(self) -> Plane:
        """Where the finger touches it first."""
        normal, rest = np.array(PRESSES[self.press][1]), finger_mesh()[0]
        return Plane(rest[np.argmin(rest @ normal)], normal, friction=self.friction)

    def problem(self) -> Problem:
        """See the base class; with the table."""
        problem = super().problem()
        return problem.with_target(problem.target, contact=(self.table(),))

    def play(self, project: Callable[[FloatArray], FloatArray]) -> Iterator[StepReport]:
        """Time steps, to a depth from the speed of the press on, under a load from rest on."""
        body, towards = self._body, SPEED * self._towards

        def loaded(time: float) -> FloatArray:  # called before each step, of no pins
            assert isinstance(body, Boned)
            body.bone.load = min(RATE * time, self.force)
            return np.zeros((0, 3))

        def driven(time: float) -> FloatArray:
            return body.rest[body.pinned] + min(time, self.depth / SPEED) * towards

        if self.force:
            return self._steps(project, np.zeros_like(body.rest), loaded)
        return self._steps(project, np.tile(towards, (len(body.rest), 1)), driven)

    def warm_up(self) -> None:
        """With the coarsest mesh."""
        next(replace(self, resolution=1).play(lambda target: target))


@dataclass(eq=False)
class Bone(Energy):
    """A rigid piece that goes along a line alone, by stiff springs, and a load that pulls it.

    With u the moves of its vertices from rest, and a = mean(u . d) how far it has gone along d,
    it stores 1/2 k sum ||u - a d||^2 - load a.

    Parameters
    ----------
    elements : (1, p) its vertices
    rest : (p, 3) where they are at rest [m]
    towards : (3,) d, a unit vector
    stiffness : k of each vertex [N/m]
    load : [N]
    """

    name = "bone"
    elements: IntArray
    rest: FloatArray
    towards: FloatArray
    stiffness: float
    load: float = 0.0

    def add_gradient(self, x: FloatArray, out: FloatArray) -> float:
        """See the base class."""
        moves, d = x[self.elements[0]] - self.rest, self.towards
        gone = float(np.mean(moves @ d))
        off = moves - gone * d
        out[self.elements[0]] += self.stiffness * off - self.load / len(moves) * d
        return 0.5 * self.stiffness * float(np.sum(off**2)) - self.load * gone

    def add_hessian(self, x: FloatArray, blocks: Blocks, clamp: bool) -> None:  # noqa: ARG002
        """See the base class; it is positive semidefinite."""
        modes = np.vstack([np.eye(self.rest.size), self._along])
        blocks.add(self.stiffness * np.append(np.ones(self.rest.size), -1.0)[None], modes[None])

    def matrix(self, vertices: int) -> sp.csc_array:
        """(3n, 3n) its Hessian [N/m]."""
        own = (3 * self.elements[0][:, None] + np.arange(3)).ravel()
        block = self.stiffness * (np.eye(len(own)) - np.outer(self._along, self._along))
        place = np.repeat(own, len(own)), np.tile(own, len(own))
        return sp.csc_array(sp.coo_array((block.ravel(), place), shape=(3 * vertices,) * 2))

    @property
    def _along(self) -> FloatArray:
        """(3p,) the move along d of all, of unit length."""
        along: FloatArray = np.tile(self.towards, len(self.rest)) / np.sqrt(len(self.rest))
        return along


@dataclass(frozen=True, eq=False, kw_only=True)
class Boned(Solid):
    """A solid on a bone."""

    bone: Bone

    @cached_property
    def energies(self) -> tuple[Energy, ...]:
        """The bone's beside the solid's own."""
        return (*super().energies, self.bone)

    def metric(self, x: FloatArray, h: float) -> sp.csc_array:
        """A, the bone's springs included."""
        return sp.csc_array(super().metric(x, h) + h**2 * self.bone.matrix(len(x)))


def _ticks() -> FloatArray:
    """(20,) where rings are, along x [m]."""
    return np.linspace(0.0, LENGTH * 20 / 21, LAYERS + 1)


def finger_mesh() -> tuple[FloatArray, IntArray]:
    """Vertices (141, 3), layer by layer, centre first, and tetrahedra (348, 4).

    Each ring of six has the radius of the capsule; a prism of the centre and two neighbours is cut
    into three from its lowest vertex on, and the last ring is joined to the tip.
    """
    x = _ticks()
    beyond = np.maximum(0.0, x - (LENGTH - RADIUS))
    radius = np.sqrt(RADIUS**2 - beyond**2)
    angle = np.arange(6) * np.pi / 3
    ring = np.stack([np.zeros(6), -np.sin(angle), np.cos(angle)], axis=1)
    layer = np.concatenate([np.zeros((1, 3)), ring])
    rest = x[:, None, None] * [1, 0, 0] + radius[:, None, None] * layer
    rest = np.concatenate([rest.reshape(-1, 3), [[LENGTH, 0.0, 0.0]]])
    k = np.arange(6)
    wedge = np.stack([np.zeros(6, dtype=np.int64), 1 + k, 1 + (k + 1) % 6], axis=1)
    low = np.sort(7 * np.arange(LAYERS)[:, None, None] + wedge, axis=-1).reshape(-1, 3)
    a, b, c = low.T
    prisms = np.stack([[a, b, c, c + 7], [a, b, b + 7, c + 7], [a, a + 7, b + 7, c + 7]])
    cap = np.column_stack([7 * LAYERS + wedge, np.full(6, len(rest) - 1)])
    elements = np.concatenate([prisms.transpose(2, 0, 1).reshape(-1, 4), cap])
    volumes = np.linalg.det(rest[elements[:, 1:]] - rest[elements[:, :1]])
    elements[volumes < 0] = elements[volumes < 0][:, [0, 2, 1, 3]]
    return rest, elements
