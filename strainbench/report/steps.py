"""The rows of steps.csv that the newest rows of runs.csv are about."""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from strainbench.records import STEP_COLUMNS, STEPS, read_rows


def newest_steps(folder: Path, runs: pd.DataFrame) -> pd.DataFrame:
    """The projections of each cell's newest run, as text; of earlier runs none, even if longer."""
    steps = pd.DataFrame(read_rows(folder / STEPS, STEP_COLUMNS), columns=list(STEP_COLUMNS))
    counts = runs.set_index("cell")["projections"]
    left = steps.groupby("cell").cumcount(ascending=False)
    count = steps["cell"].map(counts[~counts.index.duplicated(keep="last")])
    known = steps["cell"].isin(counts.index)
    return steps[known & ((left < count) | count.isna())]
