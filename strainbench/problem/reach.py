"""How long the limits let edges become, and so how far apart pins may be."""

from __future__ import annotations

from itertools import combinations

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from strainbench.arrays import FloatArray, IntArray
from strainbench.problem.limits import StretchLimits

ROUNDING = 4 * np.finfo(float).eps  # of a unit length
FLAT = 1e-9  # a hull that is thinner, for its length, tells nothing


def longest_edges(
    corners: FloatArray, elements: IntArray, limits: StretchLimits
) -> tuple[IntArray, FloatArray]:
    """How long the limits let each edge become, of elements with `corners` (e, k, dim) at rest [m].

    With e = sum_j c_j d_j over the limited directions, ||F e|| <= sum_j |c_j| b_j; the smallest
    such bound over all coefficients and adjacent elements is kept. With exact limits,
    ||F e|| <= ||D^-1 e||.

    Returns
    -------
    edges : (k, 2)
        Vertex pairs whose length the limits bound.
    lengths : (k,)
        Upper bound on the deformed length [m].
    """
    pairs = list(combinations(range(elements.shape[1]), 2))
    first, second = np.array(pairs).T
    vectors = corners[:, second] - corners[:, first]
    bounds = np.atleast_2d(limits.bounds)
    if limits.spectral:
        longest = np.linalg.norm(vectors * bounds[:, None], axis=2)
    else:
        longest = np.empty(vectors.shape[:2])
        kinds, kind = np.unique(bounds, axis=0, return_inverse=True)
        kind = np.broadcast_to(kind.ravel(), len(vectors))
        order = np.argsort(kind, kind="stable")
        starts = np.searchsorted(kind[order], np.arange(1, len(kinds)))
        for b, same in zip(kinds, np.split(order, starts), strict=True):
            longest[same] = gauge(limits.directions, b, vectors[same])
    edges = np.sort(elements[:, pairs].reshape(-1, 2), axis=1)
    unique, inverse = np.unique(edges, axis=0, return_inverse=True)
    lengths = np.full(len(unique), np.inf)
    np.minimum.at(lengths, inverse.ravel(), longest.ravel())
    limited = np.isfinite(lengths)
    return unique[limited], lengths[limited]


def gauge(directions: FloatArray, bounds: FloatArray, vectors: FloatArray) -> FloatArray:
    """The least sum_j |c_j| b_j with e = sum_j c_j d_j, of each vector e (..., dim).

    That is the norm whose unit ball is the hull of all +-d_j / b_j: the largest a.e over its
    facets a.p = 1. Infinite where the directions do not span the space.
    """
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
