"""Nonlinear programming with Ipopt from a start with noise (Tang et al. 2022, Table 1)."""

from __future__ import annotations

from dataclasses import dataclass

from solvers.ipopt import Ipopt, Structure
from solvers.sequential_cuts.starts import candidate
from strainbench import Problem
from strainbench.arrays import FloatArray
from strainbench.solver.memory import Memory


class Noisy(Memory[Structure]):
    """Starts at the target with the noise of sequential-cuts, out of plane."""

    def start(self, problem: Problem) -> tuple[FloatArray, FloatArray]:
        """See the base class."""
        return candidate(problem), super().start(problem)[1]


@dataclass(frozen=True)
class IpoptNoisy(Ipopt):
    """Nonlinear programming with Ipopt from a start with noise (Tang et al. 2022, Table 1)."""

    name = "ipopt-noisy"
    variants = {}

    def prepare(self, problem: Problem) -> Memory[Structure]:
        """See the base class."""
        return Noisy(super().prepare(problem).mesh, self.warm)
