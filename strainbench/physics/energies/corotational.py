"""Linear corotational tetrahedra (Mueller and Gross 2004, Interactive virtual materials).

With F = R S, R the rotation of the polar decomposition (of the SVD with rotations, so that an
inverted element is turned back), and e = S - I, an element of volume w stores

    W = w (mu e:e + lam/2 tr(e)^2),  lam = E nu / ((1 + nu)(1 - 2 nu)),  mu = E / (2 (1 + nu)).

Its gradient for vertex k is w R (2 mu e + lam tr(e) I) B_k: the turn of R does not contribute. The
Hessian in F has nine eigenpairs in closed form. With F = U diag(s) V^T they are, in the frames of U
and V: the scalings, 2 mu + 3 lam for I / sqrt(3) and 2 mu for what is without trace; three flips
(u_i v_j^T + u_j v_i^T) / sqrt(2), 2 mu; and three twists (u_i v_j^T - u_j v_i^T) / sqrt(2),

    2 mu + (lam tr(e) - 2 mu) 2 / (s_i + s_j).

With R held, which is the stiffness of Mueller and Gross, the twists have 0 instead.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from strainbench import sparse as sp
from strainbench.arrays import FloatArray, IntArray
from strainbench.physics.energies.energy import Energy
from strainbench.physics.pattern import Blocks
from strainbench.problem.principal_rows import Frames, rotation_svd

PAIRS = ((0, 1), (0, 2), (1, 2))
LEAST_SUM = 1e-6  # of two singular values, of which one is negative


def _modes() -> FloatArray:
    """(9, 3, 3) scalings, flips and twists, in the frames of U and V."""
    scalings = np.array([[1, 1, 1], [1, -1, 0], [1, 1, -2]]) / np.sqrt([[3], [2], [6]])
    mixed = []
    for sign in (1, -1):
        for i, j in PAIRS:
            Q = np.zeros((3, 3))
            Q[i, j], Q[j, i] = np.sqrt(0.5), sign * np.sqrt(0.5)
            mixed.append(Q)
    return np.concatenate([[np.diag(a) for a in scalings], mixed])


MODES = _modes()


@dataclass(frozen=True, eq=False)
class Corotational(Energy):
    """All tetrahedra of a body."""

    name = "corotational"
    elements: IntArray  # (e, 4)
    gradients: FloatArray  # (e, 4, 3) of the shape functions: B [1/m]
    volumes: FloatArray  # (e,) w [m^3]
    lame: tuple[float, float]  # lam, mu [Pa]

    def frames(self, x: FloatArray) -> Frames:
        """The singular frames of each element's F at positions x (n, 3)."""
        return rotation_svd(np.einsum("ekx,ekc->exc", x[self.elements], self.gradients))

    def add_gradient(self, x: FloatArray, out: FloatArray) -> float:
        """See the base class."""
        (lam, mu), (U, s, V) = self.lame, self.frames(x)
        e = s - 1
        trace = e.sum(axis=1)
        stress = self.volumes[:, None] * (2 * mu * e + lam * trace[:, None])
        P = np.einsum("exi,ei,eyi->exy", U, stress, V)
        np.add.at(out, self.elements, np.einsum("exy,eky->ekx", P, self.gradients))
        density = mu * np.sum(e**2, axis=1) + 0.5 * lam * trace**2
        return float(self.volumes @ density)

    def add_hessian(self, x: FloatArray, blocks: Blocks, clamp: bool) -> None:
        """See the base class."""
        frames = self.frames(x)
        values = self._values(frames, self._twists(frames.s))
        blocks.add(np.maximum(values, 0.0) if clamp else values, self._modes(frames))

    def stiffness(self, x: FloatArray) -> sp.csc_array:
        """(3n, 3n) K [N/m] of all vertices at positions x (n, 3), with rotations held."""
        frames = self.frames(x)
        q = self._modes(frames)
        K = np.einsum("em,emp,emq->epq", self._values(frames, np.zeros((len(q), 3))), q, q)
        unknowns = (3 * self.elements[:, :, None] + np.arange(3)).reshape(len(q), 12)
        rows, columns = np.repeat(unknowns, 12, axis=1), np.tile(unknowns, (1, 12))
        entries = K.ravel(), (rows.ravel(), columns.ravel())
        return sp.csc_array(sp.coo_array(entries, shape=(x.size, x.size)))

    def _values(self, frames: Frames, twists: FloatArray) -> FloatArray:
        """(e, 9) eigenvalues, those of the twists given."""
        lam, mu = self.lame
        others = np.full((len(frames.s), 6), 2 * mu)
        others[:, 0] += 3 * lam
        values: FloatArray = self.volumes[:, None] * np.concatenate([others, twists], axis=1)
        return values

    def _twists(self, s: FloatArray) -> FloatArray:
        """(e, 3) eigenvalues of the twists [Pa]."""
        lam, mu = self.lame
        sums = np.stack([s[:, i] + s[:, j] for i, j in PAIRS], axis=1)
        stress = lam * (s.sum(axis=1, keepdims=True) - 3) - 2 * mu
        twists: FloatArray = 2 * mu + 2 * stress / np.maximum(sums, LEAST_SUM)
        return twists

    def _modes(self, frames: Frames) -> FloatArray:
        """(e, 9, 12) the eigenmatrices Q as moves of the corners: Q B_k at vertex k."""
        Q = np.einsum("exi,mij,eyj->emxy", frames.U, MODES, frames.V, optimize=True)
        q: FloatArray = np.einsum("emxy,eky->emkx", Q, self.gradients).reshape(-1, 9, 12)
        return q
