"""Time and accuracy against one setting of a scene (Tang et al. 2022, section 5.1)."""

from __future__ import annotations

import json
from pathlib import Path

import pandas as pd
from matplotlib.figure import Figure

from strainbench import escape
from strainbench.report.chart import FLOOR_MM, save, styles
from strainbench.report.table import UNCONSTRAINED, accuracy_text, describe, time_text

FEWEST = 3  # values of a setting that make a sweep
APART = 1.6  # times the largest number: where a chart has the words among the values
PANELS = (
    "seconds a projection",
    "distance to optimum [mm]",
    "largest principal stretch beyond the limit",
)
FLOOR = 1e-9  # of stretch beyond the limit: less is drawn here
BEYOND = """\
`beyond`: the largest principal stretch of any triangle less 1 + limit. Sampled directions let the
true stretch go further between them; `exact` limits the principal stretch itself."""


def sweeps(runs: pd.DataFrame) -> dict[str, pd.DataFrame]:
    """For each setting of a scene with at least three numbers, the rows by its value.

    Words among the values, such as exact directions, come last: `value` is a place beyond all
    numbers, `shown` the word.
    """
    parameters = [json.loads(text or "{}") for text in runs["scenario_parameters"]]
    found = {}
    for key in dict.fromkeys(k for p in parameters for k in p):
        values = pd.Series([p.get(key) for p in parameters], runs.index, dtype=object)
        numbers = {v for v in values if isinstance(v, int | float)}
        if len(numbers) >= FEWEST:
            words = values.map(lambda v: isinstance(v, str))
            rows = runs.assign(value=pd.to_numeric(values.mask(words, APART * max(numbers))))
            rows["shown"] = [f"{v:g}" if v in numbers else str(v) for v in values]
            rest = [{k: v for k, v in p.items() if k != key} for p in parameters]
            rows["rest"] = [json.dumps(r, sort_keys=True) for r in rest]
            rows = rows[(rows["solver"] != UNCONSTRAINED) & rows["value"].notna()]
            rows = rows[rows.groupby("rest")["value"].transform("nunique") >= FEWEST]
            if len(rows):
                found[key] = rows.sort_values("value", kind="stable")
    return found


def beyond(rows: pd.DataFrame) -> pd.Series:
    """How far the largest principal stretch goes beyond 1 + limit; 0 where it does not."""
    return (rows["max_principal_stretch"] - (1 + rows["limit"])).clip(lower=0)


def beyond_text(row: pd.Series | None) -> str:
    """The same of one cell."""
    return "" if row is None or pd.isna(row["beyond"]) else f"{row['beyond']:.2g}"


def sweep_markdown(runs: pd.DataFrame) -> list[str]:
    """A table for each sweep: rows are values, columns solvers."""
    columns = ("violation · gap · mm", "beyond")
    parts = []
    for key, rows in sweeps(runs).items():
        rows = rows.assign(beyond=beyond(rows))
        for (_, mode), group in rows.groupby(["rest", "mode"], sort=False):
            first = group.iloc[0]
            about = describe(first["rest"])
            solvers = list(dict.fromkeys(group["solver"]))
            header = [key, *(t for s in solvers for t in (f"{escape.markdown(s)} [s]", *columns))]
            lines = [header, ["---"] * len(header)]
            for _, at in group.groupby("value"):
                by_solver = {r["solver"]: r for _, r in at.iterrows()}
                texts = [
                    text(by_solver.get(s))
                    for s in solvers
                    for text in (time_text, accuracy_text, beyond_text)
                ]
                lines.append([escape.markdown(at["shown"].iloc[0]), *texts])
            table = "\n".join("| " + " | ".join(line) + " |" for line in lines)
            title = f"{first['scenario']} against {key} ({mode}, {about})"
            parts.append(f"## {escape.markdown(title)}\n\n{table}")
    return parts


def draw_sweeps(folder: Path, runs: pd.DataFrame) -> list[Path]:
    """sweep-<setting>.svg and .png: seconds, distance, true stretch against each setting."""
    paths = []
    for key, rows in sweeps(runs).items():
        figure = Figure(figsize=(13, 3.6), layout="constrained")
        axes = figure.subplots(1, 3)
        several = rows["rest"].nunique() > 1
        lines = list(rows.groupby(["solver", "rest"], sort=False))
        style = styles([f"{solver} {rest}" for (solver, rest), _ in lines])
        for (solver, rest), line in lines:
            label = solver if not several else f"{solver}, {_differs(rest, rows)}"
            answered = line[line["outcome"] != "no answer"]
            look = {**style[f"{solver} {rest}"], "markersize": 5, "linewidth": 1.2}
            axes[0].plot(
                answered["value"], answered["solve_seconds_mean"], label=escape.chart(label), **look
            )
            millimetres = (1000 * answered["distance_max"]).clip(lower=FLOOR_MM)
            axes[1].plot(answered["value"], millimetres, **look)
            excess = beyond(answered).clip(lower=FLOOR)
            axes[2].plot(answered["value"], excess, **look)
        for ax, name in zip(axes, PANELS, strict=True):
            ax.set_yscale("log")
            if rows["value"].min() > 0 and rows["value"].max() > 8 * rows["value"].min():
                ax.set_xscale("log")
            ticks = rows.drop_duplicates("value")
            ax.set_xticks(ticks["value"], [escape.chart(v) for v in ticks["shown"]], size=8)
            ax.xaxis.minorticks_off()
            ax.set_xlabel(key)
            ax.set_ylabel(name)
            ax.grid(visible=True, color="#dddddd", linewidth=0.6)
        figure.legend(loc="outside right upper", frameon=False, fontsize=8)
        paths += save(figure, folder / f"sweep-{key}")
    return paths


def _differs(rest: str, rows: pd.DataFrame) -> str:
    """What sets one line's other settings apart from the other lines'."""
    everything = [json.loads(r) for r in rows["rest"].unique()]
    mine = json.loads(rest)
    keys = [k for k in mine if len({json.dumps(e.get(k)) for e in everything}) > 1]
    return ", ".join(f"{k} {mine[k]}" for k in keys)
