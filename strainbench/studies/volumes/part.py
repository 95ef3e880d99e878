"""A part of the study: cells that are measured one by one, and the table of their rows."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import pandas as pd

from strainbench.document import Column, Table
from strainbench.scenario.registry import find_scenario
from strainbench.scenario.volume import VolumeScenario

Cell = tuple[Any, ...]


@dataclass(frozen=True)
class Plan:
    """What is asked of the study: steps [s], and cells across the beam."""

    steps: Sequence[float] = (5e-3, 20e-3)
    resolutions: Sequence[int] = (2,)


@dataclass(frozen=True)
class Part:
    """A table of the study.

    Parameters
    ----------
    name : of its CSV file
    cells : of a plan, as values of the first columns, `keys` of them
    rows : dataclasses, of a cell
    header : a column for each field of a row
    """

    name: str
    keys: int
    cells: Callable[[Plan], Iterable[Cell]]
    rows: Callable[..., Iterable[Any]]
    title: str
    about: str
    header: Sequence[str | Column]
    nothing: str = ""

    def table(self, frame: pd.DataFrame) -> Table:
        """The rows as they are shown."""
        lines = Table.of(frame).lines
        return Table(self.title, self.header, lines, about=self.about, nothing=self.nothing)


def numbers(*columns: tuple[str, str, str]) -> list[Column]:
    """Columns of numbers: name, unit and format."""
    return [Column(name, unit, form, right=True) for name, unit, form in columns]


def scene_of(name: str, **settings: object) -> VolumeScenario:
    """A scene of volumes."""
    scene = find_scenario(name)(**settings)  # type: ignore[arg-type]
    assert isinstance(scene, VolumeScenario)
    return scene
