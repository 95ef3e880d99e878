"""Limits linearised at the start of a step, by an interior point (Hernandez et al. 2013; Clarabel).

The quadratic program of `solvers.lcp_pgs.step`, to its end: what is left of a violation is then the
linearisation's. In lengths of an edge and with the metric's mean as unit, e = (d - d*) / edge:

    minimise 1/2 e^T A e / mean  such that  -J edge e + s = c + J d*,  s >= 0.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from solvers.lcp_pgs.step import Answer, LinearComplementarity, Rows
from strainbench import FloatArray, section
from strainbench import sparse as sp
from strainbench.plugins import Library

clarabel = Library("clarabel")


@dataclass(frozen=True)
class LcpQp(LinearComplementarity):
    """Linearised limits by Clarabel's interior point, one step (Hernandez et al. 2013, Sec. 4).

    | status | when |
    |---|---|
    | nothing near a limit | x* is the answer |
    | linearised step solved | Clarabel says Solved |
    | infeasible | no step meets the linearised limits: no answer |
    | another of Clarabel's | it ended otherwise |

    Parameters
    ----------
    select, gamma, rounds, rows : see `lcp-pgs`
    precision : Clarabel's tolerances of gap and feasibility
    """

    name = "lcp-qp"
    variants = {
        "literal": {"select": "violated", "gamma": 1.0, "rounds": 1},
        "biot": {"rows": "biot"},
    }

    precision: float = 1e-8

    def solved(self, rows: Rows, inverse: Callable[[FloatArray], FloatArray]) -> Answer:
        """Clarabel, from scratch."""
        step, k = rows.step, len(rows.c)
        edge, mean = step.problem.edge_length, float(step.A.diagonal().mean())
        settings = clarabel.DefaultSettings()
        settings.verbose = False
        settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = self.precision
        P, A = sp.triu(step.A / mean, format="csc"), sp.csc_array(-edge * rows.J)
        room = rows.c + rows.J @ step.proposed
        cones = [clarabel.NonnegativeConeT(k)]
        with section("interior point"):
            zero = np.zeros(P.shape[0])
            found = clarabel.DefaultSolver(P, zero, A, room, cones, settings).solve()
        status = str(found.status)
        if "PrimalInfeasible" in status:
            return Answer(np.full(P.shape[0], np.nan), rows.l, found.iterations, "infeasible")
        d = step.proposed + edge * np.array(found.x)
        multipliers = mean * edge**2 * np.array(found.z)
        return Answer(d, multipliers, found.iterations, "" if status == "Solved" else status)
