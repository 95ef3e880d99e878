"""Where the rounds may begin: positions near the limits, not yet within them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from strainbench import Problem
from strainbench.arrays import FloatArray
from strainbench.problem.elements import rest_corners
from strainbench.problem.principal import PrincipalLimits

NOISE = 0.01
"""Of starts, out of plane, in edges: a flat sheet does not buckle by itself."""
LOST = 1e-3
"""Stretch below which a direction has collapsed, and noise in edges that gives it one again."""
SEED = 0


def begun(problem: Problem) -> FloatArray | None:
    """Where the step begins, with the pins where they must be; None where the problem has none."""
    if problem.linearise_at is None:
        return None
    x: FloatArray = problem.linearise_at.copy()
    x[problem.held] = problem.target[problem.held]
    return x


def candidate(problem: Problem) -> FloatArray:
    """The target, with noise."""
    return _noisy(problem, problem.target)


def rest(problem: Problem) -> FloatArray | None:
    """The rest shape moved rigidly to the target, with noise; None where its corners lie apart."""
    if problem.rest.ndim == 3:
        return None
    along, _, axes = _fitted(problem)
    if len(axes) == 3 and np.linalg.det(problem.deformation_gradients(along @ axes)[0]) < 0:
        axes[2] *= -1  # a volume is not mirrored
    return _noisy(problem, _placed(problem, along @ axes))


def accordion(problem: Problem) -> FloatArray | None:
    """The rest shape in folds of one edge, so that it is as short as a flat target.

    None where the target is not flat, or on average nowhere compressed beyond its limit.
    """
    if problem.rest.ndim == 3 or problem.rest.shape[1] != 2 or not _flat(problem):
        return None
    along, (_, part), axes = _fitted(problem)
    if part >= _least(problem):
        return None
    fold = _fold(problem)
    place = (along[:, 1] - along[problem.used, 1].min()) / fold
    height = np.sqrt(1 - part**2) * fold * np.abs(place % 2 - 1)
    along[:, 1] *= part
    return _placed(problem, along @ axes + np.outer(height, np.cross(*axes)))


def _least(problem: Problem) -> float:
    """The least stretch that a limit allows; 0 without lower limits."""
    if isinstance(problem.kind, PrincipalLimits):
        return float(np.nan_to_num(problem.kind.lower_limits.min()))
    return float(problem.lower_bounds.min())


def _flat(problem: Problem) -> bool:
    x = problem.target - problem.target.mean(axis=0)
    normal = np.linalg.svd(x, full_matrices=False)[2][2]
    return bool(np.abs(x @ normal).max() < NOISE * problem.edge_length)


def _fitted(problem: Problem) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The best affine map of the rest shape onto the target.

    Returns
    -------
    along : (n, dim) rest positions along its principal axes [m], about their centre
    factors : (dim,) by which it stretches these, the largest first
    axes : (dim, 3) where they go, orthonormal
    """
    X, x = (a - a[problem.used].mean(axis=0) for a in (problem.rest, problem.target))
    best = np.linalg.lstsq(X[problem.used], x[problem.used], rcond=None)[0]
    V, factors, axes = np.linalg.svd(best, full_matrices=False)
    return X @ V, factors, axes


def _placed(problem: Problem, x: FloatArray) -> FloatArray:
    """Those positions about the target's centre, with the pins where they must be."""
    placed: FloatArray = x + problem.target[problem.used].mean(axis=0)
    placed[problem.held] = problem.target[problem.held]
    return placed


def _fold(problem: Problem) -> float:
    """The shortest edge of an element, the median of all: on grids the distance of two lines."""
    corners = rest_corners(problem.rest, problem.elements)
    edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    return float(np.median(edges.min(axis=1)))


def _noisy(problem: Problem, x: FloatArray) -> FloatArray:
    """With noise along the normals of vertices, and in all directions where F has lost rank."""
    rng = np.random.default_rng(SEED)
    normal, other = rng.normal(size=(len(x), 1)), rng.normal(size=x.shape)
    collapsed = np.zeros((len(x), 1))
    lengths = np.linalg.norm(problem.G @ x, axis=1)
    collapsed[problem.row_vertices[lengths < LOST]] = 1.0
    noise = NOISE * normal * _normals(problem, x) + LOST * collapsed * other
    noise[problem.held] = 0.0
    noisy: FloatArray = x + problem.edge_length * noise
    return noisy


def _normals(problem: Problem, x: FloatArray) -> FloatArray:
    """(n, 3) of the vertices of a sheet, unit; 0 in volumes, and where the sheet has none."""
    normals = np.zeros_like(x)
    if problem.rest.shape[-1] == 2:
        F = problem.deformation_gradients(x)
        of_elements = problem.measures[:, None] * np.cross(F[:, :, 0], F[:, :, 1])
        np.add.at(normals, problem.elements, of_elements[:, None])
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    return normals / np.where(length > 0, length, 1.0)


STARTS: dict[str, Callable[[Problem], FloatArray | None]] = {
    "accordion": accordion,
    "candidate": candidate,
    "rest": rest,
}
