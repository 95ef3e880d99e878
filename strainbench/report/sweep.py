"""Time and accuracy against one setting of a scene (Tang et al. 2022, section 5.1)."""

from __future__ import annotations

import json

import pandas as pd

from strainbench.document import Column, Table
from strainbench.report.lines import MEASURES, marked, ranked
from strainbench.report.names import describe, digits, digits_of, settings
from strainbench.report.table import UNCONSTRAINED

FEWEST = 3  # values of a setting that make a sweep
APART = 1.6  # times the largest number: where a chart has the words among the values
LINE = ["scenario", "rest", "mode", "tolerance", "steps"]
BEYOND = """\
`beyond`: the largest principal stretch of any triangle less 1 + limit. Sampled directions let the
true stretch go further between them; `exact` limits the principal stretch itself."""


def sweeps(runs: pd.DataFrame) -> dict[str, pd.DataFrame]:
    """For each setting of a scene with at least three numbers, the rows by its value.

    Words among the values, such as exact directions, come last: `value` is a place beyond all
    numbers, `shown` the word. Rows of one `line` differ in nothing but the value and the solver.
    """
    parameters = [settings(text) for text in runs["scenario_parameters"]]
    found = {}
    for key in dict.fromkeys(k for p in parameters for k in p):
        values = pd.Series([p.get(key) for p in parameters], runs.index, dtype=object)
        numbers = {v for v in values if isinstance(v, int | float) and not isinstance(v, bool)}
        if len(numbers) >= FEWEST:
            words = values.map(lambda v: isinstance(v, str))
            rows = runs.assign(value=pd.to_numeric(values.mask(words, APART * max(numbers))))
            precision = digits_of(numbers)
            rows["shown"] = [f"{v:.{precision}g}" if v in numbers else str(v) for v in values]
            rest = [{k: v for k, v in p.items() if k != key} for p in parameters]
            rows["rest"] = [json.dumps(r, sort_keys=True) for r in rest]
            rows["steps"] = 0 if key == "step" else runs["steps_asked"]  # step sizes: of a duration
            rows["line"] = rows.groupby(LINE, sort=False, dropna=False).ngroup()
            rows = rows[(rows["solver"] != UNCONSTRAINED) & rows["value"].notna()]
            rows = rows[rows.groupby("line")["value"].transform("nunique") >= FEWEST]
            if len(rows):
                found[key] = rows.sort_values("value", kind="stable")
    return found


def beyond(rows: pd.DataFrame) -> pd.Series:
    """How far the largest principal stretch goes beyond 1 + limit; 0 where it does not."""
    return (rows["max_principal_stretch"] - (1 + rows["limit"])).clip(lower=0)


def beyond_text(row: pd.Series) -> str:
    """The same of one cell."""
    return "" if pd.isna(row["beyond"]) else f"{row['beyond']:.2g}".replace("e-0", "e-")


def sweep_tables(runs: pd.DataFrame) -> list[Table]:
    """A table for each sweep: a line a value and solver."""
    return [
        _table(key, group, rows)
        for key, rows in sweeps(runs).items()
        for _, group in rows.assign(beyond=beyond(rows)).groupby("line", sort=False)
    ]


def _table(key: str, group: pd.DataFrame, rows: pd.DataFrame) -> Table:
    """That of one line among the rows of its sweep."""
    first = group.iloc[0]
    rest = describe(first["rest"], (), digits(rows["rest"]))
    about = ", ".join(filter(None, (first["mode"], rest, *_how(first, rows))))
    lines = [
        [row["shown"], *texts, beyond_text(row)]
        for _, at in group.groupby("value")
        for row, texts in marked(ranked(at))
    ]
    header: list[str | Column] = [key, "method", *MEASURES, "beyond"]
    return Table(f"{first['scenario']} against {key} ({about})", header, lines)


def _how(row: pd.Series, rows: pd.DataFrame) -> list[str]:
    """What of its tolerance and steps sets a line apart from the others of its sweep."""
    tolerance = [f"tolerance {row['tolerance']:g}"] if rows["tolerance"].nunique() > 1 else []
    return tolerance + ([f"{row['steps']:.0f} steps"] if rows["steps"].nunique() > 1 else [])


def differs(row: pd.Series, rows: pd.DataFrame) -> list[str]:
    """The same of all that may set it apart, but for the limit, which titles have."""
    words = [row[name] for name in ("scenario", "mode") if rows[name].nunique() > 1]
    every = [settings(text) for text in rows["rest"].unique()]
    same = [k for k in settings(row["rest"]) if len({json.dumps(e.get(k)) for e in every}) == 1]
    words.append(describe(row["rest"], ["limit", *same], digits(rows["rest"])))
    return [word for word in (*words, *_how(row, rows)) if word]
