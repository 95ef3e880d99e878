"""Ipopt on the lengths of edges from a start with noise (after Jin et al. 2017)."""

from __future__ import annotations

from dataclasses import dataclass

from solvers.ipopt import Structure
from solvers.ipopt_edges import IpoptEdges
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
class IpoptEdgesNoisy(IpoptEdges):
    """Ipopt on the lengths of edges from a start with noise (after Jin et al. 2017)."""

    name = "ipopt-edges-noisy"
    variants = {}

    def prepare(self, problem: Problem) -> Memory[Structure]:
        """See the base class."""
        return Noisy(super().prepare(problem).mesh, self.warm)
