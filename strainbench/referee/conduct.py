"""What an answer does to the cloth besides its limits, from positions alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from strainbench.arrays import FloatArray, IntArray
from strainbench.problem.problem import Problem


@dataclass(frozen=True)
class Conduct:
    """What an answer does.

    Parameters
    ----------
    inverted : elements turned inside out that the candidate has not: tetrahedra of negative
        volume; triangles that face away from all of their neighbours, two or more.
    momentum_error : how far the projection moves the centre of mass, in mean edges; no sum of
        forces within the cloth does. NaN where a vertex is held.
    """

    inverted: int
    momentum_error: float


def conduct(problem: Problem, positions: FloatArray) -> Conduct:
    """What an answer does to the cloth; nothing of what is no array of finite positions."""
    x = np.asarray(positions)
    if x.shape != problem.target.shape or x.dtype.kind not in "iuf" or not np.isfinite(x).all():
        return Conduct(0, float("nan"))
    with np.errstate(all="ignore"):  # an answer may be infinitely wrong
        turned = inverted(problem, x) & ~inverted(problem, problem.target)
        return Conduct(int(turned.sum()), momentum_error(problem, x))


def inverted(problem: Problem, positions: FloatArray) -> np.ndarray:
    """(e,) which elements are inside out."""
    size = float(np.abs(positions).max()) or 1.0  # or the products of a diverged answer overflow
    F = problem.deformation_gradients(positions / size)
    if F.shape[-1] == 3:
        return np.asarray(np.linalg.det(F) < 0)
    normals = np.cross(F[:, :, 0], F[:, :, 1])
    one, other = neighbours(problem)
    facing = np.sum(normals[one] * normals[other], axis=1)
    best, count = np.full(len(F), -np.inf), np.zeros(len(F), dtype=np.int64)
    for own in (one, other):
        np.maximum.at(best, own, facing)
        np.add.at(count, own, 1)
    return np.asarray((best < 0) & (count > 1))


def neighbours(problem: Problem) -> tuple[IntArray, IntArray]:
    """Pairs of triangles with a common edge."""
    elements = problem.elements
    edges = np.sort(np.stack([elements, np.roll(elements, -1, axis=1)], axis=-1).reshape(-1, 2))
    order = np.lexsort(edges.T)
    same = np.flatnonzero((edges[order[1:]] == edges[order[:-1]]).all(axis=1))
    return order[same] // 3, order[same + 1] // 3


def momentum_error(problem: Problem, positions: FloatArray) -> float:
    """See `Conduct`."""
    if len(problem.pinned):
        return float("nan")
    used = problem.used
    weights = problem.weights[used, None]
    moved = np.sum(weights * (positions - problem.target)[used], axis=0) / weights.sum()
    return float(np.linalg.norm(moved)) / problem.edge_length
