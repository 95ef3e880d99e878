"""How the free vertices can change the rows of G, and which of them interact."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from strainbench import sparse as sp
from strainbench.arrays import FloatArray, IntArray
from strainbench.problem.problem import Problem

NO_LEVERAGE = 1e-24
"""A constraint with L below this part of what all its vertices would give is held by its pins."""


class Leverage(NamedTuple):
    """How the free vertices can change the constraints, c of m rows each; W is M^-1, 0 at a pin.

    moves : (c, m, k), W g;
    total : (c,) L, the largest eigenvalue of g W g^T: of a single row sum_k w_k g_k^2; or 0 where
    no free vertex can change it.
    """

    moves: FloatArray
    total: FloatArray

    @classmethod
    def of(cls, problem: Problem) -> Leverage:
        """That of the vertices that are not held."""
        g = problem.row_coefficients
        terms = g**2 / problem.weights[problem.row_vertices]
        moves = g * inverse_weights(problem)[problem.row_vertices]
        shape = problem.constraints, -1, g.shape[1]
        moves, g = moves.reshape(shape), g.reshape(shape)
        total = np.sum(moves * g, axis=(1, 2))
        if g.shape[1] > 1:
            total = np.linalg.eigvalsh(moves @ g.swapaxes(1, 2))[:, -1]
        whole = np.sum(terms.reshape(shape), axis=(1, 2))
        return cls(moves, np.where(total > NO_LEVERAGE * whole, total, 0.0))

    @property
    def steps(self) -> FloatArray:
        """(c,) 1/L, or 0 where there is none."""
        return np.divide(1.0, self.total, out=np.zeros(len(self.total)), where=self.total > 0)


def inverse_weights(problem: Problem) -> FloatArray:
    """(n,) W = M^-1, 0 at the vertices that are held."""
    w = np.zeros(problem.vertices)
    w[problem.free] = 1 / problem.weights[problem.free]
    return w


def free_numbers(problem: Problem) -> IntArray:
    """(n,) the number of each vertex among the free ones, or -1."""
    number = np.full(problem.vertices, -1)
    number[problem.free] = np.arange(len(problem.free))
    return number


class Pairs:
    """The entries of M + sum_i w_i g_i g_i^T on the free vertices, of its lower triangle.

    Parameters
    ----------
    vertices, coefficients : (rows, k) of the g_i

    Attributes
    ----------
    rows, columns : (pairs,) free vertices, sorted by column
    products : (pairs, rows) sparse, g_iv g_iw [1/m^2]
    diagonal : (free,) index of the pair (v, v)
    """

    def __init__(self, problem: Problem, vertices: IntArray, coefficients: FloatArray) -> None:
        n = len(problem.free)
        a, b = np.tril_indices(vertices.shape[1])
        ends = free_numbers(problem)[vertices[:, [a, b]]]
        column, row = ends.min(axis=1), ends.max(axis=1)
        i, pair = np.nonzero(column >= 0)
        keys = np.concatenate([(column * n + row)[i, pair], np.arange(n) * (n + 1)])
        found, index = np.unique(keys, return_inverse=True)
        entries = (coefficients[:, a] * coefficients[:, b])[i, pair]
        shape = len(found), len(vertices)
        self.products = sp.csr_array((entries, (index[: len(i)], i)), shape=shape)
        self.diagonal = index[len(i) :]
        self.columns, self.rows = np.divmod(found, max(n, 1))
