"""From certificates and events to a cell's outcome and reason."""

from __future__ import annotations

from types import SimpleNamespace

from strainbench.judge import _cut_off, _in_time, _outcome
from strainbench.referee import Certificate


def certificate(outcome, violation=0.0, gap=0.0):
    reason = f"violation {violation:.2e}" if outcome == "violated" else f"gap {gap:.2e}"
    return Certificate(outcome, reason, violation, 1.0, 1.0, 1.0, gap, 0.0, 0.0, 0.0, 0)


def judged(certificates, asked=3, done=3, ending="", events=()):
    return _outcome(SimpleNamespace(steps=asked), list(events), certificates, done, ending)


def test_the_outcome_is_the_worst_of_all_steps():
    good, loose = certificate("optimal"), certificate("feasible", gap=1e-3)
    assert judged([good, good, good]) == ("optimal", "")
    assert judged([good, loose, good])[0] == "feasible"
    assert judged([good, loose, certificate("violated", violation=0.1)])[0] == "violated"


def test_the_reason_names_the_worst_of_its_kind():
    found = [
        certificate("feasible", violation=5e-7, gap=2e-4),
        certificate("feasible", violation=0.0, gap=3e-2),
    ]
    assert (
        judged([certificate("optimal"), *found])[1] == "2 of 3 projections: gap 3.00e-02 at worst"
    )
    found = [certificate("violated", 0.1, 0.9), certificate("violated", 0.3, 0.2)]
    assert "violation 3.00e-01 at worst" in judged([*found, certificate("optimal")])[1]


def test_missing_steps_are_no_answer_whatever_was_done():
    outcome, reason = judged([certificate("optimal")], done=1, ending="time limit of 9 s")
    assert (outcome, reason) == ("no answer", "time limit of 9 s (1 of 3 steps)")
    events = [{"event": "failed", "reason": "ValueError: no"}]
    assert judged([], done=0, events=events)[1] == "ValueError: no (0 of 3 steps)"
    assert "without a word" in judged([], done=0)[1]


def test_newton_failures_and_what_the_solver_says_are_told():
    events = [
        {"event": "step", "step": 1, "newton_converged": False},
        {"event": "projection", "status": "AlmostSolved"},
    ]
    reason = judged([certificate("feasible", gap=1e-3)], asked=1, done=1, events=events)[1]
    assert "Newton did not converge on 1 steps" in reason
    assert "it says 'AlmostSolved'" in reason


def test_a_projection_cut_off_at_the_limit_counts_as_far_as_it_went():
    cell = SimpleNamespace(time_limit=10.0)
    events = [{"event": "started", "at": 100.0}, {"event": "projection", "at": 103.0}]
    assert _cut_off(cell, events, "time limit of 10 s") == [7.0]
    assert _cut_off(cell, events, "") == []


def test_a_projection_that_came_back_late_is_not_in_time():
    projections = [{"event": "projection", "at": at} for at in (103.0, 109.9, 110.5)]
    events = [{"event": "started", "at": 100.0}, *projections]
    assert _in_time(SimpleNamespace(time_limit=10.0), events, projections) == 2
    assert _in_time(SimpleNamespace(time_limit=None), events, projections) == 3
