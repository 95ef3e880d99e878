"""The charts as they stand on the page: specified for a wide window and for a phone."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import pandas as pd

from strainbench.progress import Track
from strainbench.report.charts import (
    Chart,
    Target,
    convergence,
    energy,
    growth,
    profiles,
    sweep,
    work_precision,
)
from strainbench.report.page.races import CASE

ACCURACIES = ("distance", "gap", "violation")
PANEL = ["scenario", "mode", "exact", "steps_asked", "threads", "mesh", "bound"]
LEAST = 1.0  # seconds of play: less tells nothing of energies
MOST, FEW = 20, 12  # panels, each twice 50 kB and twice a tenth of a second
TARGETS = {"page": Target.PAGE, "phone": Target.PHONE}
KEYS = {"scene": "scene", "mode": "mode", "bound": "limit", "aim": "aim", "mesh": "size"}
"""What the page calls the columns of a case."""


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


def drawn(
    draw: Callable[[Target], Sequence[Chart]], runs: pd.DataFrame, **about: str
) -> Iterator[Drawn]:
    """Charts of rows with what `with_cases` adds."""
    cases = runs.set_index("cell")[list(CASE)]
    several = {name: draw(target) for name, target in TARGETS.items()}
    for page, phone in zip(*several.values(), strict=True):
        shown = cases.loc[list(_cells(page.spec))]
        alone = {KEYS[name]: shown[name].iloc[0] for name in CASE if shown[name].nunique() == 1}
        specs = {"page": page.spec, "phone": phone.spec}
        yield Drawn(page.name, page.caption, alone | about, specs)


def _cells(spec: object) -> set[str]:
    """Those that a chart's data name."""
    found: set[str] = set()

    def read(pairs: dict[str, object]) -> None:
        if isinstance(cell := pairs.get("cell"), str):
            found.add(cell)

    json.loads(json.dumps(spec), object_hook=read)
    return found


def speed(runs: pd.DataFrame, track: Track) -> tuple[list[Drawn], str]:
    """Time against each accuracy, the reader chooses; what is left out of a large folder."""
    number = runs.groupby(PANEL, dropna=False).ngroups
    kept = runs if number <= MOST else _largest(runs, MOST)
    against = ACCURACIES if number <= FEW else ACCURACIES[:1]
    said = []
    if number > MOST:
        said.append(f"The {MOST} cases with most cells are drawn, of {number}; all stand below.")
    if number > FEW:
        said.append(f"Gap and violation are drawn where there are at most {FEW} cases.")
    charts = [
        chart
        for measure in track(against, "charts", len(against))
        for chart in drawn(partial(work_precision, kept, against=measure), kept, against=measure)
    ]
    return charts, " ".join(said)


def _largest(runs: pd.DataFrame, number: int) -> pd.DataFrame:
    """The rows of so many panels, those with most cells."""
    panel = runs.groupby(PANEL, dropna=False, sort=False).ngroup()
    return runs[panel.isin(panel.value_counts().index[:number])]


def others(folder: Path, runs: pd.DataFrame, steps: pd.DataFrame) -> dict[str, list[Drawn]]:
    """The charts of further sections."""
    kept = _largest(runs, MOST)
    kinds: dict[str, list[Callable[[Target], Sequence[Chart]]]] = {
        "profile": [partial(profiles, runs, steps), partial(growth, kept)],
        "failures": [lambda target: [c for own in sweep(kept, target).values() for c in own]],
        "convergence": [
            partial(_convergence, folder),
            lambda target: energy(folder, kept, target, LEAST),
        ],
    }
    return {
        section: [chart for draw in draws for chart in drawn(draw, runs)]
        for section, draws in kinds.items()
    }


def _convergence(folder: Path, target: Target) -> list[Chart]:
    """Of what `strainbench converge` wrote into the same folder."""
    path = folder / "convergence.csv"
    if not path.exists():
        return []
    table = pd.read_csv(path)
    table["distance_mm"] = 1000 * table["distance"]
    return [chart for chart in convergence(table, target) if "-seconds" in chart.name]
