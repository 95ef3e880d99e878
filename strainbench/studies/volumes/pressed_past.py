"""The finger pressed past what its limits allow: who says that no step is left."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import product

from strainbench.studies.volumes.part import Cell, Part, Plan, numbers
from strainbench.studies.volumes.press import pressed

DEPTHS = (0.5, 1.0, 1.5, 2.0, 2.5)  # [mm]
METHODS, PRESSES = ("lcp-pgs", "lcp-qp"), ("side", "tip")


@dataclass(frozen=True)
class Past:
    """A method at a depth."""

    press: str
    method: str
    depth_mm: float
    force: float  # [N]
    violation: float
    converged: str
    ended: str


def cells(_: Plan) -> Iterable[Cell]:
    """Presses and methods."""
    return product(PRESSES, METHODS)


def past(press: str, method: str) -> Iterator[Past]:
    """Rows at depths, without friction, which lcp-qp does not take."""
    for row in pressed(press, "anisotropic", 0.0, DEPTHS, method):
        found = row.depth_mm, row.force, row.violation, row.converged, row.ended
        yield Past(press, method, *found)


PART = Part(
    "past",
    2,
    cells,
    past,
    "Limits pressed past what they allow",
    "The finger with limits by axis and without friction, driven to 2.5 mm. Where no step is "
    "within the linearised limits, the interior point says so and ends; sweeps go on, "
    "unconverged or beyond the limits themselves, and their force means nothing.",
    [
        *("press", "method"),
        *numbers(("depth", "mm", ".3g"), ("force", "N", ".3g"), ("violation", "", ".2g")),
        *("converged", "ended by"),
    ],
)
