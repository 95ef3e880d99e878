"""How far the drapes of a scene's curves of limits are from each other, and from those of another
mesh.

    python -m strainbench.studies.drapes --resolution 15,30 -o results/claims/drapes

finds the rest state of each shape of the scene `drape` without any projection, and writes the
Hausdorff distance of each two surfaces to apart.csv. Surfaces are sampled: distances are certain to
the spacing of the samples, an eighth of a cell.
"""

from __future__ import annotations

from itertools import combinations
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from scipy.spatial import cKDTree

from strainbench.arrays import FloatArray, IntArray
from strainbench.document import Table
from strainbench.files import open_folder
from strainbench.progress import Track, untracked
from strainbench.scenario.registry import find_scenario
from strainbench.studies.program import start, watched, write_table

SHAPES = ("isotropic", "orthotropic", "anisotropic")
HEADER = ("shape", "resolution", "other", "other_resolution", "hausdorff")
EIGHTHS = 8
FILE = "apart.csv"


def samples(positions: FloatArray, triangles: IntArray) -> FloatArray:
    """Points (p, 3) of a surface, an eighth of an edge apart."""
    whole = np.arange(EIGHTHS + 1)
    a, b = (w.ravel() for w in np.meshgrid(whole, whole))
    weights = np.column_stack([a, b, EIGHTHS - a - b])[a + b <= EIGHTHS] / EIGHTHS
    points: FloatArray = np.einsum("wk,ekj->ewj", weights, positions[triangles]).reshape(-1, 3)
    return points


def hausdorff(one: FloatArray, other: FloatArray) -> float:
    """Distance of the point of either set that is farthest from the other set.

    >>> line = np.array([[0.0, 0, 0], [1, 0, 0]])
    >>> hausdorff(line, np.vstack([line, [[1, 2, 0]]]))
    2.0
    """
    there, back = cKDTree(other).query(one)[0], cKDTree(one).query(other)[0]
    return float(max(there.max(), back.max()))


def distances(
    resolutions: list[int], track: Track = untracked
) -> list[tuple[str, int, str, int, float]]:
    """Of each two drapes, the shapes' on all meshes [m].

    Raises
    ------
    ArithmeticError
        If one was not found to the tolerance.
    """
    each = [(shape, n) for n in resolutions for shape in SHAPES]
    drapes = {one: _surface(*one) for one in track(each, "drapes", len(each))}
    return [
        (*one, *other, hausdorff(drapes[one], drapes[other]))
        for one, other in combinations(drapes, 2)
    ]


def _surface(shape: str, resolution: int) -> FloatArray:
    scene = find_scenario("drape")(resolution=resolution, shape=shape)  # type: ignore[call-arg]
    return samples(scene.certified().positions, scene.sheet()[1])  # type: ignore[attr-defined]


def run(
    resolution: Annotated[str, typer.Option(help="cells a side, several by commas")] = "15,30",
    output: Annotated[Path, typer.Option("--output", "-o", help="folder of apart.csv")] = Path(
        "results/local/drapes"
    ),
) -> None:
    """Write the distances of the drapes of a scene's curves."""
    words = resolution.split(",")
    if not all(word.isdecimal() for word in words):
        raise SystemExit(
            f"--resolution {resolution}: whole numbers with commas, such as 15,30, are valid"
        )
    try:
        open_folder(output, "-o")
        found = distances([int(word) for word in words], watched)
    except (ValueError, ArithmeticError) as error:
        raise SystemExit(f"strainbench.studies.drapes: {error}") from None
    write_table(output / FILE, "drapes", "Distances of drapes", Table("", list(HEADER), found))
    print(f"wrote {output / FILE}")


if __name__ == "__main__":
    start(run)
