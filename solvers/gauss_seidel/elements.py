"""Gauss-Seidel sweeps over the triangles (Thomaszewski et al. 2009; Wang et al. 2010).

For each triangle in turn, in mesh order, with F = sum_k x_k B_k^T (F D with exact limits):

1. F = U diag(s) V^T = R S, with R = U V^T and S = V diag(s) V^T, in closed form;
2. skip the triangle if the problem's own limits hold in it;
3. "principal" clamps s to the limits, "strain" the entries of the corotated Cauchy strain S - I:
   E is the change of S;
4. x_k += R E a_k, all three vertices together, so that none is read after it was written.
   Momentum is conserved: sum m_k a_k = 0.

Levers a_k. "strain" has the paper's, x_k <- c + R (S + E) (X_k - X_c) about the centre of mass:
a_k = X_k - X_c, as x_k = c + F (X_k - X_c). A pin has infinite mass and is itself the centre; two
leave the third vertex, which brings F as close to F + R E as it can alone, a = B_k / |B_k|^2.
"principal" goes down the gradient of |R E|^2 / 2 in the norm of M, with w_k = 1/m_k, 0 at pins:
a_k = w_k B_k / l, l the mean non-zero eigenvalue of sum w_k B_k B_k^T. That is the same move where
the triangle is equilateral and its masses equal, and since it never leads away from any point
within exact limits, it cannot cycle. X_k - X_c can: it left 8 of 40 random irregular meshes with
up to 4 pins unsolved, at 20 cells it takes as many sweeps and ends farther away. For "strain" it
takes a quarter of the sweeps that the gradient takes at 10 cells, and left 1 of the 40.

What limits say of S: "principal" takes those that have no preferred direction, exact ones and
equal samples. Samples stand for the exact limit b that it clamps at; step 2 keeps it from clamping
what they allow between them (a quarter of the sweeps at 20 cells and 1%, and closer to the
optimum). "strain" takes limits along warp, weft and +-45 degrees.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.gauss_seidel.strain import polar, strain_change, symmetric, violation
from strainbench import Problem
from strainbench.arrays import FloatArray
from strainbench.compiled import compiled
from strainbench.problem.kinds import Exact

ENTRIES = np.array([[1, 0], [0, 1], [0.5**0.5, 0.5**0.5], [0.5**0.5, -(0.5**0.5)]])
"""Warp, weft and the two diagonals: what the entries of a strain can limit."""
SAME = 1e-9
"""Directions and bounds that differ by less than this are the same."""


def refusal(constraint: str, problem: Problem) -> str | None:
    """Why the limits cannot be put as limits on what one step corrects, or None."""
    d = problem.kind.directions
    if constraint == "directions":
        exact = "it has no form for exact limits; gauss-seidel-principal has"
        return exact if isinstance(problem.kind, Exact) else None
    if d.shape[1] != 2:
        return f"it clamps the {constraint} of triangles, not of volumes"
    if constraint == "strain":
        if isinstance(problem.kind, Exact) or not np.all(_along_entries(d).any(axis=1)):
            return "it clamps warp, weft and shear: limits at 0, 90 and +-45 degrees alone"
        return None
    balanced = np.allclose(d.T @ d, 0.5 * len(d) * np.eye(2), rtol=0, atol=SAME)
    for bounds in (problem.bounds, problem.lower_bounds):
        balanced &= np.ptp(bounds.reshape(len(problem.elements), -1), axis=1).max() < SAME
    return None if balanced else "it clamps principal stretches: limits alike in all directions"


def _along_entries(directions: FloatArray) -> NDArray[np.bool_]:
    """(m, 4) whether each direction is that of an entry."""
    cross = np.outer(directions[:, 0], ENTRIES[:, 1]) - np.outer(directions[:, 1], ENTRIES[:, 0])
    along: NDArray[np.bool_] = np.abs(cross) < SAME
    return along


@dataclass(frozen=True)
class Elements:
    """The triangles as contiguous arrays.

    vertices : (e, 3); gradients : (e, 3, 2), B_k, times D with exact limits [1/m];
    levers : (e, 3, 2), a_k [m]; directions : (m, 2), none with exact limits;
    columns : (4,) the direction of each of ENTRIES, or -1; none to clamp principal stretches.
    """

    vertices: NDArray[np.int32]
    gradients: FloatArray
    levers: FloatArray
    directions: FloatArray
    columns: NDArray[np.int64]

    @classmethod
    def of(cls, problem: Problem, strain: bool) -> Elements:
        """The triangles of a problem, to clamp their strain or their principal stretches."""
        gradients = problem.gradients.copy()
        directions = problem.limits.directions
        columns = np.zeros(0, dtype=np.int64)
        if isinstance(problem.kind, Exact):
            gradients = np.swapaxes(problem.row_coefficients.reshape(-1, 2, 3), 1, 2).copy()
            directions = directions[:0]
        if strain:
            along = _along_entries(directions)
            columns = np.where(along.any(axis=0), along.argmax(axis=0), -1)
        levers = levers_of(problem, gradients, strain)
        return cls(problem.elements.astype(np.int32), gradients, levers, directions, columns)

    def sweep(self, problem: Problem, x: FloatArray, tolerance: float, sweeps: int) -> int:
        """Sweeps done on `x` (n, 3), in place: as many as asked, or until one is calm."""
        arrays = (self.vertices, self.gradients, self.levers, self.directions, self.columns)
        count = len(self.vertices)
        bounds = (problem.bounds.reshape(count, -1), problem.lower_bounds.reshape(count, -1))
        return sweep_elements(*arrays, *bounds, x, float(tolerance), sweeps)


def levers_of(problem: Problem, gradients: FloatArray, strain: bool) -> FloatArray:
    """(e, 3, 2) how far each vertex moves for a unit change of F [m]; a pin does not."""
    pinned = np.isin(problem.elements, problem.pinned)[:, :, None]
    pins = pinned.sum(axis=1, keepdims=True)
    m = problem.weights[problem.elements][:, :, None]
    downhill = np.where(pinned, 0.0, gradients / m)
    eigenvalues = np.sum(downhill * gradients, axis=(1, 2), keepdims=True)
    downhill *= np.minimum(2, 3 - pins) / np.where(eigenvalues > 0, eigenvalues, 1.0)
    if not strain:
        return downhill
    arms = np.zeros_like(gradients)  # X_k - X_0: sum_k (X_k - X_0) B_k^T = I
    arms[:, 1:] = np.swapaxes(np.linalg.inv(gradients[:, 1:]), 1, 2)
    shares = np.where(pins == 0, m, pinned)
    centre = np.sum(shares * arms, axis=1, keepdims=True) / shares.sum(axis=1, keepdims=True)
    return np.where(pinned, 0.0, np.where(pins < 2, arms - centre, downhill))


@compiled
def sweep_elements(
    vertices: NDArray[np.int32],
    gradients: FloatArray,
    levers: FloatArray,
    directions: FloatArray,
    columns: NDArray[np.int64],
    bounds: FloatArray,
    lower: FloatArray,
    x: FloatArray,
    tolerance: float,
    sweeps: int,
) -> int:
    """Take steps 1 to 4 on `x` in place, and return the number of sweeps done.

    It stops early after a sweep that found no limit violated by `tolerance`.
    """
    F = np.empty((3, 2))
    for sweep in range(sweeps):
        worst = 0.0
        for e in range(len(vertices)):
            F[:] = 0.0
            for k in range(3):
                for i in range(3):
                    F[i, 0] += x[vertices[e, k], i] * gradients[e, k, 0]
                    F[i, 1] += x[vertices[e, k], i] * gradients[e, k, 1]
            s1, s2, c, s = polar(F)  # 1; F is now R
            excess = violation(s1, s2, c, s, directions, bounds[e], lower[e])
            if excess <= 0:  # 2
                continue
            worst = max(worst, excess)
            if len(columns):  # 3
                change = strain_change(s1, s2, c, s, columns, bounds[e], lower[e])
            else:
                d1 = min(max(s1, lower[e, 0]), bounds[e, 0]) - s1
                d2 = min(max(s2, lower[e, 0]), bounds[e, 0]) - s2
                change = symmetric(d1, d2, c, s)
            xx, yy, xy = change
            for k in range(3):  # 4
                a0, a1 = levers[e, k, 0], levers[e, k, 1]
                p, q = xx * a0 + xy * a1, xy * a0 + yy * a1
                for i in range(3):
                    x[vertices[e, k], i] += F[i, 0] * p + F[i, 1] * q
        if worst < tolerance:
            return sweep + 1
    return sweeps
