"""The projection as a cone program: the data that conic solvers and their file formats take.

With the free vertices' displacements u = x - target as unknowns,

    minimise 1/2 u'Pu  such that  A u + s = b,  each block of s in one and the same cone,

where P = s M. This is Tang et al. 2022, Eq. 12, but for the objective, which is given as a
quadratic, without a cone of its own. Constraint i has the second-order cone of order 4,
(b_i, (G x)_i) in Q^4.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from strainbench.limits import FloatArray
from strainbench.problem import Problem


class ConicForm:
    """The cone program of a mesh, for any target and bounds.

    Parameters
    ----------
    problem : any frame of the mesh.
    scaling : factor s of the objective in units of 1/edge^2; None leaves it in the problem's.

    Attributes
    ----------
    P : (u, u) diagonal, u = 3 times the free vertices, in the order of (free vertices, 3)
    A : (length count, u)
    cone, length, count : "second-order"; entries of s in one cone; how many cones
    scale : s
    """

    def __init__(self, problem: Problem, scaling: float | None = None) -> None:
        self.scale = 1.0 if scaling is None else scaling / problem.edge_length**2
        weights = np.repeat(problem.weights[problem.free], 3)
        self.P = sp.csc_array(sp.diags_array(self.scale * weights))
        self.cone, self.length, self.count = "second-order", 4, problem.rows
        self.A = -sp.csc_array(sp.kron(problem.G[:, problem.free], sp.eye_array(4, 3, k=-1)))

    def constants(self, problem: Problem) -> FloatArray:
        """The vector b of a frame: (b_i, (G target)_i) for each constraint."""
        return np.column_stack([problem.bounds, problem.G @ problem.target]).ravel()

    def positions(self, problem: Problem, u: FloatArray) -> FloatArray:
        """(n, 3) target plus displacement [m]."""
        positions = problem.target.copy()
        positions[problem.free] += u.reshape(-1, 3)
        return positions

    def multipliers(self, duals: FloatArray) -> FloatArray:
        """(rows, 3) Y from the duals of A u + s = b, in the problem's own units."""
        return -duals.reshape(-1, 4)[:, 1:] / self.scale
