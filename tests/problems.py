"""Small random irregular problems, and what their optima must obey."""

from __future__ import annotations

import numpy as np
from scipy.spatial import Delaunay

from strainbench import Problem, StretchLimits
from strainbench.physics.linear import symmetric
from strainbench.problem.draws import quality as quality
from strainbench.problem.draws import random_mesh as random_mesh
from strainbench.problem.draws import random_placed_problem as random_placed_problem
from strainbench.problem.draws import random_problem as random_problem
from strainbench.problem.draws import rotation as rotation
from strainbench.problem.grid import square_grid
from strainbench.referee.reference import Reference


def hessian(body, x, diagonal):
    """A body's clamped one, as a whole symmetric matrix on the free vertices."""
    return symmetric(body.pattern.matrix(body.hessian_values(x, diagonal)))


def hard_mesh(rng):
    """Irregular triangles, a square sheet, slivers down to 1e-3 of their length, or a volume."""
    kind = int(rng.integers(4))
    if kind == 0:
        return random_mesh(rng)
    if kind == 1:
        return square_grid(int(rng.integers(2, 13)), 10 ** rng.uniform(-1, 0.5), "alternating")
    if kind == 2:
        points = rng.uniform(size=(int(rng.integers(6, 60)), 2)) * [1, 10 ** rng.uniform(-3, 0)]
    else:
        points = rng.normal(size=(int(rng.integers(5, 25)), 3))
    elements = Delaunay(points).simplices.astype(np.int64)
    used, compact = np.unique(elements, return_inverse=True)
    return points[used], compact.reshape(elements.shape)


def hard_limits(rng, elements, dim):
    """0.01% to 20%, exact or in 1 to 8 directions, maybe different for each element."""
    limit = 10 ** rng.uniform(-4, np.log10(0.2))
    size = elements if rng.random() < 0.3 else None
    if dim == 2 and rng.random() < 0.4:
        return StretchLimits.exact(1 + limit * rng.uniform(0.5, 2, size))
    m = int(rng.integers(1, 9))
    if dim == 2:
        angles = np.pi * np.arange(m) / m
        directions = np.column_stack([np.cos(angles), np.sin(angles)])
    else:
        directions = rng.normal(size=(m, 3))
        directions /= np.linalg.norm(directions, axis=1)[:, None]
    shape = (m,) if size is None else (size, m)
    spread = rng.uniform(0.5, 2, shape) if size else np.ones(shape)
    return StretchLimits(directions, 1 + limit * spread)


def hard_problem(rng):
    """Masses over up to 24 decades; up to 4 pins at rest, or at the limit but for rounding."""
    rest, elements = hard_mesh(rng)
    n, dim = rest.shape
    limits = hard_limits(rng, len(elements), dim)
    frame, size = rotation(rng)[:, :dim], np.ptp(rest, axis=0).max()
    low = limits.bounds.min()
    target = rest * rng.uniform(0.5, 2, dim) @ frame.T
    target += 10 ** rng.uniform(-5, -1) * size / np.sqrt(n) * rng.normal(size=(n, 3))
    pinned = rng.permutation(n)[: int(rng.integers(0, 5))]
    short = 1 + (low - 1) * (1 - 10 ** rng.uniform(-9, -1))
    apart = rng.choice([1.0, low, low * (1 + 2e-16 * rng.integers(-4, 5)), short])
    target[pinned] = apart * rest[pinned] @ frame.T
    decades = rng.uniform(0, 24)
    mass = 10 ** rng.uniform(-decades / 2, decades / 2, n) if rng.random() < 0.6 else None
    return Problem(rest, elements, target + size * rng.normal(size=3), limits, pinned, mass)


def moved(problem, Q, shift):
    """The same problem after a rigid motion of space."""
    return problem.with_target(problem.target @ Q.T + shift)


def renumbered(problem, order):
    """The same problem with vertex order[i] renamed i; elements keep their order."""
    new = np.argsort(order)
    return Problem(
        rest=problem.rest[order],
        elements=new[problem.elements],
        target=problem.target[order],
        limits=problem.limits,
        pinned=new[problem.pinned],
        mass=None if problem.mass is None else problem.mass[order],
    )


def scattered_triangles(rng, count=6, mass=False):
    """Disjoint triangles with one limited direction each, and the exact projection.

    Only one constraint acts on each triangle, so with y = sum_k g_k t_k
    x_k = t_k - (g_k / m_k) / sum_j (g_j^2 / m_j) max(0, |y| - b) y / |y|.
    """
    rest = rng.normal(size=(3 * count, 2))
    elements = np.arange(3 * count).reshape(count, 3)
    while np.any(flat := quality(rest, elements) < 0.2):
        rest[elements[flat].ravel()] = rng.normal(size=(3 * flat.sum(), 2))
    angle = rng.uniform(0, np.pi, 1)
    limits = StretchLimits.sampled(angle, rng.uniform(0.9, 1.2, (count, 1)))
    target = rng.uniform(0.5, 2.5) * rest @ rotation(rng)[:, :2].T
    target += 0.2 * rng.normal(size=target.shape)
    masses = 10 ** rng.uniform(-2, 0, len(rest)) if mass else None
    problem = Problem(rest, elements, target, limits, mass=masses)
    exact = target.copy()
    for e, triangle in enumerate(elements):
        g = problem.gradients[e] @ limits.directions[0]
        step = g / problem.weights[triangle]
        y = g @ target[triangle]
        length = np.linalg.norm(y)
        excess = max(0.0, length - problem.bounds[e])
        exact[triangle] -= np.outer(step, y / length) * excess / (g @ step)
    return problem, exact


def stretched_cube(limits):
    """Five tetrahedra, a corner pinned, beyond limits of some per cent."""
    rest = np.array([[i & 1, i >> 1 & 1, i >> 2] for i in range(8)], dtype=float)
    corners = [[0, 1, 2, 4], [3, 2, 1, 7], [5, 4, 7, 1], [6, 7, 4, 2], [1, 2, 4, 7]]
    noise = 0.1 * np.random.default_rng(3).normal(size=(8, 3))
    target = rest * [1.6, 1.2, 0.5] + noise
    return Problem(rest, np.array(corners), target, limits, pinned=np.array([0]))


def random_volume(rng, limits=None):
    """Some 10 to 40 irregular tetrahedra beyond limits, exact ones by default, and up to 3 pins."""
    rest = 10 ** rng.uniform(-2, 0.5) * rng.uniform(0, 1, (int(rng.integers(8, 15)), 3))
    elements = Delaunay(rest).simplices.astype(np.int64)
    edges = rest[elements[:, 1:]] - rest[elements[:, :1]]
    longest = np.linalg.norm(edges, axis=2).max(axis=1)
    elements = elements[np.abs(np.linalg.det(edges)) > 0.05 * longest**3]
    used, compact = np.unique(elements, return_inverse=True)
    rest, elements = rest[used], compact.reshape(-1, 4)
    if limits is None:
        bounds = 1 + 10 ** rng.uniform(-3, -0.7) * rng.uniform(0.5, 2, (len(elements), 3))
        limits = StretchLimits(np.eye(3), bounds, spectral=True)
    placed = rest @ rotation(rng).T + rng.normal(size=3)
    axes, strains = rotation(rng), rng.uniform(0.7, [1.8, 1.5, 1.5])
    target = placed @ (axes * strains @ axes.T)
    pinned = rng.permutation(len(rest))[: rng.integers(0, 4)]
    target[pinned] = placed[pinned]
    mass = 10 ** rng.uniform(-3, -1, len(rest)) if rng.random() < 0.5 else None
    return Problem(rest, elements, target, limits, pinned, mass), placed


def own_gap(problem, solution):
    """The referee's relative gap, from the solver's own multipliers instead of a reference's."""
    nowhere = np.full_like(problem.target, np.nan)
    bound = Reference.verified(problem, nowhere, solution.multipliers).lower_bound
    norms = problem.dual_norms(solution.multipliers)
    priced = float(norms @ problem.violations(solution.positions))
    return (problem.objective(solution.positions) + priced) / bound - 1


def central_difference(function, x, h=1e-6):
    """Derivative of a scalar or array function in each entry of x, stacked behind its own shape."""
    columns = []
    for index in np.ndindex(*x.shape):
        ahead, behind = x.copy(), x.copy()
        ahead[index] += h
        behind[index] -= h
        columns.append((np.asarray(function(ahead)) - np.asarray(function(behind))) / (2 * h))
    stacked = np.stack(columns, axis=-1)
    return stacked.reshape(*stacked.shape[:-1], *x.shape)
