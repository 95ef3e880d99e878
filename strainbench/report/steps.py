"""The rows of steps.csv that the rows of runs.csv shown are about."""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from strainbench.bench.columns import STEP_COLUMNS
from strainbench.bench.records import latest_steps


def newest_steps(folder: Path, runs: pd.DataFrame) -> pd.DataFrame:
    """The projections of each cell's newest run, as text; of earlier runs none, even if longer."""
    steps = pd.DataFrame(latest_steps(folder), columns=list(STEP_COLUMNS))
    return steps[steps["cell"].isin(runs["cell"])]
