"""How long the limits let edges become, and so how far apart pins may be."""

from __future__ import annotations

from itertools import combinations
from typing import Protocol

import numpy as np
import scipy

from strainbench import sparse as sp
from strainbench.arrays import FloatArray, IntArray

ROUNDING = 4 * np.finfo(float).eps  # of a unit length
FLAT = 1e-9  # a hull that is thinner, for its length, tells nothing


class Lengths(Protocol):
    """What bounds lengths: a kind of limit."""

    def longest(self, vectors: FloatArray) -> FloatArray:
        """(e, p) an upper bound on the deformed length of material vectors (e, p, dim) [m]."""


def longest_edges(
    corners: FloatArray, elements: IntArray, limits: Lengths
) -> tuple[IntArray, FloatArray]:
    """How long the limits let each edge become, of elements with `corners` (e, k, dim) at rest [m].

    The smallest bound over all adjacent elements is kept.

    Returns
    -------
    edges : (k, 2)
        Vertex pairs whose length the limits bound.
    lengths : (k,)
        Upper bound on the deformed length [m].
    """
    pairs = list(combinations(range(elements.shape[1]), 2))
    first, second = np.array(pairs).T
    longest = limits.longest(corners[:, second] - corners[:, first])
    edges = np.sort(elements[:, pairs].reshape(-1, 2), axis=1)
    unique, inverse = np.unique(edges, axis=0, return_inverse=True)
    lengths = np.full(len(unique), np.inf)
    np.minimum.at(lengths, inverse.ravel(), longest.ravel())
    limited = np.isfinite(lengths)
    return unique[limited], lengths[limited]


def distances(edges: IntArray, lengths: FloatArray, vertices: int, pins: IntArray) -> FloatArray:
    """(p, n) an upper bound on the distance of each vertex from each pin: shortest paths [m]."""
    if len(pins) == 0:
        return np.zeros((0, vertices))
    graph = sp.csr_array((lengths, (edges[:, 0], edges[:, 1])), shape=2 * (vertices,))
    reach: FloatArray = scipy.sparse.csgraph.dijkstra(graph, directed=False, indices=pins)
    return reach


def pins_apart(lengths: FloatArray, target: FloatArray, pins: IntArray) -> str | None:
    """The two pins that are farthest beyond the `lengths` (p, p) they may be apart, in words."""
    held = target[pins]
    apart: FloatArray = np.hypot.reduce(held[:, None] - held[None], axis=2)
    excess = np.zeros_like(apart)
    np.subtract(apart, lengths, out=excess, where=apart > lengths * (1 + 1e-12))
    i, j = np.unravel_index(int(np.argmax(excess)), excess.shape)
    if excess[i, j] <= 0:
        return None
    return (
        f"infeasible: pinned vertices {pins[i]} and {pins[j]} are "
        f"{apart[i, j]:.6g} m apart, and the limits allow at most {lengths[i, j]:.6g} m"
    )


def farthest(reach: FloatArray, pins: FloatArray, targets: FloatArray) -> FloatArray:
    """(f,) how far from its target (f, 3) a vertex within `reach` (p, f) of its nearest pin is."""
    nearest = np.argmin(reach, axis=0)
    far: FloatArray = np.linalg.norm(targets - pins[nearest], axis=1)
    far += np.take_along_axis(reach, nearest[None], axis=0)[0]
    return far


def gauge(directions: FloatArray, bounds: FloatArray, vectors: FloatArray) -> FloatArray:
    """The least sum_j |c_j| b_j with e = sum_j c_j d_j, of each vector e (..., dim).

    That is the norm whose unit ball is the hull of all +-d_j / b_j: the largest a.e over its
    facets a.p = 1. Infinite where the directions do not span the space.
    """
    from scipy.spatial import ConvexHull, QhullError  # a fifth of what the suite takes to load

    unit = bounds.min()
    points = directions * (unit / bounds)[:, None]
    try:
        facets = ConvexHull(np.concatenate([points, -points])).equations
    except QhullError:  # the hull is flat
        return np.full(vectors.shape[:-1], np.inf)
    distance = -facets[:, -1] - ROUNDING  # so that no length comes out too short
    if distance.min() < FLAT:
        return np.full(vectors.shape[:-1], np.inf)
    normals = (facets[:, :-1] / distance[:, None]).T
    parts = np.array_split(vectors, 1 + vectors.size * len(facets) // 10**7)  # for memory's sake
    lengths: FloatArray = np.concatenate([(part @ normals).max(axis=-1) for part in parts])
    lengths *= unit
    return lengths
