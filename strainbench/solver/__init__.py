"""What a solver is, and how one is run and timed."""

from strainbench.solver.solver import Clock, Solution, Solver

__all__ = ["Clock", "Solution", "Solver"]
