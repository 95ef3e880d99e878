"""The verbs that draw a scene: render, polar."""

from __future__ import annotations

from strainbench.cli.display import say, tracking
from strainbench.cli.options import (
    DEFAULT_SOLVER,
    LOCAL,
    ChartFile,
    Every,
    OneScenario,
    OneSolver,
    PictureFormats,
    PicturesFolder,
    Scale,
    SomeSolvers,
    Steps,
    StepsToLast,
    Tolerance,
    Values,
    View,
)

PICTURES = LOCAL / "pictures"


def render_scene(
    scenario: OneScenario,
    solver: OneSolver = DEFAULT_SOLVER,
    set_: Values = None,
    steps: Steps = 30,
    every: Every = 1,
    format_: PictureFormats = "png,gif",
    camera: View = "30,32",
    scale: Scale = None,
    tolerance: Tolerance = 1e-6,
    output: PicturesFolder = PICTURES,
) -> None:
    """Play a scene with one solver; write pictures, animations and mesh series."""
    from strainbench.render import parse_camera, parse_scale, render

    top = None if scale is None else parse_scale(scale)
    view = parse_camera(camera)
    settings = set_ or []
    with tracking() as track:
        lines = render(
            scenario, solver, settings, steps, every, format_, output, view, top, tolerance, track
        )
    for line in lines:
        say(line)


def draw_polar(
    scenario: OneScenario,
    solver: SomeSolvers = DEFAULT_SOLVER,
    set_: Values = None,
    steps: StepsToLast = 30,
    tolerance: Tolerance = 1e-6,
    output: ChartFile = PICTURES / "polar.svg",
) -> None:
    """Draw the limits over the material angle, and the strains a scene ends with."""
    from strainbench.render.polar import polar

    with tracking() as track:
        lines = polar(scenario, solver, set_ or [], steps, output, tolerance, track)
    for line in lines:
        say(line)
