"""What both kinds of limits share: a step, and what an element adds to the matrix.

The functions are compiled into the loops that call them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from strainbench.arrays import FloatArray, IntArray
from strainbench.compiled import compiled
from strainbench.problem.rows import Rows

ROUNDING = 1e-14
"""Residuals below it count as 0: divided by small slacks, rounding would floor the gap."""


@dataclass(frozen=True)
class Change:
    """What a step changes: numbers (rows,) for sampled limits, matrices (e, 3) for exact ones.

    s, l : of slacks and multipliers
    square : dy dy^T / 2, by which slacks fall short of their linearisation
    length : the part of the step that reaches the boundary, at most 1
    first, second : the sum of products after the part a grows by a first + a^2 second
    """

    s: FloatArray
    l: FloatArray  # noqa: E741
    square: FloatArray
    length: float
    first: float
    second: float


class Sums(NamedTuple):
    """Over all constraints, with norms |Y_i| and excess |y_i| - b_i.

    most, linear : sum of b |Y|, and of <Y, G target>
    price, beyond : sum of |Y| times the excess, and times that beyond twice ROUNDING
    worst : the largest excess, or NaN where one is
    """

    most: float
    linear: float
    price: float
    beyond: float
    worst: float


class Slots(NamedTuple):
    """Where blocks go: (e, k, k) and (n,) of `strainbench.physics.pattern.Pattern`."""

    slots: IntArray
    stride: IntArray


@compiled
def add_sums(sums: Sums, b: float, norm: float, excess: float, linear: float) -> Sums:
    """The sums with one constraint more."""
    price = norm * excess if excess > 0 else 0.0
    beyond = norm * (excess - 2 * ROUNDING) if excess > 2 * ROUNDING else 0.0
    worst = excess if excess > sums.worst or excess != excess else sums.worst
    return Sums(
        sums.most + b * norm,
        sums.linear + linear,
        sums.price + price,
        sums.beyond + beyond,
        worst,
    )


@compiled
def spread_blocks(G: Rows, at: Slots, e: int, H: FloatArray, data: FloatArray) -> None:
    """Add sum_cf B_ca B_fb H_cf, of H (dim, dim, 3, 3), to the block of each vertex pair a, b."""
    for b in range(len(G.corners)):
        width = at.stride[G.vertices[e, b]]
        for a in range(len(G.corners)):
            first = at.slots[e, a, b]
            if first < 0:
                continue
            for j in range(3):
                k0 = k1 = k2 = 0.0
                for c in range(len(G.axes)):
                    for f in range(len(G.axes)):
                        weight = G.coefficients[e, c, a] * G.coefficients[e, f, b]
                        k0 += weight * H[c, f, 0, j]
                        k1 += weight * H[c, f, 1, j]
                        k2 += weight * H[c, f, 2, j]
                column = first + j * width
                data[column] += k0
                data[column + 1] += k1
                data[column + 2] += k2


@compiled
def spread_symmetric(G: Rows, at: Slots, e: int, H: FloatArray, data: FloatArray) -> None:
    """The same for H_cf = H_fc = H_cf^T, whose entries 00, 01, 02, 11, 12, 22 are H (dim, dim, 6).

    Those with f <= c are read.
    """
    for b in range(len(G.corners)):
        width = at.stride[G.vertices[e, b]]
        for a in range(len(G.corners)):
            first = at.slots[e, a, b]
            if first < 0:
                continue
            k0 = k1 = k2 = k3 = k4 = k5 = 0.0
            for c in range(len(G.axes)):
                for f in range(c + 1):
                    weight = G.coefficients[e, c, a] * G.coefficients[e, f, b]
                    if f < c:
                        weight += G.coefficients[e, f, a] * G.coefficients[e, c, b]
                    k0 += weight * H[c, f, 0]
                    k1 += weight * H[c, f, 1]
                    k2 += weight * H[c, f, 2]
                    k3 += weight * H[c, f, 3]
                    k4 += weight * H[c, f, 4]
                    k5 += weight * H[c, f, 5]
            data[first] += k0
            data[first + 1] += k1
            data[first + 2] += k2
            data[first + width] += k1
            data[first + width + 1] += k3
            data[first + width + 2] += k4
            data[first + 2 * width] += k2
            data[first + 2 * width + 1] += k4
            data[first + 2 * width + 2] += k5
