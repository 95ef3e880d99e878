"""strainbench: a benchmarking suite for strain-limiting solvers in cloth simulation.

What is imported from here stays here, wherever the modules behind it lie.
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from strainbench.arrays import FloatArray, IntArray
    from strainbench.physics.cloth import Cloth
    from strainbench.physics.energies.energy import Energy
    from strainbench.physics.pattern import Blocks
    from strainbench.problem.grid import square_grid
    from strainbench.problem.limits import StretchLimits
    from strainbench.problem.principal import PrincipalLimits
    from strainbench.problem.problem import Problem
    from strainbench.referee.certificate import Certificate, certify
    from strainbench.scenario.cloth import ClothScenario
    from strainbench.scenario.scenario import Scenario, SheetScenario, StepReport
    from strainbench.solver.memory import Memory
    from strainbench.solver.sections import section
    from strainbench.solver.solve import solve
    from strainbench.solver.solver import Clock, Solution, Solver

__version__ = "0.2.0"
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
    "PrincipalLimits",
    "Problem",
    "Scenario",
    "SheetScenario",
    "Solution",
    "Solver",
    "StepReport",
    "StretchLimits",
    "certify",
    "section",
    "solve",
    "square_grid",
]
_HOMES = {
    "arrays": ("FloatArray", "IntArray"),
    "physics.cloth": ("Cloth",),
    "physics.energies.energy": ("Energy",),
    "physics.pattern": ("Blocks",),
    "problem.grid": ("square_grid",),
    "problem.limits": ("StretchLimits",),
    "problem.principal": ("PrincipalLimits",),
    "problem.problem": ("Problem",),
    "referee.certificate": ("Certificate", "certify"),
    "scenario.cloth": ("ClothScenario",),
    "scenario.scenario": ("Scenario", "SheetScenario", "StepReport"),
    "solver.memory": ("Memory",),
    "solver.sections": ("section",),
    "solver.solve": ("solve",),
    "solver.solver": ("Clock", "Solution", "Solver"),
}


def __getattr__(name: str) -> object:
    """Import what is offered when it is asked for: `strainbench --help` asks for nothing."""
    for home, names in _HOMES.items():
        if name in names:
            globals()[name] = getattr(import_module(f"{__name__}.{home}"), name)
            return globals()[name]
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
