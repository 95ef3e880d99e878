"""What a scene is: its mesh, limits, pins, physics, and nothing that it does not need."""

from strainbench.scenario.scenario import Scenario as Scenario
