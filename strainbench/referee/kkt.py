"""How far positions are from a local optimum: the residual of the KKT conditions, from x alone.

With s_i(x) = ||(G x)_i|| and u_i = (G x)_i / s_i, or what else a kind of limit measures and its
derivative, a local optimum of

    minimise 1/2 ||x - target||_M^2  subject to  l_i <= s_i(x) <= b_i

has M (x - target) + sum_i m_i g_i u_i = 0 at the free vertices, with m_i >= 0 where s_i = b_i,
m_i <= 0 where s_i = l_i, and m_i = 0 elsewhere; vertices on planes that they are kept off have
terms -m n, n the plane's normal. The best such multipliers are a non-negative
least-squares problem; what they leave, in the norm of M^-1, over ||x - target||_M is the residual:
0 at a local optimum, 1 where the active limits explain nothing of the move from the target. M may
be a metric: R R^T = M then, and R is M^1/2 else.

In a convex problem that is the optimum. With lower bounds it is a local one at best: the conditions
are necessary, and hold at saddles too, such as a flat sheet that would rather fold.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import scipy

from strainbench import sparse as sp
from strainbench.arrays import FloatArray, IntArray
from strainbench.plugins import Library
from strainbench.problem.principal import PrincipalLimits
from strainbench.problem.problem import Problem

clarabel = Library("clarabel")

NEAR = 1e-5
"""Limits this close to their bound count as active. Interior-point answers at a tolerance of 1e-6
leave more than 1e-6 to those of small multipliers: of 10 of Ipopt's on the swing and random meshes,
2 then had a residual of 1e-4, and all have less than 1e-5 so; Gauss-Seidel's have 0.2 to 0.9."""
SQUARED = 1e-10
"""Tolerance of the least squares, whose objective is half the residual squared: the residual is
known to 1e-5. Below 1e-11 the solver of the quadratic program breaks down at times."""


def kkt_residual(problem: Problem, positions: FloatArray) -> float:
    """Relative residual of stationarity at `positions` (n, 3), with the best multipliers.

    Limits count as active within `NEAR` of their bound. Moves smaller than 1e-3 edges a vertex
    count as that long.

    Raises
    ------
    ValueError
        If the limits are exact: their measure has no derivative where singular values are equal.
    """
    movable = np.setdiff1d(np.arange(problem.vertices), problem.pinned)
    if len(movable) == 0:
        return 0.0
    root = _root_of(problem, movable)
    force = root.transposed((positions - problem.target)[movable].T.ravel())
    scale = max(float(np.linalg.norm(force)), float(np.sqrt(2 * problem.objective_floor)))
    if scale == 0:  # the floor of tiny problems underflows
        return 0.0
    normals = _active_normals(problem, positions, movable, root)
    if normals.shape[1] == 0:
        return float(np.linalg.norm(force)) / scale
    multipliers = _nonnegative_least_squares(normals, -force / scale)
    return float(np.linalg.norm(normals @ multipliers + force / scale))


def _active_normals(
    problem: Problem, positions: FloatArray, movable: IntArray, root: Root
) -> sp.csc_array:
    """(3 movable, active) outward normals R^-1 g_i u_i of the active limits, of unit length."""
    y = problem.G @ positions
    active, sign = _active(problem, y)
    rows, u = problem.kind.derivatives(y, active)
    u = (sign[:, None, None] * u).reshape(-1, 3)
    g = sp.csc_array(problem.G[rows.ravel()][:, movable].T)
    together = sp.kron(sp.eye_array(len(rows)), np.ones((rows.shape[1], 1)))
    outward = sp.vstack([g * a for a in u.T]) @ together
    outward = sp.hstack([outward, _contact_normals(problem, positions[movable])])
    normals = root.inverse(sp.csc_array(outward))
    length = sp.linalg.norm(normals, axis=0)
    turns = length > 0
    return sp.csc_array(normals[:, turns] / length[turns])


def _contact_normals(problem: Problem, x: FloatArray) -> sp.csc_array:
    """(3 m, touching) -n at each of the movable vertices x (m, 3) that lies on a plane."""
    parts = [sp.csc_array((x.size, 0))]
    for plane in problem.contact:
        vertex = np.flatnonzero(plane.gaps(x) < NEAR * problem.edge_length)
        at = sp.csc_array(
            (np.ones(len(vertex)), (vertex, range(len(vertex)))), (len(x), len(vertex))
        )
        parts.append(sp.vstack([-a * at for a in plane.normal]))
    return sp.csc_array(sp.hstack(parts))


def _active(problem: Problem, y: FloatArray) -> tuple[IntArray, FloatArray]:
    """Constraints near a bound, and 1 for an upper one, -1 for a lower one."""
    s = problem.kind.measure(y)
    upper = np.flatnonzero(s > problem.bounds - NEAR)
    limited = problem.kind.lower is not None
    lower = np.flatnonzero(limited & (s < problem.lower_bounds + NEAR))
    return np.concatenate([upper, lower]), np.repeat([1.0, -1.0], [len(upper), len(lower)])


def smallest_gap(problem: Problem, positions: FloatArray) -> float:
    """The least difference of two singular values of an element with an active limit.

    Infinite where none is active, NaN where limits are not on principal stretches.
    """
    if not isinstance(problem.kind, PrincipalLimits):
        return float("nan")
    y = problem.G @ positions
    elements = _active(problem, y)[0] // (problem.constraints // len(problem.elements))
    return float(np.min(problem.kind.gaps(y)[elements], initial=np.inf))


class Root(NamedTuple):
    """R with R R^T = M on the movable vertices, their coordinates one after the other (3, m)."""

    transposed: Callable[[FloatArray], FloatArray]
    """R^T d."""
    inverse: Callable[[sp.csc_array], sp.csc_array]
    """R^-1 A."""


def _root_of(problem: Problem, movable: IntArray) -> Root:
    if problem.metric is None:
        root = np.tile(np.sqrt(problem.weights[movable]), 3)
        return Root(lambda d: root * d, lambda A: sp.csc_array(A / root[:, None]))
    unknowns = (3 * movable + np.arange(3)[:, None]).ravel()
    A = sp.csc_array(problem.metric[unknowns][:, unknowns])
    factor = scipy.sparse.linalg.splu(
        A, "MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
    )
    place = np.argsort(factor.perm_r)  # no pivot is exchanged: A[place][:, place] = L D L^T
    L, D = sp.csr_array(factor.L), factor.U.diagonal()

    def inverse(B: sp.csc_array) -> sp.csc_array:
        solved = scipy.sparse.linalg.spsolve_triangular(L, B.toarray()[place], unit_diagonal=True)
        return sp.csc_array(solved / np.sqrt(D)[:, None])

    return Root(lambda d: np.sqrt(D) * (L.T @ d[place]), inverse)


def _nonnegative_least_squares(A: sp.csc_array, b: FloatArray) -> FloatArray:
    """The x >= 0 of least ||A x - b||, as a quadratic program in x and r = A x - b."""
    m, n = A.shape
    P = sp.block_diag([sp.csc_array((n, n)), sp.eye_array(m)], format="csc")
    constraints = sp.block_array([[A, -sp.eye_array(m)], [-sp.eye_array(n), None]], format="csc")
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.tol_gap_abs, settings.tol_gap_rel, settings.tol_feas = SQUARED, SQUARED, SQUARED
    cones = [clarabel.ZeroConeT(m), clarabel.NonnegativeConeT(n)]
    h = np.concatenate([b, np.zeros(n)])
    solver = clarabel.DefaultSolver(P, np.zeros(m + n), constraints, h, cones, settings)
    x: FloatArray = np.maximum(0.0, np.array(solver.solve().x[:n]))
    return x
