"""The rows of a cell: what it is, what its process measured, what the referee found."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import fields
from typing import Any

import numpy as np

from strainbench.bench.cell import Cell, PluginRef
from strainbench.bench.ending import GAP, VIOLATION, Ending
from strainbench.bench.faults import SCHEMA
from strainbench.bench.journal import Events, only
from strainbench.bench.mode import replays
from strainbench.referee.certificate import Certificate
from strainbench.scenario.scenario import StepReport
from strainbench.sources import suite_digest

Verdict = tuple[dict[str, object], list[dict[str, object]]]
"""The row of a cell and those of its projections."""
LOADED = ("variables", "constraints", "nonzeros", "needs", "blas_threads")
PHYSICS = tuple(f.name for f in fields(StepReport))
LOCAL = ("kkt_residual", "best_known")
"""What certificates have where lower bounds leave them no gap; kept among a step's details."""
WORST = {
    "max_violation": "max_violation",
    "max_principal_stretch": "max_principal_stretch",
    "relative_gap_max": "relative_gap",
    "distance_max": "distance",
    "distance_bound_max": "distance_bound",
    "reference_error_max": "reference_error",
}
"""Columns that hold the largest of what the certificates say; of compression, the least."""


def identity(cell: Cell) -> dict[str, object]:
    """The columns that say which cell a row is about."""
    scenario = dict(cell.scenario.parameters)
    return {
        "schema": SCHEMA,
        "cell": cell.key,
        "scenario": cell.scenario.name,
        "resolution": scenario.get("resolution", ""),
        "limit": scenario.get("limit", ""),
        "directions": scenario.get("directions", ""),
        "integrator": scenario.get("integrator", ""),
        "solver": cell.solver.label,
        "tolerance": cell.tolerance,
        "mode": cell.mode,
        "steps_asked": cell.steps,
        "time_limit": "" if cell.time_limit is None else cell.time_limit,
        "violation_threshold": VIOLATION,
        "gap_threshold": GAP,
        "scenario_parameters": _as_json(cell.scenario),
        "solver_parameters": _as_json(cell.solver),
        "threads": cell.threads,
        "solver_source": cell.solver.source,
        "scenario_source": cell.scenario.source,
        "content": f"{cell.scenario.content} {cell.solver.content}",
        "suite": suite_digest(),
        "repeats": cell.repeats,
    }


def step_rows(
    cell: Cell, events: Events, verdicts: Sequence[Mapping[str, object]]
) -> list[dict[str, object]]:
    """A row a projection, with the fields of its certificate and what failed in it."""
    steps = {e["step"]: e for e in only(events, "step")}
    projections = zip(only(events, "projection"), times(events), verdicts, strict=True)
    return [
        _step_row(event, found, steps.get(event["step"], {}))
        | {"cell": cell.key, "projection": number, **_seconds(each)}
        for number, (event, each, found) in enumerate(projections, start=1)
    ]


def times(events: Events) -> list[list[float]]:
    """Seconds of each projection: of the answer that counts, then of its repeats."""
    each = [[float(e["seconds"])] for e in only(events, "projection")]
    for again in only(events, "again"):
        each[again["projection"] - 1].append(float(again["seconds"]))
    return each


def _seconds(each: list[float]) -> dict[str, object]:
    """The median, and of several the quartiles and all as they are."""
    if len(each) == 1:
        return {"seconds": each[0]}
    low, median, high = map(float, np.quantile(each, [0.25, 0.5, 0.75]))
    every = " ".join(map(repr, each))
    return {"seconds": median, "seconds_low": low, "seconds_high": high, "seconds_each": every}


def _step_row(
    event: Mapping[str, Any], found: Mapping[str, object], physics: Mapping[str, object]
) -> dict[str, object]:
    details = event["details"] | {k: v for k, v in found.items() if k in LOCAL and v == v}
    return {
        **{k: event[k] for k in ("step", "status", "iterations")},
        **{k: v for k, v in found.items() if k not in ("reason", *LOCAL)},
        **{k: physics.get(k, "") for k in PHYSICS},
        "details": json.dumps(details) if details else "",
    }


@np.errstate(over="ignore")
def run_row(
    cell: Cell, events: Events, certificates: Sequence[Certificate], ending: str
) -> dict[str, object]:
    """A cell's row but for its outcome."""
    return identity(cell) | _measured(cell, events, ending) | _found(certificates)


def _measured(cell: Cell, events: Events, ending: str) -> dict[str, object]:
    """What its process says of itself."""
    last = {e["event"]: e for e in events}
    steps, projections = only(events, "step"), only(events, "projection")
    each, last_one = times(events), cut_off(cell, events, ending)
    seconds = [float(np.median(taken)) for taken in each] + last_one
    euler = [e["ie_seconds"] for e in steps]
    loaded = last.get("loaded", {})
    played = last.get("repeating", last.get("ended", {}))
    return {
        "steps_done": len(steps),
        "projections": len(projections),
        "solve_seconds_mean": _of(np.mean, seconds),
        "solve_seconds_median": _of(np.median, seconds),
        "setup_seconds": last.get("setup", {}).get("seconds", ""),
        "ie_seconds_mean": _of(np.mean, [] if replays(cell.mode) else euler),
        "play_seconds": sum(taken[0] for taken in each) + sum(last_one) + sum(euler),
        "iterations_mean": _of(np.mean, [e["iterations"] for e in projections]),
        "details_mean": _mean_details([e["details"] for e in projections]),
        "newton_failures": sum(not e["newton_converged"] for e in steps),
        "peak_memory_mb": played.get("peak_memory_mb", ""),
        **{name: loaded.get(name, "") for name in LOADED},
    }


def _found(certificates: Sequence[Certificate]) -> dict[str, object]:
    """What the referee says of its answers, the worst of them."""
    outcomes = [c.outcome for c in certificates]
    return {
        "projections_violated": outcomes.count("violated"),
        "projections_optimal": outcomes.count("optimal"),
        "active_constraints_max": max((c.active_constraints for c in certificates), default=""),
        **{
            column: _of(max, [getattr(c, name) for c in certificates])
            for column, name in WORST.items()
        },
        "min_principal_stretch": _of(min, [c.min_principal_stretch for c in certificates]),
    }


def cut_off(cell: Cell, events: Events, ending: str) -> list[float]:
    """Seconds in a projection that was stopped from outside at the time limit: at least so long."""
    ended = [e["at"] for e in events if e["event"] in ("setup", "step", "projection")]
    if not ended or cell.time_limit is None or Ending.of(ending) is not Ending.TIME_LIMIT:
        return []
    begun = next((e["at"] for e in only(events, "started")), ended[-1])
    rest = begun + cell.time_limit - ended[-1]
    return [rest] if rest > 0 else []


def _mean_details(details: list[dict[str, float]]) -> str:
    """The solver's own further numbers, averaged over its projections, as JSON."""
    names = {name for d in details for name in d}
    means = {n: float(np.mean([d[n] for d in details if n in d])) for n in sorted(names)}
    return json.dumps(means) if means else ""


def _as_json(plugin: PluginRef) -> str:
    return json.dumps(dict(plugin.parameters), sort_keys=True)


def _of(function: Any, values: Sequence[float]) -> object:
    """`function` of the finite or infinite values, or nothing where there are none."""
    known = [v for v in values if not np.isnan(v)]
    return float(function(known)) if known else ""
