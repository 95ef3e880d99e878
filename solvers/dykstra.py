"""Block coordinate ascent on the dual, one constraint at a time (Dykstra 1983).

R. Dykstra, "An algorithm for restricted least squares regression", JASA 78, 1983; for convex sets
J. Boyle and R. Dykstra 1986; as coordinate ascent on the dual N. Gaffke and R. Mathar, "A cyclic
projection algorithm via duality", Metrika 36, 1989. The sweep is Gauss-Seidel's, with the
correction that each constraint has made remembered as its multiplier Y_i. With W = M^-1 (0 at a
pin), x = target - W G^T Y and, for each constraint in turn, G_i its rows and y = G_i x:

1. Z = Y_i + y/L, where L is the largest eigenvalue of G_i W G_i^T;
2. Y_i becomes Z with its singular values lowered by b/L, to 0 at least, and x follows:
   x -= W G_i^T (change of Y_i).

A sampled direction has one row: the one singular value is |Z|, L = sum_k w_k g_k^2, and 1 and 2
are Dykstra's projection, the exact maximum over Y_i. An exact limit has the dim rows of its
element; the maximum has no closed form, and 1 and 2 are a proximal gradient step, which ascends.

Accelerated, a sweep there and back is taken as one symmetric Gauss-Seidel step (X. Li, D. Sun,
K.-C. Toh, "A block symmetric Gauss-Seidel decomposition theorem", Math. Program. 175, 2019),

3. from Y + beta (Y - Y_last), with Nesterov's beta (A. Beck, M. Teboulle, "A fast iterative
   shrinkage-thresholding algorithm", SIAM J. Imaging Sci. 2(1), 2009, Eq. 4.2);
4. where the dual objective falls, the step is undone and beta starts from 0 (B. O'Donoghue,
   E. Candes, "Adaptive restart for accelerated gradient schemes", Found. Comput. Math. 15, 2015).

So the dual objective never falls. Their theorem allows one non-smooth block and here all are, so
that the square-root rate is what is measured, not what is proven.

5. Now and then x is computed afresh from Y, against rounding, with its largest violation and its
   gap f(x) + sum_i |Y_i| v_i - D(Y) = sum_i |Y_i| max(b_i, |y_i|) - <Y_i, y_i>: stop at small ones.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from strainbench import Clock, Problem, Solution, Solver
from strainbench.arrays import FloatArray
from strainbench.compiled import compiled
from strainbench.problem.leverage import Leverage
from strainbench.problem.rows import Rows, add_row, gather, spread
from strainbench.solver.memory import Memory

ROWS_A_CHUNK = 1_000_000
"""Row visits between two looks at the clock: 30 ms at the 30 ns a visit measured."""

CHECK = 20
"""Step 5 comes each time that the sweeps have grown by one in so many: 5% of the time at most."""


class Blocks(NamedTuple):
    """The rows of each constraint, c of them with m rows; W g (c, m, k); 1/L (c,), or 0."""

    G: Rows
    moves: FloatArray
    steps: FloatArray


class Frame(NamedTuple):
    """b (c,), t (n, 3), G t (c, m, 3), and M (n, 1), which is 0 at a pin."""

    b: FloatArray
    t: FloatArray
    Gt: FloatArray
    M: FloatArray


class Run(NamedTuple):
    """An iterate x (n, 3), Y (c, m, 3), the one before, Nesterov's t_k, and D(Y)."""

    x: FloatArray
    Y: FloatArray
    x_last: FloatArray
    Y_last: FloatArray
    momentum: float
    dual: float


@dataclass(frozen=True)
class Dykstra(Solver):
    """Block coordinate ascent on the dual, one constraint at a time (Dykstra 1983).

    | status | when |
    |---|---|
    | solved | the largest violation and the relative duality gap are below the tolerance |
    | iteration limit | they are not, after `max_sweeps` |
    | time limit | they are not, at the deadline |

    Parameters
    ----------
    accelerate : steps 3 and 4; False, the variant "plain", is Dykstra's algorithm. Measured on
        frame 30 of the swing, to 1e-6: 7 times fewer sweeps at 10 cells and 1%, 20 at 20 cells
        and 1%, 46 at 10 cells and 0.1%. Over-relaxing the plain sweep, shuffling it, Anderson
        acceleration of it and repeated sweeps within each element gained less.
    warm : start from the multipliers of the frame before. Replayed from frame 10 to 30 of the
        swing, 1%, that saves a quarter of the sweeps at 10 cells (558 to 420 a frame, medians)
        and hardly any at 20 (3286 to 3056): what takes long is the error that is left.
    max_sweeps : over all constraints; there and back counts as two.
    """

    name = "dykstra"
    variants = {"plain": {"accelerate": False}}
    takes_exact = True

    accelerate: bool = True
    warm: bool = False
    max_sweeps: int = 1_000_000

    def prepare(self, problem: Problem) -> Memory[Blocks]:
        """Coefficients, step lengths, and the compiled loops."""
        G = blocks(problem)
        frame, run = start(problem, G, np.zeros((problem.rows, 3)))
        judge(G, frame, self._advance(G, frame, run, 0))
        return Memory(G, self.warm)

    def solve(
        self,
        problem: Problem,
        state: Memory[Blocks],
        *,
        tolerance: float,
        monitor: Callable[..., None],
        deadline: Clock,
    ) -> Solution:
        """Sweeps from Y = 0, or from the last Y; the monitor sees about sweeps 2, 4, 8, ..."""
        _, Y = state.start(problem)
        return state.keep(
            problem, self.ascend(problem, state.mesh, Y, tolerance, monitor, deadline)
        )

    def ascend(
        self,
        problem: Problem,
        G: Blocks,
        multipliers: FloatArray,
        tolerance: float,
        monitor: Callable[..., None],
        deadline: Clock,
    ) -> Solution:
        """Sweeps from any multipliers (rows, 3)."""
        frame, run = start(problem, G, multipliers)
        floor, done, mark = problem.objective_floor, 0, 2
        chunk = max(2, ROWS_A_CHUNK // problem.rows)
        while True:
            violation, gap, objective = judge(G, frame, run)  # 5
            Y = run.Y.reshape(-1, 3)
            if violation < tolerance and gap < tolerance * max(objective - gap, floor):
                return Solution(run.x, "solved", done, Y)
            if deadline.passed:
                return Solution(run.x, "time limit", done, Y)
            if done >= self.max_sweeps:
                return Solution(run.x, "iteration limit", done, Y)
            if done >= mark:
                monitor(run.x.copy(), Y.copy(), done)
                mark = 2 * done
            sweeps = 2 * max(1, min(chunk, done // CHECK, self.max_sweeps - done) // 2)
            run = self._advance(G, frame, run, sweeps)
            done += sweeps

    def _advance(self, G: Blocks, frame: Frame, run: Run, sweeps: int) -> Run:
        """An even number of sweeps."""
        return (accelerated if self.accelerate else plain)(G, frame, run, sweeps)


def blocks(problem: Problem) -> Blocks:
    """What the loops need of the mesh."""
    levers = Leverage.of(problem)
    return Blocks(Rows.of(problem), levers.moves, levers.steps)


def start(problem: Problem, G: Blocks, multipliers: FloatArray) -> tuple[Frame, Run]:
    """The frame, and an iterate at any multipliers (rows, 3)."""
    Gt = (problem.G @ problem.target).reshape(problem.constraints, -1, 3)
    M = problem.weights[:, None].copy()
    M[problem.held] = 0.0
    frame = Frame(problem.bounds, problem.target, Gt, M)
    x, Y = problem.target.copy(), multipliers.reshape(Gt.shape).copy()
    place(G, frame, x, Y)
    return frame, Run(x, Y, x.copy(), Y.copy(), 1.0, -np.inf)


@compiled
def plain(mesh: Blocks, frame: Frame, run: Run, sweeps: int) -> Run:
    """So many sweeps forwards, in place."""
    norms = np.zeros(len(mesh.steps))
    for _ in range(sweeps):
        sweep(mesh, frame.b, run.x, run.Y, norms, False)
    return run


@compiled
def accelerated(mesh: Blocks, frame: Frame, run: Run, sweeps: int) -> Run:
    """So many sweeps, there and back."""
    x, Y, x_last, Y_last, momentum, dual = run
    norms = np.zeros(len(mesh.steps))
    for _ in range(sweeps // 2):
        larger = (1 + np.sqrt(1 + 4 * momentum**2)) / 2
        beta = (momentum - 1) / larger
        x_new, Y_new = x + beta * (x - x_last), Y + beta * (Y - Y_last)  # 3
        sweep(mesh, frame.b, x_new, Y_new, norms, False)
        sweep(mesh, frame.b, x_new, Y_new, norms, True)
        linear = np.dot(Y_new.reshape(-1), frame.Gt.reshape(-1)) - np.dot(frame.b, norms)
        value = linear - 0.5 * np.sum(frame.M * (x_new - frame.t) ** 2)
        if value < dual and beta > 0:  # 4
            momentum = 1.0
            continue
        x, Y, x_last, Y_last, momentum, dual = x_new, Y_new, x, Y, larger, value
    return Run(x, Y, x_last, Y_last, momentum, dual)


@compiled
def sweep(
    mesh: Blocks, b: FloatArray, x: FloatArray, Y: FloatArray, norms: FloatArray, reverse: bool
) -> None:
    """Steps 1 and 2 for each constraint, forwards or back; `norms` takes the |Y_i|.

    1.29 of the same in C (`make kernels`), for a single row: Z goes through memory, as its shape is
    that of a row or of an element. Products and sums rounded at once gain a twentieth.
    """
    G, moves, steps = mesh
    Z = np.empty((len(G.axes), 3))
    for number in range(len(b)):
        i = len(b) - 1 - number if reverse else number
        step = steps[i]
        if step == 0:
            continue
        gather(G, i, x, Z)
        for a in range(len(G.axes)):  # 1
            for c in range(3):
                Z[a, c] = Y[i, a, c] + step * Z[a, c]
        _, norms[i] = shrink(Z, G.axes, step * b[i])
        if norms[i] == 0 and not np.any(Y[i]):
            continue
        for a in range(len(G.axes)):  # 2
            back = Y[i, a, 0] - Z[a, 0], Y[i, a, 1] - Z[a, 1], Y[i, a, 2] - Z[a, 2]
            Y[i, a, 0], Y[i, a, 1], Y[i, a, 2] = Z[a, 0], Z[a, 1], Z[a, 2]
            add_row(G, moves, i, a, back, x)


@compiled
def shrink(A: FloatArray, axes: tuple[int, ...], t: float) -> tuple[float, float]:
    """Lower the singular values of A (m, 3) by t; return the largest before, their sum after."""
    if len(axes) == 1:
        s = np.sqrt(A[0, 0] ** 2 + A[0, 1] ** 2 + A[0, 2] ** 2)
        f = 1 - t / s if s > t else 0.0
        for c in range(3):
            A[0, c] *= f
        return s, f * s
    if len(axes) > 2:
        U, values, Vt = np.linalg.svd(A)
        lower = np.maximum(values - t, 0.0)
        A[:] = (U * lower) @ Vt
        return values[0], np.sum(lower)
    p, q, r = np.dot(A[0], A[0]), np.dot(A[1], A[1]), np.dot(A[0], A[1])
    h = (p - q) / 2  # A A^T = (p + q) / 2 I + [[h, r], [r, -h]], and the latter squared is w^2 I
    w = np.sqrt(h * h + r * r)
    s = np.sqrt((p + q) / 2 + w)
    s2 = np.sqrt(np.sum(np.cross(A[0], A[1]) ** 2)) / s if s > 0 else 0.0
    f, f2 = 1 - t / s if s > t else 0.0, 1 - t / s2 if s2 > t else 0.0
    mean, turn = (f + f2) / 2, (f - f2) / (2 * w) if w > 0 else 0.0
    for c in range(3):
        u, v = A[0, c], A[1, c]
        A[0, c] = mean * u + turn * (h * u + r * v)
        A[1, c] = mean * v + turn * (r * u - h * v)
    return s, f * s + f2 * s2


@compiled
def place(mesh: Blocks, frame: Frame, x: FloatArray, Y: FloatArray) -> None:
    """Set x = t - W G^T Y."""
    x[:] = frame.t
    for i in range(len(Y)):
        spread(mesh.G, mesh.moves, i, -Y[i], x)


@compiled
def judge(mesh: Blocks, frame: Frame, run: Run) -> tuple[float, float, float]:
    """Largest violation, gap and objective; x is set afresh.

    x_last too: momentum makes any difference between the rounding errors of the two grow.
    """
    place(mesh, frame, run.x, run.Y)
    place(mesh, frame, run.x_last, run.Y_last)
    G = mesh.G
    y = np.empty((len(G.axes), 3))
    violation = gap = 0.0
    for i in range(len(frame.b)):
        gather(G, i, run.x, y)
        gap -= np.sum(y * run.Y[i])
        stretched, _ = shrink(y, G.axes, 0.0)
        y[:] = run.Y[i]
        _, norm = shrink(y, G.axes, 0.0)
        gap += norm * max(stretched, frame.b[i])
        violation = max(violation, stretched - frame.b[i])
    return violation, gap, 0.5 * np.sum(frame.M * (run.x - frame.t) ** 2)
