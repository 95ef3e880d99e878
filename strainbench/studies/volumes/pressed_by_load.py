"""The finger pressed by a load that grows, in place of to a depth."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from strainbench.solver.registry import find_solver
from strainbench.studies.volumes.part import Cell, Part, Plan, numbers
from strainbench.studies.volumes.press import FOUND, MATERIALS, PRESSES, Pressing

LOADS = (2.0, 5.0, 10.0, 20.0, 40.0)  # [N]
RATE = 100.0  # [N/s], of the scene
SWEEPS = 10_000


@dataclass(frozen=True)
class Loaded:
    """A finger under a load."""

    press: str
    material: str
    load: float  # [N]
    depth_mm: float
    force: float  # [N], from here on as in `press.Press`
    rows: int
    contacts: int
    sweeps: int
    cone_error: float
    violation: float
    converged: str


def cells(_: Plan) -> Iterable[Cell]:
    """Presses and limits."""
    return product(PRESSES, MATERIALS)


def loaded(press: str, material: str) -> Iterator[Loaded]:
    """Rows at the loads, of one play."""
    solver = replace(find_solver("lcp-pgs"), max_sweeps=SWEEPS)  # type: ignore[call-arg]
    pressing = Pressing(solver, press=press, material=material, force=max(LOADS))
    rest = pressing.stage.problem.rest
    base = rest[:, 0] == 0
    for report in pressing.steps():
        for load in LOADS:
            if abs(report.time * RATE - load) <= 1e-6 * load:
                gone = np.mean(pressing.stage.positions[base] - rest[base], axis=0)
                depth = 1e3 * float(np.linalg.norm(gone))
                yield Loaded(press, material, load, depth, *pressing.found)


PART = Part(
    "load",
    2,
    cells,
    loaded,
    "A finger pressed by a load",
    "The same finger with its bone free to go along the way it is pressed, by a load that grows by "
    "100 N/s: how deep it is when the load comes to so much, and the normal force on the table, "
    "which carries the load with its friction. A step from within the limits has an answer, to go "
    "no further: rigid is a depth that a load twice as large adds little to, not a force that "
    f"means nothing. Up to {SWEEPS} sweeps a round.",
    ["press", "limits", *numbers(("load", "N", "g"), ("depth", "mm", ".3f")), *FOUND],
)
