"""The projection that every solver is given (Tang et al. 2022, Eqs. 1-5).

minimise 1/2 ||x - target||_M^2  subject to  ||(G x)_i|| <= b_i  and  x = target at the pins.

The deformation gradient F_e = sum_k x_k B_k is linear in the positions, so each limited
direction d of each element is one row of a sparse matrix G (rows x vertices), with entries
B_k . d, that acts on the three coordinates alike. With exact limits the rows of an element are
the columns of F_e D, and the largest singular value of these together is bounded.
"""

from __future__ import annotations

import copy
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal, TypeVar

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike
from scipy.sparse.csgraph import dijkstra

from strainbench.arrays import FloatArray, IntArray, frozen_array, index_array, read_only
from strainbench.problem.elements import rest_corners, shape_gradients
from strainbench.problem.limits import StretchLimits
from strainbench.problem.reach import longest_edges

Value = TypeVar("Value")


def _of_mesh(compute: Callable[[Problem], Value]) -> cached_property[Value]:
    """A cached property that the frames of one mesh share, whichever of them is asked first."""

    def shared(problem: Problem) -> Value:
        values: dict[str, Value] = problem._mesh  # type: ignore[attr-defined]
        if compute.__name__ not in values:
            values[compute.__name__] = compute(problem)
        return values[compute.__name__]

    shared.__doc__ = compute.__doc__
    return cached_property(shared)


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
        Upper bounds on stretch.
    pinned : (p,)
        Vertices held at their target.
    mass : (n,), optional
        Vertex masses [kg], the weights M of the norm; None is the unweighted norm of Eq. 5.

    All arrays are copied and read-only. A vertex in no element belongs at its target, and is held
    there like a pinned one.

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
    limits: StretchLimits
    pinned: IntArray = ()  # type: ignore[assignment]
    mass: FloatArray | None = None

    def __post_init__(self) -> None:
        def put(name: str, value: object) -> None:
            object.__setattr__(self, name, value)

        put("rest", frozen_array("rest", self.rest, 2, 3))
        dim = self.rest.shape[-1]
        if dim not in (2, 3):
            valid = "(n, 2), (n, 3), (e, 3, 2) and (e, 4, 3)"
            raise ValueError(f"rest: shape {self.rest.shape}; valid are {valid}")
        per_corner = self.rest.ndim == 3
        if per_corner:
            put("target", frozen_array("target", self.target, 2))
        put("elements", index_array("elements", self.elements, 2, self.vertices))
        if per_corner and self.rest.shape[:2] != self.elements.shape:
            raise ValueError(
                f"rest: shape {self.rest.shape} for elements of shape {self.elements.shape}; "
                f"one material position for each corner of each element is valid"
            )
        if len(self.elements) == 0 or self.elements.shape[1] != dim + 1:
            raise ValueError(
                f"elements: shape {self.elements.shape}; rest has {dim} coordinates, "
                f"so (e, {dim + 1}) with at least one element is valid"
            )
        put("target", self._checked_target(self.target))
        put("pinned", self._checked_pins())
        put("mass", self._checked_mass())
        if not isinstance(self.limits, StretchLimits):
            raise ValueError(f"limits: {self.limits!r} is not a StretchLimits")
        if self.limits.directions.shape[1] != dim:
            raise ValueError(
                f"limits.directions: {self.limits.directions.shape[1]} coordinates, "
                f"but the material space of rest has {dim}"
            )
        for name in ("bounds", "lower"):
            array = getattr(self.limits, name)
            if array is not None and array.ndim == 2 and len(array) != len(self.elements):
                raise ValueError(
                    f"limits.{name}: {len(array)} rows for {len(self.elements)} elements"
                )
        put("_shape", shape_gradients(self.rest, self.elements))
        put("_mesh", {})

    def _checked_target(self, target: ArrayLike) -> FloatArray:
        array = frozen_array("target", target, 2)
        n = self.vertices
        if array.shape != (n, 3):
            raise ValueError(
                f"target: shape {array.shape}, but rest has {n} vertices, so ({n}, 3) is valid"
            )
        return array

    def _checked_pins(self) -> IntArray:
        pins = index_array("pinned", self.pinned, 1, self.vertices)
        values, counts = np.unique(pins, return_counts=True)
        for vertex in values[counts > 1][:1]:
            second = np.flatnonzero(pins == vertex)[1]
            raise ValueError(f"pinned[{second}] is {vertex}: this vertex is pinned already")
        return pins

    def _checked_mass(self) -> FloatArray | None:
        if self.mass is None:
            return None
        mass = frozen_array("mass", self.mass, 1)
        if len(mass) != self.vertices:
            raise ValueError(f"mass: {len(mass)} entries for {self.vertices} vertices")
        for vertex in np.flatnonzero(mass <= 0)[:1]:
            raise ValueError(f"mass[{vertex}] is {mass[vertex]}: a mass must be above 0")
        return mass

    def with_target(self, target: ArrayLike) -> Problem:
        """The same mesh, limits and pins with other candidate positions (n, 3) [m]."""
        other = copy.copy(self)
        object.__setattr__(other, "target", self._checked_target(target))
        return other

    def tightened(self, margin: float) -> Problem:
        """The same projection with every bound lowered by `margin`, every lower one raised."""
        other = copy.copy(self)
        limits = self.limits
        if limits.spectral:  # D stays as it is
            bounds = limits.bounds * (1 - margin / limits.bounds.min(axis=-1, keepdims=True))
        else:
            bounds = limits.bounds - margin
        lower = None if limits.lower is None else limits.lower + margin
        object.__setattr__(other, "limits", replace(limits, bounds=bounds, lower=lower))
        mesh = {k: v for k, v in self._mesh.items() if k not in ("bounds", "lower_bounds")}  # type: ignore[attr-defined]
        mesh["_reach"] = self._reach * float(np.max(bounds / limits.bounds))
        object.__setattr__(other, "_mesh", mesh)
        for name in ("bounds", "lower_bounds", "_reach"):
            other.__dict__.pop(name, None)
        return other

    @property
    def vertices(self) -> int:
        """Number of vertices n."""
        return len(self.rest) if self.rest.ndim == 2 else len(self.target)

    @property
    def rows(self) -> int:
        """Rows of G: elements times limited directions."""
        return len(self.elements) * len(self.limits.directions)

    @property
    def constraints(self) -> int:
        """Number of constraints: one a row of G, or one an element where limits are exact."""
        return len(self.elements) if self.limits.spectral else self.rows

    @property
    def convex(self) -> bool:
        """Whether there are no lower bounds: then the optimum is unique, and certified."""
        return self.limits.lower is None

    @property
    def gradients(self) -> FloatArray:
        """(e, k, dim) shape function gradients B [1/m]: F_e = sum_k x_k B_k."""
        gradients: FloatArray = self._shape[0]  # type: ignore[attr-defined]
        return gradients

    @property
    def measures(self) -> FloatArray:
        """(e,) rest areas [m^2] of triangles, or volumes [m^3] of tetrahedra."""
        measures: FloatArray = self._shape[1]  # type: ignore[attr-defined]
        return measures

    @_of_mesh
    def used(self) -> IntArray:
        """Indices of the vertices of the elements."""
        return read_only(np.unique(self.elements))

    @_of_mesh
    def isolated(self) -> IntArray:
        """Indices of the vertices in no element, and not pinned: their optimum is the target."""
        touched = np.union1d(self.used, self.pinned)
        return read_only(np.setdiff1d(np.arange(self.vertices), touched))

    @_of_mesh
    def held(self) -> IntArray:
        """Indices of the vertices that a solver leaves at their target: pinned, or isolated."""
        return read_only(np.concatenate([self.pinned, self.isolated]))

    @_of_mesh
    def free(self) -> IntArray:
        """Indices of the vertices that can move: all others."""
        return read_only(np.setdiff1d(np.arange(self.vertices), self.held))

    @_of_mesh
    def weights(self) -> FloatArray:
        """(n,) diagonal of M: the masses, or ones."""
        return read_only(np.ones(self.vertices)) if self.mass is None else self.mass

    @property
    def least_weight(self) -> float:
        """Smallest weight of a free vertex: ||d||^2 <= ||d||_M^2 / least_weight."""
        return float(np.min(self.weights[self.free], initial=np.inf))

    @_of_mesh
    def mean_weight(self) -> float:
        """Mean weight of the elements' vertices."""
        return float(self.weights[self.used].mean())

    @property
    def objective_floor(self) -> float:
        """Half a squared correction of 1e-3 mean edges a vertex: the least scale of a gap."""
        correction = 1e-3 * self.edge_length
        return 0.5 * float(np.sum(self.weights[self.free])) * correction * correction

    @_of_mesh
    def edge_length(self) -> float:
        """Mean rest length of the elements' edges [m]: the problem's own length unit."""
        corners = rest_corners(self.rest, self.elements)
        return float(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).mean())

    @_of_mesh
    def row_vertices(self) -> IntArray:
        """(rows, k) vertices of each row of G; row e m + j is element e, direction j."""
        vertices = np.repeat(self.elements, len(self.limits.directions), axis=0)
        vertices.setflags(write=False)
        return vertices

    @_of_mesh
    def row_coefficients(self) -> FloatArray:
        """(rows, k) entries B_k . d of each row of G [1/m]; exact limits scale each axis by D."""
        per_element: FloatArray = np.einsum("ekc,mc->emk", self.gradients, self.limits.directions)
        if self.limits.spectral:
            axes = np.atleast_2d(self.limits.bounds)
            per_element = per_element * (axes.min(axis=1, keepdims=True) / axes)[:, :, None]
        return read_only(per_element.reshape(self.rows, -1))

    @_of_mesh
    def G(self) -> sp.csr_array:  # noqa: N802
        """(rows, n) sparse: (G x)_i = F_e d, the deformed direction of constraint i."""
        k = self.elements.shape[1]
        starts = np.arange(0, self.rows * k + 1, k)
        G = sp.csr_array(
            (self.row_coefficients.ravel(), self.row_vertices.ravel(), starts),
            shape=(self.rows, self.vertices),
            copy=True,
        )
        G.sort_indices()
        G.data.setflags(write=False)
        return G

    @_of_mesh
    def bounds(self) -> FloatArray:
        """(constraints,) largest stretch b_i; with exact limits that of the tightest axis."""
        bounds = self.limits.bounds
        if self.limits.spectral:
            bounds = bounds.min(axis=-1, keepdims=True)
        shape = (len(self.elements), bounds.shape[-1])
        return read_only(np.broadcast_to(bounds, shape).reshape(-1).copy())

    @_of_mesh
    def lower_bounds(self) -> FloatArray:
        """(constraints,) least stretch; 0 without lower bounds."""
        lower = np.zeros(1) if self.limits.lower is None else self.limits.lower
        per_element = self.constraints // len(self.elements)
        shape = (len(self.elements), per_element)
        return read_only(np.broadcast_to(lower, shape).reshape(-1).copy())

    def stretches(self, positions: FloatArray) -> FloatArray:
        """(constraints,) stretch at `positions` (n, 3): ||(G x)_i||, or ||F D||_2 min(bounds)."""
        return self._norms(self.G @ positions, 2)

    def dual_norms(self, multipliers: FloatArray) -> FloatArray:
        """(constraints,) |Y_i| of `multipliers` (rows, 3), or nuclear norms of exact limits."""
        return self._norms(multipliers, "nuc")

    def _norms(self, rows: FloatArray, order: Literal[2, "nuc"]) -> FloatArray:
        """(constraints,) of (rows, 3): vector norms, or matrix norms with exact limits."""
        if self.limits.spectral:
            blocks = rows.reshape(len(self.elements), -1, 3)
            finite = np.isfinite(blocks).all(axis=(1, 2))  # numpy raises for others
            norms: FloatArray = np.full(len(blocks), np.nan)
            norms[finite] = np.linalg.norm(blocks[finite], order, axis=(1, 2))
        else:
            norms = np.linalg.norm(rows, axis=1)
        return norms

    def violations(self, positions: FloatArray) -> FloatArray:
        """(constraints,) max(0, stretch - b_i), or what it lacks to its lower bound."""
        stretches = self.stretches(positions)
        beyond = np.maximum(0.0, stretches - self.bounds)
        return beyond if self.convex else np.maximum(beyond, self.lower_bounds - stretches)

    def deformation_gradients(self, positions: FloatArray) -> FloatArray:
        """(e, 3, dim) F_e at `positions` (n, 3)."""
        F: FloatArray = np.einsum("ekx,ekc->exc", positions[self.elements], self.gradients)
        return F

    def objective(self, positions: FloatArray) -> float:
        """1/2 ||x - target||_M^2, in m^2, or in kg m^2 with masses."""
        difference = positions - self.target
        return 0.5 * float(np.sum(self.weights[:, None] * difference**2))

    def infeasible_pins(self) -> str | None:
        """Why no positions can meet the limits, where the pins alone show it; else None.

        An edge with material vector e is at most L(e) long under the limits (see
        `longest_edges`), so two pins are at most as far apart as the shortest path of such
        lengths along the edges. A None does not say that the problem is feasible.
        """
        if len(self.pinned) < 2:
            return None
        lengths = self._reach[:, self.pinned]
        pins = self.target[self.pinned]
        apart: FloatArray = np.hypot.reduce(pins[:, None] - pins[None], axis=2)
        excess = np.zeros_like(apart)
        np.subtract(apart, lengths, out=excess, where=apart > lengths * (1 + 1e-12))
        i, j = np.unravel_index(int(np.argmax(excess)), excess.shape)
        if excess[i, j] <= 0:
            return None
        return (
            f"infeasible: pinned vertices {self.pinned[i]} and {self.pinned[j]} are "
            f"{apart[i, j]:.6g} m apart, and the limits allow at most {lengths[i, j]:.6g} m"
        )

    @property
    def largest_objective(self) -> float:
        """An upper bound on the objective of any feasible point; infinite without pins."""
        if len(self.pinned) == 0:
            return float("inf")
        nearest = np.argmin(self._reach[:, self.free], axis=0)
        pins = self.target[self.pinned[nearest]]
        farthest = np.linalg.norm(self.target[self.free] - pins, axis=1)
        farthest += self._reach[nearest, self.free]
        return 0.5 * float(np.sum(self.weights[self.free] * farthest**2))

    def longest_edges(self) -> tuple[IntArray, FloatArray]:
        """(k, 2) edges, and (k,) how long the limits let each become [m]."""
        return longest_edges(rest_corners(self.rest, self.elements), self.elements, self.limits)

    @_of_mesh
    def _reach(self) -> FloatArray:
        """(p, n) an upper bound on the distance of each vertex from each pin [m]."""
        if len(self.pinned) == 0:
            return read_only(np.zeros((0, self.vertices)))
        edges, lengths = self.longest_edges()
        graph = sp.csr_array((lengths, (edges[:, 0], edges[:, 1])), shape=2 * (self.vertices,))
        reach: FloatArray = dijkstra(graph, directed=False, indices=self.pinned)
        return reach
