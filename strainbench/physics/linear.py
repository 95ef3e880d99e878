"""Solving with symmetric positive definite matrices that share one sparsity pattern.

Ordering and symbolic analysis happen once, in the constructor; `factorise` is numeric alone.

One factorisation of newton-ipm's matrix on the swing at 60 x 60 (11,157 unknowns), in turns:

| | factor | solve | |
|---|---|---|---|
| MKL Pardiso, minimum degree | 1 (5.4 ms) | 1 (0.48 ms) | pypardiso; free, not open; x86 only |
| the same, nested dissection | 1.3 | 1.3 | ahead from 200 x 200 on, by a tenth |
| CHOLMOD (Chen et al. 2008) | 1.8 | 2.0 | cvxopt; GPL |
| QDLDL | 2.9 | 1.5 | not offered: its numeric factorisation does not block |
| SuperLU | 4.2 | 2.9 | SciPy; always there |

SuperLU redoes its symbolic part each time; with the permutation of its first run kept, it is
spared the search for one, a seventh of its time, half of which goes into reading its pivots. Its
`relax` and `panel_size` stay as they are: larger ones gain nothing and write past its work arrays
(scipy 1.17).
"""

from __future__ import annotations

import ctypes
import importlib
import weakref
from abc import ABC, abstractmethod
from functools import cache
from importlib.util import find_spec
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray
from threadpoolctl import ThreadpoolController, threadpool_info

from strainbench import sparse as sp
from strainbench.arrays import FloatArray


class NotPositiveDefiniteError(ArithmeticError):
    """The matrix has no Cholesky factor."""


class LinearSolver(ABC):
    """Solves A x = b for matrices A of one pattern.

    Parameters
    ----------
    pattern : (n, n), sorted; of a matrix's lower triangle. What it stores above is ignored.
    """

    name: str

    @abstractmethod
    def __init__(self, pattern: sp.csc_array) -> None: ...

    @abstractmethod
    def factorise(self, data: FloatArray) -> None:
        """Take the matrix with these values in the entries of the pattern.

        Raises
        ------
        NotPositiveDefiniteError
        """

    @abstractmethod
    def solve(self, b: FloatArray) -> FloatArray:
        """A^-1 b, (n,) or (n, k), for the matrix that was factorised last."""


def symmetric(lower: sp.csc_array) -> sp.csc_array:
    """The whole matrix of which `lower` stores the lower triangle."""
    return sp.csc_array(sp.tril(lower) + sp.tril(lower, -1).T)


class SuperLU(LinearSolver):
    """SciPy's LU factorisation in symmetric mode, its minimum degree ordering found once."""

    name = "superlu"

    def __init__(self, pattern: sp.csc_array) -> None:
        n = pattern.shape[0]
        entry = (np.arange(pattern.nnz) + 1.0, pattern.indices, pattern.indptr)
        numbered = symmetric(sp.csc_array(entry, shape=pattern.shape))
        dominant = sp.csc_array(numbered, copy=True)
        dominant.data[:] = 1.0
        dominant = sp.csc_array(dominant + 2 * dominant.sum(axis=0).max() * sp.eye_array(n))
        self._order = np.argsort(_lu(dominant, "MMD_AT_PLUS_A").perm_c)
        permuted = sp.csc_array(numbered[self._order][:, self._order])
        permuted.sort_indices()
        self._entries = permuted.data.astype(np.int64) - 1
        self._matrix = permuted

    def factorise(self, data: FloatArray) -> None:
        """See the base class."""
        np.take(data, self._entries, out=self._matrix.data)
        try:
            self._factor = _lu(self._matrix, "NATURAL")
        except RuntimeError as error:
            raise NotPositiveDefiniteError(str(error)) from None
        pivots = self._factor.U.diagonal()  # those of L D L^T, as none is exchanged
        if not np.all(pivots > 0):
            column = int(np.argmin(pivots > 0))
            raise NotPositiveDefiniteError(f"no Cholesky factor: column {column}")

    def solve(self, b: FloatArray) -> FloatArray:
        """See the base class."""
        x = np.empty_like(b)
        x[self._order] = self._factor.solve(b[self._order])
        return x


def _lu(matrix: sp.csc_array, ordering: str) -> Any:
    return scipy.sparse.linalg.splu(
        matrix, permc_spec=ordering, diag_pivot_thresh=0.0, options={"SymmetricMode": True}
    )


class Cholmod(LinearSolver):
    """CHOLMOD's supernodal Cholesky factorisation with approximate minimum degree ordering."""

    name = "cholmod"

    def __init__(self, pattern: sp.csc_array) -> None:
        self._cvxopt = importlib.import_module("cvxopt")
        self._cholmod = importlib.import_module("cvxopt.cholmod")
        n = pattern.shape[0]
        columns = np.repeat(np.arange(n), np.diff(pattern.indptr))
        self._below = np.flatnonzero(pattern.indices >= columns)
        rows, columns = pattern.indices[self._below], columns[self._below]
        self._matrix = self._cvxopt.spmatrix(1.0, rows, columns, (n, n))
        self._factor = self._cholmod.symbolic(self._matrix)

    def factorise(self, data: FloatArray) -> None:
        """See the base class."""
        lower = data[self._below]
        if not np.all(np.isfinite(lower)):  # CHOLMOD itself does not notice
            raise NotPositiveDefiniteError("a value is not finite")
        self._matrix.V = self._cvxopt.matrix(lower)
        try:
            self._cholmod.numeric(self._matrix, self._factor)
        except ArithmeticError as error:
            raise NotPositiveDefiniteError(f"no Cholesky factor: column {error}") from None

    def solve(self, b: FloatArray) -> FloatArray:
        """See the base class."""
        x = self._cvxopt.matrix(b)
        self._cholmod.solve(self._factor, x)
        return np.array(x).reshape(b.shape)


class Pardiso(LinearSolver):
    """MKL's supernodal Cholesky factorisation with minimum degree ordering.

    Called through the library that pypardiso finds, as pypardiso itself repeats the analysis with
    each factorisation.
    """

    name = "pardiso"
    _ANALYSE, _FACTORISE, _SOLVE, _RELEASE = 11, 22, 33, -1
    _NOT_POSITIVE = -4  # its error code

    def __init__(self, pattern: sp.csc_array) -> None:
        self._function = _mkl().pardiso
        n = pattern.shape[0]
        columns = np.repeat(np.arange(n), np.diff(pattern.indptr))
        self._below = np.flatnonzero(pattern.indices >= columns)
        counts = np.bincount(columns[self._below], minlength=n)
        # columns of the lower triangle are the rows of the upper one, which MKL takes
        self._starts = np.concatenate([[0], np.cumsum(counts)]).astype(np.int32)
        self._indices = pattern.indices[self._below].astype(np.int32)
        self._lower = np.ones(len(self._indices))
        self._memory = np.zeros(64, dtype=np.int64)
        self._parameters = np.zeros(64, dtype=np.int32)
        self._parameters[0] = 1  # these, not the defaults: minimum degree, no refinement
        self._parameters[34] = 1  # indices from 0
        self._bind(self._lower)
        self._call(self._ANALYSE)
        weakref.finalize(self, _pardiso, self._matrix, self._RELEASE).atexit = False

    def _bind(self, values: FloatArray) -> None:
        """Set the arguments that stay the same while these are the values."""
        self._values = values
        arrays = (self._memory, self._parameters, values, self._starts, self._indices)
        self._matrix = (self._function, len(self._starts) - 1, *map(_array, arrays))

    def _call(self, phase: int, b: FloatArray | None = None) -> FloatArray:
        x, error = _pardiso(self._matrix, phase, b)
        if error == self._NOT_POSITIVE:
            raise NotPositiveDefiniteError(f"no Cholesky factor: column {self._parameters[29] - 1}")
        if error:
            raise RuntimeError(f"MKL Pardiso: error {error} in phase {phase}")
        return x

    def factorise(self, data: FloatArray) -> None:
        """See the base class."""
        if len(data) > len(self._below):
            data = np.take(data, self._below, out=self._lower)
        if data is not self._values:
            self._bind(data)
        if not np.all(np.isfinite(self._values)):
            raise NotPositiveDefiniteError("a value is not finite")
        self._call(self._FACTORISE)

    def solve(self, b: FloatArray) -> FloatArray:
        """See the base class."""
        return self._call(self._SOLVE, b)


@cache
def _mkl() -> Any:
    """MKL, found once: pypardiso searches the whole environment for it.

    It takes as many threads as BLAS has by now: a limit set before holds for it too.
    """
    threads = min(pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas")
    library = importlib.import_module("pypardiso").PyPardisoSolver().libmkl
    library.pardiso.argtypes = None
    ThreadpoolController().select(internal_api="mkl").limit(limits=threads)
    return library


def _pardiso(
    matrix: tuple[Any, ...], phase: int, b: FloatArray | None = None
) -> tuple[FloatArray, int]:
    """x and the error code of MKL's function: one matrix, any right-hand sides, no output."""
    function, n, memory, parameters, values, starts, indices = matrix
    b = np.zeros(n) if b is None else np.asfortranarray(b, dtype=np.float64)
    x, error = np.empty_like(b), ctypes.c_int32(0)
    function(
        *(memory, _ONE, _ONE, _POSITIVE_DEFINITE, _number(phase), _number(n)),
        *(values, starts, indices, _NOTHING, _number(b.size // n)),
        *(parameters, _SILENT, _array(b), _array(x), ctypes.byref(error)),
    )
    return x, error.value


def _number(value: int) -> Any:
    return ctypes.byref(ctypes.c_int32(value))


def _array(entries: NDArray[Any]) -> Any:
    return entries.ctypes.data_as(ctypes.c_void_p)


_ONE, _SILENT, _POSITIVE_DEFINITE = _number(1), _number(0), _number(2)
_NOTHING = _array(np.zeros(1, dtype=np.int32))  # no permutation


PACKAGES: dict[type[LinearSolver], str] = {
    Pardiso: "pypardiso",
    Cholmod: "cvxopt",
    SuperLU: "scipy",
}
"""Linear solvers and the packages that they need, the fastest first."""


def available_linear_solvers() -> list[type[LinearSolver]]:
    """Those whose packages are installed, the fastest first."""
    return [kind for kind, package in PACKAGES.items() if find_spec(package)]


def best_linear_solver(pattern: sp.csc_array) -> LinearSolver:
    """The fastest one whose package is installed."""
    return available_linear_solvers()[0](pattern)
