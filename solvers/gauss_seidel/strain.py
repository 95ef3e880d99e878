"""The strain of one triangle, in closed form: its polar decomposition and its limits.

F (3, 2) = U diag(s1, s2) V^T = R S, with V = [v1 v2], v1 = (c, s) and v2 = (-s, c).

Thomaszewski et al. 2009 have a constant limit for each entry of S - I. Here each has the room that
the other entries leave, so that limits on the stretch |S d| along warp, weft and the diagonals
hold: first S_xy by |S d|^2 = (h +- S_xy)^2 + k^2 along the diagonals, with h and k the half sum and
half difference of S_xx and S_yy, then these by |S e_x|^2 = S_xx^2 + S_xy^2 and so on.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from strainbench.arrays import FloatArray
from strainbench.compiled import compiled

Vector = tuple[float, float, float]

FLAT = 1e-12
"""Singular values smaller than this beside the larger one are rounding, without a direction."""


@compiled
def polar(F: FloatArray) -> tuple[float, float, float, float]:
    """Singular values s1 >= s2 of F (3, 2) and its first right vector (c, s); F becomes R.

    V is in closed form; F v2 is made orthogonal to F v1 again, so that s2 is as accurate as s1,
    and where nothing is left of it any direction normal to F v1 will do.
    """
    a = b = d = 0.0
    for i in range(3):
        a += F[i, 0] * F[i, 0]
        b += F[i, 0] * F[i, 1]
        d += F[i, 1] * F[i, 1]
    half = 0.5 * (a - d)
    r = np.hypot(half, b)
    c, s = (half + r, b) if half >= 0 else (abs(b), np.copysign(r - half, b))
    length = np.hypot(c, s)
    c, s = (c / length, s / length) if length > 0 else (1.0, 0.0)
    u1 = (c * F[0, 0] + s * F[0, 1], c * F[1, 0] + s * F[1, 1], c * F[2, 0] + s * F[2, 1])
    u2 = (c * F[0, 1] - s * F[0, 0], c * F[1, 1] - s * F[1, 0], c * F[2, 1] - s * F[2, 0])
    s1, u1 = unit(u1, (0.0, 0.0, 0.0), 0.0)
    along = u1[0] * u2[0] + u1[1] * u2[1] + u1[2] * u2[2]
    across = (u2[0] - along * u1[0], u2[1] - along * u1[1], u2[2] - along * u1[2])
    s2, u2 = unit(across, u1, FLAT * s1)
    for i in range(3):
        F[i, 0] = u1[i] * c - u2[i] * s
        F[i, 1] = u1[i] * s + u2[i] * c
    return s1, s2, c, s


@compiled
def unit(y: Vector, normal: Vector, least: float) -> tuple[float, Vector]:
    """Length and direction of y; any direction orthogonal to `normal` where it is too short."""
    length = np.sqrt(y[0] * y[0] + y[1] * y[1] + y[2] * y[2])
    if length > least:
        return length, (y[0] / length, y[1] / length, y[2] / length)
    n0, n1, n2 = normal
    if abs(n0) <= min(abs(n1), abs(n2)):
        other = (1 - n0 * n0, -n0 * n1, -n0 * n2)
    elif abs(n1) <= abs(n2):
        other = (-n0 * n1, 1 - n1 * n1, -n1 * n2)
    else:
        other = (-n0 * n2, -n1 * n2, 1 - n2 * n2)
    size = np.sqrt(other[0] ** 2 + other[1] ** 2 + other[2] ** 2)
    return length, (other[0] / size, other[1] / size, other[2] / size)


@compiled
def symmetric(first: float, second: float, c: float, s: float) -> Vector:
    """Entries xx, yy, xy of V diag(first, second) V^T."""
    return first * c * c + second * s * s, first * s * s + second * c * c, (first - second) * c * s


@compiled
def violation(
    s1: float,
    s2: float,
    c: float,
    s: float,
    directions: FloatArray,
    bounds: FloatArray,
    lower: FloatArray,
) -> float:
    """Largest violation of a triangle's own limits."""
    if len(directions) == 0:
        return s1 - float(bounds[0])
    worst = 0.0
    for j in range(len(directions)):
        along = directions[j, 0] * c + directions[j, 1] * s
        across = directions[j, 1] * c - directions[j, 0] * s
        stretch = np.hypot(s1 * along, s2 * across)
        worst = max(worst, stretch - bounds[j], lower[j] - stretch)
    return worst


@compiled
def strain_change(
    s1: float,
    s2: float,
    c: float,
    s: float,
    columns: NDArray[np.int64],
    bounds: FloatArray,
    lower: FloatArray,
) -> Vector:
    """Entries xx, yy, xy of the change that clamps the strain to the limits."""
    xx, yy, xy = symmetric(s1, s2, c, s)
    b0, l0 = room(columns[0], bounds, lower)
    b1, l1 = room(columns[1], bounds, lower)
    x, y = min(xx, b0), min(yy, b1)
    h, k = 0.5 * (x + y), 0.5 * (x - y)
    b2, l2 = room(columns[2], bounds, lower)
    b3, l3 = room(columns[3], bounds, lower)
    b2, b3, l2, l3 = leg(b2, k), leg(b3, k), leg(l2, k), leg(l3, k)
    h = min(max(h, 0.5 * (l2 + l3)), 0.5 * (b2 + b3))
    z = min(max(xy, h - b3, l2 - h), b2 - h, h - l3)
    z = min(max(z, -b0, -b1), b0, b1)
    x = min(max(h + k, leg(l0, z)), leg(b0, z))
    y = min(max(h - k, leg(l1, z)), leg(b1, z))
    return x - xx, y - yy, z - xy


@compiled
def room(column: int, bounds: FloatArray, lower: FloatArray) -> tuple[float, float]:
    """Largest and least stretch along one of ENTRIES."""
    return (bounds[column], lower[column]) if column >= 0 else (np.inf, 0.0)


@compiled
def leg(hypotenuse: float, other: float) -> float:
    """The other leg of a right triangle, 0 where there is none."""
    return float(np.sqrt(max(0.0, hypotenuse * hypotenuse - other * other)))
