"""Solving with symmetric positive definite matrices that share one sparsity pattern.

Ordering and symbolic analysis happen once, in the constructor; `factorise` is numeric alone.

CHOLMOD (Chen et al. 2008, supernodal Cholesky), from the optional GPL package cvxopt, takes a
quarter of the time of SuperLU, which is always there: 17 ms to 62 ms on the swing at 60 x 60.
SuperLU redoes its symbolic part each time; with the permutation of its first run kept, it is
spared the search for one, a seventh of its time, half of which goes into reading its pivots. Its
`relax` and `panel_size` stay as they are: larger ones gain nothing and write past its work arrays
(scipy 1.17).
"""

from __future__ import annotations

import importlib
from abc import ABC, abstractmethod
from importlib.util import find_spec
from typing import Any

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from strainbench.limits import FloatArray


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
    return splu(matrix, permc_spec=ordering, diag_pivot_thresh=0.0, options={"SymmetricMode": True})


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


def available_linear_solvers() -> list[type[LinearSolver]]:
    """Those whose packages are installed, the fastest first."""
    return [Cholmod, SuperLU] if find_spec("cvxopt") else [SuperLU]


def best_linear_solver(pattern: sp.csc_array) -> LinearSolver:
    """CHOLMOD where cvxopt is installed, SuperLU otherwise."""
    return available_linear_solvers()[0](pattern)
