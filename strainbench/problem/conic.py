"""The projection as a cone program: the data that conic solvers and their file formats take.

With the free vertices' displacements u = x - target as unknowns, in units of a length h,

    minimise 1/2 u'Pu  such that  A u + s = b,  each block of s in one and the same cone,

where P = s h^2 M. This is Tang et al. 2022, Eq. 12, but for the objective, which is given as a
quadratic, without a cone of its own. A constraint's block of s is

- (b_i, (G x)_i) in the second-order cone of order 4; of a larger one where limits bound the length
  of several rows together; or
- with exact limits, the matrix [[b I, Y], [Y^T, b I]], positive semidefinite iff ||Y||_2 <= b,
  where Y (3 x dim) has the element's rows of G x as its columns. A block holds one triangle of
  it, column after column, off-diagonal entries times sqrt(2), so that products of blocks are
  those of matrices: the upper triangle as Clarabel wants it, or the lower one as SCS does.
"""

from __future__ import annotations

import numpy as np

from strainbench import sparse as sp
from strainbench.arrays import FloatArray, IntArray
from strainbench.problem.problem import Problem


class ConicForm:
    """The cone program of a mesh, for any target and bounds.

    Parameters
    ----------
    problem : any frame of the mesh.
    scaling : factor s of the objective in units of 1/edge^2 over the mean weight, with lengths in
        units of the mean edge; None leaves both as they are.
    triangle : "upper" or "lower", of semidefinite cones.

    Attributes
    ----------
    P : (u, u) diagonal, u = 3 times the free vertices, in the order of (free vertices, 3)
    A : (length count, u)
    cone, order : "second-order" and 1 + 3 times the rows of a constraint, mostly 4, or
        "semidefinite" and 3 + dim, the matrices' order
    length, count : entries of s in one cone; how many cones
    scale, unit : s, and h [m]
    """

    def __init__(
        self, problem: Problem, scaling: float | None = None, triangle: str = "upper"
    ) -> None:
        self.scale, self.unit = 1.0, 1.0
        if scaling is not None:
            self.unit = problem.edge_length
            self.scale = scaling / (self.unit**2 * problem.mean_weight)
        weights = np.repeat(problem.weights[problem.free], 3)
        self.P = sp.csc_array(sp.diags_array(self.scale * self.unit**2 * weights))
        self.count = problem.constraints
        if problem.kind.cone is None:
            raise ValueError(f"limits {problem.kind.formula} have no cone")
        self.cone, group = problem.kind.cone, problem.rows // problem.constraints
        if self.cone == "semidefinite":
            self.order = 3 + group
            self.length, self._factor = self.order * (self.order + 1) // 2, np.sqrt(2)
            entry = _places(self.order, triangle)
            self._bound_entries, rows = np.diag(entry), entry[3:, :3]
        else:
            self.order = self.length = 1 + 3 * group
            self._factor, self._bound_entries = 1.0, np.array([0])
            rows = 1 + np.arange(3 * group).reshape(group, 3)
        blocks = self.length * np.arange(self.count)[:, None, None]
        self._entries = (blocks + rows).reshape(-1, 3)
        pick = sp.csc_array(
            (
                np.full(3 * problem.rows, -self._factor * self.unit),
                (self._entries.ravel(), range(3 * problem.rows)),
            ),
            shape=(self.length * self.count, 3 * problem.rows),
        )
        self.A = sp.csc_array(pick @ sp.kron(problem.G[:, problem.free], sp.eye_array(3)))

    def constants(self, problem: Problem) -> FloatArray:
        """The vector b of a frame: the bounds and G target, where s holds b_i and (G x)_i."""
        blocks = np.zeros((self.count, self.length))
        blocks[:, self._bound_entries] = problem.bounds[:, None]
        constants = blocks.ravel()
        constants[self._entries] = self._factor * (problem.G @ problem.target)
        return constants

    def positions(self, problem: Problem, u: FloatArray) -> FloatArray:
        """(n, 3) target plus displacement [m]."""
        positions = problem.target.copy()
        positions[problem.free] += self.unit * u.reshape(-1, 3)
        return positions

    def multipliers(self, duals: FloatArray) -> FloatArray:
        """(rows, 3) Y from the duals of A u + s = b, in the problem's own units."""
        multipliers: FloatArray = -self._factor * duals[self._entries] / self.scale
        return multipliers


def _places(order: int, triangle: str) -> IntArray:
    """(order, order) where in its cone's block each entry of a symmetric matrix is."""
    corner = np.tril_indices(order)  # row by row: the upper one column by column
    if triangle == "lower":
        corner = np.triu_indices(order)
    place = np.zeros((order, order), dtype=np.int64)
    place[corner] = np.arange(len(corner[0]))
    return np.maximum(place, place.T)
