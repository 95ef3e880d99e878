"""The projection that every solver is given (Tang et al. 2022, Eqs. 1-5).

minimise 1/2 ||x - target||_M^2  subject to  ||(G x)_i|| <= b_i  and  x = target at the pins.

The deformation gradient F_e = sum_k x_k B_k is linear in the positions, so each limited
direction d of each element is one row of a sparse matrix G (rows x vertices), with entries
B_k . d, that acts on the three coordinates alike. With exact limits the rows of an element are
the columns of F_e D, and the largest singular value of these together is bounded.
"""

from __future__ import annotations

import copy
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
from numpy.typing import ArrayLike

from strainbench import sparse as sp
from strainbench.arrays import FloatArray, IntArray, frozen_array, read_only
from strainbench.problem import checks
from strainbench.problem.cached import of_mesh
from strainbench.problem.contact import Plane
from strainbench.problem.elements import rest_corners, shape_gradients, sparse_rows
from strainbench.problem.kinds import Kind, Limits, kind_of
from strainbench.problem.reach import distances, farthest, longest_edges, pins_apart


@dataclass(frozen=True, eq=False)
class Problem:
    """Closest positions to a target in which no limited direction is stretched too far.

    Parameters
    ----------
    rest : (n, 2) or (n, 3)
        Material positions [m] of a surface, or of a volume. Or (e, 3, 2) or (e, 4, 3): those of
        each element's own corners, for pieces sewn together along seams, and for shapes that do
        not lie flat as a whole; each element then has material axes of its own.
    elements : (e, 3) or (e, 4)
        Vertex indices of triangles, or of tetrahedra.
    target : (n, 3)
        Candidate positions [m].
    limits : StretchLimits
        Upper bounds on stretch; or those of another `Kind`.
    pinned : (p,)
        Vertices held at their target.
    mass : (n,), optional
        Vertex masses [kg], the weights M of the norm; None is the unweighted norm of Eq. 5.
    metric : (3n, 3n) sparse, optional
        Symmetric positive definite: the norm itself, in place of the masses.
    linearise_at : (n, 3), optional
        Where methods of one step linearise limits [m]; at the target, if nowhere else.
    contact : planes that vertices are kept off, optional (`strainbench.problem.contact`)

    All arrays are copied and read-only. A vertex in no element is held at its target.

    Raises
    ------
    ValueError
        Naming the field, the index and the value.

    Examples
    --------
    An edge of 1 m pulled to 1.3 m, 0.2 m beyond its limit:

    >>> rest, target = [[0, 0], [1, 0], [0, 1]], [[0, 0, 0], [1.3, 0, 0], [0, 1, 0]]
    >>> problem = Problem(rest, [[0, 1, 2]], target, StretchLimits.isotropic(1.1, directions=2))
    >>> float(problem.violations(problem.target).max().round(6))
    0.2
    """

    rest: FloatArray
    elements: IntArray
    target: FloatArray
    limits: Limits
    pinned: IntArray = ()  # type: ignore[assignment]
    mass: FloatArray | None = None
    metric: sp.csc_array | None = None
    linearise_at: FloatArray | None = None
    contact: tuple[Plane, ...] = ()

    def __post_init__(self) -> None:
        put = partial(object.__setattr__, self)
        put("rest", checks.checked_rest(self.rest))
        if self.rest.ndim == 3:  # the target says how many vertices there are
            put("target", frozen_array("target", self.target, 2))
        put("elements", checks.checked_elements(self.elements, self.rest, self.vertices))
        put("target", checks.checked_target(self.target, self.vertices))
        put("pinned", checks.checked_pins(self.pinned, self.vertices))
        if self.mass is not None:
            put("mass", checks.checked_mass(self.mass, self.vertices))
        checks.put_step(self, self.metric, self.linearise_at, self.contact)
        self.kind.check(self.rest.shape[-1], len(self.elements))
        put("_mesh", {})
        _ = self._shape  # finds flat elements

    def with_target(
        self,
        target: ArrayLike,
        metric: sp.sparray | None = None,
        linearise_at: ArrayLike | None = None,
        contact: Sequence[Plane] = (),
    ) -> Problem:
        """The same mesh, limits and pins with other candidates (n, 3) [m], and what is given."""
        other = copy.copy(self)
        object.__setattr__(other, "target", checks.checked_target(target, self.vertices))
        checks.put_step(other, metric, linearise_at, contact)
        return other

    def tightened(self, margin: float) -> Problem:
        """The same projection with every bound lowered by `margin`, every lower one raised."""
        other = copy.copy(self)
        object.__setattr__(other, "limits", self.kind.tightened(margin))
        own = ("kind", "bounds", "lower_bounds", "_reach")
        for name in own:
            other.__dict__.pop(name, None)
        mesh = {k: v for k, v in self._mesh.items() if k not in own}  # type: ignore[attr-defined]
        if self.convex:  # a norm's unit ball grows by no more
            mesh["_reach"] = self._reach * float(np.max(other.kind.bounds / self.kind.bounds))
        object.__setattr__(other, "_mesh", mesh)
        return other

    @cached_property
    def kind(self) -> Kind:
        """What the limits demand of an element, by their kind."""
        return kind_of(self.limits)

    @property
    def vertices(self) -> int:
        """Number of vertices n."""
        return len(self.rest) if self.rest.ndim == 2 else len(self.target)

    @property
    def rows(self) -> int:
        """Rows of G: elements times limited directions."""
        return len(self.elements) * len(self.kind.directions)

    @property
    def constraints(self) -> int:
        """Number of constraints: one a row of G, or one an element where limits are exact."""
        return len(self.elements) * int(self.kind.bounds.shape[-1])

    @property
    def convex(self) -> bool:
        """Whether the optimum is certified: no lower bounds or planes, and a norm of masses."""
        return self.kind.convex and self.metric is None and not self.contact

    @of_mesh
    def _shape(self) -> tuple[FloatArray, FloatArray]:
        return shape_gradients(self.rest, self.elements)

    @property
    def gradients(self) -> FloatArray:
        """(e, k, dim) shape function gradients B [1/m]: F_e = sum_k x_k B_k."""
        return self._shape[0]

    @property
    def measures(self) -> FloatArray:
        """(e,) rest areas [m^2] of triangles, or volumes [m^3] of tetrahedra."""
        return self._shape[1]

    @of_mesh
    def used(self) -> IntArray:
        """Indices of the vertices of the elements."""
        return read_only(np.unique(self.elements))

    @of_mesh
    def isolated(self) -> IntArray:
        """Indices of the vertices in no element, and not pinned: their optimum is the target."""
        touched = np.union1d(self.used, self.pinned)
        return read_only(np.setdiff1d(np.arange(self.vertices), touched))

    @of_mesh
    def held(self) -> IntArray:
        """Indices of the vertices that a solver leaves at their target: pinned, or isolated."""
        return read_only(np.concatenate([self.pinned, self.isolated]))

    @of_mesh
    def free(self) -> IntArray:
        """Indices of the vertices that can move: all others."""
        return read_only(np.setdiff1d(np.arange(self.vertices), self.held))

    @of_mesh
    def weights(self) -> FloatArray:
        """(n,) diagonal of M: the masses, or ones. A metric is no diagonal."""
        return read_only(np.ones(self.vertices)) if self.mass is None else self.mass

    @property
    def least_weight(self) -> float:
        """Smallest weight of a free vertex: ||d||^2 <= ||d||_M^2 / least_weight."""
        return float(np.min(self.weights[self.free], initial=np.inf))

    @of_mesh
    def mean_weight(self) -> float:
        """Mean weight of the elements' vertices."""
        return float(self.weights[self.used].mean())

    @property
    def objective_floor(self) -> float:
        """Half a squared correction of 1e-3 mean edges a vertex: the least scale of a gap."""
        correction = 1e-3 * self.edge_length
        diagonal = self.weights if self.metric is None else self.metric.diagonal()[::3]
        return 0.5 * float(np.sum(diagonal[self.free])) * correction * correction

    @of_mesh
    def edge_length(self) -> float:
        """Mean rest length of the elements' edges [m]: the problem's own length unit."""
        corners = rest_corners(self.rest, self.elements)
        return float(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).mean())

    @of_mesh
    def row_vertices(self) -> IntArray:
        """(rows, k) vertices of each row of G; row e m + j is element e, direction j."""
        return read_only(np.repeat(self.elements, len(self.kind.directions), axis=0))

    @of_mesh
    def row_coefficients(self) -> FloatArray:
        """(rows, k) entries B_k . d of each row of G [1/m]; exact limits scale each axis by D."""
        return read_only(self.kind.coefficients(self.gradients).reshape(self.rows, -1))

    @of_mesh
    def G(self) -> sp.csr_array:  # noqa: N802
        """(rows, n) sparse: (G x)_i = F_e d, the deformed direction of constraint i."""
        return sparse_rows(self.row_vertices, self.row_coefficients, self.vertices)

    @of_mesh
    def bounds(self) -> FloatArray:
        """(constraints,) largest stretch b_i; with exact limits that of the tightest axis."""
        return self._by_constraint(self.kind.bounds)

    @of_mesh
    def lower_bounds(self) -> FloatArray:
        """(constraints,) least stretch; 0 without lower bounds."""
        return self._by_constraint(np.zeros(1) if self.kind.lower is None else self.kind.lower)

    def _by_constraint(self, values: FloatArray) -> FloatArray:
        shape = (len(self.elements), self.kind.bounds.shape[-1])
        return read_only(np.broadcast_to(values, shape).reshape(-1).copy())

    def stretches(self, positions: FloatArray) -> FloatArray:
        """(constraints,) stretch at `positions` (n, 3): ||(G x)_i||, or ||F D||_2 min(bounds)."""
        return self.kind.measure(self.G @ positions)

    def dual_norms(self, multipliers: FloatArray) -> FloatArray:
        """(constraints,) |Y_i| of `multipliers` (rows, 3), or nuclear norms of exact limits."""
        return self.kind.dual_norms(multipliers)

    def violations(self, positions: FloatArray) -> FloatArray:
        """(constraints,) max(0, stretch - b_i), or what it lacks to its lower bound."""
        stretches = self.stretches(positions)
        beyond = np.maximum(0.0, stretches - self.bounds)
        if self.kind.lower is None:
            return beyond
        return np.maximum(beyond, self.lower_bounds - stretches)

    def deformation_gradients(self, positions: FloatArray) -> FloatArray:
        """(e, 3, dim) F_e at `positions` (n, 3)."""
        F: FloatArray = np.einsum("ekx,ekc->exc", positions[self.elements], self.gradients)
        return F

    def objective(self, positions: FloatArray) -> float:
        """1/2 ||x - target||^2 in the problem's norm, in m^2, or in kg m^2 with masses."""
        difference = positions - self.target
        if (A := self.metric) is not None:
            return 0.5 * float(np.vdot(difference, A @ difference.ravel()))
        return 0.5 * float(np.sum(self.weights[:, None] * difference**2))

    def infeasible_pins(self) -> str | None:
        """Why no positions can meet the limits, where the pins alone show it; else None.

        An edge with material vector e is at most L(e) long under the limits (see
        `longest_edges`), so two pins are at most as far apart as the shortest path of such
        lengths along the edges. A None does not say that the problem is feasible.
        """
        if len(self.pinned) < 2:
            return None
        return pins_apart(self._reach[:, self.pinned], self.target, self.pinned)

    @property
    def largest_objective(self) -> float:
        """An upper bound on the objective of any feasible point; infinite without pins."""
        if len(self.pinned) == 0:
            return float("inf")
        far = farthest(self._reach[:, self.free], self.target[self.pinned], self.target[self.free])
        return 0.5 * float(np.sum(self.weights[self.free] * far**2))

    def longest_edges(self) -> tuple[IntArray, FloatArray]:
        """(k, 2) edges, and (k,) how long the limits let each become [m]."""
        return longest_edges(rest_corners(self.rest, self.elements), self.elements, self.kind)

    @of_mesh
    def _reach(self) -> FloatArray:
        """(p, n) an upper bound on the distance of each vertex from each pin [m]."""
        return distances(*self.longest_edges(), self.vertices, self.pinned)
