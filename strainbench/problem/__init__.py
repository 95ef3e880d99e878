"""The projection that every solver is given: mesh, limits, pins; and its files."""

from strainbench.problem.limits import StretchLimits
from strainbench.problem.problem import Problem

__all__ = ["Problem", "StretchLimits"]
