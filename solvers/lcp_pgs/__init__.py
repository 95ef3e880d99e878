"""Constraints linearised at the start of a step, by projected Gauss-Seidel (Hernandez et al. 2013).

F. Hernandez, G. Cirio, A. G. Perez, M. A. Otaduy, "Anisotropic strain limiting", CEIG 2013,
section 4; R. W. Cottle, J.-S. Pang, R. E. Stone, "The linear complementarity problem", 1992. The
step is that of `step.py`. Its multipliers l >= 0 have A (d - d*) = J^T l, and r = c + J d >= 0 is
complementary to them. With the columns y_k = A^-1 J_k^T and W_kk = J_k y_k, a sweep does for each
row k

    r_k = c_k + J_k d,  l_k' = max(0, l_k - r_k / W_kk),  d += (l_k' - l_k) y_k,

so that W = J A^-1 J^T, which has many more rows than rank, is never formed. A contact's friction
follows its normal row, with the slip t = T d + slip and L the largest eigenvalue of T A^-1 T^T,

    l_t' = P(l_t - t / L),  P the projection onto the disc |l_t| <= mu l_n,

so that the cone is round, and met to the last digit. It stops when max_k |min(r_k, W_kk l_k)|, a
strain or a length in mean edges, and L |l_t' - l_t| of all contacts are below the tolerance.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from solvers.lcp_pgs.step import Answer, LinearComplementarity, Rows
from strainbench import FloatArray, Problem, section
from strainbench import sparse as sp
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
    takes_friction = True
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
        none, starts = np.zeros(0), np.zeros(1, dtype=np.int32)
        rows = Swept(starts, starts[:0], none, np.zeros((0, 3)), none, none, none)
        sweep(rows, 1.0, 1, none, np.zeros(3))

    def solved(self, rows: Rows, inverse: Callable[[FloatArray], FloatArray]) -> Answer:
        """Sweeps from the multipliers of the round before."""
        J, c, l, mu = rows.J, rows.c, rows.l.copy(), np.zeros(0)  # noqa: E741
        if (rub := rows.friction) is not None:
            J = sp.vstack([J, rub.rows], format="csr")
            c, l, mu = np.append(c, rub.slip), np.append(l, rub.l), rub.mu  # noqa: E741
        with section("columns"):
            Y = np.ascontiguousarray(inverse(J.T.toarray()).T)
        W = np.asarray(J.multiply(Y).sum(axis=1)).ravel()
        swept = Swept(J.indptr, J.indices, J.data, Y, W, c, mu)
        d = rows.step.proposed + l @ Y
        with section("sweeps"):
            count, left = sweep(swept, self.residual, self.max_sweeps, l, d)
        found, rubbing = np.split(l, [len(rows.c)])
        fault = "" if left <= self.residual else "sweep limit"
        return Answer(d, found, count, fault, rubbing if len(mu) else None)


class Swept(NamedTuple):
    """J by its rows, with those of friction, two a contact, at its end; Y, W and c (k,); mu (c,).

    The contacts themselves are the last rows before those.
    """

    starts: NDArray[np.int32]
    columns: NDArray[np.int32]
    entries: FloatArray
    Y: FloatArray
    W: FloatArray
    c: FloatArray
    mu: FloatArray


@compiled
def sweep(
    rows: Swept,
    enough: float,
    most: int,
    l: FloatArray,  # noqa: E741
    d: FloatArray,
) -> tuple[int, float]:
    """Sweeps over all rows, which change l and d; how many, and the residual of the last one.

    A row's residual is that before its own correction; rows that move nothing have W_kk = 0.
    """
    left, count, contacts = np.inf, 0, len(rows.mu)
    limits = len(rows.c) - 3 * contacts
    while count < most and left > enough:
        left = 0.0
        for k in range(limits + contacts):
            if rows.W[k] <= 0.0:
                continue
            r = room(rows, k, d)
            left = max(left, abs(min(r, rows.W[k] * l[k])))
            change(rows, k, max(0.0, l[k] - r / rows.W[k]), l, d)
            if k >= limits and rows.mu[k - limits] > 0.0:
                first = limits + contacts + 2 * (k - limits)
                left = max(left, rub(rows, first, rows.mu[k - limits] * l[k], l, d))
        count += 1
    return count, left


@compiled
def rub(
    rows: Swept,
    k: int,
    most: float,
    l: FloatArray,  # noqa: E741
    d: FloatArray,
) -> float:
    """Friction of a contact, rows k and k + 1, up to `most`; its residual."""
    mixed = 0.0
    for i in range(rows.starts[k], rows.starts[k + 1]):
        mixed += rows.entries[i] * rows.Y[k + 1, rows.columns[i]]
    half = 0.5 * (rows.W[k] - rows.W[k + 1])
    largest = 0.5 * (rows.W[k] + rows.W[k + 1]) + np.sqrt(half * half + mixed * mixed)
    a, b = l[k] - room(rows, k, d) / largest, l[k + 1] - room(rows, k + 1, d) / largest
    size = np.sqrt(a * a + b * b)
    share = most / size if size > most else 1.0
    moved = np.sqrt((share * a - l[k]) ** 2 + (share * b - l[k + 1]) ** 2)
    change(rows, k, share * a, l, d)
    change(rows, k + 1, share * b, l, d)
    return float(largest * moved)


@compiled
def room(rows: Swept, k: int, d: FloatArray) -> float:
    """c_k + J_k d."""
    r = rows.c[k]
    for i in range(rows.starts[k], rows.starts[k + 1]):
        r += rows.entries[i] * d[rows.columns[i]]
    return float(r)


@compiled
def change(
    rows: Swept,
    k: int,
    new: float,
    l: FloatArray,  # noqa: E741
    d: FloatArray,
) -> None:
    """A multiplier, and d with it."""
    if new != l[k]:
        d += (new - l[k]) * rows.Y[k]
        l[k] = new
