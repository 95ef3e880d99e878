"""Gauss-Seidel by element with singular values clamped, on principal limits (Wang et al. 2010).

H. Wang, J. O'Brien, R. Ramamoorthi, "Multi-resolution isotropic strain limiting", ACM Trans. Graph.
29(6), 2010, Sec. 4, for the limits of Hernandez et al. 2013, Eqs. 9 and 10: above, below, on
triangles and tetrahedra. For each element in turn, in mesh order, with F = sum_k x_k B_k^T:

1. F = U diag(s) V^T with rotations U and V: s_3 of an inverted tetrahedron is negative;
2. s' = s clamped to [lower, upper]; skip the element if that is s;
3. x_k += U diag(s' - s) V^T a_k.

With S = sum_k w_k B_k B_k^T, w_k = 1/m_k, 0 at pins, the levers a_k are

- "downhill": w_k B_k / l, l the largest eigenvalue of S: the longest step down the gradient of half
  the squared distance of F from its clamped shape, in the norm of M, that leads away from no point
  within upper limits, so that sweeps cannot cycle among these;
- "shape": w_k S^+ B_k. Of all moves that give the element its clamped shape this is the shortest
  in the norm of M, and where pins leave no such move it goes towards it. Sweeps cycle on irregular
  meshes: within limits of 0.9 to 1.1 two of six random ones of tests/problems.py (`random_volume`)
  had no end, with violations beyond 1, where "downhill" ends five, and within 2e-6 the sixth.

In the norm of a metric, m_k is the mean of its diagonal's three entries. Singular values and axes
are by one-sided Jacobi rotations (`solvers.newton_ipm.jacobi`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from solvers.gauss_seidel.strain import unit
from solvers.newton_ipm.jacobi import orthogonalise
from strainbench import Clock, Problem, Solution, Solver, section
from strainbench.arrays import FloatArray
from strainbench.compiled import compiled
from strainbench.problem.principal import PrincipalLimits

VISITS_A_CHUNK = 100_000
"""Element visits between two looks at the clock: some 50 ms."""
RANK = 1e-9
"""Eigenvalues of S below this part of its largest one are rounding's."""
FLAT = 1e-12
"""Singular values below this part of the largest one have no direction of their own."""


class Elements(NamedTuple):
    """vertices (e, k); gradients B_k and levers a_k (e, k, 3), those of triangles end in 0."""

    vertices: NDArray[np.int32]
    gradients: FloatArray
    levers: FloatArray
    dim: int

    @classmethod
    def of(cls, problem: Problem, shape: bool) -> Elements:
        """Those of a problem, with levers that give an element its shape or lead downhill."""
        B, weights = problem.gradients, problem.weights
        if problem.metric is not None:
            weights = problem.metric.diagonal().reshape(-1, 3).mean(axis=1)
        w = np.zeros(problem.vertices)
        w[problem.free] = 1 / weights[problem.free]
        moves = w[problem.elements][:, :, None] * B
        S = np.swapaxes(B, 1, 2) @ moves
        if shape:
            levers = moves @ np.linalg.pinv(S, rcond=RANK, hermitian=True)
        else:
            largest = np.linalg.eigvalsh(S)[:, -1, None, None]
            levers = np.divide(moves, largest, out=np.zeros_like(moves), where=largest > 0)
        pad = ((0, 0), (0, 0), (0, 3 - B.shape[2]))
        vertices = problem.elements.astype(np.int32)
        return cls(vertices, np.pad(B, pad), np.pad(levers, pad), B.shape[2])


@dataclass(frozen=True)
class GaussSeidelClamp(Solver):
    """Gauss-Seidel by element with singular values clamped (Wang et al. 2010; on volumes too).

    | status | when |
    |---|---|
    | solved | the largest violation of the returned positions is below the tolerance |
    | iteration limit | it is not, after `max_sweeps` |
    | time limit | it is not, at the deadline |

    Limits on principal stretches of kind isotropic, which bound singular values alone. The answer
    is a point within them near the target, not the closest one; with lower bounds, which are not
    convex, sweeps may not come to an end.

    Parameters
    ----------
    move : "downhill" or "shape", how an element's vertices follow: see the module.
    max_sweeps : over all elements.
    """

    name = "gauss-seidel-clamp"
    variants = {"shape": {"move": "shape"}}
    takes_principal = True
    takes_metric = True

    move: str = "downhill"
    max_sweeps: int = 10_000

    def __post_init__(self) -> None:
        if self.move not in ("downhill", "shape"):
            raise ValueError(f"move is {self.move!r}: valid are downhill, shape")

    def supports(self, problem: Problem) -> str | None:
        """A reason, where limits are not on singular values alone."""
        if refusal := super().supports(problem):
            return refusal
        if not isinstance(problem.kind, PrincipalLimits):
            return "it limits principal stretches alone"
        if problem.kind.name != "isotropic":
            return f"it clamps singular values: {problem.kind.name} limits depend on their axes too"
        return None

    def prepare(self, problem: Problem) -> Elements:
        """Levers, and the compiled loop."""
        elements = Elements.of(problem, self.move == "shape")
        sweep_elements(elements, *_range(problem), problem.target.copy(), 1.0, 0)
        return elements

    def solve(
        self,
        problem: Problem,
        state: Elements,
        *,
        tolerance: float,
        monitor: Callable[..., None],
        deadline: Clock,
    ) -> Solution:
        """Sweeps from the target; the monitor sees sweeps 1, 2, 4, 8, ..."""
        x, done, mark = problem.target.copy(), 0, 1
        chunk = max(1, VISITS_A_CHUNK // len(problem.elements))
        while not problem.violations(x).max() < tolerance:
            if done >= self.max_sweeps:
                return Solution(x, "iteration limit", done)
            if deadline.passed:
                return Solution(x, "time limit", done)
            sweeps = min(mark - done, chunk, self.max_sweeps - done)
            with section("sweep"):
                done += sweep_elements(state, *_range(problem), x, float(tolerance), sweeps)
            if done == mark:
                monitor(x.copy(), iterations=done)
                mark *= 2
        return Solution(x, "solved", done)


def _range(problem: Problem) -> tuple[float, float]:
    """What singular values are clamped to; infinite where limits are free."""
    kind = problem.kind
    assert isinstance(kind, PrincipalLimits)
    lower, upper = float(kind.lower_limits[0]), float(kind.upper_limits[0])
    margin = -float(kind.bounds[0])
    return (
        -np.inf if np.isnan(lower) else lower + margin,
        np.inf if np.isnan(upper) else upper - margin,
    )


@compiled
def decompose(F: FloatArray, U: FloatArray, s: FloatArray, V: FloatArray) -> None:
    """F = U diag(s) V^T of F (3, 3), which is written over, with rotations U and V."""
    for i in range(3):
        for j in range(3):
            V[i, j] = 1.0 if i == j else 0.0
    orthogonalise(F, V)
    for j in range(3):
        s[j] = F[0, j] ** 2 + F[1, j] ** 2 + F[2, j] ** 2
    p = 0 if s[0] >= s[1] and s[0] >= s[2] else (1 if s[1] >= s[2] else 2)
    q, r = (p + 1) % 3, (p + 2) % 3
    turn = 1.0  # u_p x u_q = turn u_r
    if s[r] > s[q] or (s[r] == s[q] and r < q):
        q, r, turn = r, q, -1.0
    s[p], u = unit((F[0, p], F[1, p], F[2, p]), (0.0, 0.0, 0.0), 0.0)
    along = u[0] * F[0, q] + u[1] * F[1, q] + u[2] * F[2, q]
    rest = (F[0, q] - along * u[0], F[1, q] - along * u[1], F[2, q] - along * u[2])
    s[q], v = unit(rest, u, FLAT * s[p])
    cross = (u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0])
    s[r] = 0.0
    for i in range(3):
        U[i, p], U[i, q], U[i, r] = u[i], v[i], turn * cross[i]
        s[r] += U[i, r] * F[i, r]


@compiled
def sweep_elements(
    elements: Elements,
    lower: float,
    upper: float,
    x: FloatArray,
    tolerance: float,
    sweeps: int,
) -> int:
    """Take steps 1 to 3 on `x` in place, and return the number of sweeps done.

    It stops early after a sweep that found no limit violated by `tolerance`.
    """
    F, U, V, change = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3)), np.empty(3)
    for sweep in range(sweeps):
        worst = 0.0
        for e in range(len(elements.vertices)):
            fill(elements, e, x, F)
            decompose(F, U, change, V)  # 1
            excess = 0.0
            for j in range(elements.dim):
                s = change[j]
                change[j] = min(max(s, lower), upper) - s  # 2
                excess = max(excess, abs(change[j]))
            worst = max(worst, excess)
            if excess > 0:
                move(elements, e, U, change, V, x)  # 3
        if worst < tolerance:
            return sweep + 1
    return sweeps


@compiled
def fill(elements: Elements, e: int, x: FloatArray, F: FloatArray) -> None:
    """F = sum_k x_k B_k^T."""
    F[:] = 0.0
    for k in range(elements.vertices.shape[1]):
        v = elements.vertices[e, k]
        for i in range(3):
            for j in range(3):
                F[i, j] += x[v, i] * elements.gradients[e, k, j]


@compiled
def move(
    elements: Elements, e: int, U: FloatArray, change: FloatArray, V: FloatArray, x: FloatArray
) -> None:
    """x_k += U diag(change) V^T a_k."""
    for k in range(elements.vertices.shape[1]):
        v = elements.vertices[e, k]
        for j in range(elements.dim):
            along = 0.0
            for i in range(3):
                along += V[i, j] * elements.levers[e, k, i]
            for i in range(3):
                x[v, i] += U[i, j] * change[j] * along
