"""Nonlinear programming with Ipopt (Tang et al. 2022, Table 1; Wachter and Biegler 2006).

    minimise s/2 ||x - target||_M^2  such that  l_i^2 <= ||y_i||^2 <= b_i^2,  y = G x,

over the free vertices alone, with exact sparse derivatives: row i of the Jacobian is
2 y_i^T (x) g_i, and the Hessian of the Lagrangian, s M + 2 sum_i m_i g_i g_i^T, is the same for
the three coordinates and linear in the multipliers m. With lower bounds l the problem is not
convex, and the answer a local minimum near the target.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from strainbench import Clock, Problem, Solution, Solver
from strainbench import sparse as sp
from strainbench.arrays import FloatArray, IntArray
from strainbench.plugins import Library
from strainbench.problem.leverage import Pairs
from strainbench.solver.claim import claimed
from strainbench.solver.memory import Memory
from strainbench.solver.solver import held_still

cyipopt = Library("cyipopt")

STATUS = {
    0: "solved",
    1: "acceptable level",
    2: "infeasible",
    3: "search direction too small",
    4: "diverging",
    5: "time limit",
    -1: "iteration limit",
    -2: "restoration failed",
    -3: "error in step computation",
    -4: "time limit",
    -5: "time limit",
    -13: "invalid number",
    -102: "out of memory",
}
"""Ipopt's return codes in short words (IpReturnCodes_inc.h)."""
ANSWERS = (0, 1, 3, 4, 5, -1, -2, -3, -4, -5)
"""The codes that come with an iterate worth judging."""


@dataclass(frozen=True)
class Ipopt(Solver):
    """Nonlinear programming with Ipopt (Tang et al. 2022, Table 1; Wachter and Biegler 2006).

    An interior-point line-search method with MUMPS as linear solver, started at the target. It
    looks at its time limit between iterations alone.

    Parameters
    ----------
    scaling : "default" is the problem in metres with Ipopt's own options: a tolerance of 1e-8
        (`tolerance` is not used), 3000 iterations. The initial barrier parameter of 0.1 then
        dwarfs an objective of 1e-3 m^2 and throws the cloth far from the target. With the exact
        Hessian it does not come back in time; with L-BFGS (`-default-lbfgs`) it does, but there
        1e-8 is too loose for small multipliers, and the first answers have gaps of 5e-2 to 0.4.
        "scaled" takes lengths in edge lengths h and s = 10 / h^2 (over the mean mass), an
        adaptive barrier parameter, constraints not relaxed, and a hundredth of `tolerance`.
        Tuned on frames 1 to 11 of the swing at 10, 20 and 40 cells, limits 1% and 10%: at
        20 cells and 1%, s h^2 = 1, 10, 100 take 18, 20, 20 iterations, and at a tolerance of
        1e-5 s h^2 = 1 leaves gaps of 1e-4; the monotone barrier strategy takes 24. Other starts
        (last frame, rest), oracles and options of MUMPS do not help, Mehrotra's algorithm harms.
    warm : start from the frame before: its multipliers, and its positions moved as the target has
        moved, as `warm_start_init_point` takes them. On frames 10 to 30 of the swing at 20 cells,
        1%, 21 iterations become 14 (medians). The other `warm_start` options are Ipopt's own: at
        10 cells points pushed inside by 1e-2 to 1e-4 take 10 iterations, by 1e-6 14, and the
        monotone barrier strategy, from 1e-2 to 1e-5, 11 to 22.
    hessian : "exact", or "limited-memory" for Ipopt's L-BFGS. Variants have the exact one unless
        they end in `-lbfgs`.
    """

    name = "ipopt"
    takes_lower = True
    variants = {
        "default": {"scaling": "default"},
        "default-lbfgs": {"scaling": "default", "hessian": "limited-memory"},
    }

    scaling: str = "scaled"
    hessian: str = "exact"
    warm: bool = False

    def __post_init__(self) -> None:
        if self.scaling not in ("scaled", "default"):
            raise ValueError(f"scaling is {self.scaling!r}: valid are scaled, default")
        if self.hessian not in ("exact", "limited-memory"):
            raise ValueError(f"hessian is {self.hessian!r}: valid are exact, limited-memory")

    def lengths(self, problem: Problem) -> Lengths:
        """What is bounded: the limited directions."""
        g = problem.row_coefficients
        return Lengths(problem.row_vertices, g, problem.lower_bounds, problem.bounds)

    def prepare(self, problem: Problem) -> Memory[Structure]:
        """The sparsity of the derivatives."""
        return Memory(Structure(problem, self.lengths(problem)), self.warm)

    def solve(
        self,
        problem: Problem,
        state: Memory[Structure],
        *,
        tolerance: float,
        monitor: Callable[..., None],
        deadline: Clock,
    ) -> Solution:
        """One run of Ipopt, and what its "solved" is worth."""
        found = self._run(problem, state, tolerance, monitor, deadline)
        return claimed(problem, found, tolerance)

    def _run(
        self,
        problem: Problem,
        state: Memory[Structure],
        tolerance: float,
        monitor: Callable[..., None],
        deadline: Clock,
    ) -> Solution:
        unit, scale = self._units(problem)
        nlp = Callbacks(problem, state.mesh, unit, scale, monitor, deadline)
        positions, Y = state.start(problem)
        start = positions[problem.free].ravel() / unit
        if start.size == 0:
            return held_still(problem, tolerance)
        bounds, options, given = state.mesh.lengths, self._options(tolerance, deadline), {}
        if np.any(Y):
            options["warm_start_init_point"] = "yes"
            y = nlp.stretched(start)
            given["lagrange"] = scale / 2 * np.sum(Y * y, axis=1) / np.sum(y**2, axis=1)
        ipopt = cyipopt.Problem(
            n=start.size,
            m=len(bounds.upper),
            problem_obj=nlp,
            cl=np.where(bounds.lower > 0, bounds.lower**2, -np.inf),
            cu=bounds.upper**2,
        )
        for option, value in options.items():
            ipopt.add_option(option, value)
        x, info = ipopt.solve(start, **given)
        code = info["status"]
        if code not in ANSWERS:
            x = np.full_like(start, np.nan)
        solution = Solution(
            nlp.positions(x),
            STATUS.get(code, f"Ipopt status {code}"),
            nlp.iterations,
            2 / scale * info["mult_g"][:, None] * nlp.stretched(x),
        )
        return state.keep(problem, solution)

    def _units(self, problem: Problem) -> tuple[float, float]:
        """The unit of length [m], and the factor s of the objective."""
        if self.scaling == "default" or len(problem.free) == 0:
            return 1.0, 1.0
        edge = problem.edge_length
        return edge, 10 / (edge**2 * float(problem.weights[problem.free].mean()))

    def _options(self, tolerance: float, deadline: Clock) -> dict[str, Any]:
        options: dict[str, Any] = {"print_level": 0, "sb": "yes"}
        if np.isfinite(deadline.remaining):
            options["max_wall_time"] = max(deadline.remaining, 1e-3)
        if self.hessian == "limited-memory":
            options["hessian_approximation"] = "limited-memory"
        if self.scaling == "scaled":
            options["tol"] = 0.01 * tolerance
            options["nlp_scaling_method"] = "none"
            options["mu_strategy"] = "adaptive"
            options["bound_relax_factor"] = 0.0
        return options


@dataclass(frozen=True, eq=False)
class Lengths:
    """Bounds on lengths: lower <= ||y_i|| <= upper with y_i = sum_k g_k x_k.

    vertices : (rows, k); coefficients : (rows, k), g [1/m]; lower, upper : (rows,).
    """

    vertices: IntArray
    coefficients: FloatArray
    lower: FloatArray
    upper: FloatArray


class Structure:
    """The sparsity of the derivatives, unknowns being (free vertices, 3) in C order.

    Attributes
    ----------
    lengths : what is bounded
    G, fixed : (rows, free vertices) and (rows, pins) sparse [1/m]
    row, value : (non-zeros of G,) row index and entry [1/m] of each non-zero
    jacobian, hessian : (row indices, column indices), the Hessian's of the lower triangle
    pairs : of neighbours
    """

    def __init__(self, problem: Problem, lengths: Lengths) -> None:
        self.lengths, count = lengths, len(lengths.upper)
        vertices, g = lengths.vertices, lengths.coefficients
        places = np.repeat(np.arange(count), vertices.shape[1]), vertices.ravel()
        G = sp.csr_array(sp.coo_array((g.ravel(), places), shape=(count, problem.vertices)))
        self.G, self.fixed = sp.csr_array(G[:, problem.free]), G[:, problem.pinned]
        entries = self.G.tocoo()
        self.row, self.value = entries.row, entries.data
        self.jacobian = np.repeat(self.row, 3), _coordinates(entries.col)
        self.pairs = Pairs(problem, vertices, g)
        self.hessian = _coordinates(self.pairs.rows), _coordinates(self.pairs.columns)


def _coordinates(vertices: IntArray) -> IntArray:
    """Indices of the three coordinates of each vertex."""
    return (3 * vertices[:, None] + np.arange(3)).ravel()


class Callbacks:
    """Values and derivatives as cyipopt calls them, at x (3 free vertices,) in `unit` metres."""

    def __init__(
        self,
        problem: Problem,
        structure: Structure,
        unit: float,
        scale: float,
        monitor: Callable[..., None],
        deadline: Clock,
    ) -> None:
        self.problem, self.structure, self.unit = problem, structure, unit
        self.monitor, self.deadline = monitor, deadline
        self.weights = scale * unit**2 * problem.weights[problem.free, None]
        self.target = problem.target[problem.free] / unit
        self.fixed = structure.fixed @ problem.target[problem.pinned]
        self.iterations = 0
        self.iterate = self.target.ravel()

    def positions(self, x: FloatArray) -> FloatArray:
        """(n, 3) [m] of all vertices."""
        positions = self.problem.target.copy()
        positions[self.problem.free] = self.unit * x.reshape(-1, 3)
        return positions

    def stretched(self, x: FloatArray) -> FloatArray:
        """(rows, 3) deformed directions y = G x."""
        y: FloatArray = self.structure.G @ (self.unit * x.reshape(-1, 3)) + self.fixed
        return y

    def objective(self, x: FloatArray) -> float:
        """s/2 ||x - target||_M^2."""
        return 0.5 * float(np.sum(self.weights * (x.reshape(-1, 3) - self.target) ** 2))

    def gradient(self, x: FloatArray) -> FloatArray:
        """s M (x - target)."""
        self.iterate = x  # Ipopt asks for gradients at accepted iterates alone
        return (self.weights * (x.reshape(-1, 3) - self.target)).ravel()

    def constraints(self, x: FloatArray) -> FloatArray:
        """||y_i||^2."""
        squares: FloatArray = np.sum(self.stretched(x) ** 2, axis=1)
        return squares

    def jacobianstructure(self) -> tuple[IntArray, IntArray]:
        """Row and column indices."""
        return self.structure.jacobian

    def jacobian(self, x: FloatArray) -> FloatArray:
        """2 y_i g_iv, three entries a non-zero of G."""
        g = 2 * self.unit * self.structure.value[:, None]
        entries: FloatArray = g * self.stretched(x)[self.structure.row]
        return entries.ravel()

    def hessianstructure(self) -> tuple[IntArray, IntArray]:
        """Row and column indices of the lower triangle."""
        return self.structure.hessian

    def hessian(self, x: FloatArray, multipliers: FloatArray, factor: float) -> FloatArray:
        """Of factor times the objective plus multipliers times constraints."""
        pairs = self.structure.pairs
        values = self.unit**2 * (pairs.products @ (2 * multipliers))
        values[pairs.diagonal] += factor * self.weights[:, 0]
        return np.repeat(values, 3)

    def intermediate(self, algorithm: int, iteration: int, *progress: float) -> bool:
        """Whether to go on; called once an iteration."""
        self.iterations = iteration
        self.monitor(self.positions(self.iterate), iterations=iteration)
        return not self.deadline.passed
