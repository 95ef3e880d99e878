"""Small pictures of the scenes, for a table of them: `python -m strainbench.render.thumbnails`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from matplotlib import colormaps
from PIL import Image

from strainbench.bench.plan import plan_one
from strainbench.bench.records import open_folder
from strainbench.render.camera import Camera
from strainbench.render.film import Film, shoot
from strainbench.render.picture import MAP, colour_top
from strainbench.render.stage import Stage
from strainbench.scenario.registry import list_scenarios

SIZE, SAMPLES, COLOURS = (240, 180), 4, 255
FOLDER = Path("results/thumbnails")
SOLVER = "newton-ipm"


@dataclass(frozen=True)
class Shot:
    """A frame of a scene in which one sees what it is about."""

    settings: Sequence[str] = ("resolution=12",)
    steps: int | None = None  # None is as many as a run takes
    camera: Camera = field(default_factory=Camera)
    solver: str = SOLVER


SHOTS = {
    "beam": Shot(("resolution=2", "step=0.02"), 25, Camera(20.0, 15.0), "lcp-qp"),
    "beam-compress": Shot(("resolution=2", "alpha=2"), 60, Camera(30.0, 15.0), "lcp-qp"),
    "chainmail": Shot(("resolution=14",), 18),
    "collision": Shot(("resolution=20",), 28),
    "drape": Shot(("resolution=20",), 1, Camera(20.0, 10.0)),
    "finger": Shot(("press=side", "depth=0.001"), 10, Camera(20.0, 10.0), "lcp-pgs"),
    "flag": Shot(("resolution=14",), 60),
    "garment": Shot(("resolution=8",), 15),
    "spike": Shot(("resolution=20",), 75),
    "sphere-drop": Shot(("resolution=20",), 36),
    "stretch-square": Shot(("resolution=10",), 1, Camera(0.0, 0.0)),
    "swing": Shot(("resolution=16",), 15),
    "twist": Shot(("resolution=12", "limit=10%", "turn_rate=300"), 10),
}
"""Of our scenes; another one is shown after as many steps as a run of it takes."""


def thumbnail(film: Film, camera: Camera) -> Image.Image:
    """The last state of a film, in colours of its own and without words."""
    last = replace(film, states=film.states[-1:])
    share = last.strains[0] / colour_top(last)
    colours = colormaps[MAP](np.clip(share, 0, 1))[:, :3]
    pixels = Stage(last, camera, SIZE).draw(0, colours, SAMPLES)
    method = Image.Quantize.MAXCOVERAGE
    return Image.fromarray(pixels).quantize(COLOURS, method, dither=Image.Dither.NONE)


def take(name: str, folder: Path) -> Path:
    """Play a scene and write its thumbnail; ValueError where it cannot be played to the end."""
    shot = SHOTS.get(name, Shot())
    steps = shot.steps
    if steps is None:
        steps = plan_one(name, shot.solver, shot.settings, 1, 1e-6).scenario.scenario().usual_steps
    film = shoot(plan_one(name, shot.solver, shot.settings, steps, 1e-6), every=steps)
    if film.stopped:
        raise ValueError(film.stopped)
    path = folder / f"{name}.png"
    thumbnail(film, shot.camera).save(path, optimize=True)
    return path


def main(
    scenes: Annotated[list[str] | None, typer.Argument(help="all of ours by default")] = None,
    output: Annotated[Path, typer.Option("--output", "-o", help="folder")] = FOLDER,
) -> None:
    """Write a thumbnail of each scene."""
    try:
        open_folder(output, "-o")
        for name in scenes or [scene.name for scene in list_scenarios()]:
            typer.echo(f"wrote {take(name, output)}")
    except ValueError as error:
        raise SystemExit(f"strainbench.render.thumbnails: {error}") from None


if __name__ == "__main__":
    typer.run(main)
