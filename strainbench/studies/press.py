"""The finger pressed against a table (Hernandez et al. 2013, Fig. 3): forces, and what they cost.

Part of `strainbench.studies.volumes`. A press is played once; each row is the step at which it has
come to a depth.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from itertools import product

from strainbench.arrays import FloatArray
from strainbench.document import Column, Table
from strainbench.scenario.registry import find_scenario
from strainbench.scenario.stage import Stage
from strainbench.scenario.volume import VolumeScenario
from strainbench.solver.registry import find_solver

PRESSES, MATERIALS = ("flat", "side", "tip"), ("anisotropic", "isotropic")
DEPTHS = (0.5, 1.0, 1.5, 2.0)  # [mm]
FRICTIONS = (0.0, 0.25, 1.0)  # beside the scene's own .5, on the side to 1 mm
SPEED = 20.0  # [mm/s]
ABOUT = (
    "The scene `finger` by lcp-pgs, steps of 5 ms: the normal force on the table at a depth, with "
    "limits by axis and alike in all. Flat they are one material; on the side and on the tip the "
    "limits by axis soon make it rigid. Where sweeps have not converged no step within the limits "
    "may be left, and the force grows with the sweeps that are allowed: rigid, it says. The "
    "violation is that of the limits themselves, after linearised steps."
)
COLUMNS = (
    *(("friction", "", "g"), ("depth", "mm", "g"), ("force", "N", ".3g"), ("rows", "", "")),
    *(
        ("contacts", "", ""),
        ("sweeps", "", ""),
        ("cone error", "", ".1g"),
        ("violation", "", ".2g"),
    ),
)


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


def pressed(press: str, material: str, friction: float, depths: Sequence[float]) -> Iterator[Press]:
    """Rows at depths [mm], of one play."""
    given: dict[str, object] = {"press": press, "material": material, "friction": friction}
    given["depth"] = 1e-3 * max(depths)
    scene = find_scenario("finger")(**given)  # type: ignore[arg-type]
    assert isinstance(scene, VolumeScenario)
    stage, details = Stage.opened(scene, find_solver("lcp-pgs")), dict[str, float]()

    def project(target: FloatArray) -> FloatArray:
        found = stage.solve(target)
        details.update(found.solution.details, sweeps=found.solution.iterations)
        return stage.accept(found)

    for report in stage.steps(scene.usual_steps, project):
        for depth in depths:
            if abs(report.time * SPEED - depth) > 1e-6 * depth:
                continue
            yield Press(
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
            )


def presses() -> Iterator[Press]:
    """All rows of the table."""
    for press, material in product(PRESSES, MATERIALS):
        yield from pressed(press, material, 0.5, DEPTHS)
    for friction in FRICTIONS:
        yield from pressed("side", "anisotropic", friction, (1.0,))


def table(rows: Sequence[Press]) -> Table:
    """Forces by press, limits, friction and depth."""
    numbers = [Column(name, unit, form, right=True) for name, unit, form in COLUMNS]
    return Table(
        "A finger pressed against a table (Fig. 3)",
        ["press", "limits", *numbers, "converged"],
        [tuple(asdict(row).values()) for row in rows],
        about=ABOUT,
    )
