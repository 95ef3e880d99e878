"""The finger pressed against a table (Hernandez et al. 2013, Fig. 3): forces, and what they cost.

Part of `strainbench.studies.volumes`. A press is played once; each row is the step at which it has
come to a depth.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import product

from strainbench.arrays import FloatArray
from strainbench.document import Column
from strainbench.scenario.scenario import StepReport
from strainbench.scenario.stage import Stage, StageError
from strainbench.solver.registry import find_solver
from strainbench.solver.solver import Solver
from strainbench.studies.volumes.part import Cell, Part, Plan, numbers, scene_of

PRESSES, MATERIALS = ("flat", "side", "tip"), ("anisotropic", "isotropic")
DEPTHS = (0.5, 1.0, 1.5, 2.0)  # [mm]
FRICTIONS = (0.0, 0.25, 1.0)  # beside the scene's own .5, on the side
STEEP = (1.0, 1.1)  # [mm], theirs
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


class Pressing:
    """The scene `finger` as a solver plays it."""

    def __init__(self, solver: Solver, **settings: object) -> None:
        self.scene = scene_of("finger", **settings)
        self.stage = Stage.opened(self.scene, solver)
        self._details = dict[str, float]()

    def steps(self) -> Iterator[StepReport]:
        """All, until there is none within the limits."""
        return self.stage.steps(self.scene.usual_steps, self._project)

    def _project(self, target: FloatArray) -> FloatArray:
        found = self.stage.solve(target)
        self._details.update(found.solution.details, sweeps=found.solution.iterations)
        return self.stage.accept(found)

    @property
    def found(self) -> tuple[float, int, int, int, float, float, str]:
        """Of the last step, what `Press` has from its force on."""
        details = self._details
        return (
            details["push"] / self.scene.step**2,
            int(details["rows"]),
            int(details["contacts"]),
            int(details["sweeps"]),
            details["cone_error"],
            float(self.stage.problem.violations(self.stage.positions).max()),
            "no" if details["unconverged"] else "yes",
        )


def cells(_: Plan) -> Iterable[Cell]:
    """Presses and limits with the scene's friction, and other frictions on the side."""
    usual = ((*pair, 0.5) for pair in product(PRESSES, MATERIALS))
    return (*usual, *(("side", "anisotropic", friction) for friction in FRICTIONS))


def rows_of(press: str, material: str, friction: float) -> Iterator[Press]:
    """The depths of the table."""
    return pressed(press, material, friction, DEPTHS if friction == 0.5 else STEEP)


def pressed(
    press: str, material: str, friction: float, depths: Sequence[float], method: str = "lcp-pgs"
) -> Iterator[Press]:
    """Rows at depths [mm], of one play; the last one says why it ends, if it comes to no answer."""
    given: dict[str, object] = {"press": press, "material": material, "friction": friction}
    pressing = Pressing(find_solver(method), depth=1e-3 * max(depths), **given)
    try:
        for report in pressing.steps():
            for depth in depths:
                if abs(report.time * SPEED - depth) <= 1e-6 * depth:
                    yield Press(press, material, friction, depth, *pressing.found)
    except StageError as error:  # no step is within the limits
        depth = SPEED * pressing.scene.step * pressing.stage.step
        yield Press(press, material, friction, depth, *pressing.found, str(error))


FOUND: tuple[str | Column, ...] = (
    *numbers(("force", "N", ".3g"), ("rows", "", ""), ("contacts", "", ""), ("sweeps", "", "")),
    *numbers(("cone error", "", ".1g"), ("violation", "", ".2g")),
    "converged",
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
    "may be left, and the force grows with the sweeps that are allowed: rigid, it says. Friction "
    "makes it rigid sooner: what a tenth of a millimetre more adds, where it is 1, says how much "
    "such a force is worth on another mesh, or with another bone. The violation is that of the "
    "limits themselves, after linearised steps.",
    [
        "press",
        "limits",
        *numbers(("friction", "", "g"), ("depth", "mm", ".3g")),
        *FOUND,
        "ended by",
    ],
)
