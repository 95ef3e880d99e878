"""From certificates and events to a cell's outcome and reason."""

from __future__ import annotations

import json
from types import SimpleNamespace

import pytest

from strainbench.bench.journal import read_journal
from strainbench.bench.judge import _in_time, _outcome, judge_limit, unjudged
from strainbench.bench.plan import plan
from strainbench.bench.rows import cut_off
from strainbench.referee.certificate import Certificate


def certificate(outcome, violation=0.0, gap=0.0):
    reason = f"violation {violation:.2e}" if outcome == "violated" else f"gap {gap:.2e}"
    return Certificate(outcome, reason, violation, 1.0, 1.0, 1.0, gap, 0.0, 0.0, 0.0, 0)


def judged(certificates, asked=3, done=3, ending="", events=()):
    return _outcome(
        SimpleNamespace(steps=asked, repeats=1), list(events), certificates, done, ending
    )


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
    assert cut_off(cell, events, "time limit of 10 s") == [7.0]
    assert cut_off(cell, events, "") == []


LINES = [
    {"event": "warming", "at": 1.0},
    {"event": "ready", "at": 2.0},
    {"event": "started", "at": 3.0},
    {"event": "setup", "at": 3.5, "seconds": 0.5},
]


@pytest.mark.parametrize(
    "junk",
    [
        "{}",
        "nonsense",
        "[1]",
        "1e999",
        "[" * 100_000,
        '{"event": "ready", "at": "noon"}',
        '{"event": "ready", "at": NaN}',
        '{"event": "party", "at": 1.0}',
        '{"event": "setup", "at": 1.0}',
        '{"event": "setup", "at": 1.0, "seconds": "long"}',
        '{"event": "projection", "at": 1.0, "step": 1, "begin": 0, "end": 0, "seconds": 0, '
        '"iterations": 1, "status": "", "details": {"x": "text"}}',
        "\udcff",
    ],
)
def test_a_damaged_journal_is_read_up_to_there(tmp_path, junk):
    lines = [*map(json.dumps, LINES), junk, json.dumps(LINES[0])]
    text = "".join(line + "\n" for line in lines)
    (tmp_path / "events.jsonl").write_bytes(text.encode(errors="surrogateescape"))
    events, damage = read_journal(tmp_path)
    assert events == LINES
    assert damage == "the journal is damaged at line 5"


def test_a_torn_last_line_is_no_damage(tmp_path):
    (tmp_path / "events.jsonl").write_text("".join(json.dumps(e) + "\n" for e in LINES) + '{"ev')
    assert read_journal(tmp_path) == (LINES, "")


def test_what_was_measured_is_kept_where_the_referee_fails(tmp_path):
    (cell,) = plan(["swing"], ["none"], [], "simulate", 3, [1e-6], None)
    said = {"iterations": 4, "status": "solved", "details": {"x": 1.0}}
    projection = {"event": "projection", "at": 5.0, "step": 1, "begin": 4.0, "end": 5.0}
    events = [*LINES, projection | {"seconds": 1.0} | said]
    (tmp_path / "events.jsonl").write_text("".join(json.dumps(e) + "\n" for e in events))
    row, steps = unjudged(cell, tmp_path, "time limit of 2 s", "OSError: no")
    words = "the referee failed: OSError: no (0 of 3 steps); before that, time limit of 2 s"
    assert (row["outcome"], row["reason"]) == ("no answer", words)
    assert (row["solve_seconds_mean"], row["setup_seconds"]) == (1.0, 0.5)
    assert (row["iterations_mean"], row["details_mean"]) == (4.0, '{"x": 1.0}')
    assert [(s["seconds"], s["iterations"], s["outcome"]) for s in steps] == [(1.0, 4, "no answer")]


def test_solves_that_take_longer_than_they_say_are_no_answer():
    events = [
        {"event": "projection", "status": "solved", "begin": 0.0, "end": 2.0, "seconds": s}
        for s in (2.0, 1.9)
    ]
    assert judged([certificate("optimal")], done=3, events=events)[0] == "optimal"
    events[0]["seconds"] = 0.0
    outcome, reason = judged([certificate("optimal")], done=3, events=events)
    assert outcome == "no answer"
    assert "the clock was tampered with: solves of 1.90 s by its account took 4.00 s" in reason


def test_the_referee_has_time_in_proportion_to_the_problem():
    assert judge_limit([]) == judge_limit([{"event": "loaded", "variables": 300}])
    assert judge_limit([{"event": "loaded", "variables": 300_000}]) == 10 * judge_limit([])


def test_a_projection_that_came_back_late_is_not_in_time():
    projections = [{"event": "projection", "at": at} for at in (103.0, 109.9, 110.5)]
    events = [{"event": "started", "at": 100.0}, *projections]
    assert _in_time(SimpleNamespace(time_limit=10.0), events) == projections[:2]
    assert _in_time(SimpleNamespace(time_limit=None), events) == projections
