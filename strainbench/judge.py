"""The referee's side of a cell: from the frames that a process left, its rows."""

from __future__ import annotations

import json
import time
from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from strainbench.cell import Cell, PluginRef
from strainbench.play import read_events, read_frames
from strainbench.records import SCHEMA
from strainbench.referee import OUTCOMES, Certificate, certify
from strainbench.reference import ReferenceSolver
from strainbench.scenario import StepReport

VIOLATION, GAP = 1e-6, 1e-4
"""The thresholds of every outcome in a results folder; printed with each table."""


def judge(
    cell: Cell, folder: Path, ending: str, cache: Path | None
) -> tuple[dict[str, object], list[dict[str, object]]]:
    """The row of a cell and those of its projections.

    Parameters
    ----------
    folder : what `play` wrote
    ending : why the process was stopped from outside, or ""
    cache : for references of replayed frames
    """
    begin = time.perf_counter()
    events = read_events(folder)
    projections = [e for e in events if e["event"] == "projection"]
    certificates = _certificates(cell, folder, len(projections), cache)
    steps = _step_rows(cell, events, projections, certificates)
    row = _run_row(cell, events, projections, certificates, ending)
    row["judge_seconds"] = time.perf_counter() - begin
    return row, steps


def _certificates(cell: Cell, folder: Path, count: int, cache: Path | None) -> list[Certificate]:
    if not count:
        return []
    problem = cell.scenario.scenario().problem()
    references = ReferenceSolver(problem, cache)
    certificates = []
    for target, positions in read_frames(folder, count):
        frame = problem.with_target(target)
        certificates.append(certify(frame, positions, VIOLATION, GAP, references(frame)))
    return certificates


def _step_rows(
    cell: Cell,
    events: list[dict[str, Any]],
    projections: list[dict[str, Any]],
    certificates: list[Certificate],
) -> list[dict[str, object]]:
    steps = {e["step"]: e for e in events if e["event"] == "step"}
    rows: list[dict[str, object]] = []
    for number, (event, found) in enumerate(zip(projections, certificates, strict=True), start=1):
        verdict = {k: v for k, v in vars(found).items() if k not in ("reason", *LOCAL)}
        details = event["details"] | {k: v for k, v in vars(found).items() if k in LOCAL and v == v}
        physics = steps.get(event["step"], {})
        rows.append(
            {
                "cell": cell.key,
                "step": event["step"],
                "projection": number,
                "status": event["status"],
                "seconds": event["seconds"],
                "iterations": event["iterations"],
                **verdict,
                **{k: physics.get(k, "") for k in PHYSICS},
                "details": json.dumps(details) if details else "",
            }
        )
    return rows


PHYSICS = tuple(f.name for f in fields(StepReport))
LOCAL = ("kkt_residual", "best_known")
"""What certificates have where lower bounds leave them no gap; kept among a step's details."""


def _run_row(
    cell: Cell,
    events: list[dict[str, Any]],
    projections: list[dict[str, Any]],
    certificates: list[Certificate],
    ending: str,
) -> dict[str, object]:
    by_name = {e["event"]: e for e in events}
    steps = [e for e in events if e["event"] == "step"]
    seconds = [e["seconds"] for e in projections] + _cut_off(cell, events, ending)
    outcome, reason = _outcome(cell, events, certificates, len(steps), ending)
    loaded = by_name.get("loaded", {})
    row: dict[str, object] = identity(cell) | {
        "steps_done": len(steps),
        "outcome": outcome,
        "reason": reason,
        "solve_seconds_mean": _of(np.mean, seconds),
        "solve_seconds_median": _of(np.median, seconds),
        "setup_seconds": by_name.get("setup", {}).get("seconds", ""),
        "ie_seconds_mean": _of(np.mean, [e["ie_seconds"] for e in steps])
        if cell.mode == "simulate"
        else "",
        "iterations_mean": _of(np.mean, [e["iterations"] for e in projections]),
        "details_mean": _mean_details([e["details"] for e in projections]),
        "max_violation": _of(max, [c.max_violation for c in certificates]),
        "max_principal_stretch": _of(max, [c.max_principal_stretch for c in certificates]),
        "relative_gap_max": _of(max, [c.relative_gap for c in certificates]),
        "distance_max": _of(max, [c.distance for c in certificates]),
        "distance_bound_max": _of(max, [c.distance_bound for c in certificates]),
        "reference_error_max": _of(max, [c.reference_error for c in certificates]),
        "projections": len(certificates),
        "projections_violated": sum(c.outcome == "violated" for c in certificates),
        "projections_optimal": sum(c.outcome == "optimal" for c in certificates),
        "newton_failures": sum(not e["newton_converged"] for e in steps),
        "variables": loaded.get("variables", ""),
        "constraints": loaded.get("constraints", ""),
        "nonzeros": loaded.get("nonzeros", ""),
        "needs": loaded.get("needs", ""),
        "active_constraints_max": max((c.active_constraints for c in certificates), default=""),
        "peak_memory_mb": by_name.get("ended", {}).get("peak_memory_mb", ""),
        "blas_threads": loaded.get("blas_threads", ""),
        "play_seconds": sum(seconds) + sum(e["ie_seconds"] for e in steps),
    }
    return row


def _badness(certificate: Certificate) -> float:
    """What the reason of an outcome is about."""
    c = certificate
    if c.outcome == "violated":
        return c.max_violation
    return c.kkt_residual if np.isnan(c.relative_gap) else c.relative_gap


def _cut_off(cell: Cell, events: list[dict[str, Any]], ending: str) -> list[float]:
    """Seconds in a projection that was stopped from outside at the time limit: at least so long."""
    last = next(
        (e for e in reversed(events) if e["event"] in ("setup", "step", "projection")), None
    )
    if last is None or cell.time_limit is None or not ending.startswith("time limit"):
        return []
    begun = next(e["at"] for e in events if e["event"] == "started")
    return [max(0.0, begun + cell.time_limit - last["at"])]


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
    }


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


def _outcome(
    cell: Cell,
    events: list[dict[str, Any]],
    certificates: list[Certificate],
    steps_done: int,
    ending: str,
) -> tuple[str, str]:
    """The worst outcome of any projection, "no answer" where steps are missing; and the reason."""
    failures = [e["reason"] for e in events if e["event"] == "failed"]
    reasons = []
    if steps_done < cell.steps:
        outcome = "no answer"
        cause = ending or (failures[0] if failures else "the process ended without a word")
        reasons.append(f"{cause} ({steps_done} of {cell.steps} steps)")
    else:
        outcome = max((c.outcome for c in certificates), key=OUTCOMES.index)
        worst = [c for c in certificates if c.outcome == outcome]
        if outcome != "optimal":
            found = max(worst, key=_badness).reason
            reasons.append(f"{len(worst)} of {len(certificates)} projections: {found} at worst")
    unconverged = sum(e["event"] == "step" and not e["newton_converged"] for e in events)
    if unconverged:
        reasons.append(f"Newton did not converge on {unconverged} steps")
    statuses = sorted({e["status"] for e in events if e["event"] == "projection"} - {"solved"})
    if statuses and outcome != "optimal":
        reasons.append("it says " + ", ".join(repr(s) for s in statuses[:3]))
    reasons += [note for e in events if e["event"] == "loaded" for note in e["notes"]]
    return outcome, "; ".join(reasons)
