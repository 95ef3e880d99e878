"""What is odd about a mesh of cloth, though it can be read: its parts, openings, edges, pattern."""

from __future__ import annotations

import numpy as np
import scipy

from strainbench import sparse as sp
from strainbench.arrays import FloatArray, IntArray


def pattern_stretches(flat: FloatArray, pattern: FloatArray) -> FloatArray:
    """(e, 2) largest and least length on the pattern, over that in space, of each triangle.

    Parameters
    ----------
    flat : (e, 3, 2) triangles as they lie in space, laid flat; each with an area
    pattern : (e, 3, 2)
    """
    here, there = (np.swapaxes(c[:, 1:] - c[:, :1], 1, 2) for c in (flat, pattern))
    stretches: FloatArray = np.linalg.svd(there @ np.linalg.inv(here), compute_uv=False)
    return stretches


def parts(elements: IntArray, pins: IntArray) -> tuple[int, int]:
    """How many parts do not hang together, and how many of these have none of the pins."""
    ends = np.concatenate([elements[:, :2], elements[:, 1:]])
    n = int(elements.max()) + 1
    graph = sp.coo_array((np.ones(len(ends)), tuple(ends.T)), shape=(n, n))
    count, label = scipy.sparse.csgraph.connected_components(graph, directed=False)
    return count, count - len(np.unique(label[pins]))


def unsewn(positions: FloatArray) -> int:
    """How many vertices lie exactly on others."""
    return len(positions) - len(np.unique(positions + 0.0, axis=0))  # no negative zeros


def _edges(elements: IntArray) -> tuple[IntArray, IntArray, IntArray]:
    """Directed edges (3 e, 2) of the triangles, which undirected one each is, and their counts."""
    directed = np.concatenate([elements[:, [0, 1]], elements[:, [1, 2]], elements[:, [2, 0]]])
    _, which, count = np.unique(
        np.sort(directed, axis=1), axis=0, return_inverse=True, return_counts=True
    )
    return directed, which.ravel(), count


def odd_edges(elements: IntArray) -> int:
    """How many edges belong to more than two triangles."""
    return int(np.sum(_edges(elements)[2] > 2))


def level_openings(positions: FloatArray, elements: IntArray) -> str:
    """ "y" or "z": which of the two the openings of a garment, such as waist and hem, face more.

    An opening is a loop of the boundary, its area vector 1/2 sum x_a x x_b over its edges. That
    of a flat sheet has its whole area: it lies flat against the axis it faces, and hangs along
    the larger of its extents.
    """
    directed, which, count = _edges(elements)
    rim = directed[count[which] == 1]
    n = len(positions)
    _, label = scipy.sparse.csgraph.connected_components(
        sp.coo_array((np.ones(len(rim)), tuple(rim.T)), shape=(n, n)), directed=False
    )
    x = positions - positions.mean(axis=0)
    loops = np.zeros((n, 3))
    np.add.at(loops, label[rim[:, 0]], 0.5 * np.cross(x[rim[:, 0]], x[rim[:, 1]]))
    a, b, c = np.moveaxis(x[elements], 1, 0)
    surface = 0.5 * float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())
    if np.linalg.norm(loops, axis=1).max() > 0.5 * surface:
        _, y, z = np.ptp(positions, axis=0)
    else:
        _, y, z = np.abs(loops).sum(axis=0)
    return "z" if z > 2 * y else "y"
