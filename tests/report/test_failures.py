"""Hard cases beside their easier neighbours: scenes, and the table of failures."""

from __future__ import annotations

import json
from dataclasses import replace
from itertools import islice

import numpy as np
import pytest

from strainbench import certify, solve
from strainbench.bench.columns import RUN_COLUMNS, STEP_COLUMNS
from strainbench.bench.records import RUNS, STEPS, append_rows
from strainbench.problem.grid import lumped_areas
from strainbench.report import load_runs, write_report
from strainbench.report.failures import failures
from strainbench.scenario.registry import find_scenario
from strainbench.solver.registry import find_solver
from strainbench.solver.solver import run_solver
from tests.report.test_report import row

Stress = find_scenario("stress")
CASES = ["slivers", "mass-ratio", "displaced", "fast-pins"]


def candidates(scene, steps):
    """What a scene asks to project when nothing is."""
    seen = []
    list(islice(scene.play(lambda target: seen.append(target) or target), steps))
    return seen


@pytest.mark.parametrize("case", CASES)
def test_every_case_is_beyond_its_limits_and_can_be_met(case):
    scene = Stress(case=case, resolution=4)
    rest, _, _, pinned = scene.sheet()
    (candidate,) = candidates(scene, 1)
    problem = scene.problem().with_target(candidate)
    assert np.any(problem.violations(candidate) > 0.05)
    flat = np.column_stack([rest, np.zeros(len(rest))])
    flat += (candidate - flat)[pinned[0]]  # the square as cut, moved with its pins
    assert np.allclose(flat[pinned], candidate[pinned], atol=1e-15)
    assert problem.violations(flat).max() < 1e-12
    assert certify(problem, solve(problem, "newton-ipm").positions).outcome == "optimal"


def test_severity_is_what_it_says():
    widths = np.diff(Stress(case="slivers").sheet()[0][::11, 0])
    assert widths.max() / widths.min() == pytest.approx(100)
    heavy = Stress(case="mass-ratio")
    ratios = heavy.mass() / lumped_areas(*heavy.sheet()[:2])
    assert sorted({round(r, 6) for r in ratios}) == [1, 1e4]
    calm, off = (Stress(case="displaced", severity=s).sheet()[2] for s in (0.0, 1.0))
    lengths = np.linalg.norm(off - calm, axis=1) / Stress().edge
    assert np.sort(lengths) == pytest.approx([0, 0, *[1.0] * (len(lengths) - 2)])
    first, second = candidates(Stress(case="fast-pins"), 2)
    pinned = heavy.sheet()[3]
    assert np.linalg.norm(second - first, axis=1)[pinned] / Stress().edge == pytest.approx(2)


def test_qoco_answers_a_later_frame_like_the_first():
    scene, solver = Stress(case="fast-pins", severity=0.1), find_solver("qoco")
    problem = scene.problem()
    state = solver.prepare(problem)

    def project(target):
        frame = problem.with_target(target)
        used, fresh = (run_solver(solver, frame, s, 1e-6) for s in (state, solver.prepare(frame)))
        assert np.abs(used.positions - fresh.positions).max() < 1e-9 * scene.edge
        return fresh.positions

    list(islice(scene.play(project), 2))


@pytest.mark.parametrize("change", [{"case": "odd"}, {"severity": -1.0}, {"seed": -1}])
def test_wrong_values_are_named(change):
    ((key, value),) = change.items()
    with pytest.raises(ValueError, match=f"{key} is {value!r}"):
        Stress(**change)


def test_a_mass_ratio_needs_masses():
    with pytest.raises(ValueError, match="norm is 'unweighted'"):
        Stress(case="mass-ratio", norm="unweighted")


@pytest.mark.parametrize(
    ("name", "hard", "easy"),
    [
        ("swing", {"limit": 0.001}, {"limit": 0.01}),
        ("stress", {"severity": 1.0}, {"severity": 0.1}),
        ("stretch-square", {"scale_x": 2.0}, {"scale_x": 1.1}),
        ("twist", {"turn_rate": 1200.0}, {"turn_rate": 300.0}),
    ],
)
def test_a_hard_scene_names_its_neighbour_and_that_has_none(name, hard, easy):
    scene = find_scenario(name)(**hard)
    assert scene.easier() == replace(scene, **easy)
    assert scene.easier().easier() is None


def scene_row(solver, parameters, outcome, reason="", **changes):
    scene = find_scenario(parameters["scenario"])
    settings = {k: v for k, v in parameters.items() if k != "scenario"}
    text = json.dumps(scene(**settings).parameters, sort_keys=True)
    about = {"scenario": scene.name, "scenario_parameters": text, "outcome": outcome}
    return row(solver, **about, reason=reason, cell=f"{solver} {text}", **changes)


HARD, EASY = ({"scenario": "stress", "severity": s} for s in (1.0, 0.1))
PAST, WITHIN = ({"scenario": "twist", "turn_rate": r} for r in (1200.0, 300.0))
TORN = "1 of 1 projections: infeasible: pinned vertices ... at worst"
ROWS = [
    (scene_row("best", HARD, "optimal"), "solved"),
    (scene_row("weak", HARD, "violated", "...", max_violation=3e-3), "iteration limit"),
    (scene_row("weak", EASY, "optimal"), "solved"),
    (scene_row("rough", HARD, "feasible", "...", relative_gap_max=0.05), "solved"),
    (scene_row("rough", EASY, "feasible", "..."), "solved"),
    (
        scene_row("lost", HARD, "no answer", "time limit of 9 s (0 of 10 steps)")
        | {"steps_done": 0},
        None,
    ),
    (scene_row("lost", EASY, "violated", "..."), "time limit"),
    (scene_row("proud", HARD, "no answer", "unsupported: too thin (0 of 3 steps)"), None),
    (scene_row("alone", HARD, "no answer", "crashed (0 of 3 steps)"), None),
    (scene_row("absent", HARD, "no answer", "unavailable: needs absent"), None),
    (scene_row("none", HARD, "violated", "..."), "not limited"),
    (scene_row("best", PAST, "no answer", "positions that are ..."), "PrimalInfeasible"),
    (scene_row("weak", PAST, "violated", TORN), "iteration limit"),
    (scene_row("liar", PAST, "violated", TORN, max_violation=0.02), "solved"),
    (scene_row("liar", WITHIN, "violated", "violation 2e-2 above 1e-6"), "solved"),
]


@pytest.fixture
def folder(tmp_path):
    append_rows(tmp_path / RUNS, RUN_COLUMNS, [r for r, _ in ROWS])
    steps = [
        {"cell": r["cell"], "step": 1, "projection": 1, "outcome": r["outcome"], "status": status}
        for r, status in ROWS
        if status
    ]
    append_rows(tmp_path / STEPS, STEP_COLUMNS, steps)
    return tmp_path


STRESS, TWIST = "stress, severity 1", "twist, turn_rate 1200"
METHODS, SHARED = (
    "severity 0.1: the method's",
    "severity 0.1 too: by its nature, or a fault of ours",
)


@pytest.mark.parametrize(
    ("case", "method", "sign", "found", "verdict"),
    [
        (STRESS, "best", "✓", "", ""),
        (STRESS, "weak", "✗", "violated by 3e-3, says iteration limit", f"optimal at {METHODS}"),
        (STRESS, "rough", "○", "gap 5e-2, 0.0090 mm", f"feasible at {SHARED}"),
        (STRESS, "lost", "✗", "out of time, 0 of 10", f"violated at {SHARED}"),
        (STRESS, "alone", "✗", "crashed", "not run at severity 0.1"),
        (STRESS, "proud", "✗", "unsupported: too thin", "refused"),
        (TWIST, "best", "✓", "says infeasible", ""),
        (TWIST, "weak", "○", "iteration limit", "not run at turn_rate 300"),
        (
            TWIST,
            "liar",
            "✗",
            "says solved, violated by 2e-2",
            "violated at turn_rate 300 too: by its nature, or a fault of ours",
        ),
    ],
)
def test_each_failure_has_its_sign_and_its_neighbour(folder, case, method, sign, found, verdict):
    table = failures(folder, load_runs(folder)).set_index(["case", "method"])
    line = table.loc[(case, method)]
    assert (line["sign"], line["found"], line["verdict"]) == (sign, found, verdict)


def test_what_is_not_there_has_no_line(folder):
    table = failures(folder, load_runs(folder))
    assert not {"absent", "none"} & set(table["method"])
    assert set(table["case"]) == {STRESS, TWIST}


def test_the_report_writes_the_table(folder):
    paths = write_report(folder)
    assert folder / "failures.csv" in paths
    text = (folder / "failures.md").read_text()
    assert f"| method | {STRESS} | {TWIST} |" in text
    assert "| rough | ○ gap 5e-2, 0.0090 mm † |  |" in text
    assert f"- weak: violated by 3e-3, says iteration limit; optimal at {METHODS}" in text


def test_runs_of_one_case_in_other_ways_are_cases_of_their_own(folder):
    longer = scene_row("weak", HARD, "optimal", steps_asked=20) | {"cell": "longer"}
    append_rows(folder / RUNS, RUN_COLUMNS, [longer])
    table = failures(folder, load_runs(folder)).set_index(["case", "method"])
    assert table.loc[(f"{STRESS}, steps_asked 20", "weak")]["sign"] == "✓"
    assert table.loc[(f"{STRESS}, steps_asked 10", "weak")]["sign"] == "✗"


def test_a_folder_without_hard_cases_has_no_table(tmp_path):
    append_rows(tmp_path / RUNS, RUN_COLUMNS, [scene_row("best", EASY, "optimal"), row("mine")])
    assert not len(failures(tmp_path, load_runs(tmp_path)))
