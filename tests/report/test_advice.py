"""Which method reaches an accuracy within a time: the answer is what the raw rows say."""

from __future__ import annotations

import csv
import json
import shlex
import statistics
import subprocess
import sys
from math import inf
from pathlib import Path

import pytest

from strainbench.bench.columns import RUN_COLUMNS, STEP_COLUMNS
from strainbench.bench.plan import plan_scenarios
from strainbench.bench.records import RUNS, STEPS, append_rows, latest_runs
from strainbench.bench.settings import parse_settings
from strainbench.report.advice import advise
from strainbench.report.candidate import Records
from strainbench.report.question import Question
from tests.command import command
from tests.report.test_report import row

FIELD = Path(__file__).parent / "records/field"
COLUMNS = {"mm": ("distance_max", 1e-3), "gap": ("relative_gap_max", 1)}
COLUMNS |= {"violation": ("max_violation", 1)}


def table(name):
    with (FIELD / name).open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def by_hand(resolution, most, unit, seconds):
    """The methods that meet both, the fastest first; from the rows of the files alone."""
    times, failed = {}, {}
    for step in table("steps.csv"):
        if step["outcome"] not in ("optimal", "feasible"):
            failed.setdefault(step["cell"], []).append(step["status"])
        if int(step["active_constraints"] or 0) > 0:
            times.setdefault(step["cell"], []).append(float(step["seconds"]))
    column, size = COLUMNS[unit]
    found = []
    for run in table("runs.csv"):
        done = run["steps_done"] == run["steps_asked"]
        counts = run["outcome"] in ("optimal", "feasible") or (
            unit == "violation" and run["outcome"] == "violated"
        )
        cut_off = [("time" in s or "user_limit" in s) for s in failed.get(run["cell"], [])]
        counts = counts and not (cut_off and all(cut_off))
        if int(run["resolution"]) != resolution or not (done and counts) or run["solver"] == "none":
            continue
        reached = float(run[column] or inf)
        if unit == "mm":
            reached = max(reached, float(run["reference_error_max"]))
        if statistics.median(times[run["cell"]]) <= seconds and reached <= most * size:
            found.append((statistics.median(times[run["cell"]]), run["solver"]))
    return [name for _, name in sorted(found)]


@pytest.fixture(scope="module")
def records():
    return Records.of([FIELD])


def answer(records, words, to, within, per="projection", solvers=None):
    chosen = parse_settings(words)
    (scene,) = plan_scenarios(["swing"], chosen)
    return advise(Question.read(to, within, per), "swing", scene, chosen, records, solvers)


@pytest.mark.parametrize("resolution", [20, 40])
@pytest.mark.parametrize(
    ("most", "unit"), [(0.1, "mm"), (0.003, "mm"), (20, "mm"), (1e-6, "gap"), (1e-1, "violation")]
)
@pytest.mark.parametrize("ms", [20, 3000])
def test_the_answer_is_that_of_the_raw_rows(records, resolution, most, unit, ms):
    found = answer(records, [f"resolution={resolution}"], f"{most}{unit}", f"{ms}ms").found
    assert [c.row["solver"] for c in found] == by_hand(resolution, most, unit, ms / 1e3)


def test_the_question_of_the_sheet(monkeypatch, capsys):
    asked = ["--to", "0.1mm", "--within", "20ms", "--results", FIELD]
    coarse = command(monkeypatch, capsys, "recommend", "swing", "--set", "resolution=20", *asked)
    assert coarse.returncode == 0
    assert "within 20 ms a projection: newton-ipm (11 ms, 0.0020 mm)." in coarse.stdout
    assert "Nearest misses: clarabel takes 3.5× the time;" in coarse.stdout
    fine = command(monkeypatch, capsys, "recommend", "swing", "--set", "resolution=60", *asked)
    assert fine.returncode == 3
    assert "not measured; there is 20×20 at 1%, 40×40 at 1%." in fine.stdout
    assert "strainbench run swing --set resolution=60 --solver" in fine.stdout


def test_where_one_of_two_scenes_has_no_answer_the_status_says_so(monkeypatch, capsys, tmp_path):
    words = ["--to", "100um", "--within", "0.02s", "--results", FIELD, "-o", tmp_path / "a.csv"]
    done = command(monkeypatch, capsys, "recommend", "swing", "--set", "resolution=20,40", *words)
    assert done.returncode == 3
    assert "none of those measured. Nearest" in " ".join(done.stdout.split())
    lines = list(csv.DictReader((tmp_path / "a.csv").read_text().splitlines()))
    assert {line["scene"] for line in lines} == {"swing 20 at 1%", "swing 40 at 1%"}
    assert [line["solver"] for line in lines if line["meets"] == "1"] == ["newton-ipm"]


def test_nothing_on_the_front_is_beaten_and_all_else_is(records):
    found = answer(records, ["resolution=20"], "0.1mm", "20ms")
    points = {c.name: (c.time.median, c.reached) for c in found.candidates}
    front = {c.name for c in found.front}
    assert "newton-ipm" in front
    for name, (seconds, reached) in points.items():
        better = [n for n, (s, r) in points.items() if s < seconds and r < reached]
        assert not (better and name in front)
        assert better or name in front or (seconds, reached) in [points[n] for n in front]


def test_what_ran_out_of_time_or_violates_is_left_out_with_its_reason(records):
    left = answer(records, ["resolution=40"], "0.1mm", "20ms").left_out
    assert left["dykstra"] == "out of time, 7 of 8 steps"
    assert left["ipopt-edges"] == "violates by 3e-2"
    assert "none" not in left


@pytest.mark.parametrize("words", [["limit=2%"], ["resolution=20", "limit=2%"]])
def test_other_settings_are_not_taken_for_the_scene(records, words):
    found = answer(records, words, "0.1mm", "20ms")
    assert not found.candidates
    assert not found.left_out


# --- made rows


def made(folder, *rows, steps=()):
    folder.mkdir(exist_ok=True)
    (scene,) = plan_scenarios(["swing"], parse_settings(["resolution=10"]))
    parameters = json.dumps(dict(scene.parameters))
    append_rows(folder / RUNS, RUN_COLUMNS, [r | {"scenario_parameters": parameters} for r in rows])
    append_rows(folder / STEPS, STEP_COLUMNS, steps)
    return folder


def steps(cell, *seconds, euler=0.0):
    facts = {"outcome": "optimal", "status": "solved", "active_constraints": 5}
    return [
        {"cell": cell, "step": k, "projection": k, "seconds": s, "ie_seconds": euler} | facts
        for k, s in enumerate(seconds, start=1)
    ]


def cell_of(solver, **values):
    facts = {"cell": solver, "distance_max": 2e-5, "reference_error_max": 1e-9}
    return row(solver, resolution=10, **(facts | values))


def test_a_step_is_its_projections_and_its_physics(tmp_path):
    rows = [cell_of("a", mode="simulate"), cell_of("b", mode="replay")]
    both = steps("a", 0.01, 0.02, 0.03, euler=0.1) + steps("b", 0.01, 0.02, 0.03, euler=0.1)
    both[1]["step"] = 1  # two projections in the first step of a
    records = Records.of([made(tmp_path / "r", *rows, steps=both)])
    found = answer(records, ["resolution=10"], "1mm", "1s", "step")
    assert [(c.row["solver"], c.time.median) for c in found.found] == [
        ("b", pytest.approx(0.02)),
        ("a", pytest.approx(0.13)),
    ]
    assert "Replayed frames have no physics: their steps are projections alone." in found.foot()
    assert [c.time.median for c in answer(records, ["resolution=10"], "1mm", "1s").found] == [
        pytest.approx(0.02)
    ] * 2


def test_a_distance_below_what_is_known_of_the_reference_is_not_believed(tmp_path):
    rows = [cell_of("a", distance_max=1e-6, reference_error_max=2e-4)]
    records = Records.of([made(tmp_path / "r", *rows, steps=steps("a", 0.01))])
    (candidate,) = answer(records, ["resolution=10"], "0.1mm", "1s").candidates
    assert not candidate.meets
    assert candidate.accuracy == "<0.20"
    assert candidate.missing == "2.0× the distance"


def test_rows_of_one_method_are_told_apart_by_how_they_ran(tmp_path):
    rows = [cell_of("a"), cell_of("a", cell="a2", tolerance=1e-3)]
    known = steps("a", 0.02) + steps("a2", 0.01)
    records = Records.of([made(tmp_path / "r", *rows, steps=known)])
    found = answer(records, ["resolution=10"], "1mm", "1s")
    assert [c.name for c in found.found] == ["a (tolerance 0.001)", "a (tolerance 1e-06)"]


def test_rows_measured_beside_other_work_are_named(tmp_path):
    rows = [cell_of("a", load=2.13), cell_of("b", load=0.3)]
    known = steps("a", 0.02) + steps("b", 0.01)
    records = Records.of([made(tmp_path / "r", *rows, steps=known)])
    lines = answer(records, ["resolution=10"], "1mm", "1s").foot()
    assert "Measured beside other work: a (load 2.1)." in lines


@pytest.mark.parametrize(
    ("values", "to", "fault"),
    [
        ({"relative_gap_max": ""}, "1e-4gap", "nothing is known of its gap"),
        ({"reference_error_max": inf}, "1mm", "nothing is known of its distance"),
        (
            {"outcome": "no answer", "reason": "unavailable: x", "steps_done": 0},
            "1mm",
            "not installed",
        ),
    ],
)
def test_rows_of_which_nothing_is_known_are_left_out_and_say_so(tmp_path, values, to, fault):
    records = Records.of([made(tmp_path / "r", cell_of("a", **values), steps=steps("a", 0.01))])
    found = answer(records, ["resolution=10"], to, "1s")
    assert not found.candidates
    assert found.left_out == {"a": fault}
    assert "none of those measured" in found.head()[0]


def test_several_folders_are_one_record(tmp_path):
    one = made(tmp_path / "one", cell_of("a"), steps=steps("a", 0.02))
    two = made(tmp_path / "two", cell_of("b"), steps=steps("b", 0.01))
    found = answer(Records.of([one, two, one]), ["resolution=10"], "1mm", "1s")
    assert [c.row["solver"] for c in found.found] == ["b", "a"]


def test_names_with_signs_are_text(tmp_path, monkeypatch, capsys):
    name = "a|b & 5%_<i>[red]"
    folder = made(tmp_path / "r", cell_of(name), steps=steps(name, 0.02))
    words = ["--set", "resolution=10", "--to", "1mm", "--within", "1s", "--results", folder]
    done = command(monkeypatch, capsys, "recommend", "swing", *words, "-o", tmp_path / "a.md")
    assert done.returncode == 0
    assert name in done.stdout
    assert r"a\|b" in (tmp_path / "a.md").read_text()


# --- what is missing


@pytest.mark.slow
def test_the_command_measures_what_is_missing_like_what_is_there(tmp_path, monkeypatch, capsys):
    folder = tmp_path / "r"
    words = ["--set", "resolution=4", "--steps", "5", "--mode", "replay", "--time-limit", "30"]
    words += ["--results", folder]
    command(monkeypatch, capsys, "run", "swing", "--solver", "newton-ipm", *words)
    asked = ["recommend", "swing", "--set", "resolution=4", "--to", "1mm", "--within", "1min"]
    asked[-1] = "60s"
    asked += ["--solver", "newton-ipm,gauss-seidel", "--results", folder]
    before = command(monkeypatch, capsys, *asked)
    assert "Not measured: gauss-seidel." in before.stdout
    line = next(x for x in before.stdout.splitlines() if x.startswith("strainbench run"))
    expected = ["strainbench", "run", "swing", "--set", "resolution=4", "--solver", "gauss-seidel"]
    expected += ["--mode", "replay", "--steps", "5", "--time-limit", "30", "--results", str(folder)]
    assert shlex.split(line) == expected
    after = command(monkeypatch, capsys, *asked, "--measure")
    assert "Not measured" not in after.stdout
    rows = list(latest_runs(folder).values())
    assert {r["solver"] for r in rows} == {"newton-ipm", "gauss-seidel"}
    assert {(r["mode"], r["steps_asked"], r["time_limit"]) for r in rows} == {
        ("replay", "5", "30.0")
    }
    again = command(monkeypatch, capsys, *asked, "--measure")
    assert "cells in" not in again.stdout


def test_no_chart_is_loaded_for_an_answer():
    words = ["recommend", "swing", "--to", "1mm", "--within", "1s", "--results", str(FIELD)]
    code = f"import sys; sys.argv[1:] = {words}; from strainbench.cli.app import main\n"
    code += "try:\n    main()\nfinally:\n    print({'matplotlib', 'cvxpy'} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.stdout.endswith("set()\n"), done.stdout + done.stderr


# --- nonsense


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ({"--to": "0.1"}, "--to 0.1: a number above 0 with mm, um, nm, cm or m, gap or violation"),
        ({"--to": "0.1 furlongs"}, "--to 0.1 furlongs: a number above 0 with mm"),
        ({"--to": "0mm"}, "--to 0mm: a number above 0"),
        ({"--to": "-1mm"}, "--to -1mm: a number above 0"),
        ({"--to": "nanmm"}, "--to nanmm: a number above 0"),
        ({"--to": "1e999mm"}, "--to 1e999mm: a number above 0"),
        ({"--to": "mm"}, "--to mm: a number above 0"),
        ({"--to": " "}, "--to ' ': a number above 0"),
        ({"--to": "20ms"}, "--to 20ms: a number above 0"),
        ({"--within": "20"}, "--within 20: a number above 0 with s, ms or us right behind it"),
        ({"--within": "1mm"}, "--within 1mm: a number above 0 with s, ms or us"),
        ({"--within": "1e-4gap"}, "--within 1e-4gap: a number above 0 with s"),
        ({"--per": "frame"}, "--per frame: valid are projection, step"),
        ({"--set": "colour=red"}, "swing has no setting 'colour'; valid are"),
        ({"--set": "clarabel.x=1"}, "--set clarabel.…: settings of swing alone are valid"),
        ({"--set": "resolution=-1"}, "resolution"),
        ({"--solver": "clarabell"}, "--solver clarabell: neither a solver of ours nor in"),
        ({"--solver": ","}, "--solver"),
        ({"-o": "answer.pdf"}, "-o answer.pdf: a name that ends in .csv, .md is valid"),
        ({"--results": "results/none"}, "holds no results"),
    ],
)
def test_nonsense_is_one_line(monkeypatch, capsys, words, said):
    options = {"--to": "1mm", "--within": "20ms", "--results": str(FIELD)} | words
    flat = [word for pair in options.items() for word in pair]
    done = command(monkeypatch, capsys, "recommend", "swing", *flat)
    assert done.returncode in (1, 2)
    assert done.stderr.startswith("strainbench: ")
    assert said in done.stderr
    assert done.stderr.count("\n") == 1


def test_an_empty_folder_is_said_in_a_line(monkeypatch, capsys, tmp_path):
    words = ["--to", "1mm", "--within", "20ms", "--results", tmp_path]
    done = command(monkeypatch, capsys, "recommend", "swing", *words)
    assert done.returncode == 1 or done.returncode == 2
    assert f"{tmp_path} holds no results" in done.stderr
    assert done.stderr.count("\n") == 1


@pytest.mark.parametrize(
    "to", ["0.1mm", "100 um", "100µm", "1e-4m", ".01cm", "1e5nm", "1e-4gap", "1e-4 violation"]
)
def test_units(to):
    assert Question.read(to, "20ms", "step").accuracy.most == pytest.approx(1e-4)
