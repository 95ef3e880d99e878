"""Cone programs as text in the Conic Benchmark Format (H. A. Friberg, CBF, version 1).

CBF has no quadratic objective. With the variables (u, t), u those of `ConicForm`,

    minimise t  such that  (t, k, P^1/2 u) in QR,  b - A u in the problem's cones,

where QR is the rotated cone 2 t k >= ||P^1/2 u||^2: the cone of the objective in Tang et al.
2022, Eq. 12, so that k t is the objective; k is 1 but in scaled files. Second-order cones follow
it in CON, one a constraint. Semidefinite ones are matrices in PSDCON, their coefficients and
constants in HCOORD and DCOORD by the lower triangle, without the factors sqrt(2) of `ConicForm`.
Numbers keep all their digits.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import repeat

import numpy as np

from strainbench import sparse as sp
from strainbench.arrays import FloatArray, IntArray
from strainbench.problem.conic import ConicForm

Lines = Iterator[str]


def cbf_text(form: ConicForm, b: FloatArray, comments: Iterable[str], k: float = 1.0) -> str:
    """A cone program as the text of a CBF file.

    Parameters
    ----------
    b : the frame's constants
    comments : for the file's head, a line each
    k : the constant of the objective's cone
    """
    head = (f"# {' '.join(line.split())}" for line in comments)
    return "\n".join([*head, *_sections(form, b, k)]) + "\n"


def _sections(form: ConicForm, b: FloatArray, k: float) -> Lines:
    u = form.P.shape[0]
    objective = sp.block_array(  # (t, 1, P^1/2 u), t being the last variable
        [[None, sp.csr_array([[1.0], [0.0]])], [sp.diags_array(np.sqrt(form.P.diagonal())), None]]
    )
    limits = sp.hstack([-form.A, sp.csr_array((len(b), 1))])
    one = np.zeros(u + 2)
    one[1] = k
    cones = [f"QR {u + 2}"]

    yield from ("VER", "1", "", "OBJSENSE", "MIN", "", "VAR", f"{u + 1} 1", f"F {u + 1}", "")
    if form.cone == "semidefinite":
        yield from ("PSDCON", str(form.count), *repeat(str(form.order), form.count), "")
        yield from _rows(objective, one, cones, u)
        yield from _matrices(form, limits, b)
    else:
        cones += repeat(f"Q {form.order}", form.count)
        rows = sp.vstack([objective, limits])
        yield from _rows(rows, np.concatenate([one, b]), cones, u)


def _rows(rows: sp.sparray, constants: FloatArray, cones: list[str], t: int) -> Lines:
    """Minimise variable t such that `rows` and constants lie in the cones."""
    yield from ("CON", f"{len(constants)} {len(cones)}", *cones, "", "OBJACOORD", "1", f"{t} 1.0")
    i, j, values = sp.find(rows)
    yield from _list("ACOORD", (i, j), values)
    yield from _list("BCOORD", (np.arange(len(constants), dtype=np.int64),), constants)


def _matrices(form: ConicForm, limits: sp.sparray, b: FloatArray) -> Lines:
    """The same for the matrices, blocks of rows that hold their upper triangles by column."""
    row, column = np.tril_indices(form.order)  # the lower one by row: the same entries
    factor = np.where(row == column, 1.0, np.sqrt(0.5))

    def place(index: IntArray) -> tuple[IntArray, IntArray, IntArray]:
        return index // form.length, row[index % form.length], column[index % form.length]

    i, variable, values = sp.find(limits)
    matrix, p, q = place(i)
    yield from _list("HCOORD", (matrix, variable, p, q), values * factor[i % form.length])
    index = np.arange(len(b), dtype=np.int64)
    yield from _list("DCOORD", place(index), b * factor[index % form.length])


def _list(name: str, indices: tuple[IntArray, ...], values: FloatArray) -> Lines:
    """A section of indexed values, zeros left out."""
    known = np.flatnonzero(values)
    yield from ("", name, str(len(known)))
    columns = [index[known].tolist() for index in indices]
    for *index, value in zip(*columns, values[known].tolist(), strict=True):
        yield f"{' '.join(map(str, index))} {value!r}"
