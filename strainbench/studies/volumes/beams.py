"""The beams of Fig. 2: where they come to, and how they wobble."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from strainbench.scenario.stage import Stage
from strainbench.solver.registry import find_solver
from strainbench.studies.volumes.march import stretches
from strainbench.studies.volumes.part import Cell, Part, Plan, numbers, scene_of

LASTS, TO_REST = 1.2, 4.0  # [s]
CREEPS = 6.0  # [1/s] by which a beam is damped to come to rest
SOFTER = (8e4, 1e5, 1.2e5, 1.5e5)  # [Pa]
CELLS = (
    ("stiff", 2e5, "none", 20.0, CREEPS),
    *(("stiff", young, "none", 20.0, CREEPS) for young in SOFTER),
    ("stiff", 2e5, "none", 20.0, 2.0),
    ("anisotropic", 5e3, "lcp-qp", 20.0, 2.0),
    ("anisotropic", 5e3, "lcp-qp", 10.0, 2.0),
    ("isotropic", 5e3, "lcp-qp", 20.0, 2.0),
    ("isotropic", 5e3, "sequential-cuts", 20.0, 2.0),
    ("isotropic", 5e3, "sequential-cuts", 10.0, 2.0),
    ("stiff", 4e6, "none", 20.0, 2.0),
    ("stiff", 4e6, "none", 5.0, 2.0),
)
"""Material, Young's modulus [Pa], method, step [ms] and damping [1/s]; 4 MPa keep to 4%."""


@dataclass(frozen=True)
class Beam:
    """A beam after its time."""

    material: str
    young: float  # [Pa]
    method: str
    step_ms: float
    alpha: float  # [1/s]
    tip_x: float  # [m], of the middle of the free end
    tip_y: float
    along: float  # largest ||F e_x||
    strain: float  # largest of any principal stretch, either way
    wobble: float  # how much the length of the centre line varies in the second half [mm]
    violation: float  # of 4%, the worst; of those of the material
    inverted: int  # steps with inverted elements


def cells(_: Plan) -> Iterable[Cell]:
    """All."""
    return CELLS


def played(
    material: str, young: float, method: str, step_ms: float, alpha: float
) -> Iterator[Beam]:
    """Play the scene `beam`."""
    step = 1e-3 * step_ms
    scene = scene_of("beam", material=material, young=young, step=step, alpha=alpha)
    stage = Stage.opened(scene, find_solver(method))
    rest = stage.problem.rest
    centre = np.flatnonzero(np.all(np.abs(rest[:, 1:] - 0.5 * rest.max(axis=0)[1:]) < 1e-9, axis=1))
    centre = centre[np.argsort(rest[centre, 0])]
    lengths, worst, inverted = [], 0.0, 0
    lasts = TO_REST if alpha == CREEPS else LASTS
    for _ in stage.steps(round(lasts / step)):
        x = stage.positions
        lengths.append(np.linalg.norm(np.diff(x[centre], axis=0), axis=1).sum())
        worst = max(worst, float(stage.problem.violations(x).max()))
        inverted += bool(np.any(stretches(stage.problem, x)[:, 2] < 0))
    along = np.linalg.norm(stage.problem.deformation_gradients(x)[:, :, 0], axis=1)
    yield Beam(
        material,
        young,
        method,
        step_ms,
        alpha,
        tip_x=float(x[centre[-1], 0]),
        tip_y=float(x[centre[-1], 1]),
        along=float(along.max()),
        strain=float(np.abs(stretches(stage.problem, x) - 1).max()),
        wobble=float(1e3 * np.ptp(lengths[len(lengths) // 2 :])),
        violation=worst,
        inverted=inverted,
    )


PART = Part(
    "beams",
    5,
    cells,
    played,
    "The beams of Fig. 2",
    "Each 1.2 s from rest, damped by masses, those that are damped to come to rest 4 s; limits of "
    "4%, but stiff beams have none, and 4 MPa is what keeps their strain below 4%. The tip is the "
    "middle of the free end, at first at (1, .1); the wobble is how much the length of the centre "
    "line varies in the second half. Strain is the largest of any principal stretch, at the end.",
    [
        "material",
        *numbers(("E", "Pa", ".0f")),
        "method",
        *numbers(("step", "ms", "g"), ("damping", "1/s", "g"), ("tip x", "m", ".3f")),
        *numbers(("tip y", "m", ".3f"), ("‖F e_x‖", "", ".3f"), ("strain", "", ".3f")),
        *numbers(("wobble", "mm", ".1f"), ("worst violation", "", ".2g")),
        *numbers(("steps with inverted elements", "", "")),
    ],
)
