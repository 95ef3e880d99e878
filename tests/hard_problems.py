"""Random problems of every valid kind, the awkward ones often."""

from __future__ import annotations

import numpy as np

from strainbench import Problem, StretchLimits
from tests.problems import random_mesh, rotation

SQUARE = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]), [[0, 1, 2], [0, 2, 3]]
TRIANGLE = SQUARE[0][:3], [[0, 1, 2]]
TETRAHEDRON = np.vstack([np.zeros(3), np.eye(3)]), [[0, 1, 2, 3]]
CUBE = (
    np.array([[i & 1, i >> 1 & 1, i >> 2] for i in range(8)], dtype=float),
    [[0, 1, 2, 4], [3, 2, 1, 7], [5, 4, 7, 1], [6, 7, 4, 2], [1, 2, 4, 7]],
)


def chance(rng, share):
    """Whether one of so many draws is this one."""
    return rng.random() < share


def hard_mesh(rng):
    """Rest (n, dim) and elements: one element, two, five, or an irregular mesh."""
    kind = rng.integers(6)
    if kind >= 4:
        return random_mesh(rng, int(rng.integers(6, 16)))
    rest, elements = (TRIANGLE, SQUARE, TETRAHEDRON, CUBE)[kind]
    return rest @ rotation(rng, rest.shape[1]), np.array(elements)


def hard_bounds(rng, shape):
    """Near 1, above or below it, or anything from 0.1 to 1e6."""
    if chance(rng, 0.6):
        return 1 + 10 ** rng.uniform(-6, -0.5) * rng.uniform(0.5, 1, shape)
    return 10 ** rng.uniform(-1, rng.choice([0.3, 6])) * rng.uniform(0.5, 1, shape)


def hard_limits(rng, elements, dim):
    """Sampled ones of 1 to 6 directions, exact ones, orthotropic ones, lower bounds."""
    count = (elements,) if chance(rng, 0.3) else ()
    if chance(rng, 0.25):
        weft = hard_bounds(rng, count) if dim == 2 and chance(rng, 0.5) else None
        return StretchLimits.exact(hard_bounds(rng, count), weft, dim=dim)
    m = int(rng.choice([1, 2, 3, 6]))
    directions = rng.normal(size=(m, dim))
    if chance(rng, 0.5):
        directions[: min(m, dim)] = np.eye(dim)[:m]
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    bounds = hard_bounds(rng, (*count, m))
    lower = 0.9 * bounds if chance(rng, 0.05) else None
    return StretchLimits(directions, bounds, lower=lower)


def hard_problem(rng):
    """Any mesh, limits, masses, pins and target, in units from 1e-8 to 1e8 m."""
    rest, elements = hard_mesh(rng)
    n, dim = rest.shape
    limits = hard_limits(rng, len(elements), dim)
    frame = rotation(rng)[:, :dim]
    least = min(1.0, limits.bounds.min())
    placed = least * rest @ frame.T
    strain = rng.uniform(0.3, 2.5, dim) * limits.bounds.max()
    target = (rest * strain) @ frame.T + rng.choice([0, 0.01, 0.3]) * rng.normal(size=(n, 3))
    pinned = rng.permutation(n)[: rng.choice([0, 0, 1, 2, dim, n])]
    if chance(rng, 0.8):  # pins that can be met
        target[pinned] = placed[pinned]
    if chance(rng, 0.05):
        target[:] = target[0]
    if chance(rng, 0.05):
        target = placed + rng.choice([0.0, 1e-9]) * rng.normal(size=(n, 3))
    if chance(rng, 0.1):
        target = target + 1e3 * rng.normal(size=3)
    if chance(rng, 0.05):
        target = target * 10 ** rng.uniform(-100, 100)
    if chance(rng, 0.25):  # vertices in no element
        rest = np.vstack([rest, rng.normal(size=(2, dim))])
        target = np.vstack([target, rng.normal(size=(2, 3))])
        pinned = np.append(pinned, n) if chance(rng, 0.3) else pinned
    unit = 10 ** rng.uniform(-8, 8) if chance(rng, 0.3) else 1.0
    if chance(rng, 0.1):
        rest = rest[elements]
    spread = rng.choice([0.0, 1.0, 12.0])
    mass = 10 ** rng.uniform(-spread, spread, len(target)) if spread else None
    return Problem(unit * rest, elements, unit * target, limits, pinned.astype(int), mass)
