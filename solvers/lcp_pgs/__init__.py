"""Constraints linearised at the start of a step, by projected Gauss-Seidel (Hernandez et al. 2013).

F. Hernandez, G. Cirio, A. G. Perez, M. A. Otaduy, "Anisotropic strain limiting", CEIG 2013,
section 4; R. W. Cottle, J.-S. Pang, R. E. Stone, "The linear complementarity problem", 1992. The
step is that of `step.py`. Its multipliers l >= 0 have A (d - d*) = J^T l, and r = c + J d >= 0 is
complementary to them. With the columns y_k = A^-1 J_k^T and W_kk = J_k y_k, a sweep does for each
row k

    r_k = c_k + J_k d,  l_k' = max(0, l_k - r_k / W_kk),  d += (l_k' - l_k) y_k,

so that W = J A^-1 J^T, which has many more rows than rank, is never formed. It stops when
max_k |min(r_k, W_kk l_k)|, a strain, is below the tolerance.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.lcp_pgs.step import Answer, LinearComplementarity, Rows
from strainbench import FloatArray, Problem, section
from strainbench.compiled import compiled


@dataclass(frozen=True)
class LcpPgs(LinearComplementarity):
    """Linearised limits by projected Gauss-Seidel, one step (Hernandez et al. 2013, Sec. 4).

    What it returns is the step that is asked of it, not the projection: its violation is that of
    the linearisation. `literal` is the paper's; the defaults see contact between rows coming, and
    put in no energy where a step starts beyond the limits.

    | status | when |
    |---|---|
    | nothing near a limit | x* is the answer |
    | linearised step solved | the residual of the complementarity is below `residual` |
    | sweep limit | it is not, after `max_sweeps` |

    Parameters
    ----------
    select : "violated" takes the rows that x* violates; "near" also those within half the tightest
        limit at x_0 or x*
    gamma : share of a violation at x_0 that a step makes good; 1 is all of it
    rounds : of a step, each with the rows that the last one newly violates
    rows : "exact" derivatives, or those of "biot" rows (`strainbench.problem.principal_rows`)
    residual : of the complementarity at which sweeps end [strain]
    max_sweeps : of a round
    """

    name = "lcp-pgs"
    variants = {
        "literal": {"select": "violated", "gamma": 1.0, "rounds": 1},
        "biot": {"rows": "biot"},
    }

    residual: float = 1e-5
    max_sweeps: int = 1000

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.residual > 0 or self.max_sweeps < 1:
            given = f"residual is {self.residual} and max_sweeps {self.max_sweeps}"
            raise ValueError(f"{given}: numbers above 0 are valid")

    def prepare(self, problem: Problem) -> None:
        """Compile the sweeps."""
        none = np.zeros(0)
        starts, columns = np.zeros(1, dtype=np.int32), np.zeros(0, dtype=np.int32)
        sweep(starts, columns, none, np.zeros((0, 3)), none, none, 1.0, 1, none, np.zeros(3))

    def solved(self, rows: Rows, inverse: Callable[[FloatArray], FloatArray]) -> Answer:
        """Sweeps from the multipliers of the round before."""
        with section("columns"):
            Y = np.ascontiguousarray(inverse(rows.J.T.toarray()).T)
        W = np.asarray(rows.J.multiply(Y).sum(axis=1)).ravel()
        l, d = rows.l.copy(), rows.step.proposed + rows.l @ Y  # noqa: E741
        J = (rows.J.indptr, rows.J.indices, rows.J.data)
        with section("sweeps"):
            count, left = sweep(*J, Y, W, rows.c, self.residual, self.max_sweeps, l, d)
        return Answer(d, l, count, "" if left <= self.residual else "sweep limit")


@compiled
def sweep(
    starts: NDArray[np.int32],
    columns: NDArray[np.int32],
    entries: FloatArray,
    Y: FloatArray,
    W: FloatArray,
    c: FloatArray,
    enough: float,
    most: int,
    l: FloatArray,  # noqa: E741
    d: FloatArray,
) -> tuple[int, float]:
    """Sweeps over all rows, which change l and d; how many, and the residual of the last one.

    A row's residual is that before its own correction; rows that move nothing have W_kk = 0.
    """
    left, count = np.inf, 0
    while count < most and left > enough:
        left = 0.0
        for k in range(len(c)):
            if W[k] <= 0.0:
                continue
            r = c[k]
            for i in range(starts[k], starts[k + 1]):
                r += entries[i] * d[columns[i]]
            left = max(left, abs(min(r, W[k] * l[k])))
            new = max(0.0, l[k] - r / W[k])
            if new != l[k]:
                d += (new - l[k]) * Y[k]
                l[k] = new
        count += 1
    return count, left
