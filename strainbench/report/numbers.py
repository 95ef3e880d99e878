"""Seconds and distances as text."""

from __future__ import annotations

import pandas as pd


def seconds_text(seconds: float) -> str:
    """Four decimals, or two digits where those would show little; nothing for NaN."""
    return "" if pd.isna(seconds) else f"{seconds:.4f}" if seconds >= 1e-3 else f"{seconds:.2g}"


def distance_text(row: pd.Series) -> str:
    """In mm; where it is below what the reference is certified to, a bound on it."""
    distance, error = 1000 * row["distance_max"], 1000 * row["reference_error_max"]
    if pd.isna(distance):
        return "-"
    return f"<{distance + error:.2g}" if distance < error else f"{distance:.2g}"


def power(value: float) -> str:
    """One digit and a power of ten, as in 3e-9; 0 is 0."""
    return f"{value:.0e}".replace("e-0", "e-").replace("0e+00", "0").replace("e+00", "")
