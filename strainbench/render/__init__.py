"""Pictures, animations and mesh series of a scene, and polar plots of its limits."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from shutil import which
from tempfile import TemporaryDirectory

import numpy as np
from PIL import Image

from strainbench.bench.plan import plan_one
from strainbench.bench.records import open_folder
from strainbench.options import shown
from strainbench.render.animation import write_gif, write_mp4
from strainbench.render.camera import Camera
from strainbench.render.export import MESH_FORMATS, write_meshes
from strainbench.render.film import (
    Film,
    Track,
    shoot,
    untracked,
)
from strainbench.render.picture import DPI, Picture

FORMATS = ("png", "gif", "mp4", *MESH_FORMATS)


def parse_formats(text: str) -> list[str]:
    """The formats of a comma-separated list; ValueError names one that there is not."""
    formats = list(dict.fromkeys(text.split(",")))
    for word in formats:
        if word not in FORMATS:
            valid = f"valid are {', '.join(FORMATS)}, with commas"
            raise ValueError(f"--format {shown(word)}: {valid}")
    if formats == ["mp4"] and not which("ffmpeg"):
        others = ", ".join(f for f in FORMATS if f != "mp4")
        raise ValueError(f"--format mp4: it needs ffmpeg, not on the path; valid are {others}")
    return formats


def parse_scale(text: str) -> float:
    """A strain such as 5% or 0.05, above 0."""
    try:
        top = float(text[:-1]) / 100 if text.endswith("%") else float(text)
    except ValueError:
        top = float("nan")
    if not 0 < top < float("inf"):
        raise ValueError(f"--scale {shown(text)}: a strain above 0 is valid, such as 5% or 0.05")
    if top >= 1 and not text.endswith("%"):
        meant = f"{text}% is valid, or {100 * top:g}% if it is meant"
        raise ValueError(f"--scale {text}: that is a strain of {100 * top:g}%; {meant}")
    return top


def parse_camera(text: str) -> Camera:
    """Two angles in degrees with a comma."""
    try:
        azimuth, elevation = (float(word) for word in text.split(","))
    except ValueError:
        azimuth = elevation = float("nan")
    if not (np.isfinite(azimuth) and abs(elevation) <= 90):
        raise ValueError(
            f"--camera {shown(text)}: AZIMUTH,ELEVATION in degrees is valid, such as 30,32"
        )
    return Camera(azimuth, elevation)


def render(
    scenario: str,
    solver: str,
    settings: Sequence[str],
    steps: int,
    every: int,
    formats: str,
    folder: Path,
    camera: Camera | None = None,
    top: float | None = None,
    tolerance: float = 1e-6,
    track: Track = untracked,
) -> list[str]:
    """Play a scene with one solver and write it down; return a line for each thing written.

    Parameters
    ----------
    formats : of FORMATS, with commas
    top : strain at the end of the colour scale, the same for every state; None is from the data

    Raises
    ------
    ValueError
        One line that names the wrong word and what is valid.
    """
    kinds = parse_formats(formats)
    cell = plan_one(scenario, solver, settings, steps, tolerance)
    if every < 1:
        raise ValueError(f"--every {every}: a whole number above 0 is valid")
    open_folder(folder, "-o")
    film = shoot(cell, every, track)
    lines = [film.stopped] if film.stopped else []
    return lines + write_film(film, kinds, folder, camera, top, track)


def write_film(
    film: Film,
    kinds: Sequence[str],
    folder: Path,
    camera: Camera | None = None,
    top: float | None = None,
    track: Track = untracked,
) -> list[str]:
    """Write a film in each of `kinds` to `folder`; return a line for each."""
    lines = []
    digits = max(4, len(str(film.states[-1].step)))
    for kind in [k for k in kinds if k in MESH_FORMATS]:
        paths = write_meshes(film, kind, folder, track, digits)
        lines.append(_wrote(paths[: len(film.states)]))
        lines += [f"wrote {path}" for path in paths[len(film.states) :]]
    if not {"png", "gif", "mp4"} & set(kinds):
        return lines
    with TemporaryDirectory() as scratch:
        pictures = draw_all(film, folder if "png" in kinds else Path(scratch), camera, top, track)
        if "png" in kinds:
            lines.append(_wrote(pictures))
        if "gif" in kinds:
            path = write_gif(folder / "animation.gif", pictures, film.interval, track)
            lines.append(f"wrote {path}")
        if "mp4" in kinds:
            video = write_mp4(folder / "animation.mp4", pictures, film.interval, track)
            lines.append(f"wrote {video}" if video else "left out mp4: no ffmpeg on the path")
    return lines


def draw_all(
    film: Film,
    folder: Path,
    camera: Camera | None = None,
    top: float | None = None,
    track: Track = untracked,
) -> list[Path]:
    """One PNG a state, named by its step."""
    picture = Picture(film, camera, top)
    digits = max(4, len(str(film.states[-1].step)))
    paths = []
    for index in track(range(len(film.states)), "drawing", len(film.states)):
        path = folder / f"frame-{film.states[index].step:0{digits}d}.png"
        Image.fromarray(picture.draw(index)).save(path, dpi=(DPI, DPI))
        paths.append(path)
    return paths


def _wrote(paths: Sequence[Path]) -> str:
    """One line for a series of files."""
    if len(paths) == 1:
        return f"wrote {paths[0]}"
    return f"wrote {len(paths)} files, {paths[0]} to {paths[-1].name}"


__all__ = ["FORMATS", "Camera", "Film", "Picture", "render", "write_film"]
