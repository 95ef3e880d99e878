"""The records as the page's script reads them: as JSON, each value once."""

from __future__ import annotations

import base64
import gzip
import json
import re
from collections.abc import Iterable, Sequence
from math import isfinite, isnan
from typing import Any

import pandas as pd

from strainbench.bench.columns import RUN_COLUMNS
from strainbench.escape import plain
from strainbench.report.identity import LOOKS, Family, look
from strainbench.report.measures import SIGNS, distance_text, projections
from strainbench.report.numbers import power
from strainbench.report.rows import Row, rows_of

KEPT = 5  # significant digits of a step's numbers
DRAWN = 5  # digits of a fraction in a chart
STEP = ("step", "seconds", "max_violation", "relative_gap", "distance")
"""Numbers of a step that are shown; what it says comes last."""
CELL = {
    "id": "cell",
    "scene": "scene",
    "mode": "mode",
    "limit": "bound",
    "aim": "aim",
    "size": "mesh",
    "method": "solver",
    "ending": "ending",
    "done": "done",
    "planned": "steps_asked",
    "why": "why",
    "time": "time",
    "low": "time_low",
    "high": "time_high",
    "mean": "solve_seconds_mean",
    "gap": "relative_gap_max",
    "violation": "max_violation",
    "older": "older",
    "failure": "failure",
    "since": "failure_step",
}
"""What a cell is called on the page, and its column."""


def as_json(value: object) -> str:
    """To stand in a script element, whatever it holds."""
    text = json.dumps(value, separators=(",", ":"), ensure_ascii=False, allow_nan=False)
    return text.replace("<", r"\u003c")


def packed(value: object, most: int | None = None) -> str:
    """As JSON, but a tenth as long: gzip in base64; of fractions at most so many digits."""
    text = json.dumps(value, separators=(",", ":"), allow_nan=False)
    if most:
        text = re.sub(rf"(\d\.0*(?!0)\d{{{most}}})\d+", r"\1", text)
    return base64.b64encode(gzip.compress(text.encode(), mtime=0)).decode()


def cells(runs: pd.DataFrame, steps: pd.DataFrame) -> list[dict[str, object]]:
    """A record a cell, with what the page says of it in words and the share that is optimal."""
    shares = _optimal(steps)
    return [_cell(row, shares.get(row["cell"], 0)) for row in rows_of(runs)]


def _cell(row: Row, optimal: int) -> dict[str, object]:
    distance, error = 1000 * row["distance_max"], 1000 * row["reference_error_max"]
    asked = row["steps_asked"] * max(1, row["projections"] / max(row["steps_done"], 1))
    found = {name: _value(row[column]) for name, column in CELL.items()}
    return found | {
        "sign": SIGNS[row["ending"]],
        "mm": _value(max(distance, error) if distance < error else distance),
        "distance": distance_text(distance, error),
        "gaps": "" if isnan(row["relative_gap_max"]) else power(row["relative_gap_max"]),
        "violates": "" if isnan(row["max_violation"]) else power(row["max_violation"]),
        "optimal": round(100 * min(1.0, optimal / asked)) if asked == asked else None,
    }


def _optimal(steps: pd.DataFrame) -> dict[str, int]:
    """How many projections of each cell are optimal."""
    counts = steps[steps["outcome"] == "optimal"].groupby("cell").size()
    return {str(cell): int(n) for cell, n in counts.items()}


def records(runs: pd.DataFrame) -> dict[str, Any]:
    """The rows of runs.csv as they are: what all share once, of the rest a list a cell."""
    rows = runs[list(RUN_COLUMNS)]
    values = {name: [_value(v) for v in rows[name]] for name in RUN_COLUMNS}
    same = {name: v[0] for name, v in values.items() if all(each == v[0] for each in v)}
    vary = [name for name in RUN_COLUMNS if name not in same]
    lists = list(zip(*(values[name] for name in vary), strict=True))
    return {"columns": list(RUN_COLUMNS), "same": same, "vary": vary, "rows": lists}


def step_lists(steps: pd.DataFrame) -> dict[str, Any]:
    """Each cell's steps: a list of STEP, whether it had something to do, what was said (a place
    in `said`)."""
    said = list(dict.fromkeys(plain(status) for status in steps["status"]))
    places = {status: k for k, status in enumerate(said)}
    active = set(projections(steps).index)
    lists: dict[str, list[list[object]]] = {}
    numbers = zip(*(steps[name] for name in STEP), strict=True)
    about = zip(steps.index, steps["cell"], steps["status"], numbers, strict=True)
    for index, cell, status, values in about:
        short = [_short(value) for value in values]
        lists.setdefault(cell, []).append([*short, int(index in active), places[plain(status)]])
    return {"said": said, "of": lists}


def _short(value: float) -> object:
    """A number with fewer digits."""
    return _value(float(f"{value:.{KEPT}g}"))


def _value(value: Any) -> object:
    """As JSON has it: no NaN, infinity as a word, whole numbers without a point."""
    if isinstance(value, str):
        return plain(value)
    if value is None or isnan(value):
        return None
    if not isfinite(value):
        return "inf" if value > 0 else "-inf"
    return int(value) if float(value).is_integer() and abs(value) < 1e15 else float(value)


def failed_lists(failed: pd.DataFrame, runs: pd.DataFrame) -> list[dict[str, object]]:
    """What was found on each hard case, with the cell that it is about."""
    lines = failed.to_dict("records")
    return [
        {str(key): _value(value) for key, value in line.items()} | {"cell": runs["cell"][index]}
        for index, line in zip(failed.index, lines, strict=True)
    ]


def looks(method: str) -> dict[str, str]:
    """How a method is drawn, and of which it is a variant."""
    shown = look(method)
    return {"colour": shown.colour, "path": shown.shape, "base": shown.base or method}


def families(methods: Iterable[str]) -> list[tuple[str, list[str]]]:
    """Each with its methods, the registered order first."""
    order = list(LOOKS)
    found = sorted(methods, key=lambda name: _order(look(name).base, order))
    of = {family: [name for name in found if look(name).family is family] for family in Family}
    return [(family.value, names) for family, names in of.items() if names]


def _order(base: str, order: Sequence[str]) -> int:
    return order.index(base) if base in order else len(order)
