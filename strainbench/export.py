"""A projection as a file: a standard conic instance (CBF), or everything of it (npz).

The arrays of an npz: n vertices, e elements, m limited directions, r = e m rows, c constraints:

| name | shape | what |
|---|---|---|
| rest, elements, target, pinned, mass | | those of `Problem`; no mass where the norm has none |
| limit_directions, limit_bounds, limit_spectral | (m, dim), (m,) or (e, m) | `StretchLimits` |
| G_*, bounds | (r, n), (c,) | ||(G x)_i|| <= b_i; with exact limits see `Problem` |
| free | (f,) | vertices that are not pinned |
| P_*, q, A_*, b | | minimise 1/2 u'Pu + q'u such that A u + s = b, s in the cones |
| cone, cone_order, cone_length, cone_count | | what a block of s is in, its order and entries |

A matrix is four arrays, as scipy has compressed rows: `X_data`, `X_indices`, `X_indptr`,
`X_shape`. The unknowns u are the displacements from the target of the free vertices, (f, 3) in C
order, in metres; the objective is that of the problem. s has `cone_count` blocks of `cone_length`
entries, each in one "second-order" cone, or in one "semidefinite": matrices of `cone_order` as
`strainbench.conic` lays them out. `load_problem` reads an npz back.
"""

from __future__ import annotations

from collections.abc import Mapping
from io import BytesIO
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from strainbench.cbf import cbf_text
from strainbench.conic import ConicForm
from strainbench.limits import StretchLimits
from strainbench.options import shown
from strainbench.problem import Problem
from strainbench.records import open_folder


def check_format(kind: str) -> str:
    """`kind`, if it is one of FORMATS; else ValueError."""
    if kind not in FORMATS:
        raise ValueError(f"--format {shown(kind)}: valid are {', '.join(FORMATS)}")
    return kind


def write_problem(problem: Problem, path: Path, kind: str, about: str) -> None:
    """Write `problem` to a file.

    Parameters
    ----------
    kind : of FORMATS
    about : where it comes from, kept in the file

    Raises
    ------
    ValueError
        One line: another format, or a file that cannot be written.
    """
    content = FORMATS[check_format(kind)](problem, about)
    open_folder(path.parent, "-o")
    try:
        path.write_bytes(content)
    except OSError as error:
        raise ValueError(f"-o {path} cannot be written to ({error.strerror})") from None


def as_cbf(problem: Problem, about: str) -> bytes:
    """The cone program in the Conic Benchmark Format; see `strainbench.cbf`."""
    form = ConicForm(problem)
    comments = [
        about,
        f"minimise t = 1/2 ||x - target||_M^2 such that {_limits(problem)}",
        f"variables 0 to {form.P.shape[0] - 1}: x - target [m] of the free vertices, three each",
        f"variable {form.P.shape[0]}: t",
    ]
    return cbf_text(form, form.constants(problem), comments).encode()


def _limits(problem: Problem) -> str:
    return "||F_e D||_2 <= b_e" if problem.limits.spectral else "||(G x)_i|| <= b_i"


def as_npz(problem: Problem, about: str) -> bytes:
    """All arrays of the problem and of its cone program."""
    form = ConicForm(problem)
    arrays: dict[str, object] = {
        "about": about,
        "rest": problem.rest,
        "elements": problem.elements,
        "target": problem.target,
        "pinned": problem.pinned,
        **({} if problem.mass is None else {"mass": problem.mass}),
        "limit_directions": problem.limits.directions,
        "limit_bounds": problem.limits.bounds,
        "limit_spectral": problem.limits.spectral,
        "bounds": problem.bounds,
        "free": problem.free,
        **_sparse("G", problem.G),
        **_sparse("P", form.P),
        "q": np.zeros(form.P.shape[0]),
        **_sparse("A", form.A),
        "b": form.constants(problem),
        "cone": form.cone,
        "cone_order": form.order,
        "cone_length": form.length,
        "cone_count": form.count,
    }
    buffer = BytesIO()
    plain: dict[str, Any] = {name: np.asarray(value) for name, value in arrays.items()}
    np.savez_compressed(buffer, **plain)
    return buffer.getvalue()


FORMATS = {"cbf": as_cbf, "npz": as_npz}


def _sparse(name: str, matrix: sp.sparray) -> dict[str, object]:
    rows = sp.csr_array(matrix)
    return {
        f"{name}_{part}": getattr(rows, part) for part in ("data", "indices", "indptr", "shape")
    }


def load_problem(path: str | Path) -> Problem:
    """The problem of an npz that `strainbench export` wrote.

    Raises
    ------
    ValueError
        One line that names the file and what is wrong with it.
    """
    try:
        with np.load(path) as data:
            arrays = dict(data)
        return _problem(arrays)
    except OSError as error:
        raise ValueError(f"{path} cannot be read ({error.strerror or error})") from None
    except KeyError as error:
        raise ValueError(f"{path} holds no exported problem: it has no {error}") from None
    except (BadZipFile, TypeError, ValueError) as error:
        raise ValueError(f"{path} holds no exported problem ({error})") from None


def _problem(data: Mapping[str, NDArray[np.float64]]) -> Problem:
    return Problem(
        rest=data["rest"],
        elements=data["elements"],  # type: ignore[arg-type]
        target=data["target"],
        limits=StretchLimits(
            data["limit_directions"], data["limit_bounds"], bool(data["limit_spectral"])
        ),
        pinned=data["pinned"],  # type: ignore[arg-type]
        mass=data.get("mass"),
    )
