"""What a solver is, and how one is run and timed."""

from strainbench.solver.solver import Clock as Clock
from strainbench.solver.solver import Solution as Solution
from strainbench.solver.solver import Solver as Solver
