"""The projection that every solver is given: mesh, limits, pins; and its files."""

from strainbench.problem.limits import StretchLimits as StretchLimits
from strainbench.problem.problem import Problem as Problem
