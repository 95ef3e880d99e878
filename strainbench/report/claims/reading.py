"""What several claims read: samples of convergence, the tally of random problems, loads."""

from __future__ import annotations

import re
from collections.abc import Sequence

import pandas as pd

from strainbench.report.claims.evidence import Evidence, NotThereError

TALLIED = ("optimal", "feasible", "violated", "no answer", "solved, but violated", "refused")
"""Columns of certificates/tally.md."""
UNLIKE_LOADS = 0.3  # cores


def tally(seen: Evidence) -> pd.DataFrame:
    """How solvers ended on random problems: a row a solver, columns TALLIED."""
    file = seen.root / "certificates" / "tally.md"
    if not file.exists():
        raise NotThereError(f"certificates holds no {file.name}")
    text = file.read_text(encoding="utf-8")
    lines = re.findall(rf"^(\S+)((?: +\d+){{{len(TALLIED)}}})$", text, re.MULTILINE)
    counts = {name: [int(word) for word in words.split()] for name, words in lines}
    return pd.DataFrame.from_dict(counts, orient="index", columns=list(TALLIED))


def seconds_to(seen: Evidence, solver: str, measure: str, level: float) -> float:
    """Of a solver on its projection in `convergence`, until a measure stays at most `level`.

    Raises
    ------
    NotThereError
        If it never does.
    """
    samples = seen.table("convergence", "convergence.csv")
    own = samples[samples["solver"] == solver]
    above = ~(own[measure] <= level)
    after = own[~above[::-1].cummax()[::-1]]
    if after.empty:
        raise NotThereError(f"convergence has no {measure} of {level:g} by {solver}")
    return float(after["seconds"].iloc[0])


def time_over(seen: Evidence, solver: str, other: str, measure: str, level: float) -> float:
    """Seconds that `solver` takes to such a level over those of `other`."""
    return seconds_to(seen, solver, measure, level) / seconds_to(seen, other, measure, level)


def loads(cells: pd.DataFrame | Sequence[pd.Series]) -> str:
    """A word on the other work beside cells, where it was not the same for all."""
    found = pd.to_numeric(pd.DataFrame(cells)["load"]).dropna()
    if found.empty or found.max() - found.min() < UNLIKE_LOADS:
        return ""
    return (
        f" Other work kept {found.min():.2f} to {found.max():.2f} cores busy meanwhile: these "
        "times are weak."
    )
