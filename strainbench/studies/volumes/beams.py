"""The beams of Fig. 2: where they come to, and how they wobble."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from strainbench.scenario.stage import Stage
from strainbench.solver.registry import find_solver
from strainbench.studies.volumes.march import stretches
from strainbench.studies.volumes.part import Cell, Part, Plan, numbers, scene_of

LASTS = 1.2  # [s]
ALPHA = 2.0  # [1/s]
CELLS = (
    ("stiff", 2e5, "none", 20.0),
    ("stiff", 2e5, "none", 5.0),
    ("anisotropic", 5e3, "lcp-qp", 20.0),
    ("anisotropic", 5e3, "lcp-qp", 10.0),
    ("isotropic", 5e3, "lcp-qp", 20.0),
    ("isotropic", 5e3, "lcp-qp", 5.0),
    ("stiff", 4e6, "none", 20.0),
    ("stiff", 4e6, "none", 5.0),
)
"""Material, Young's modulus [Pa], method and step [ms]; the last two are stiff enough for 4%."""


@dataclass(frozen=True)
class Beam:
    """A beam after its time."""

    material: str
    young: float  # [Pa]
    method: str
    step_ms: float
    tip_x: float  # [m], of the middle of the free end
    tip_y: float
    along: float  # largest ||F e_x||
    strain: float  # largest of any principal stretch, either way
    wobble_x: float  # how far the tip goes to and fro in the second half [mm]
    wobble_y: float
    violation: float  # of 4%, the worst; of those of the material
    inverted: int  # steps with inverted elements


def cells(_: Plan) -> Iterable[Cell]:
    """All."""
    return CELLS


def played(material: str, young: float, method: str, step_ms: float) -> Iterator[Beam]:
    """Play the scene `beam`."""
    step = 1e-3 * step_ms
    scene = scene_of("beam", material=material, young=young, step=step, alpha=ALPHA)
    stage = Stage.opened(scene, find_solver(method))
    rest = stage.problem.rest
    tip = int(np.argmin(np.linalg.norm(rest - rest.max(axis=0) * [1, 0.5, 0.5], axis=1)))
    path, worst, inverted = [], 0.0, 0
    for _ in stage.steps(round(LASTS / step)):
        x = stage.positions
        path.append(x[tip])
        worst = max(worst, float(stage.problem.violations(x).max()))
        inverted += bool(np.any(stretches(stage.problem, x)[:, 2] < 0))
    late = 1e3 * np.ptp(path[len(path) // 2 :], axis=0)
    along = np.linalg.norm(stage.problem.deformation_gradients(x)[:, :, 0], axis=1)
    strain = np.abs(stretches(stage.problem, x) - 1).max()
    given = material, young, method, step_ms, float(path[-1][0]), float(path[-1][1])
    found = float(along.max()), float(strain), float(late[0]), float(late[1])
    yield Beam(*given, *found, worst, inverted)


PART = Part(
    "beams",
    4,
    cells,
    played,
    "The beams of Fig. 2",
    f"Each 1.2 s from rest, damped by masses at {ALPHA:g} / s, limits of 4%; stiff beams have "
    "none, and 4 MPa is what keeps their strain at 4%. The tip is the middle of the free end, at "
    "rest at x = 1; its wobble how far it goes to and fro in the second half. Strain is the "
    "largest of any principal stretch.",
    [
        "material",
        *numbers(("E", "Pa", ".0f")),
        "method",
        *numbers(("step", "ms", "g"), ("tip x", "m", ".3f"), ("tip y", "m", ".3f")),
        *numbers(("‖F e_x‖", "", ".3f"), ("strain", "", ".3f"), ("wobble in x", "mm", ".1f")),
        *numbers(("in y", "mm", ".1f"), ("worst violation", "", ".2g")),
        *numbers(("steps with inverted elements", "", "")),
    ],
)
