"""Convex inner restrictions of lower bounds, which touch them at positions x_k.

Entries are linear in the positions, sum_kc C_kc x_kc - offset, and those of a cone must lie in it.
At x_k they do where the lower bounds hold, and where they do the lower bounds hold.
"""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np

from strainbench import Problem
from strainbench.arrays import FloatArray, IntArray
from strainbench.plugins import Library

clarabel = Library("clarabel")


class Cuts(Protocol):
    """The entries of a restriction.

    Attributes
    ----------
    vertices : (q, k) on which each of q entries depends
    offsets : (q,) what is taken from it
    slack : (q,) how much of it the lower bounds' slack gives
    cones : Clarabel's, in the order of the entries
    """

    vertices: IntArray
    offsets: FloatArray
    slack: FloatArray
    cones: list[Any]

    def coefficients(self, x: FloatArray) -> FloatArray:
        """(q, k, 3) C [1/m] of the restriction that touches at x (n, 3)."""

    def multipliers(self, x: FloatArray, duals: FloatArray) -> FloatArray | None:
        """(rows, 3) those of rows of G from the duals (q,) of entries, if they are."""


class RowCuts:
    """||y|| >= u . y >= l with u = y_k / ||y_k||, for each sampled direction: a half-space."""

    def __init__(self, problem: Problem) -> None:
        limited = problem.lower_bounds > 0
        self.vertices = problem.row_vertices[limited]
        self.offsets = problem.lower_bounds[limited]
        self.slack = np.ones(len(self.offsets))
        self.cones = [clarabel.NonnegativeConeT(len(self.offsets))] if limited.any() else []
        self._g, self._limited = problem.row_coefficients[limited], limited

    def coefficients(self, x: FloatArray) -> FloatArray:
        """g u^T."""
        return self._g[:, :, None] * self._directions(x)[:, None]

    def multipliers(self, x: FloatArray, duals: FloatArray) -> FloatArray:
        """Against u."""
        Y = np.zeros((len(self._limited), 3))
        Y[self._limited] = -duals[:, None] * self._directions(x)
        return Y

    def _directions(self, x: FloatArray) -> FloatArray:
        y = np.einsum("qk,qkc->qc", self._g, x[self.vertices])
        u: FloatArray = y / np.linalg.norm(y, axis=1, keepdims=True)
        return u


class PolarCuts:
    """||F v|| >= (R v) . (F v) with R = U V^T of F_k: the symmetric part of R^T F is >= l.

    With a = r_0 . f_0, b = r_1 . f_1 and 2c = r_0 . f_1 + r_1 . f_0 its smallest eigenvalue is at
    least l iff (a + b - 2 l, a - b, 2c) lies in the second-order cone of order 3.
    """

    def __init__(self, problem: Problem) -> None:
        least = problem.lower_bounds.reshape(len(problem.elements), -1).max(axis=1)
        limited = least > 0
        self._elements, self._B = problem.elements[limited], problem.gradients[limited]
        self.vertices = np.repeat(self._elements, 3, axis=0)
        self.slack = np.tile([2.0, 0.0, 0.0], len(self._elements))
        self.offsets = self.slack * np.repeat(least[limited], 3)
        self.cones = [clarabel.SecondOrderConeT(3)] * len(self._elements)

    def coefficients(self, x: FloatArray) -> FloatArray:
        """B_k0 r_0 + B_k1 r_1, B_k0 r_0 - B_k1 r_1 and B_k1 r_0 + B_k0 r_1, for each element."""
        U, _, Vt = np.linalg.svd(
            np.einsum("ekx,ekc->exc", x[self._elements], self._B), full_matrices=False
        )
        r = U @ Vt
        a, b = (np.einsum("ek,ex->ekx", self._B[:, :, i], r[:, :, i]) for i in range(2))
        c = np.einsum("eki,exi->ekx", self._B[:, :, ::-1], r)
        return np.stack([a + b, a - b, c], axis=1).reshape(-1, self.vertices.shape[1], 3)

    def multipliers(self, x: FloatArray, duals: FloatArray) -> FloatArray | None:
        """None but where nothing is bounded from below: elements have more rows than axes."""
        return None if len(duals) else np.zeros(3)


RESTRICTIONS: dict[str, type[RowCuts] | type[PolarCuts]] = {"rows": RowCuts, "polar": PolarCuts}
