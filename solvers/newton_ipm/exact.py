"""Exact limits: Q_e = (b_e^2 I - Y_e Y_e^T)/2 >= 0 with matrices for slacks and multipliers.

Y_e (m, 3) holds the columns of F_e D, m being 2 in triangles and 3 in tetrahedra. The steps are
those of sampled limits in coordinates where slack and multiplier are one diagonal matrix (Nesterov
and Todd 1997): R^-1 S R^-T = R^T L R = diag(d), where R R^T is the geometric mean of S and L^-1.

With t = R^-1 sym(dY Y^T) R^-T the scaled changes, those that a `Change` holds, are dS~ = r~ - t
and dL~ = h + t, where h = c/((d_p + d_q)/2) - r~ entry by entry, and c is what the products
diag(d)^2 are to change by. The block of vertices k, l in K is (B_k^T L B_l) I_3 + <A_ki, A_lj>
with A_ki = sym((R^-1 Y_i)(R^-1 B_k)^T). The loops over elements are those of
`solvers.newton_ipm.triangles` or `solvers.newton_ipm.tetrahedra`.
"""

from __future__ import annotations

import numpy as np

from solvers.newton_ipm import tetrahedra, triangles
from solvers.newton_ipm.matrix import Slots
from solvers.newton_ipm.mesh import Change, Point, Sums
from strainbench import Problem
from strainbench.arrays import FloatArray
from strainbench.problem.rows import Rows


class ExactCones:
    """All constraints at one point, as in `SampledCones`.

    Attributes
    ----------
    at : the point
    degree : m e, the number of products
    """

    def __init__(self, problem: Problem, slots: Slots) -> None:
        e, m = len(problem.elements), problem.rest.shape[-1]
        self._loops = loops = triangles if m == 2 else tetrahedra
        self._G, self._slots, self.degree = Rows.of_axes(problem), slots, problem.rows
        shape, scaling = loops.IDENTITY.shape, (*np.empty((2, e, m, m)), np.empty((e, m)))
        matrices = np.empty((5, e, *shape))
        self.b, self.at = problem.bounds, Point(np.empty((e, m, 3)), *matrices[:3], *scaling)
        self._c, self._h = matrices[3:]

    def place(self, b: FloatArray, x: FloatArray) -> None:
        """Go to the positions x; slacks and multipliers stay."""
        self.b = b
        self._loops.fill_rows(self._G, x, self.at.y)

    def start(self, floor: float, mu: float) -> None:
        """Slacks with eigenvalues of at least `floor` b^2, products mu."""
        least = np.multiply.outer(floor * self.b**2, self._loops.IDENTITY)
        s = self._loops.widened(self.at.y, self.b, least)
        self.put(s, self._loops.inverse_times(s, mu))

    def resume(self, s: FloatArray, l: FloatArray) -> None:  # noqa: E741
        """Slacks of another problem, widened to those at x, and its multipliers."""
        self.put(self._loops.widened(self.at.y, self.b, s), l)

    def put(self, s: FloatArray, l: FloatArray) -> None:  # noqa: E741
        """These slacks and multipliers, which are not written to."""
        self.at = self.at._replace(s=s, l=l)

    def excess(self) -> FloatArray:
        """(e,) the largest singular value of Y, less b."""
        largest = np.empty(len(self.b))
        self._loops.stretch(self.at.y, largest)
        return largest - self.b

    def measure(self, y_target: FloatArray, Y: FloatArray, pull: FloatArray) -> Sums:
        """L Y (m e, 3) is filled, and G^T L Y added to `pull` (n, 3)."""
        by_element = Y.reshape(self.at.y.shape)
        sums: Sums = self._loops.measure(self._G, self.at, self.b, y_target, by_element, pull)
        return sums

    def assemble(self, values: FloatArray) -> float:
        """Add the constraints' part of K to the matrix's values; <S, L>."""
        return float(self._loops.assemble(self._G, self._slots, self.at, self.b, values))

    def aim(self, mu: float, affine: Change | None = None) -> None:
        """To take all products to mu, the second-order error of a predictor included."""
        if affine is None:
            self._loops.aim(self.at.d, mu, self._c)
        else:
            self._loops.aim_again(self.at, mu, affine.s, affine.l, affine.square, self._c)

    def centre(self, change: Change, a: float, low: float, high: float) -> None:
        """To move, besides, the products after the part a of a step into [low, high]."""
        self._loops.centre(self.at.d, change.s, change.l, a, low, high, self._c)

    def push(self, force: FloatArray) -> None:
        """Add G^T (H Y) to `force` (n, 3), for the scaled products aimed at."""
        self._loops.push(self._G, self.at, self._c, self._h, force)

    def change(self, dx: FloatArray) -> Change:
        """The rest of the step, after `push` and the linear solve."""
        ds, dl, square = np.empty((3, *self._c.shape))
        sums = self._loops.change(self._G, self.at, self._h, dx, ds, dl, square)
        return Change(ds, dl, square, *sums)

    def moved(self, change: Change, a: float) -> tuple[FloatArray, FloatArray]:
        """Slacks and multipliers after the part a of a step."""
        at, back, moved = self.at, self.at.inverse.swapaxes(1, 2), self._loops.moved
        return moved(at.s, a, at.R, change.s), moved(at.l, a, back, change.l)
