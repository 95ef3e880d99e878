"""Contact of a step's vertices with planes, as rows like those of limits, and friction beside them.

A contact has the row g = n . (x - p) / edge >= 0, exact as it is linear, in units of the mean edge,
and with Coulomb friction two rows more, of its slip t = T (x - x_0 - moves) / edge. With l_n and
l_t the multipliers,

    |l_t| <= mu l_n, and l_t = -mu l_n t / |t| where it slips.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from strainbench import Problem
from strainbench import sparse as sp
from strainbench.arrays import FloatArray, IntArray


class Friction(NamedTuple):
    """The friction of a round's contacts, which are its last rows.

    rows : (2c, u) slip of contact k in rows 2k and 2k + 1, T d + slip
    slip : (2c,)
    mu : (c,)
    l : (2c,) multipliers to start from
    """

    rows: sp.csr_array
    slip: FloatArray
    mu: FloatArray
    l: FloatArray  # noqa: E741


class Contacts:
    """All contacts that a problem may have: contact k is vertex k mod n with plane k div n.

    Parameters
    ----------
    number : (3n,) of each coordinate among the unknowns; -1 where it is none
    """

    def __init__(self, problem: Problem, number: IntArray) -> None:
        self.planes, self.edge = problem.contact, problem.edge_length
        self.unused = np.ones(problem.vertices, dtype=bool)
        self.unused[problem.used] = False
        self._number = number.reshape(-1, 3)

    def gaps(self, x: FloatArray) -> FloatArray:
        """(planes n,) g at positions x (n, 3); infinite at vertices of no element."""
        gaps = [np.where(self.unused, np.inf, p.gaps(x) / self.edge) for p in self.planes]
        return np.concatenate([*gaps, np.zeros(0)])

    def rows(self, chosen: IntArray) -> sp.csr_array:
        """(c, u) derivatives of these contacts' g."""
        plane, vertex = np.divmod(chosen, len(self._number))
        normals = np.array([p.normal for p in self.planes]).reshape(-1, 3)
        return self._placed(normals[plane], vertex)

    def friction(self, chosen: IntArray, pushed: FloatArray, l: FloatArray) -> Friction:  # noqa: E741
        """Theirs, of vertices that pins alone move by `pushed` (n, 3)."""
        plane, vertex = np.divmod(chosen, len(self._number))
        tangents = np.array([p.tangents for p in self.planes]).reshape(-1, 2, 3)[plane]
        moves = np.array([p.moves for p in self.planes]).reshape(-1, 3)[plane]
        slip = np.einsum("ctx,cx->ct", tangents, pushed[vertex] - moves) / self.edge
        rows = self._placed(tangents.reshape(-1, 3), np.repeat(vertex, 2))
        mu = np.array([p.friction for p in self.planes])[plane]
        return Friction(rows, slip.ravel(), mu, l)

    def _placed(self, directions: FloatArray, vertex: IntArray) -> sp.csr_array:
        column = self._number[vertex]
        row, axis = np.nonzero(column >= 0)
        entries = directions[row, axis] / self.edge, (row, column[row, axis])
        shape = (len(vertex), int(self._number.max()) + 1)
        return sp.csr_array(entries, shape=shape)
