"""The rows of G as compiled loops see them, and matrices M + G^T W G."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from strainbench import Problem
from strainbench.arrays import FloatArray
from strainbench.compiled import compiled
from strainbench.physics.linear import SuperLU


class Rows:
    """The rows of G, and a solver for matrices M + G^T W G.

    Attributes
    ----------
    vertices, coefficients : (rows, k) of G [1/m]
    compliance : (constraints,) g_i M^-1 g_i, the mean over an element's rows for exact limits
    group : rows of G in a constraint
    """

    def __init__(self, problem: Problem) -> None:
        self._vertices = problem.vertices
        self.vertices, self.coefficients = problem.row_vertices, problem.row_coefficients
        self.group = problem.rows // problem.constraints
        inverse = np.zeros(problem.vertices)
        inverse[problem.free] = 1 / problem.weights[problem.free]
        g = self.coefficients
        compliance = np.sum(g**2 * inverse[self.vertices], axis=1)
        compliance = compliance.reshape(-1, self.group).mean(axis=1)
        idle = compliance <= 1e-12 * compliance.max()  # all pinned: any weight will do
        self.compliance = np.where(idle, compliance.max(), compliance)

        n = len(problem.free)
        unknown = np.full(problem.vertices, -1)
        unknown[problem.free] = np.arange(n)
        a, b = np.tril_indices(g.shape[1])
        ends = unknown[self.vertices[:, [a, b]]]
        column, row = ends.min(axis=1), ends.max(axis=1)
        i, pair = np.nonzero(column >= 0)
        keys = np.concatenate([(column * n + row)[i, pair], np.arange(n) * (n + 1)])
        found, index = np.unique(keys, return_inverse=True)
        shape = len(found), problem.rows
        entries = (g[:, a] * g[:, b])[i, pair]
        self._products = sp.csr_array((entries, (index[: len(i)], i)), shape=shape)
        self._mass = np.zeros(len(found))
        self._mass[index[len(i) :]] = problem.weights[problem.free]
        starts = np.searchsorted(found, n * np.arange(n + 1))
        if n:
            self.linear = SuperLU(sp.csc_array((self._mass, found % n, starts)))

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
        add_pull(self.vertices, self.coefficients, w, v, z, start, pull)
        return pull


@compiled
def project_on_balls(v, bounds, z):  # type: ignore[no-untyped-def]
    """z_i = min(1, b_i / |v_i|) v_i."""
    for i in range(len(v)):
        square = v[i, 0] ** 2 + v[i, 1] ** 2 + v[i, 2] ** 2
        factor = bounds[i] / np.sqrt(square) if square > bounds[i] ** 2 else 1.0
        for c in range(3):
            z[i, c] = factor * v[i, c]


@compiled
def clamp_singular_values(v, bounds, z):  # type: ignore[no-untyped-def]
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
def add_pull(vertices, coefficients, w, v, z, start, pull):  # type: ignore[no-untyped-def]
    """pull += G^T W (2 z - v - start)."""
    for i in range(len(vertices)):
        r0 = w[i] * (2 * z[i, 0] - v[i, 0] - start[i, 0])
        r1 = w[i] * (2 * z[i, 1] - v[i, 1] - start[i, 1])
        r2 = w[i] * (2 * z[i, 2] - v[i, 2] - start[i, 2])
        for j in range(vertices.shape[1]):
            k, g = vertices[i, j], coefficients[i, j]
            pull[k, 0] += g * r0
            pull[k, 1] += g * r1
            pull[k, 2] += g * r2
