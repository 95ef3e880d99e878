"""The rows of a results folder, as tables and charts take them."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
from pandas.api.types import is_numeric_dtype

from strainbench.bench.columns import WORDS
from strainbench.bench.records import RecordsError
from strainbench.report.drift import with_drift
from strainbench.report.measures import measured
from strainbench.report.names import with_names
from strainbench.report.steps import newest_steps
from strainbench.report.versions import shown_runs


def load_runs(folder: Path) -> pd.DataFrame:
    """The row of each cell that is shown, numbers as numbers, with what it comes to.

    See `strainbench.report.versions`, `names` and `measures`.

    Raises
    ------
    RecordsError
        If there is nothing to report, or the records are damaged.
    """
    rows = shown_runs(folder)
    if not rows:
        raise RecordsError(f"{folder} holds no results: `strainbench run ... --results {folder}`")
    runs = pd.DataFrame(rows, dtype=object)
    for column in runs.columns.difference([*WORDS, "older"]):
        runs[column] = pd.to_numeric(runs[column])
    named = with_names(runs)
    steps = newest_steps(folder, named)
    return _compact(with_drift(measured(named, steps), steps))


def _compact(table: pd.DataFrame) -> pd.DataFrame:
    """The same in as few blocks as there are kinds of columns: rows are then taken in a tenth of
    the time."""
    words = table.columns[[not is_numeric_dtype(kind) for kind in table.dtypes]]
    return table.astype(dict.fromkeys(words, object)).copy()
