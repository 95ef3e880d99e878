"""Limits on principal stretches as rows C(F) >= 0, and their derivatives (Hernandez et al. 2013).

F = U diag(s) V^T with rotations U and V (Eq. 4). With the components c_ij = v_i . e_j of the
principal axes along the material ones, a limit l_j on axis j, below (sign 1) or above (sign -1),
demands sign g >= 0 of each principal axis i, where g is

| kind | g | equations |
|---|---|---|
| hyperbolic | |c_ij| (s_i - 1) - (l_j - 1) | 7, 8, 11, 12 |
| orthogonal | (s_i - 1) - (l_j - 1) |c_ij| | 19, 20 |
| linear | s_i - ||(l_j c_ij)_j|| | 21, 22 as printed |
| ellipsoid | s_i - 1 / ||(c_ij / l_j)_j||, the radius that the text describes | |
| isotropic | s_i - l | 9, 10 |

With P = U^T dF V, ds_i = P_ii and dv_i = sum_{q != i} v_q (s_i P_iq + s_q P_qi) / (s_i^2 - s_q^2),
which are Eqs. 13 to 18 in closed form. The denominator vanishes where |s_i| = |s_q|, at s_i = -s_q
too: values closer than `SEPARATION` are taken for that far apart.

Biot rows have the value of the hyperbolic ones, |c_ij| (s_i - 1) = |v_i^T E e_j| but for the sign,
E = sqrt(F^T F) - I, with v_i held: their derivative stays below 1, and sees the shear that rows of
single singular values miss.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from strainbench.arrays import FloatArray

SEPARATION = 1e-6
"""Least difference of two absolute singular values, and least sum."""
FREE = {"linear": (0.0, 1e6), "ellipsoid": (1e-6, 1e6)}
"""Where axes are interpolated between: limits that stand for none."""


class Frames(NamedTuple):
    """F = U diag(s) V^T, thin for triangles: (e, 3, n), (e, n), (e, n, n).

    The least value of a tetrahedron's is negative where that is inverted.
    """

    U: FloatArray
    s: FloatArray
    V: FloatArray

    @property
    def components(self) -> FloatArray:
        """(e, n, n) c_ij = v_i . e_j."""
        return np.swapaxes(self.V, 1, 2)

    @property
    def gaps(self) -> FloatArray:
        """(e,) least difference of two absolute singular values."""
        least: FloatArray = np.diff(np.sort(np.abs(self.s), axis=1)).min(axis=1)
        return least


def rotation_svd(F: FloatArray) -> Frames:
    """The singular values of F (e, 3, n) by absolute size, with U and V rotations where n is 3."""
    U, s, Vt = np.linalg.svd(F, full_matrices=False)
    if F.shape[2] == 3:
        for side in (U, np.swapaxes(Vt, 1, 2)):  # LAPACK's own may be reflections
            flip = np.where(np.linalg.det(side) < 0, -1.0, 1.0)
            side[:, :, 2] *= flip[:, None]
            s[:, 2] *= flip
    return Frames(U, s, np.swapaxes(Vt, 1, 2))


class Demand(NamedTuple):
    """g (e, n, k) of k rows a principal axis, dg/ds_i alike, and dg/dc_i (e, n, k, n)."""

    value: FloatArray
    by_stretch: FloatArray
    by_axis: FloatArray


def hyperbolic(s: FloatArray, c: FloatArray, limit: FloatArray) -> Demand:
    """Eqs. 11, 12: the limit on e_j grows with 1 / |cos|."""
    j = np.flatnonzero(~np.isnan(limit))
    strain = s[:, :, None] - 1
    value = np.abs(c[:, :, j]) * strain - (limit[j] - 1)
    return Demand(
        value, np.abs(c[:, :, j]), (strain * np.sign(c[:, :, j]))[..., None] * np.eye(len(limit))[j]
    )


def orthogonal(s: FloatArray, c: FloatArray, limit: FloatArray) -> Demand:
    """Eqs. 19, 20: the limit on e_j shrinks with |cos|."""
    j = np.flatnonzero(~np.isnan(limit))
    value = s[:, :, None] - 1 - (limit[j] - 1) * np.abs(c[:, :, j])
    slope = -(limit[j] - 1) * np.sign(c[:, :, j])
    return Demand(value, np.ones_like(value), slope[..., None] * np.eye(len(limit))[j])


def linear(s: FloatArray, c: FloatArray, limit: FloatArray) -> Demand:
    """Eqs. 21, 22 as printed: ||D v_i||, which is not the ellipsoid's radius."""
    radius = np.linalg.norm(limit * c, axis=2)
    slope = -(limit**2) * c / np.where(radius > 0, radius, 1.0)[:, :, None]
    return _of_radius(s, radius, slope)


def ellipsoid(s: FloatArray, c: FloatArray, limit: FloatArray) -> Demand:
    """1 / ||D^-1 v_i||, where the principal axis meets the ellipsoid of the limits."""
    radius = 1 / np.linalg.norm(c / limit, axis=2)
    return _of_radius(s, radius, radius[:, :, None] ** 3 * c / limit**2)


def isotropic(s: FloatArray, c: FloatArray, limit: FloatArray) -> Demand:
    """Eqs. 9, 10: the same in all directions."""
    return _of_radius(s, np.broadcast_to(limit[0], s.shape), np.zeros_like(c))


def _of_radius(s: FloatArray, radius: FloatArray, slope: FloatArray) -> Demand:
    value = (s - radius)[:, :, None]
    return Demand(value, np.ones_like(value), slope[:, :, None])


KINDS: dict[str, Callable[[FloatArray, FloatArray, FloatArray], Demand]] = {
    f.__name__: f for f in (hyperbolic, orthogonal, linear, ellipsoid, isotropic)
}
"""By name: what a limit (n,), NaN where an axis is free, demands of frames with s and c."""


def slopes(frames: Frames, demand: Demand) -> FloatArray:
    """(e, n, k, 3, n) dg/dF of `demand`; see the module."""
    return _slopes(frames, demand.by_stretch, demand.by_axis, _square_differences(frames.s))


def biot_slopes(frames: Frames, limit: FloatArray) -> FloatArray:
    """(e, n, k, 3, n) dg/dF of Biot rows, whose g is the hyperbolic one."""
    j = np.flatnonzero(~np.isnan(limit))
    c, n = frames.components, len(limit)
    by_axis = np.sign(c[:, :, j])[..., None] * np.eye(n)[j]
    return _slopes(frames, np.abs(c[:, :, j]), by_axis, _sums(frames.s))


def _slopes(
    frames: Frames, by_stretch: FloatArray, by_axis: FloatArray, below: FloatArray
) -> FloatArray:
    """dg/dF where dv_i is sum_q v_q (s_i P_iq + s_q P_qi) / below_iq."""
    U, s, V = frames
    own = np.eye(s.shape[1])
    turn = np.einsum("eikj,eqj->eikq", by_axis, frames.components) / below[:, :, None]
    by_P = np.einsum("eik,ip,iq->eikpq", by_stretch, own, own)
    by_P += np.einsum("ip,eikq->eikpq", own, turn * s[:, :, None, None])
    by_P += np.einsum("iq,eikp->eikpq", own, turn * s[:, None, None, :])
    by_F: FloatArray = np.einsum("exp,eikpq,eyq->eikxy", U, by_P, V, optimize=True)
    return by_F


def _square_differences(s: FloatArray) -> FloatArray:
    """(e, n, n) s_i^2 - s_q^2, kept off 0; infinite for i = q, which does not turn."""
    size, number = np.abs(s), np.arange(s.shape[1])
    gap = np.maximum(np.abs(size[:, :, None] - size[:, None, :]), SEPARATION)
    whole = np.maximum(size[:, :, None] + size[:, None, :], SEPARATION)
    order = np.where(number[:, None] < number, 1.0, -1.0)  # they are sorted
    different: FloatArray = order * gap * whole
    different[:, number, number] = np.inf
    return different


def _sums(s: FloatArray) -> FloatArray:
    """(e, n, n) s_i + s_q, kept off 0; infinite for i = q."""
    whole = s[:, :, None] + s[:, None, :]
    whole = np.copysign(np.maximum(np.abs(whole), SEPARATION), whole)
    whole[:, np.arange(s.shape[1]), np.arange(s.shape[1])] = np.inf
    return whole
