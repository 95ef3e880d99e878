"""The referee's side of a cell: from the frames that a process left, its rows."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import groupby
from pathlib import Path

import numpy as np

from strainbench.bench.cell import Cell
from strainbench.bench.ending import GAP, VIOLATION, Ending
from strainbench.bench.failure import ended, of_projection, of_steps, rises
from strainbench.bench.journal import Events, only, read_events, read_frames, read_journal
from strainbench.bench.mode import replays
from strainbench.bench.rows import Verdict, run_row, step_rows, times
from strainbench.referee.certificate import OUTCOMES, Certificate, certify
from strainbench.referee.conduct import Conduct, conduct
from strainbench.referee.motion import jitter
from strainbench.referee.reference import Kept, ReferenceSolver

JUDGED = "judged"  # a file in a cell's folder, with a byte for each certificate
JUDGE_LIMIT = 300.0  # [s] for a projection of up to JUDGE_VARIABLES, beyond that in proportion
JUDGE_VARIABLES = 30_000
CLAIM_SLACK = 0.25  # [s], and CLAIM_SHARE of the time: what a busy machine takes between two clocks
CLAIM_SHARE = 0.1


def judge_limit(events: Events) -> float:
    """Seconds that the referee has for each projection of a cell."""
    loaded = next(iter(only(events, "loaded")), {"variables": 0})
    return JUDGE_LIMIT * max(1.0, loaded["variables"] / JUDGE_VARIABLES)


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
    projections = only(events, "projection")
    certificates, conducts = _certificates(cell, folder, len(projections), kept)
    failed = _failures(events, certificates, conducts)
    rows = step_rows(cell, events, [vars(c) | f for c, f in zip(certificates, failed, strict=True)])
    in_time = len(_in_time(cell, events))
    if in_time < len(projections):  # what came back late is no answer, nor is its step done
        ending = ending or f"{Ending.TIME_LIMIT} of {cell.time_limit:g} s"
        late = projections[in_time]["step"]
        events = [e for e in events if e["event"] != "step" or e["step"] < late]
    counted, steps = certificates[:in_time], len(only(events, "step"))
    early = _ended_early(cell, events, counted)
    asked = replace(cell, steps=steps) if early else cell
    outcome, reason = _outcome(asked, events, counted, steps, ending or damage)
    whole = steps == cell.steps  # of one that was cut short nothing is to be expected
    missed = _missed(cell, folder, len(projections)) if whole else []
    row = run_row(cell, events, counted, ending)
    row |= {"outcome": outcome, "reason": "; ".join(filter(None, [early, reason, *missed]))}
    row["jitter"] = _jitter(cell, folder, projections)
    row |= _failure(asked, row, rows, in_time)
    row["judge_seconds"] = time.perf_counter() - begin
    return row, rows


def unjudged(cell: Cell, folder: Path, ending: str, failure: str) -> Verdict:
    """The rows of a cell on which the referee failed: what was measured, and no verdict."""
    events = read_events(folder)
    steps, verdict = len(only(events, "step")), {"outcome": OUTCOMES[-1]}
    reason = f"{Ending.UNJUDGED}: {failure} ({steps} of {cell.steps} steps)"
    if ending:
        reason += f"; before that, {ending}"
    row = run_row(cell, events, [], ending) | verdict | {"reason": reason}
    row |= ended(cell, reason, steps)
    return row, step_rows(cell, events, [verdict] * len(only(events, "projection")))


def _certificates(
    cell: Cell, folder: Path, count: int, kept: Kept | None
) -> tuple[list[Certificate], list[Conduct]]:
    if not count:
        return [], []
    scene = cell.scenario.scenario()
    problem = scene.problem()
    references, start = ReferenceSolver(problem, kept), problem.target
    certificates, conducts = [], []
    with (folder / JUDGED).open("wb") as judged:
        for target, positions in read_frames(folder, count):
            frame, start = scene.frame(problem, target, start), positions
            certificates.append(certify(frame, positions, VIOLATION, GAP, references(frame)))
            conducts.append(conduct(frame, positions))
            judged.write(b".")
            judged.flush()
    return certificates, conducts


def _failures(
    events: Events, certificates: Sequence[Certificate], conducts: Sequence[Conduct]
) -> Iterator[dict[str, object]]:
    """What failed in each projection, and the measures of it."""
    rise = rises(events)
    for event, found, done in zip(only(events, "projection"), certificates, conducts, strict=True):
        more = rise.get(event["step"], float("nan"))
        kind = of_projection(found, done, event, more)
        yield {"failure": kind.value if kind else "", "energy_rise": more, **vars(done)}


def _failure(
    asked: Cell, row: dict[str, object], rows: list[dict[str, object]], in_time: int
) -> dict[str, object]:
    """What failed in a cell, and since when; the last projection of one that ended without an
    answer is told the same."""
    if row["outcome"] != OUTCOMES[-1]:
        return of_steps(row["outcome"], rows[:in_time])
    columns = ended(asked, str(row["reason"]), int(str(row["steps_done"])))
    if rows and rows[-1]["outcome"] == OUTCOMES[-1]:
        rows[-1]["failure"] = columns["failure"]
    return columns


def _ended_early(cell: Cell, events: Events, certificates: Sequence[Certificate]) -> str:
    """Whether a cell ended as it may, soon after limits were violated, in words, or ""."""
    steps = len(only(events, "step"))
    violated = any(c.outcome == "violated" for c in certificates)
    if cell.patience is None or not (violated and only(events, "enough")):
        return ""
    return f"ended early, after step {steps} of {cell.steps}"


def _missed(cell: Cell, folder: Path, count: int) -> list[str]:
    """What a scene is for and the steps of a cell, with `count` frames, never came to."""
    if not count:
        return []
    scene, last = cell.scenario.scenario(), cell.window[1]
    problem, words = scene.problem(), []
    frames = [problem.with_target(target) for target, _ in read_frames(folder, count)]
    if not any(np.any(frame.violations(frame.target)) for frame in frames):
        words.append("no candidate was beyond the limits: nothing had to be projected")
    if not any(scene.has_begun(frame) for frame in frames):
        first = scene.first_step
        later = f"; it begins at about step {first:g}" if last < first < np.inf else ""
        words.append(f"{scene.about} never happened in these {cell.steps} steps{later}")
    return words


def _jitter(cell: Cell, folder: Path, projections: Events) -> object:
    """Of the positions that the steps of a closed loop end with; nothing for those of a replay."""
    if replays(cell.mode):
        return ""
    each = zip(projections, read_frames(folder, len(projections)), strict=True)
    ends = (list(of)[-1][1][1] for _, of in groupby(each, key=lambda p: p[0]["step"]))
    found = jitter(ends)
    return "" if np.isnan(found) else found


def _badness(certificate: Certificate) -> float:
    """What the reason of an outcome is about."""
    c = certificate
    if c.outcome == "violated":
        return c.max_violation
    return c.kkt_residual if np.isnan(c.relative_gap) else c.relative_gap


def _in_time(cell: Cell, events: Events) -> Events:
    """The projections, the first ones, that came back before the cell's time was over."""
    projections = only(events, "projection")
    if cell.time_limit is None:
        return projections
    begun = next((e["at"] for e in only(events, "started")), float("inf"))
    end = cell.time_limit + begun
    return [e for e in projections if e["at"] <= end]


def _false_claim(events: Events) -> str:
    """Whether projections took longer by the journal's clock than they say themselves."""
    timed = [*only(events, "projection"), *only(events, "again")]
    projections = [e for e in timed if "end" in e]
    said = sum(e["seconds"] for e in projections)
    took = sum(e["end"] - e["begin"] for e in projections)
    if took - said < CLAIM_SLACK + CLAIM_SHARE * took:
        return ""
    return f"{Ending.TAMPERED}: solves of {said:.2f} s by its account took {took:.2f} s"


def _missing_repeats(
    cell: Cell, events: Events, failures: Sequence[str], ending: str
) -> Iterator[str]:
    """How often projections were timed where that is less often than was asked for, and why."""
    if cell.repeats == 1:
        return
    fewest = min(map(len, times(events)), default=cell.repeats)
    if fewest < cell.repeats:
        cause = ending or next(iter(failures), "their time was over")
        yield f"{fewest} of {cell.repeats} repeats: {cause}"


def _outcome(
    cell: Cell,
    events: Events,
    certificates: list[Certificate],
    steps_done: int,
    ending: str,
) -> tuple[str, str]:
    """The worst outcome of any projection, "no answer" where steps are missing; and the reason."""
    failures = [e["reason"] for e in only(events, "failed")]
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
        reasons += _missing_repeats(cell, events, failures, ending)
    unconverged = sum(not e["newton_converged"] for e in only(events, "step"))
    if unconverged:
        reasons.append(f"Newton did not converge on {unconverged} steps")
    statuses = sorted({e["status"] for e in only(events, "projection")} - {"solved"})
    if statuses and outcome != "optimal":
        reasons.append("it says " + ", ".join(repr(s) for s in statuses[:3]))
    reasons += [note for e in only(events, "loaded") for note in e["notes"]]
    return outcome, "; ".join(reasons)
