"""Parts of findings that several claims share."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import pandas as pd

from strainbench.report.claims.evidence import Evidence, NotThereError
from strainbench.report.energy import unsteadiness


def or_missing(measure: Callable[..., str], *seen: Evidence) -> str:
    """What it says of the evidence, or which of its numbers are missing."""
    try:
        return measure(*seen)
    except NotThereError as missing:
        return f"Not measured yet: {missing}."


def listed(values: Iterable[float], form: str = ".1f") -> str:
    """Numbers of one precision, with commas; one that rounds to nothing has no sign.

    >>> listed([-0.04, 1, 2.25])
    '0.0, 1.0, 2.2'
    """
    return ", ".join(f"{value:z{form}}" for value in values)


def fraction(step: float) -> str:
    """A time step in words.

    >>> fraction(0.0166666667)
    '1/60'
    """
    return f"1/{1 / step:.0f}"


def unsteady(
    seen: Evidence, folder: str, until: float, **wanted: object
) -> tuple[float, float, int]:
    """Rises, roughness [mJ] and turns of a cell's energy up to a time [s]; see `unsteadiness`."""
    curve = seen.energy(folder, **wanted)
    return unsteadiness(curve["energy"][curve["time"] <= until + 1e-6].to_numpy())


def in_steps(seen: Evidence, folder: str, names: tuple[str, ...], **wanted: object) -> pd.DataFrame:
    """Columns of the steps of the newest such cell, a row a step."""
    cell = seen.cells(folder, **wanted).tail(1)
    columns = {name: seen.steps(folder, cell, name) for name in ("step", *names)}
    return pd.DataFrame(columns).drop_duplicates("step")


def highest(values: Iterable[float]) -> float:
    """The largest that is a number."""
    return float(pd.Series(list(values), dtype=float).max())
