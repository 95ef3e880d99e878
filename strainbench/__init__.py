"""strainbench: a benchmarking suite for strain-limiting solvers in cloth simulation."""

from strainbench.api import solve
from strainbench.limits import StretchLimits
from strainbench.problem import Problem
from strainbench.referee import Certificate, certify
from strainbench.scenario import Scenario
from strainbench.solver import Clock, Solution, Solver

__version__ = "0.1.0"
__all__ = [
    "Certificate",
    "Clock",
    "Problem",
    "Scenario",
    "Solution",
    "Solver",
    "StretchLimits",
    "certify",
    "solve",
]
