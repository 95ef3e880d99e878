"""A scene that does to the referee's process what scenes must not; run by test_runner.py."""

from __future__ import annotations

import os
import signal
import sys
import time
from dataclasses import dataclass

import numpy as np

from strainbench.problem.grid import square_grid
from strainbench.scenario.scenario import SheetScenario, StepReport


@dataclass(frozen=True)
class Wayward(SheetScenario):
    """A stretched square (nobody)."""

    name = "wayward"
    needs = frozenset()
    how: str = "well"

    def sheet(self):
        rest, elements = square_grid(self.resolution, 1.0, "uniform")
        positions = np.column_stack([1.5 * rest, np.zeros(len(rest))])
        return rest, elements, positions, np.array([0])

    def problem(self):
        if "strainbench.bench.judge" in sys.modules:  # not in a cell's process
            MISDEEDS[self.how]()
        return super().problem()

    def play(self, project):
        while True:
            project(self.sheet()[2])
            yield StepReport()


def fail():
    raise ZeroDivisionError("by a scene")


MISDEEDS = {
    "exit": lambda: sys.exit("enough"),
    "end": lambda: os._exit(0),
    "kill": lambda: os.kill(os.getpid(), signal.SIGKILL),
    "raise": fail,
    "hang": lambda: time.sleep(600),
    "well": lambda: None,
}
