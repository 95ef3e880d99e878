"""What both kinds of limits share: a step, sums over constraints, and vectors over vertices.

The functions are compiled into the loops that call them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from strainbench.arrays import FloatArray, IntArray
from strainbench.compiled import compiled

ROUNDING = 1e-14
"""Residuals below it count as 0: divided by small slacks, rounding would floor the gap."""


@dataclass(frozen=True)
class Change:
    """What a step changes: numbers (rows,) for sampled limits, matrices for exact ones.

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


class Point(NamedTuple):
    """Where all exact constraints are: y (e, m, 3), s, l and r~, and the scaling R, R^-1, d (e, m).

    Symmetric matrices of triangles are their entries (e, 3), those of tetrahedra (e, 3, 3).
    """

    y: FloatArray
    s: FloatArray
    l: FloatArray  # noqa: E741
    r: FloatArray
    R: FloatArray
    inverse: FloatArray
    d: FloatArray


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
def residual(
    weights: FloatArray, x: FloatArray, t: FloatArray, pull: FloatArray, r_d: FloatArray
) -> tuple[float, float]:
    """r_d = M (x - t) + pull; 1/2 ||x - t||_M^2, and ||pull||^2_{M^-1}."""
    objective = square = 0.0
    for v in range(len(x)):
        for i in range(3):
            d = x[v, i] - t[v, i]
            r_d[v, i] = weights[v] * d + pull[v, i]
            objective += 0.5 * weights[v] * d * d
            square += pull[v, i] * pull[v, i] / weights[v]
    return objective, square


@compiled
def take(force: FloatArray, free: IntArray, b: FloatArray) -> None:
    """The right-hand side b (3 free,) = -force at the free vertices."""
    for k in range(len(free)):
        for i in range(3):
            b[3 * k + i] = -force[free[k], i]


@compiled
def put(solution: FloatArray, free: IntArray, dx: FloatArray) -> None:
    """The (3 free,) entries of a solution in dx (n, 3)."""
    for k in range(len(free)):
        for i in range(3):
            dx[free[k], i] = solution[3 * k + i]
