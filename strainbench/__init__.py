"""strainbench: a benchmarking suite for strain-limiting solvers in cloth simulation.

What is imported from here stays here, wherever the modules behind it lie.
"""

from strainbench.arrays import FloatArray, IntArray
from strainbench.physics.cloth import Cloth
from strainbench.physics.energies.energy import Energy
from strainbench.physics.pattern import Blocks
from strainbench.problem.grid import square_grid
from strainbench.problem.limits import StretchLimits
from strainbench.problem.problem import Problem
from strainbench.referee.certificate import Certificate, certify
from strainbench.scenario.cloth import ClothScenario
from strainbench.scenario.scenario import Scenario, SheetScenario, StepReport
from strainbench.solver.memory import Memory
from strainbench.solver.solve import solve
from strainbench.solver.solver import Clock, Solution, Solver

__version__ = "0.1.0"
__all__ = [
    "Blocks",
    "Certificate",
    "Clock",
    "Cloth",
    "ClothScenario",
    "Energy",
    "FloatArray",
    "IntArray",
    "Memory",
    "Problem",
    "Scenario",
    "SheetScenario",
    "Solution",
    "Solver",
    "StepReport",
    "StretchLimits",
    "certify",
    "solve",
    "square_grid",
]
