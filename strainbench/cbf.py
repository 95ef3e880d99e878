"""Cone programs as text in the Conic Benchmark Format (H. A. Friberg, CBF, version 1).

CBF has no quadratic objective. With the variables (u, t), u those of `ConicForm`,

    minimise t  such that  (t, 1, P^1/2 u) in QR,  b - A u in the problem's cones,

where QR is the rotated cone 2 t * 1 >= ||P^1/2 u||^2: the cone of the objective in Tang et al.
2022, Eq. 12, so that t is the objective. A cone of CBF takes rows in order: the two first blocks
of CON are the objective's, then one cone a constraint. Numbers keep all their digits.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np
import scipy.sparse as sp

from strainbench.conic import ConicForm
from strainbench.limits import FloatArray


def cbf_text(form: ConicForm, constants: FloatArray, comments: Iterable[str]) -> str:
    """A cone program as the text of a CBF file.

    Parameters
    ----------
    constants : the vector b of the frame
    comments : lines for its head
    """
    return "\n".join([*(f"# {line}" for line in comments), *_sections(form, constants)]) + "\n"


def _sections(form: ConicForm, b: FloatArray) -> Iterator[str]:
    u = form.P.shape[0]
    weights = np.sqrt(form.P.diagonal())
    objective = sp.block_array(  # (t, 1, P^1/2 u), t being the last variable
        [[None, sp.csr_array([[1.0], [0.0]])], [sp.diags_array(weights), None]]
    )
    limits = sp.hstack([-form.A, sp.csc_array((len(b), 1))])
    rows = sp.coo_array(sp.vstack([objective, limits]))
    constants = np.concatenate([[0.0, 1.0], np.zeros(u), b])
    cones = [f"QR {u + 2}", *[f"Q {form.length}"] * form.count]

    yield from ("VER", "1", "", "OBJSENSE", "MIN", "")
    yield from ("VAR", f"{u + 1} 1", f"F {u + 1}", "")
    yield from ("CON", f"{len(constants)} {len(cones)}", *cones, "")
    yield from ("OBJACOORD", "1", f"{u} 1.0", "")
    entries = zip(rows.row, rows.col, rows.data, strict=True)
    yield from ("ACOORD", str(rows.nnz), *(f"{i} {j} {float(v)!r}" for i, j, v in entries), "")
    known = np.flatnonzero(constants)
    yield from ("BCOORD", str(len(known)), *(f"{i} {float(constants[i])!r}" for i in known))
