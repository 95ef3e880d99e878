"""Steps 1 and 2 of ADMM: projections on the limits, and matrices M + G^T W G."""

from __future__ import annotations

import numpy as np

from strainbench import Problem
from strainbench import sparse as sp
from strainbench.arrays import FloatArray
from strainbench.compiled import compiled
from strainbench.physics.linear import SuperLU
from strainbench.problem.leverage import Leverage, Pairs
from strainbench.problem.rows import Rows, add_row


class Steps:
    """Projections of each constraint's rows, and a solver for matrices M + G^T W G.

    Attributes
    ----------
    G : the rows of G
    compliance : (constraints,) g_i M^-1 g_i, the mean over an element's rows for exact limits
    group : rows of G in a constraint
    """

    def __init__(self, problem: Problem) -> None:
        self.G, self._vertices = Rows.of(problem), problem.vertices
        self.group = len(self.G.axes)
        moves = Leverage.of(problem).moves
        compliance = np.sum(moves * self.G.coefficients, axis=2).mean(axis=1)
        idle = compliance <= 1e-12 * compliance.max()  # all pinned: any weight will do
        self.compliance = np.where(idle, compliance.max(), compliance)
        n = len(problem.free)
        pairs = Pairs(problem, problem.row_vertices, problem.row_coefficients)
        self._products, self._mass = pairs.products, np.zeros(len(pairs.rows))
        self._mass[pairs.diagonal] = problem.weights[problem.free]
        starts = np.searchsorted(pairs.columns, np.arange(n + 1))
        if n:
            self.linear = SuperLU(sp.csc_array((self._mass, pairs.rows, starts)))

    def factorise(self, weights: FloatArray) -> None:
        """Take M + G^T W G with these weights (rows,)."""
        self.linear.factorise(self._mass + self._products @ weights)

    def project(self, v: FloatArray, bounds: FloatArray) -> FloatArray:
        """Each constraint's rows moved to the closest within its bound."""
        z = np.empty_like(v)
        if self.group == 1:
            project_on_balls(v, bounds, z)
        elif self.group == 2:
            clamp_singular_values(v, bounds, z)
        else:
            U, s, Vt = np.linalg.svd(v.reshape(-1, 3, 3))
            z[:] = ((U * np.minimum(s, bounds[:, None])[:, None]) @ Vt).reshape(-1, 3)
        return z

    def pull(self, w: FloatArray, v: FloatArray, z: FloatArray, start: FloatArray) -> FloatArray:
        """(n, 3) G^T W (2 z - v - start)."""
        pull = np.zeros((self._vertices, 3))
        add_pull(self.G, w, v, z, start, pull)
        return pull


@compiled
def project_on_balls(v: FloatArray, bounds: FloatArray, z: FloatArray) -> None:
    """z_i = min(1, b_i / |v_i|) v_i."""
    for i in range(len(v)):
        square = v[i, 0] ** 2 + v[i, 1] ** 2 + v[i, 2] ** 2
        factor = bounds[i] / np.sqrt(square) if square > bounds[i] ** 2 else 1.0
        for c in range(3):
            z[i, c] = factor * v[i, c]


@compiled
def clamp_singular_values(v: FloatArray, bounds: FloatArray, z: FloatArray) -> None:
    """Each two rows times a function of their Gram matrix C, s -> min(1, b / s) of s^2.

    With eigenvalues s_1^2 >= s_2^2 and f_k = min(1, b / s_k), f(C) is
    f_1 I + (f_2 - f_1) / (s_2^2 - s_1^2) (C - s_1^2 I).
    """
    for e in range(len(bounds)):
        p, q = v[2 * e], v[2 * e + 1]
        a, c, d = p @ p, p @ q, q @ q
        half, radius = (a - d) / 2, np.hypot((a - d) / 2, c)
        first, second = np.sqrt((a + d) / 2 + radius), np.sqrt(max((a + d) / 2 - radius, 0.0))
        f1 = min(1.0, bounds[e] / max(first, bounds[e]))
        f2 = min(1.0, bounds[e] / max(second, bounds[e]))
        slope = (f1 - f2) / (2 * radius) if radius > 0 else 0.0
        for k in range(3):
            z[2 * e, k] = f1 * p[k] + slope * ((half - radius) * p[k] + c * q[k])
            z[2 * e + 1, k] = f1 * q[k] + slope * (c * p[k] - (half + radius) * q[k])


@compiled
def add_pull(
    G: Rows, w: FloatArray, v: FloatArray, z: FloatArray, start: FloatArray, pull: FloatArray
) -> None:
    """pull += G^T W (2 z - v - start).

    1.16 of the same in C, whose products and sums are rounded at once (`make kernels`): 1.05 so,
    but `add_row` is all solvers', and the factorisation takes most of the time here.
    """
    m = len(G.axes)
    for i in range(len(G.vertices)):
        for a in range(m):
            r = i * m + a
            r0 = w[r] * (2 * z[r, 0] - v[r, 0] - start[r, 0])
            r1 = w[r] * (2 * z[r, 1] - v[r, 1] - start[r, 1])
            r2 = w[r] * (2 * z[r, 2] - v[r, 2] - start[r, 2])
            add_row(G, G.coefficients, i, a, (r0, r1, r2), pull)
