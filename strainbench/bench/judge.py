"""The referee's side of a cell: from the frames that a process left, its rows."""

from __future__ import annotations

import json
import os
import pickle
import sys
import time
import traceback
from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from strainbench.bench.cell import Cell, PluginRef
from strainbench.bench.ending import Ending
from strainbench.bench.journal import read_events, read_frames, read_journal
from strainbench.bench.records import SCHEMA
from strainbench.plugins import told
from strainbench.referee.certificate import OUTCOMES, Certificate, certify
from strainbench.referee.reference import Kept, ReferenceSolver
from strainbench.scenario.scenario import Scenario, StepReport
from strainbench.sources import suite_digest

VIOLATION, GAP = 1e-6, 1e-4
"""The thresholds of every outcome in a results folder; printed with each table."""


CASE, VERDICT, JUDGED = "case.pickle", "verdict.json", "judged"
"""In a cell's folder: what is to be judged, what came of it, and a byte for each certificate."""
JUDGE_LIMIT = 300.0  # [s] for a projection of up to JUDGE_VARIABLES, beyond that in proportion
JUDGE_VARIABLES = 30_000
CLAIM_SLACK = 0.25  # [s], and CLAIM_SHARE of the time: what a busy machine takes between two clocks
CLAIM_SHARE = 0.1
Verdict = tuple[dict[str, object], list[dict[str, object]]]
"""The row of a cell and those of its projections."""


def serve() -> None:
    """The referee's process: judge the case in each folder that a line of its input names.

    References are kept for the cells that are fed the same frames: in memory, not in a file, from
    which a cell could take its answers.
    """
    home, recording, kept = Path.cwd(), "", Kept()
    for line in sys.stdin:
        folder = Path(json.loads(line))
        cell, ending = pickle.loads((folder / CASE).read_bytes())
        key = cell.recording_key if cell.mode == "replay" else cell.key
        if key != recording:
            recording, kept = key, Kept()
        try:
            verdict: object = judge(cell, folder, ending, kept)
        except BaseException as error:  # of a scene's code, sys.exit among them, or our own
            traceback.print_exc()
            verdict = told(error)
        os.chdir(home)  # wherever a scene has gone
        part = folder / "verdict.part"
        part.write_text(json.dumps(verdict, default=_plain), encoding="utf-8")
        part.replace(folder / VERDICT)


def _plain(value: Any) -> object:
    """A NumPy number as Python's; anything else as text."""
    return getattr(value, "item", value.__str__)()


def judge_limit(events: list[dict[str, Any]]) -> float:
    """Seconds that the referee has for each projection of a cell."""
    loaded = next((e for e in events if e["event"] == "loaded"), {})
    return JUDGE_LIMIT * max(1.0, int(loaded.get("variables", 0)) / JUDGE_VARIABLES)


def judge(cell: Cell, folder: Path, ending: str, kept: Kept | None = None) -> Verdict:
    """The row of a cell and those of its projections.

    Parameters
    ----------
    folder : what `play_cell` wrote
    ending : why the process was stopped from outside, or ""
    kept : references known, and to be known
    """
    begin = time.perf_counter()
    events, damage = read_journal(folder)
    projections = [e for e in events if e["event"] == "projection"]
    certificates = _certificates(cell, folder, len(projections), kept)
    rows = _step_rows(cell, events, projections, certificates)
    in_time = len(_in_time(cell, events))
    if in_time < len(projections):  # what came back late is no answer, nor is its step done
        ending = ending or f"{Ending.TIME_LIMIT} of {cell.time_limit:g} s"
        late = projections[in_time]["step"]
        events = [e for e in events if e["event"] != "step" or e["step"] < late]
    counted, steps = certificates[:in_time], _steps_done(events)
    outcome, reason = _outcome(cell, events, counted, steps, ending or damage)
    whole = steps == cell.steps  # of one that was cut short nothing is to be expected
    missed = _missed(cell.scenario.scenario(), folder, len(projections), steps) if whole else []
    row = _run_row(cell, events, projections, counted, ending)
    row |= {"outcome": outcome, "reason": "; ".join(filter(None, [reason, *missed]))}
    row["judge_seconds"] = time.perf_counter() - begin
    return row, rows


def unjudged(cell: Cell, folder: Path, ending: str, failure: str) -> Verdict:
    """The rows of a cell on which the referee failed: what was measured, and no verdict."""
    events = read_events(folder)
    projections = [e for e in events if e["event"] == "projection"]
    reason = f"{Ending.UNJUDGED}: {failure} ({_steps_done(events)} of {cell.steps} steps)"
    if ending:
        reason += f"; before that, {ending}"
    row = _run_row(cell, events, projections, [], ending)
    row |= {"outcome": OUTCOMES[-1], "reason": reason}
    return row, _step_rows(cell, events, projections, None)


def _steps_done(events: list[dict[str, Any]]) -> int:
    return sum(e["event"] == "step" for e in events)


def _certificates(cell: Cell, folder: Path, count: int, kept: Kept | None) -> list[Certificate]:
    if not count:
        return []
    problem = cell.scenario.scenario().problem()
    references = ReferenceSolver(problem, kept)
    certificates = []
    with (folder / JUDGED).open("wb") as judged:
        for target, positions in read_frames(folder, count):
            frame = problem.with_target(target)
            certificates.append(certify(frame, positions, VIOLATION, GAP, references(frame)))
            judged.write(b".")
            judged.flush()
    return certificates


def _missed(scene: Scenario, folder: Path, count: int, steps: int) -> list[str]:
    """What a scene is for and `steps` steps of it, with `count` frames, never came to."""
    if not count:
        return []
    problem, words = scene.problem(), []
    frames = [problem.with_target(target) for target, _ in read_frames(folder, count)]
    if not any(np.any(frame.violations(frame.target)) for frame in frames):
        words.append("no candidate was beyond the limits: nothing had to be projected")
    if not any(scene.has_begun(frame) for frame in frames):
        first = scene.first_step
        later = f"; it begins at about step {first:g}" if steps < first < np.inf else ""
        words.append(f"{scene.about} never happened in these {steps} steps{later}")
    return words


def _step_rows(
    cell: Cell,
    events: list[dict[str, Any]],
    projections: list[dict[str, Any]],
    certificates: list[Certificate] | None,
) -> list[dict[str, object]]:
    """A row a projection; with None for certificates, without a verdict."""
    verdicts = (
        [{"outcome": OUTCOMES[-1]}] * len(projections)
        if certificates is None
        else [vars(c) for c in certificates]
    )
    steps = {e["step"]: e for e in events if e["event"] == "step"}
    rows: list[dict[str, object]] = []
    for number, (event, found) in enumerate(zip(projections, verdicts, strict=True), start=1):
        verdict = {k: v for k, v in found.items() if k not in ("reason", *LOCAL)}
        details = event["details"] | {k: v for k, v in found.items() if k in LOCAL and v == v}
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


@np.errstate(over="ignore")
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
    loaded = by_name.get("loaded", {})
    row: dict[str, object] = identity(cell) | {
        "steps_done": len(steps),
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
        "projections": len(projections),
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


def _in_time(cell: Cell, events: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The projections, the first ones, that came back before the cell's time was over."""
    projections = [e for e in events if e["event"] == "projection"]
    if cell.time_limit is None:
        return projections
    begun = (e["at"] for e in events if e["event"] == "started")
    end = cell.time_limit + next(begun, float("inf"))
    return [e for e in projections if e["at"] <= end]


def _false_claim(events: list[dict[str, Any]]) -> str:
    """Whether projections took longer by the journal's clock than they say themselves."""
    projections = [e for e in events if e["event"] == "projection" and "end" in e]
    said = sum(e["seconds"] for e in projections)
    took = sum(e["end"] - e["begin"] for e in projections)
    if took - said < CLAIM_SLACK + CLAIM_SHARE * took:
        return ""
    return f"{Ending.TAMPERED}: solves of {said:.2f} s by its account took {took:.2f} s"


def _cut_off(cell: Cell, events: list[dict[str, Any]], ending: str) -> list[float]:
    """Seconds in a projection that was stopped from outside at the time limit: at least so long."""
    last = next(
        (e for e in reversed(events) if e["event"] in ("setup", "step", "projection")), None
    )
    if last is None or cell.time_limit is None or Ending.of(ending) is not Ending.TIME_LIMIT:
        return []
    begun = next((e["at"] for e in events if e["event"] == "started"), last["at"])
    rest = begun + cell.time_limit - last["at"]
    return [rest] if rest > 0 else []


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
    ending = ending or _false_claim(events)
    if steps_done < cell.steps or Ending.of(ending) is Ending.TAMPERED:
        outcome = "no answer"
        cause = ending or (failures[0] if failures else Ending.SILENT)
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
