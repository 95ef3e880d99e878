"""What a solver carries from frame to frame: `strainbench.solver.memory`."""

from strainbench.solver.memory import Memory as Memory
