"""The finger pressed against a table (Hernandez et al. 2013, Fig. 3): forces, and what they cost.

Part of `strainbench.studies.volumes`. A press is played once; each row is the step at which it has
come to a depth.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import product

from strainbench.arrays import FloatArray
from strainbench.scenario.stage import Stage, StageError
from strainbench.solver.registry import find_solver
from strainbench.studies.volumes.part import Cell, Part, Plan, numbers, scene_of

PRESSES, MATERIALS = ("flat", "side", "tip"), ("anisotropic", "isotropic")
DEPTHS = (0.5, 1.0, 1.5, 2.0)  # [mm]
FRICTIONS = (0.0, 0.25, 1.0)  # beside the scene's own .5, on the side to 1 mm
SPEED = 20.0  # [mm/s]


@dataclass(frozen=True)
class Press:
    """A finger at a depth."""

    press: str
    material: str
    friction: float
    depth_mm: float
    force: float  # [N]
    rows: int  # near their limits, contacts among them
    contacts: int  # vertices that the table carries
    sweeps: int  # of all rounds of the step
    cone_error: float
    violation: float
    converged: str  # yes or no
    ended: str = ""  # why it goes no further


def cells(_: Plan) -> Iterable[Cell]:
    """Presses and limits with the scene's friction, and other frictions on the side."""
    usual = ((*pair, 0.5) for pair in product(PRESSES, MATERIALS))
    return (*usual, *(("side", "anisotropic", friction) for friction in FRICTIONS))


def rows_of(press: str, material: str, friction: float) -> Iterator[Press]:
    """The depths of the table."""
    return pressed(press, material, friction, DEPTHS if friction == 0.5 else (1.0,))


def pressed(
    press: str, material: str, friction: float, depths: Sequence[float], method: str = "lcp-pgs"
) -> Iterator[Press]:
    """Rows at depths [mm], of one play; the last one says why it ends, if it comes to no answer."""
    given: dict[str, object] = {"press": press, "material": material, "friction": friction}
    scene = scene_of("finger", depth=1e-3 * max(depths), **given)
    stage, details = Stage.opened(scene, find_solver(method)), dict[str, float]()

    def project(target: FloatArray) -> FloatArray:
        found = stage.solve(target)
        details.update(found.solution.details, sweeps=found.solution.iterations)
        return stage.accept(found)

    def row(depth: float, ended: str = "") -> Press:
        return Press(
            press,
            material,
            friction,
            depth,
            force=details["push"] / scene.step**2,
            rows=int(details["rows"]),
            contacts=int(details["contacts"]),
            sweeps=int(details["sweeps"]),
            cone_error=details["cone_error"],
            violation=float(stage.problem.violations(stage.positions).max()),
            converged="no" if details["unconverged"] else "yes",
            ended=ended,
        )

    try:
        for report in stage.steps(scene.usual_steps, project):
            for depth in depths:
                if abs(report.time * SPEED - depth) <= 1e-6 * depth:
                    yield row(depth)
    except StageError as error:  # no step is within the limits
        yield row(SPEED * scene.step * stage.step, str(error))


COLUMNS = (
    *numbers(
        ("friction", "", "g"), ("depth", "mm", ".3g"), ("force", "N", ".3g"), ("rows", "", "")
    ),
    *numbers(("contacts", "", ""), ("sweeps", "", ""), ("cone error", "", ".1g")),
    *numbers(("violation", "", ".2g")),
)
PART = Part(
    "press",
    3,
    cells,
    rows_of,
    "A finger pressed against a table (Fig. 3)",
    "The scene `finger` by lcp-pgs, steps of 5 ms: the normal force on the table at a depth, with "
    "limits by axis and alike in all. Flat they are one material; on the side and on the tip the "
    "limits by axis soon make it rigid. Where sweeps have not converged no step within the limits "
    "may be left, and the force grows with the sweeps that are allowed: rigid, it says. The "
    "violation is that of the limits themselves, after linearised steps.",
    ["press", "limits", *COLUMNS, "converged", "ended by"],
)
