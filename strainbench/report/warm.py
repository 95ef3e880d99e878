"""Cold and warm starts of the same method side by side."""

from __future__ import annotations

import json
from dataclasses import dataclass

import pandas as pd

from strainbench.document import Column, Prose, Table
from strainbench.report.measures import COUNT, distance_of

HEADER: tuple[str | Column, ...] = (
    *("scene", "limit", "method", Column("cold over warm", right=True)),
    *(Column(f"{start} iterations", right=True) for start in ("cold", "warm")),
    *(Column(f"{start} distance", "mm", right=True) for start in ("cold", "warm")),
)
EXPLANATION = """\
Ratio of the medians of seconds a projection, cold over warm, where both did all steps within the
limits, else the two outcomes; mean iterations and largest distance to the optimum.
In `simulate` each start has frames of its own, in `replay` both have the same."""
SUFFIX = "-warm"


@dataclass(frozen=True)
class Pair:
    """A cold cell and its warm twin, rows of runs.csv."""

    cold: pd.Series
    warm: pd.Series

    def line(self) -> tuple[str, ...]:
        """The entries of HEADER."""
        cold, warm = self.cold, self.warm
        ratio = cold["time"] / warm["time"]
        useful = all(r["ending"] in COUNT for r in (cold, warm))
        iterations = [_number(r["iterations_mean"]) for r in (cold, warm)]
        scene = (f"{cold['scenario']} {cold['mesh']}", cold["apart"], cold["mode"])
        return (
            ", ".join(filter(None, scene)),
            cold["bound"],
            str(cold["solver"]),
            f"{ratio:.2f}" if useful and ratio > 0 else self._outcomes(),
            *iterations,
            *(distance_of(r) for r in (cold, warm)),
        )

    def _outcomes(self) -> str:
        """What there is instead of a ratio."""
        return " → ".join(str(r["ending"]) for r in (self.cold, self.warm))


def _number(value: float) -> str:
    return "" if pd.isna(value) else f"{value:.4g}"


def starts_warm(run: pd.Series) -> bool:
    """Whether a row's solver started from the frame before."""
    return _warm(run["solver_parameters"])


def _warm(parameters: str) -> bool:
    return json.loads(parameters or "{}").get("warm") is True


def pairs(runs: pd.DataFrame) -> list[Pair]:
    """The cells that ran both ways."""
    same = ["scenario", "mode", "scenario_parameters", "tolerance", "steps_asked"]
    warms = runs["solver_parameters"].map(_warm).astype(bool)
    if not warms.any():
        return []
    cold = {(*r[same], r["solver"]): r for _, r in runs[~warms].iterrows()}
    warm = [r for _, r in runs[warms].iterrows()]
    keys = [(*r[same], r["solver"].removesuffix(SUFFIX)) for r in warm]
    return [Pair(cold[k], r) for k, r in zip(keys, warm, strict=True) if k in cold]


def table(runs: pd.DataFrame) -> Table:
    """A line a pair."""
    lines = [pair.line() for pair in pairs(runs)]
    return Table("Cold and warm starts", HEADER, lines, Prose(EXPLANATION))
