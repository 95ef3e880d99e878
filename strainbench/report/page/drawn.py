"""The charts as they stand on the page: specified for a wide window and for a phone."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import pandas as pd

from strainbench.progress import Track
from strainbench.report.charts import Chart, Makers, Target, convergence
from strainbench.report.page.races import CASE

ACCURACIES = ("distance", "gap", "violation")
LEAST = 1.0  # seconds of play: less tells nothing of energies
TARGETS = {"page": Target.PAGE, "phone": Target.PHONE}
KEYS = {"scene": "scene", "mode": "mode", "bound": "limit", "aim": "aim", "mesh": "size"}
"""What the page calls the columns of a case."""
Case = tuple[str, ...]
Draw = Callable[[Target], Sequence[Chart]]


@dataclass(frozen=True)
class Drawn:
    """A chart on the page.

    Parameters
    ----------
    about : the scene, mode, limit, tolerance and size that it shows, as far as it shows one alone
    specs : by the target's name
    """

    name: str
    caption: str
    about: Mapping[str, str]
    specs: Mapping[str, object]


def drawings_of(
    folder: Path, runs: pd.DataFrame, make: Makers, track: Track
) -> dict[str, list[Drawn]]:
    """The charts of each section.

    Parameters
    ----------
    runs : with what `with_cases` adds
    """
    ways: list[tuple[str, str, Draw]] = [
        *(("speed", against, partial(_against, make, against)) for against in ACCURACIES),
        ("profile", "", make.profile),
        ("profile", "", make.growth),
        ("failures", "", lambda target: [c for own in make.sweep(target).values() for c in own]),
        ("convergence", "", partial(_convergence, folder)),
        ("convergence", "", lambda target: make.energy(target, LEAST)),
    ]
    cases = dict(zip(runs["cell"], zip(*(runs[name] for name in CASE), strict=True), strict=True))
    found: dict[str, list[Drawn]] = {}
    for section, against, draw in track(ways, "charts", len(ways)):
        found.setdefault(section, []).extend(_drawn(draw, cases, against))
    return found


def _against(make: Makers, against: str, target: Target) -> list[Chart]:
    return make.speed(target, against)


def _drawn(draw: Draw, cases: Mapping[str, Case], against: str) -> Iterator[Drawn]:
    """Charts for each target, with what they are about."""
    about = {"against": against} if against else {}
    several = [draw(target) for target in TARGETS.values()]
    for page, *more in zip(*several, strict=True):
        values = zip(*(cases[cell] for cell in _cells(page.spec)), strict=True)
        alone = {
            KEYS[name]: v[0] for name, v in zip(CASE, values, strict=False) if len(set(v)) == 1
        }
        specs = {
            name: _sharing(chart.spec) for name, chart in zip(TARGETS, [page, *more], strict=True)
        }
        yield Drawn(page.name, page.caption, alone | about, specs)


def _sharing(spec: Mapping[str, Any]) -> dict[str, Any]:
    """The same with rows that several layers have written once."""
    every = [layer["data"]["values"] for layer in spec["layer"]]
    names = {id(rows): str(k) for k, rows in enumerate(every)}
    layers = [
        layer | {"data": {"name": names[id(rows)]}}
        for layer, rows in zip(spec["layer"], every, strict=True)
    ]
    return {**spec, "layer": layers, "datasets": {names[id(rows)]: rows for rows in every}}


def _cells(spec: Mapping[str, Any]) -> set[str]:
    """Those that a chart's data name."""
    rows = [row for layer in spec["layer"] for row in layer["data"]["values"]]
    return {row["cell"] for row in rows if "cell" in row}


def _convergence(folder: Path, target: Target) -> list[Chart]:
    """Of what `strainbench converge` wrote into the same folder."""
    path = folder / "convergence.csv"
    if not path.exists():
        return []
    table = pd.read_csv(path)
    table["distance_mm"] = 1000 * table["distance"]
    return [chart for chart in convergence(table, target) if "-seconds" in chart.name]
