"""Isotropic limits on principal stretches, in half-spaces (Kovalsky et al. 2014).

With the rotation R = U V^T of an element's F at positions x_k (`rotation_svd`), the F with

    ||F|| <= hi  and  sym(R^T F) >= lo I

are a convex set, within the limits lo <= s_i <= hi, that has x_k in it where these hold at x_k, and
touches them there. It is what is left between the half-spaces

    u . F v <= hi  and  d . R^T F d >= lo  of all unit vectors u, v and d.

Those that an F is beyond are of its singular vectors u and v, and of eigenvectors d of sym(R^T F).
The former hold whatever R is, the latter for this one; in the same direction d, for another.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from strainbench import Problem
from strainbench.arrays import FloatArray, IntArray
from strainbench.problem.principal import PrincipalLimits
from strainbench.problem.principal_rows import rotation_svd


class HalfSpaces(NamedTuple):
    """u . F v >= lo of elements where `lower`, u . F v <= hi of others; (q,), (q, 3), (q, dim)."""

    element: IntArray
    u: FloatArray
    v: FloatArray
    lower: NDArray[np.bool_]

    def those(self, chosen: NDArray[np.bool_]) -> HalfSpaces:
        """Some of them."""
        element, u, v, lower = self
        return HalfSpaces(element[chosen], u[chosen], v[chosen], lower[chosen])

    @classmethod
    def of(cls, parts: Sequence[HalfSpaces]) -> HalfSpaces:
        """All of several, in their order."""
        return cls(*(np.concatenate(arrays) for arrays in zip(*parts, strict=True)))


class Rows(NamedTuple):
    """sum_kc C_kc x_kc >= offset.

    vertices (q, k); coefficients (q, k, 3) C [1/m]; offsets (q,); lower (q,)
    """

    vertices: IntArray
    coefficients: FloatArray
    offsets: FloatArray
    lower: NDArray[np.bool_]


class Restriction:
    """What touches the limits at x (n, 3).

    Attributes
    ----------
    near : how close to a limit counts as near [strain]
    """

    def __init__(self, problem: Problem, x: FloatArray) -> None:
        kind = problem.kind
        assert isinstance(kind, PrincipalLimits)
        U, _, V = rotation_svd(problem.deformation_gradients(x))
        margin = -float(kind.bounds[0])
        self._problem, self._R = problem, U @ np.swapaxes(V, 1, 2)
        self._least = float(kind.lower_limits[0]) + margin  # NaN, where free: nothing is beyond it
        self._largest = float(kind.upper_limits[0]) - margin
        self.near = 0.5 * kind.tightest

    def beyond(self, x: FloatArray, by: float, slack: float = 0.0) -> HalfSpaces:
        """Those that x is beyond by more than that, lower limits having so much slack."""
        F = self._problem.deformation_gradients(x)
        U, s, V = rotation_svd(F)
        G = np.swapaxes(self._R, 1, 2) @ F
        least, D = np.linalg.eigh(0.5 * (G + np.swapaxes(G, 1, 2)))
        e, i = np.nonzero(s > self._largest + by)
        f, j = np.nonzero(least < self._least - slack - by)
        above = HalfSpaces(e, U[e, :, i], V[e, :, i], np.zeros(len(e), dtype=bool))
        d = D[f, :, j]
        below = HalfSpaces(f, self._turned(f, d), d, np.ones(len(f), dtype=bool))
        return HalfSpaces.of([above, below])

    def renewed(self, cuts: HalfSpaces) -> HalfSpaces:
        """Half-spaces of another restriction as those of this one, in the same directions."""
        u = np.where(cuts.lower[:, None], self._turned(cuts.element, cuts.v), cuts.u)
        return cuts._replace(u=u)

    def rows(self, cuts: HalfSpaces) -> Rows:
        """As they bound positions."""
        problem, (e, u, v, lower) = self._problem, cuts
        along = np.einsum("qkc,qc->qk", problem.gradients[e], v)
        C = np.where(lower, 1.0, -1.0)[:, None, None] * along[:, :, None] * u[:, None]
        offsets = np.where(lower, self._least, -self._largest)
        return Rows(problem.elements[e], C, offsets, lower)

    def _turned(self, elements: IntArray, d: FloatArray) -> FloatArray:
        """R d."""
        turned: FloatArray = np.einsum("qxc,qc->qx", self._R[elements], d)
        return turned
