"""The cloth at the projection that failed, with a ring about the element in question."""

from __future__ import annotations

from pathlib import Path

import matplotlib.image as image
import numpy as np

from strainbench.bench.cell import Cell
from strainbench.render.film import Film, State
from strainbench.render.picture import LIMIT_COLOUR, Picture
from strainbench.studies.explain.place import place
from strainbench.studies.explain.replay import Replay

RING = 18.0  # points across


def draw(cell: Cell, found: Replay, path: Path) -> Path:
    """Write the picture, and return its path."""
    assert found.problem is not None
    positions = found.problem.target if found.positions is None else found.positions
    element = place(found.problem, positions, str(found.row["failure"])).element
    step = int(str(found.step.get("step", found.row["failure_step"]) or 0))
    scene = f"{cell.scenario.label}: {found.row['failure'] or 'no failure'}"
    told = cell.solver.label if found.positions is not None else "the candidate, without answer"
    film = Film(scene, told, found.problem, [State(step, None, positions)], None)
    picture = Picture(film)
    centre = positions[found.problem.elements[element]].mean(axis=0)
    x, y, _ = picture.camera.view(centre[None])[0]
    picture.ax.scatter([x], [y], s=RING**2, facecolors="none", edgecolors=LIMIT_COLOUR, lw=1.6)
    image.imsave(path, np.ascontiguousarray(picture.draw(0)))
    return path
