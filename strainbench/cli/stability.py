"""The verb map: where methods stop working, over two settings."""

from __future__ import annotations

import re
import shlex
import sys
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated

import typer

from strainbench.cli.display import say
from strainbench.cli.interrupt import keeping
from strainbench.cli.options import (
    LOCAL,
    CellSeconds,
    Duration,
    Folder,
    Jobs,
    ManyValues,
    MapSteps,
    Memory,
    OneScenario,
    Solvers,
    Tolerance,
)
from strainbench.cli.run import Display
from strainbench.options import shown

if TYPE_CHECKING:
    from strainbench.bench.cell import Cell

UNITS = {"s": 1.0, "min": 60.0, "h": 3600.0}


def draw_map(
    scenario: OneScenario,
    solver: Solvers,
    x: Annotated[str, typer.Option("--x", help="KEY=FROM..TO or KEY=V1,V2, across")],
    y: Annotated[str, typer.Option("--y", help="the same, upwards")],
    set_: ManyValues = None,
    steps: MapSteps = None,
    duration: Duration = None,
    tolerance: Tolerance = 1e-6,
    time_limit: CellSeconds = 20.0,
    memory_limit: Memory = None,
    budget: Annotated[str, typer.Option("--budget", help="as 90s, 20min, 2h")] = "20min",
    jobs: Jobs = 1,
    results: Folder = LOCAL / "map",
) -> None:
    """Map where methods fail over two settings, refined along the boundaries; resumes."""
    from strainbench.bench.machine import memory_share
    from strainbench.bench.runner import Settings
    from strainbench.studies.stability import measure, parse_axis, sentences, write_map

    across, up = parse_axis("--x", x), parse_axis("--y", y)
    if across.key == up.key:
        raise ValueError(f"--x and --y are both {shown(across.key)}: two settings make a map")
    seconds = parse_budget(budget)
    settings = Settings(results, jobs, memory_limit or memory_share(jobs))

    def planner(words: Sequence[str]) -> list[Cell]:
        both = [*(set_ or []), *words]
        return _cells(scenario, solver, both, steps, duration, tolerance, time_limit)

    with Display(lines=False) as display, keeping(lambda: display.kept(display.finished)):
        found = measure(across, up, planner, settings, seconds, display)
    found.lasts = _lasts(steps, duration, time_limit)
    say(f"{found.counted}; {found.lasts[0].lower()}{found.lasts[1:]}")
    for method in found.spots:
        for sentence in sentences(found, method):
            say(sentence)
    if found.open:
        say(f"the budget of {budget} ended it with {found.open} cells to run; again: it goes on")
    title = f"{scenario}: {across.key} and {up.key}"
    command = shlex.join(["strainbench", *sys.argv[1:]])
    for written in write_map(found, title, command, results):
        say(f"wrote {written}")


def _cells(
    scenario: str,
    solver: list[str],
    words: Sequence[str],
    steps: int | None,
    duration: float | None,
    tolerance: float,
    time_limit: float | None,
) -> list[Cell]:
    """The cells of a point of the map, which end soon after their first failure."""
    from strainbench.bench.plan import plan
    from strainbench.studies.stability import PATIENCE, lasting

    length = (1 if steps is None and duration is None else steps, [tolerance], time_limit, duration)
    cells = plan([scenario], solver, words, "simulate", *length)
    whole = cells if steps or duration else lasting(cells)
    return [replace(cell, patience=PATIENCE) for cell in whole]


def _lasts(steps: int | None, duration: float | None, time_limit: float | None) -> str:
    from strainbench.studies.stability import FEWEST, LONG, PATIENCE

    longest = f"the longer of {LONG:g} s of the scene and {FEWEST} steps"
    counted = f"{steps} step{'s' if steps != 1 else ''}" if steps else longest
    length = f"{duration:g} s of the scene" if duration else counted
    clock = f"; it is out of time after {time_limit:g} s" if time_limit else ""
    return (
        f"A cell lasts {length}, and ends {PATIENCE} steps after limits are first violated{clock}."
    )


def parse_budget(text: str) -> float:
    """Seconds of 90s, 20min or 2h; ValueError for anything else."""
    match = re.fullmatch(r"(\d+(?:\.\d+)?)(s|min|h)", text.strip())
    if not match or float(match[1]) == 0:
        raise ValueError(f"--budget {shown(text)}: 90s, 20min or 2h is valid")
    return float(match[1]) * UNITS[match[2]]
