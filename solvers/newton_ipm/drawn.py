"""A start nearer to the limits than a candidate far beyond them."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from strainbench import Problem
from strainbench import sparse as sp
from strainbench.arrays import FloatArray
from strainbench.physics.linear import LinearSolver, best_linear_solver

FAR_OFF = 1.0  # violation from which on a candidate is no start
LOST = 1 / np.finfo(float).eps  # and beyond which its rounding is longer than the limits
TIE = 1e-10  # to the candidate, of the mean diagonal: for parts of a mesh without a pin


class Drawn:
    """The mesh drawn together between its pins.

    argmin ||G x||^2 + TIE d ||x - target||^2 with the pins where they are, d the mean diagonal of
    G^T G. Its rows are a few times longer than their bounds at most, and only beside pins.
    """

    def __init__(self, problem: Problem) -> None:
        self._problem = problem

    @cached_property
    def _linear(self) -> LinearSolver:
        matrix = sp.csc_array(self._free.T @ self._free)
        matrix = sp.csc_array(matrix + self._tie * sp.eye_array(matrix.shape[0]))
        matrix.sort_indices()
        linear = best_linear_solver(matrix)
        linear.factorise(matrix.data)
        return linear

    @cached_property
    def _free(self) -> sp.csr_array:
        return self._problem.G[:, self._problem.free]

    @cached_property
    def _tie(self) -> float:
        return TIE * float(np.mean(self._free.power(2).sum(axis=0)))

    def start(self, target: FloatArray, violation: float) -> FloatArray:
        """(n, 3), violated by FAR_OFF more than the drawn mesh at most; or the target.

        The target is the start where it is violated by no more than that, and where so much that
        no bound on the objective could tell limits that can be met from others.

        Parameters
        ----------
        violation : largest of the target
        """
        x = target.copy()
        if FAR_OFF < violation < LOST:
            free, kept = self._problem.free, target.copy()
            kept[free] = 0.0
            pull = self._free.T @ (self._problem.G @ kept)
            x[free] = self._linear.solve(self._tie * target[free] - pull)
            x += (FAR_OFF / violation) * (target - x)
        return x
