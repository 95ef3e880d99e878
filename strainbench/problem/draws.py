"""Problems drawn at random: small irregular meshes, beyond limits that can be met."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.spatial import Delaunay

from strainbench.arrays import FloatArray, IntArray
from strainbench.problem.limits import StretchLimits
from strainbench.problem.problem import Problem

Random = np.random.Generator


def rotation(rng: Random, dim: int = 3) -> FloatArray:
    """A random proper rotation."""
    Q, R = np.linalg.qr(rng.normal(size=(dim, dim)))
    Q = Q * np.sign(np.diag(R))
    Q[:, 0] *= np.linalg.det(Q)
    return Q


def quality(rest: FloatArray, elements: IntArray) -> FloatArray:
    """Twice the area over the longest edge squared: 0.87 for an equilateral triangle."""
    a, b, c = np.moveaxis(rest[elements], 1, 0)
    longest = np.max([np.sum((p - q) ** 2, axis=1) for p, q in ((a, b), (b, c), (c, a))], axis=0)
    u, v = b - a, c - a
    ratios: FloatArray = np.abs(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]) / longest
    return ratios


def random_mesh(rng: Random, vertices: int | None = None) -> tuple[FloatArray, IntArray]:
    """An irregular triangulation of 12 to 40 vertices: rest (n, 2) [m], elements (e, 3)."""
    n = int(rng.integers(12, 41)) if vertices is None else vertices
    side = int(np.ceil(np.sqrt(n)))
    ticks = np.arange(side * side)
    points = np.column_stack([ticks // side, ticks % side])[:n] + rng.uniform(-0.3, 0.3, (n, 2))
    rest = 10 ** rng.uniform(-2, 0.5) * points @ rotation(rng, 2)
    elements = Delaunay(rest).simplices.astype(np.int64)
    elements = elements[quality(rest, elements) > 0.15]
    elements = np.array([np.roll(e, rng.integers(3)) for e in elements])
    used, compact = np.unique(elements, return_inverse=True)
    return rest[used], compact.reshape(-1, 3)


def random_limits(
    rng: Random, elements: IntArray, directions: int, limit: float, per_element: bool
) -> StretchLimits:
    """Isotropic samples, a random curve, or a random bound for every element and direction."""
    if per_element:
        angles = -np.pi / 2 + np.pi * np.arange(directions) / directions
        return StretchLimits.sampled(
            angles, 1 + limit * rng.uniform(0.5, 2, (len(elements), directions))
        )
    if rng.random() < 0.5:
        return StretchLimits.isotropic(1 + limit, directions)
    angles = np.pi * (np.arange(directions) + rng.uniform(0, 0.9, directions)) / directions
    return StretchLimits.sampled(angles, 1 + limit * rng.uniform(0.5, 2, directions))


def random_exact_limits(
    rng: Random, elements: IntArray, limit: float, per_element: bool
) -> StretchLimits:
    """A bound on the largest singular value, or its orthotropic relative, maybe by element."""
    size = len(elements) if per_element else None
    warp, weft = 1 + limit * rng.uniform(0.5, 2, size), 1 + limit * rng.uniform(0.5, 2, size)
    return StretchLimits.exact(warp, weft if rng.random() < 0.5 else None)


def random_placed_problem(
    rng: Random,
    directions: int | None = None,
    limit: float | None = None,
    mass: bool | None = None,
    pins: int | None = None,
    per_element: bool | None = None,
    vertices: int | None = None,
    exact: bool = False,
) -> tuple[Problem, FloatArray]:
    """A problem beyond its limits, and a feasible point: the rest shape, moved rigidly.

    Parameters
    ----------
    directions : 1 to 12; limit : 0.1% to 20%; mass : whether there are masses;
    pins : how many, 0 to 4; per_element : whether bounds differ between elements;
    exact : whether singular values are limited.
        None draws each at random.
    """
    rest, elements = random_mesh(rng, vertices)
    n = len(rest)
    directions = int(rng.integers(1, 13)) if directions is None else directions
    limit = 10 ** rng.uniform(-3, np.log10(0.2)) if limit is None else limit
    mass = rng.random() < 0.5 if mass is None else mass
    pins = int(rng.integers(0, 5)) if pins is None else pins
    per_element = rng.random() < 0.3 if per_element is None else per_element
    if exact:
        limits = random_exact_limits(rng, elements, limit, per_element)
    else:
        limits = random_limits(rng, elements, directions, limit, per_element)

    size = np.ptp(rest, axis=0).max()
    frame, shift = rotation(rng)[:, :2], size * rng.normal(size=3)
    placed = rest @ frame.T + shift
    turn = rotation(rng, 2)
    strain = turn * [rng.uniform(1.05, 1.6) * limits.bounds.max(), rng.uniform(0.6, 1.5)] @ turn.T
    noise = rng.uniform(0, 0.1) * size / np.sqrt(n) * rng.normal(size=(n, 3))
    target = rest @ (frame @ strain).T + shift + noise
    pinned = rng.permutation(n)[:pins]
    target[pinned] = placed[pinned]
    masses = 10 ** rng.uniform(-3, -1, n) if mass else None
    return Problem(rest, elements, target, limits, pinned, masses), placed


def random_problem(rng: Random, **choices: Any) -> Problem:
    """See `random_placed_problem`."""
    return random_placed_problem(rng, **choices)[0]
