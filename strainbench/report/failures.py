"""Where methods fail: hard cases, each beside its easier neighbour.

A scene that is hard names its easier neighbour (`Scenario.easier`). A method that fails on the one
and does better on the other fails by itself; one that does no better may be ours to mend.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd

from strainbench.bench.ending import Ending
from strainbench.bench.failure import FAILURES
from strainbench.document import Document, Items, Prose, Table
from strainbench.referee.certificate import OUTCOMES
from strainbench.report.machine import machine_section
from strainbench.report.measures import OUT_OF_TIME, distance_of
from strainbench.report.numbers import power
from strainbench.report.rows import Row, rows_of
from strainbench.report.steps import newest_steps
from strainbench.report.table import UNCONSTRAINED
from strainbench.scenario.registry import find_scenario

EXPLANATION = """\
Signs: ✓ optimal on every step (violation at most {violation}, relative gap at most {gap}), or an
infeasible case called infeasible; ○ within the limits but not optimal (relative gap, distance of
the farthest vertex), or an infeasible case on which the method gave up without a claim; ✗ limits
violated (by how much, and what the method itself says), out of time (after how many steps), an
infeasible case called solved, or no usable answer. What is shown is the worst step.

Each failure is checked on an easier neighbour of its case. Where the method does better there, and
within the limits, the failure is the method's. †: it does not, by its nature or by a fault of
ours."""
RUN = ("scenario", "mode", "steps_asked", "tolerance")
PASSED, PARTLY, FAILED = "✓", "○", "✗"
COLUMNS = ("case", "method", "sign", "found", "neighbour", "verdict", "reason", "failure", "since")


@dataclass(frozen=True)
class Case:
    """A hard scene: how it is called, its neighbour's parameters, what sets the neighbour apart."""

    title: str
    neighbour: str
    apart: str


def failures(folder: Path, runs: pd.DataFrame) -> pd.DataFrame:
    """A line for each method on each hard case of a results folder, with the index of its run; see
    COLUMNS."""
    cases = _cases(runs)
    if not cases:
        return pd.DataFrame(columns=list(COLUMNS))
    says = _statuses(folder, runs)
    keys = ["scenario_parameters", "solver", *RUN]
    by_key = dict(zip(zip(*(runs[key] for key in keys), strict=True), runs.index, strict=True))
    lines: dict[object, tuple[object, ...]] = {}
    for (parameters, *how), rows in runs.groupby(["scenario_parameters", *RUN], sort=False):
        case = cases.get(str(parameters))
        if case is None:
            continue
        alike = runs[runs["scenario_parameters"] == parameters]
        title = ", ".join(
            [
                case.title,
                *(_setting(k, v) for k, v in zip(RUN, how, strict=True) if alike[k].nunique() > 1),
            ]
        )
        infeasible = rows["reason"].str.contains("projections: infeasible:", regex=False).any()
        for index, row in rows[rows["solver"] != UNCONSTRAINED].iterrows():
            if Ending.of(row["reason"]) is Ending.UNAVAILABLE:
                continue
            status = says.get((row["cell"], row["outcome"]), "")
            sign, found = _judge_infeasible(row, status) if infeasible else _judge(row, status)
            place = by_key.get((case.neighbour, *row[keys[1:]]))
            easier = None if place is None else runs.loc[place]
            verdict = "" if sign == PASSED else _verdict(row, easier, case.apart)
            there = "" if easier is None else easier["outcome"]
            told = (sign, found, there, verdict, row["reason"], *row[[*FAILURES]])
            lines[index] = (title, row["solver"], *told)
    return pd.DataFrame.from_dict(lines, orient="index", columns=list(COLUMNS))


def _statuses(folder: Path, runs: pd.DataFrame) -> dict[tuple[str, str], str]:
    """What the solver says of a cell's projections of each outcome."""
    alike = newest_steps(folder, runs).groupby(["cell", "outcome"])["status"]
    return {key: ", ".join(sorted(set(statuses))) for key, statuses in alike}


def _cases(runs: pd.DataFrame) -> dict[str, Case]:
    """The scenes of a folder that have an easier neighbour, by their parameters."""
    found = {}
    for name, rows in runs.groupby("scenario", sort=False):
        texts = list(dict.fromkeys(rows["scenario_parameters"]))
        every = [json.loads(text or "{}") for text in texts]
        vary = [k for k in every[0] if len({json.dumps(e.get(k)) for e in every}) > 1]
        for text, mine in zip(texts, every, strict=True):
            easy = _easier(str(name), mine)
            if easy is not None:
                apart = [k for k in mine if easy[k] != mine[k]]
                shown = dict.fromkeys([*vary, *apart])
                title = ", ".join([str(name), *(_setting(k, mine[k]) for k in shown)])
                neighbour = json.dumps(easy, sort_keys=True)
                found[text] = Case(title, neighbour, ", ".join(_setting(k, easy[k]) for k in apart))
    return found


def _easier(name: str, parameters: dict[str, Any]) -> dict[str, object] | None:
    """The parameters of the easier neighbour; None without one, or for a scene not of ours."""
    try:
        neighbour = find_scenario(name)(**parameters).easier()
    except (ValueError, TypeError):
        return None
    return None if neighbour is None else neighbour.parameters


def _setting(key: str, value: object) -> str:
    return f"{key} {value:g}" if isinstance(value, float) else f"{key} {value}"


def _judge(row: pd.Series, status: str) -> tuple[str, str]:
    """Sign and words for a method on a case that can be solved."""
    if row["outcome"] == "optimal":
        return PASSED, ""
    if row["outcome"] == "feasible":
        if pd.isna(row["relative_gap_max"]):
            return PARTLY, "local"
        return PARTLY, f"gap {power(row['relative_gap_max'])}, {distance_of(row) or '?'} mm"
    if row["ending"] == OUT_OF_TIME:
        return FAILED, f"out of time, {row['why']}"
    if row["outcome"] == "violated":
        return FAILED, f"violated by {power(row['max_violation'])}, says {status}"
    return FAILED, f"no answer, says {status}" if status else row["reason"].split(" (")[0]


def _judge_infeasible(row: pd.Series, status: str) -> tuple[str, str]:
    """The same on a case that cannot: the right answer is to say so."""
    if "infeasible" in status.lower():
        return PASSED, "says infeasible"
    if status == "solved":
        return FAILED, f"says solved, violated by {power(row['max_violation'])}"
    return (PARTLY, status) if status else _judge(row, status)


def _verdict(row: pd.Series, easier: pd.Series | None, apart: str) -> str:
    """Whose failure it is, as far as the easier neighbour tells."""
    if Ending.of(row["reason"]) is Ending.UNSUPPORTED:
        return "refused"
    if easier is None:
        return f"not run at {apart}"
    here, there = (OUTCOMES.index(r["outcome"]) for r in (row, easier))
    if there < min(here, OUTCOMES.index("violated")):
        return f"{easier['outcome']} at {apart}: the method's"
    return f"{easier['outcome']} at {apart} too: by its nature, or a fault of ours"


def failures_document(
    table: pd.DataFrame, runs: pd.DataFrame, machines: Mapping[str, Mapping[str, object]]
) -> Document:
    """Methods against cases, what the signs mean, a line for each failure, the machine."""
    cases, methods = list(dict.fromkeys(table["case"])), list(dict.fromkeys(table["method"]))
    cells = {(r["case"], r["method"]): _cell(r) for r in rows_of(table)}
    lines = [[m, *(cells.get((c, m), "") for c in cases)] for m in methods]
    first = runs.iloc[0]
    about = EXPLANATION.format(violation=first["violation_threshold"], gap=first["gap_threshold"])
    failed = [
        Document(str(case), [Items([_failure(r) for r in rows_of(rows)])])
        for case, rows in table[table["sign"] != PASSED].groupby("case", sort=False)
    ]
    grid = Table("", ["method", *cases], lines, Prose(about))
    return Document("Where methods fail", [grid, *failed, machine_section(machines)])


def _failure(row: Row) -> str:
    since = "" if pd.isna(row["since"]) else f", first in step {row['since']:.0f}"
    kind = f"; {row['failure']}{since}" if row["failure"] else ""
    return f"{row['method']}: {row['found']}{kind}; {row['verdict']}. In full: {row['reason']}"


def _cell(row: Row) -> str:
    shared = " †" if " too: " in row["verdict"] else ""
    return f"{row['sign']} {row['found']}".strip() + shared
