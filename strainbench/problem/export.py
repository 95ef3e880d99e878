"""A projection as a file: a standard conic instance (CBF), or everything of it (npz).

The arrays of an npz: n vertices, e elements, m limited directions, r = e m rows, c constraints:

| name | shape | what |
|---|---|---|
| rest, elements, target, pinned, mass | | those of `Problem`; no mass where the norm has none |
| limit_directions, limit_bounds, limit_spectral | (m, dim), (m,) or (e, m) | `StretchLimits` |
| limit_lower | (m,) or (e, m) | its lower bounds, where there are any |
| G_*, bounds | (r, n), (c,) | ||(G x)_i|| <= b_i; with exact limits see `Problem` |
| free | (f,) | vertices that are not pinned |
| P_*, q, A_*, b | | minimise 1/2 u'Pu + q'u such that A u + s = b, s in the cones |
| cone, cone_order, cone_length, cone_count | | what a block of s is in, its order and entries |

The last two lines are the cone program; there is none where lower bounds are.

A matrix is four arrays, as scipy has compressed rows: `X_data`, `X_indices`, `X_indptr`,
`X_shape`. The unknowns u are the displacements from the target of the free vertices, (f, 3) in C
order, in metres; the objective is that of the problem. s has `cone_count` blocks of `cone_length`
entries, each in one "second-order" cone, or in one "semidefinite": matrices of `cone_order` as
`strainbench.problem.conic` lays them out. `load_problem` reads an npz back, the rows of `Problem`
alone.
"""

from __future__ import annotations

import math
import os
import zlib
from collections.abc import Mapping
from io import BytesIO
from pathlib import Path
from typing import IO, Any
from zipfile import BadZipFile, ZipFile, ZipInfo

import numpy as np
import psutil
from numpy.typing import NDArray

from strainbench import sparse as sp
from strainbench.files import open_folder
from strainbench.options import shown
from strainbench.problem.cbf import cbf_text
from strainbench.problem.conic import ConicForm
from strainbench.problem.limits import StretchLimits
from strainbench.problem.problem import Problem

SCALE, BALANCE = 1e3, 0.03  # of scaled files; see `as_cbf`
LARGEST_RATIO = 1032
"""Bytes that a compressed one can become at most: DEFLATE's own limit (zlib, technical details)."""


def check_format(kind: str) -> str:
    """`kind`, if it is one of FORMATS; else ValueError."""
    if kind not in FORMATS:
        raise ValueError(f"--format {shown(kind)}: valid are {', '.join(FORMATS)}")
    return kind


def write_problem(
    problem: Problem, path: Path, kind: str, about: str, scaled: bool = False
) -> None:
    """Write `problem` to a file, which is there as a whole or as it was before.

    Parameters
    ----------
    kind : of FORMATS
    about : where it comes from, kept in the file
    scaled : whether a CBF has the units of `as_cbf`; an npz has metres

    Raises
    ------
    ValueError
        One line: another format, one that cannot hold the problem, or a file that cannot be
        written.
    """
    content = content_of(problem, kind, about, scaled)
    open_folder(path.parent, "-o")
    part = path.with_name(f".{os.getpid()}.part")
    try:
        part.write_bytes(content)
        part.replace(path)
    except OSError as error:
        part.unlink(missing_ok=True)
        raise ValueError(f"-o {path} cannot be written to ({error.strerror})") from None


def content_of(problem: Problem, kind: str, about: str, scaled: bool = False) -> bytes:
    """What the file holds."""
    if scaled and check_format(kind) == "cbf":
        return as_cbf(problem, about, scaled)
    return FORMATS[check_format(kind)](problem, about)


def as_cbf(problem: Problem, about: str, scaled: bool = False) -> bytes:
    """The cone program in the Conic Benchmark Format; see `strainbench.problem.cbf`.

    Parameters
    ----------
    scaled : lengths in mean edges, the objective SCALE times what it then is over the mean weight,
        and BALANCE times the constant of its cone that would make the cone's first two entries
        alike at the optimum, as far as that can be guessed. Tuned with Clarabel's defaults on 17
        projections of 100 to 1,300 variables: it says Solved of all, with objectives off by 3e-5 at
        most; of those in metres it says AlmostSolved of 2, and others are off by up to 2e-3.
    """
    _check_norm(problem, "cbf")
    if not problem.convex:
        raise ValueError(
            "--format cbf: limits on compression (lower bounds) are no cones; --format npz is valid"
        )
    form = ConicForm(problem, SCALE if scaled else None)
    k = BALANCE * np.sqrt(form.scale * guessed_objective(problem)) if scaled else 1.0
    factor = float(k / form.scale)
    length, value = ("[m]", "t") if factor == form.unit == 1 else ("in units", f"{factor!r} t")
    comments = [
        about,
        f"minimise {value} = 1/2 ||x - target||_M^2 such that {problem.kind.formula}",
        f"variables 0 to {form.P.shape[0] - 1}: x - target {length} of the free vertices, three "
        "each",
        f"variable {form.P.shape[0]}: t",
    ]
    if scaled:
        comments.append(f"unit of length: {form.unit!r} m, so x = target + {form.unit!r} u")
        comments.append(f"objective in m^2, or kg m^2 with masses: {factor!r} t")
    text = cbf_text(form, form.constants(problem), comments, float(k))
    return text.encode(errors="backslashreplace")


def guessed_objective(problem: Problem) -> float:
    """Its size at the optimum, from the target's violations over the size of the mesh."""
    size = problem.edge_length * np.sqrt(len(problem.used))
    far = size * np.sqrt(np.mean(problem.violations(problem.target) ** 2))
    guess = 0.5 * far**2 * float(np.sum(problem.weights[problem.free]))
    return float(max(guess, problem.objective_floor))


def as_npz(problem: Problem, about: str) -> bytes:
    """All arrays of the problem and, where it is convex, of its cone program."""
    _check_norm(problem, "npz")
    arrays: dict[str, object] = {
        "about": about,
        "rest": problem.rest,
        "elements": problem.elements,
        "target": problem.target,
        "pinned": problem.pinned,
        **({} if problem.mass is None else {"mass": problem.mass}),
        **_limits(problem.limits),
        "bounds": problem.bounds,
        "free": problem.free,
        **_sparse("G", problem.G),
        **(_cone_program(problem) if problem.convex else {}),
    }
    buffer = BytesIO()
    plain: dict[str, Any] = {name: np.asarray(value) for name, value in arrays.items()}
    np.savez_compressed(buffer, **plain)
    return buffer.getvalue()


def _check_norm(problem: Problem, kind: str) -> None:
    if problem.metric is not None:
        raise ValueError(f"--format {kind}: files hold norms of masses alone, not a metric")
    if problem.contact:
        raise ValueError(f"--format {kind}: files hold limits alone, not contact with planes")


def _limits(limits: object) -> dict[str, object]:
    if not isinstance(limits, StretchLimits):
        raise ValueError("--format npz: limits of another kind than StretchLimits have no arrays")
    return {
        "limit_directions": limits.directions,
        "limit_bounds": limits.bounds,
        "limit_spectral": limits.spectral,
        **({} if limits.lower is None else {"limit_lower": limits.lower}),
    }


def _cone_program(problem: Problem) -> dict[str, object]:
    form = ConicForm(problem)
    return {
        **_sparse("P", form.P),
        "q": np.zeros(form.P.shape[0]),
        **_sparse("A", form.A),
        "b": form.constants(problem),
        "cone": form.cone,
        "cone_order": form.order,
        "cone_length": form.length,
        "cone_count": form.count,
    }


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
        with ZipFile(path) as archive:
            members = {info.filename: info for info in archive.infolist()}
            wanted = {n: members[f"{n}.npy"] for n in ARRAYS if f"{n}.npy" in members}
            _check_sizes(wanted, Path(path).stat().st_size)
            arrays = {name: _array(archive, info) for name, info in wanted.items()}
        return _problem(arrays)
    except OSError as error:
        raise ValueError(f"{path} cannot be read ({error.strerror or error})") from None
    except KeyError as error:
        raise ValueError(f"{path} holds no exported problem: it has no {error}") from None
    except DAMAGED as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        raise ValueError(f"{path} holds no exported problem ({reason})") from None


ARRAYS = (
    *("rest", "elements", "target", "pinned", "mass"),
    *("limit_directions", "limit_bounds", "limit_spectral", "limit_lower"),
)
DAMAGED = (BadZipFile, EOFError, MemoryError, RuntimeError, TypeError, ValueError, zlib.error)
"""What damaged files raise; encrypted ones and unknown compression are a RuntimeError."""


def _check_sizes(wanted: Mapping[str, ZipInfo], stored: int) -> None:
    """ValueError where the archive claims more than it can hold, or than there is memory for."""
    for name, info in wanted.items():
        if info.file_size > LARGEST_RATIO * min(info.compress_size, stored) + 1024:
            raise ValueError(
                f"{name} claims {info.file_size} bytes, of {info.compress_size} stored"
            )
    size, free = sum(i.file_size for i in wanted.values()), psutil.virtual_memory().available
    if size > free:
        raise ValueError(f"its arrays take {size} bytes, and {free} are free")


def _array(archive: ZipFile, info: ZipInfo) -> NDArray[np.float64]:
    """One array, read only if its header and its size agree."""
    with archive.open(info) as stream:
        shape, dtype = _header(stream)
        size = math.prod(shape) * dtype.itemsize
        if dtype.hasobject or dtype.names or stream.tell() + size != info.file_size:
            raise ValueError(
                f"{info.filename} claims the shape {shape} of {dtype} in {info.file_size} bytes"
            )
        stream.seek(0)
        array: NDArray[np.float64] = np.lib.format.read_array(stream, allow_pickle=False)
    return array


def _header(stream: IO[bytes]) -> tuple[tuple[int, ...], np.dtype[Any]]:
    version = np.lib.format.read_magic(stream)
    readers = {
        (1, 0): np.lib.format.read_array_header_1_0,
        (2, 0): np.lib.format.read_array_header_2_0,
    }
    if version not in readers:
        raise ValueError(f"an array of version {version}; valid are 1.0 and 2.0")
    shape, _, dtype = readers[version](stream)
    return shape, dtype


def _problem(data: Mapping[str, NDArray[np.float64]]) -> Problem:
    spectral = data["limit_spectral"]
    if spectral.dtype != bool or spectral.shape != ():
        raise ValueError(f"limit_spectral is {spectral.dtype} of shape {spectral.shape}; one bool")
    limits = StretchLimits(
        data["limit_directions"], data["limit_bounds"], bool(spectral), data.get("limit_lower")
    )
    return Problem(
        rest=data["rest"],
        elements=data["elements"],  # type: ignore[arg-type]
        target=data["target"],
        limits=limits,
        pinned=data["pinned"],  # type: ignore[arg-type]
        mass=data.get("mass"),
    )
