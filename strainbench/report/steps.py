"""The rows of steps.csv that the rows of runs.csv shown are about."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import pandas as pd

from strainbench.bench.columns import STEP_COLUMNS
from strainbench.bench.records import RUNS, STEPS, latest_steps


def newest_steps(folder: Path, runs: pd.DataFrame) -> pd.DataFrame:
    """The projections of each cell's newest run, as text; of earlier runs none, even if longer."""
    about = [(folder / name).stat() for name in (RUNS, STEPS) if (folder / name).exists()]
    steps = _read(folder, tuple((file.st_mtime_ns, file.st_size) for file in about))
    return steps[steps["cell"].isin(runs["cell"])]


@lru_cache(maxsize=2)  # a report asks many times
def _read(folder: Path, state: tuple[tuple[int, int], ...]) -> pd.DataFrame:  # noqa: ARG001
    """All of them, as long as the files are as they were."""
    return pd.DataFrame(latest_steps(folder), columns=list(STEP_COLUMNS), dtype=object)
