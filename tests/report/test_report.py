"""Tables, chart and page from rows whose every case is known."""

from __future__ import annotations

import json
from xml.etree import ElementTree

import pandas as pd
import pytest

from strainbench.bench.columns import RUN_COLUMNS, STEP_COLUMNS
from strainbench.bench.records import MACHINES, RUNS, STEPS, RecordsError, append_rows
from strainbench.document import Faint
from strainbench.report import load_runs, write_report
from strainbench.report.charts import Target, sweep
from strainbench.report.energy import energies
from strainbench.report.lines import accuracy_of, ending_text, measures_of
from strainbench.report.measures import measured
from strainbench.report.names import digits_of
from strainbench.report.page.vega import vega_script
from strainbench.report.steps import newest_steps
from strainbench.report.sweep import beyond, sweeps
from strainbench.report.table import as_markdown, explanation, groups, ledger, mark
from strainbench.report.warm import pairs


def row(solver, **changes):
    """A row that is optimal on all of 10 steps, with changes."""
    base = {
        **dict.fromkeys(RUN_COLUMNS, ""),
        **{"schema": 1, "cell": f"{solver}{changes}", "scenario": "swing", "resolution": 10},
        **{"limit": 0.01, "directions": 4, "integrator": "sap", "solver": solver},
        **{"tolerance": 1e-6, "mode": "simulate", "steps_asked": 10, "steps_done": 10},
        **{"outcome": "optimal", "solve_seconds_mean": 0.02, "ie_seconds_mean": 0.005},
        **{"max_violation": 3e-9, "relative_gap_max": 2e-6, "distance_max": 9e-6},
        **{"reference_error_max": 1e-6, "projections_violated": 0, "violation_threshold": 1e-6},
        **{"gap_threshold": 1e-4, "machine": "a machine", "scenario_parameters": "{}"},
    }
    return base | changes


ROWS = [
    row("none", outcome="violated", projections_violated=8, max_violation=0.4),
    row("good"),
    row("good", resolution=20, solve_seconds_mean=0.1, details_mean='{"inner_seconds": 0.01}'),
    row("loose", outcome="violated", projections_violated=3, reason="3 of 10 projections: ..."),
    row("slow", outcome="no answer", steps_done=4, reason="time limit of 9 s (4 of 10 steps)"),
    row("broken", outcome="no answer", steps_done=2, reason="crashed: ... (2 of 10 steps)"),
    row(
        "absent",
        outcome="no answer",
        steps_done=0,
        reason="unavailable: needs absent",
        solve_seconds_mean="",
        max_violation="",
        relative_gap_max="",
        distance_max="",
        reference_error_max="",
    ),
]


@pytest.fixture
def folder(tmp_path):
    append_rows(tmp_path / RUNS, RUN_COLUMNS, ROWS)
    facts = {"memory_gb": 8, "system": "Linux", "python": "3.11", "threads_per_solver": 1}
    (tmp_path / MACHINES).write_text(
        json.dumps({"a machine": facts | {"packages": {"numpy": "2"}}})
    )
    return tmp_path


@pytest.fixture
def by_solver(folder):
    runs = load_runs(folder)
    return {r["solver"]: r for _, r in runs[runs["resolution"] == 10].iterrows()}


@pytest.mark.parametrize(
    ("solver", "sign", "text"),
    [
        ("good", "", "✓ optimal"),
        ("loose", "*", "✗ violates by 3e-9"),
        ("slow", "*", "✗ out of time, 4 of 10"),
        ("broken", "-", "✗ crashed"),
        ("absent", "-", "✗ not installed"),
    ],
)
def test_marks_follow_the_referee(by_solver, solver, sign, text):
    assert mark(by_solver[solver]) == sign
    assert ending_text(by_solver[solver]) == text


def test_accuracy_stands_beside_the_time(by_solver):
    assert accuracy_of(by_solver["good"]) == ("3e-9", "2e-6", "0.0090")
    assert accuracy_of(by_solver["absent"]) == ("", "", "")


def test_numbers_that_do_not_count_are_faint_and_those_not_known_absent(by_solver):
    assert [type(text) for text in measures_of(by_solver["good"])[3:]] == [str] * 5
    _, *numbers = measures_of(by_solver["loose"])
    assert {type(text) for text in numbers} == {Faint}
    assert numbers[2:] == ["20", "3e-9", "2e-6", "0.0090", ""]
    assert measures_of(by_solver["absent"]) == ["✗ not installed", *[""] * 7]


def test_the_median_is_over_projections_that_had_something_to_do(folder):
    free = {"cell": ROWS[1]["cell"], "step": 1, "seconds": 1e-4, "active_constraints": 0}
    busy = [free | {"seconds": s, "active_constraints": 7} for s in (0.011, 0.012, 0.023)]
    append_rows(folder / STEPS, STEP_COLUMNS, [free, *busy])
    text = as_markdown(load_runs(folder), {})
    line = next(line for line in text.splitlines() if "| **good** |" in line)
    expected = (
        "| 1% | 10×10 | **good** | ✓ optimal | **12** | 12 to 18 | 20 | 3e-9 | 2e-6 | 0.0090 |  |"
    )
    assert line == expected


def test_only_the_fastest_optimal_cell_stands_out_and_the_order_is_outcome_then_time(tmp_path):
    text = table_of(
        tmp_path,
        row("wrong", solve_seconds_median=0.001, outcome="violated"),
        row("near", solve_seconds_median=0.002, outcome="feasible"),
        row("second", solve_seconds_median=0.04),
        row("first", solve_seconds_median=0.03),
    )
    lines = [line for line in text.splitlines() if line.startswith("| 1% |")]
    names = [line.split(" | ")[2] for line in lines]
    assert names == ["**first**", "second", "near", "wrong"]
    assert text.count("**") == 2 * 3  # in the explanation too
    assert "| (1.0) |" in lines[-1]


def test_where_nothing_is_optimal_nothing_stands_out(tmp_path):
    text = table_of(tmp_path, row("near", solve_seconds_median=0.002, outcome="feasible"))
    assert "| near | ○ within the limits | 2.0 |" in text
    assert "nan" not in text


def test_infeasible_frames_have_no_part_in_the_references_error(folder):
    torn = row("torn", outcome="violated", reference_error_max="inf", projections_violated=1)
    append_rows(folder / RUNS, RUN_COLUMNS, [torn])
    assert "certified to within 0.001 mm" in " ".join(explanation(load_runs(folder)).split())


def test_the_table_has_the_papers_shape(folder):
    (group,) = groups(load_runs(folder))
    assert group.meshes == ["10×10", "20×20"]
    assert group.implicit_euler() == {"10×10": pytest.approx(0.005)}
    coarse, fine = group.blocks()
    assert list(coarse["solver"]) == ["good", "loose", "slow", "broken", "absent"]
    assert list(fine["solver"]) == ["good"]


def test_every_file_is_written_and_every_failure_shown(folder):
    paths = write_report(folder)
    assert all(p.stat().st_size > 0 for p in paths)
    markdown = (folder / "table1.md").read_text()
    page = (folder / "index.html").read_text()
    for words in ("time limit of 9 s", "crashed", "unavailable: needs absent", "inner seconds"):
        assert words in markdown
        assert words in page
    table = pd.read_csv(folder / "table1.csv")
    assert len(table) == len(ROWS)
    assert "http" not in page.replace(vega_script(), "").replace("http://www.w3.org", "")


def test_the_chart_names_every_solver_failed_ones_too(folder):
    write_report(folder)
    text = "".join(ElementTree.parse(folder / "speed-accuracy.svg").getroot().itertext())
    for name in ("good", "loose by 3e-9", "slow 4/10 steps", "broken crashed"):
        assert name in text
    assert "absent not installed" in text


def test_total_energy_is_drawn_against_time(folder):
    cells = [r["cell"] for r in ROWS[:2]]
    steps = [
        {"cell": c, "step": k, "time": 0.1 * k, "kinetic_energy": 2e-3, "gravity_energy": -k * 1e-3}
        | {"membrane_energy": 0.0, "bending_energy": 0.0}
        for c in cells
        for k in (1, 2, 3)
    ]
    append_rows(folder / STEPS, STEP_COLUMNS, steps)
    table = energies(folder, load_runs(folder))
    assert table["energy"].tolist() == pytest.approx(2 * [1e-3, 0.0, -1e-3])
    assert table["curve"].str.startswith("IE").tolist() == 3 * [True] + 3 * [False]
    assert folder / "energy.png" in write_report(folder)
    rows = (folder / "energy.md").read_text().splitlines()[-2:]
    assert all("| 3 | 0.3 | 1 | 1 | -1 | 1 | 0 |" in r for r in rows)  # [mJ]; 0 to -1 at the end
    assert all(r.endswith("| 0 |") for r in rows)  # no turns


def test_a_scene_without_physics_has_no_energy_and_contact_counts(folder):
    cells = [r["cell"] for r in ROWS[:2]]
    steps = [
        {"cell": cells[0], "step": 1, "time": 0.0, "kinetic_energy": "nan"},
        {"cell": cells[1], "step": 1, "time": 0.1, "kinetic_energy": 2e-3, "contact_energy": 1e-3},
    ]
    append_rows(folder / STEPS, STEP_COLUMNS, steps)
    assert energies(folder, load_runs(folder))["energy"].tolist() == pytest.approx([3e-3])


def test_a_motion_that_is_stuck_ends_its_energies(folder):
    about = {"cell": ROWS[1]["cell"], "kinetic_energy": 1e-3, "newton_converged": "False"}
    steps = [about | {"step": k, "time": 0.1 * k, "newton_iterations": 3 - k} for k in (1, 2, 3)]
    append_rows(folder / STEPS, STEP_COLUMNS, steps)
    assert energies(folder, load_runs(folder))["time"].tolist() == pytest.approx([0.1, 0.2])


def test_three_values_of_a_setting_make_a_sweep(tmp_path):
    swept = [
        row(s, limit=v, scenario_parameters=json.dumps({"limit": v, "resolution": 10}))
        for v in (0.01, 0.001, 0.1)
        for s in ("good", "none")
    ]
    append_rows(tmp_path / RUNS, RUN_COLUMNS, swept)
    runs = load_runs(tmp_path)
    assert list(sweeps(runs)) == ["limit"]
    assert sweeps(runs)["limit"]["value"].tolist() == [0.001, 0.01, 0.1]
    assert tmp_path / "sweep-limit.png" in write_report(tmp_path)
    lines = (tmp_path / "sweeps.md").read_text().splitlines()
    assert [line.split(" | ")[0] for line in lines if line.startswith("| 0")] == [
        "| 0.001",
        "| 0.01",
        "| 0.1",
    ]


def test_exact_directions_come_last_in_their_sweep_and_the_true_stretch_shows(tmp_path):
    stretches = {"exact": 1.01, 8: 1.016, 2: 1.25, 4: 1.04}
    swept = [
        row("good", directions=m, scenario_parameters=json.dumps({"directions": m}))
        | {"max_principal_stretch": stretch, "needs": "gravity", "variables": 9, "nonzeros": 9}
        for m, stretch in stretches.items()
    ]
    append_rows(tmp_path / RUNS, RUN_COLUMNS, swept)
    runs = load_runs(tmp_path)
    assert list(sweeps(runs)) == ["directions"]
    assert sweeps(runs)["directions"]["shown"].tolist() == ["2", "4", "8", "exact"]
    assert beyond(sweeps(runs)["directions"]).tolist() == pytest.approx([0.24, 0.03, 0.006, 0])
    write_report(tmp_path)
    lines = (tmp_path / "sweeps.md").read_text().splitlines()[-4:]
    assert [line.split(" | ")[0] for line in lines] == ["| 2", "| 4", "| 8", "| exact"]
    assert [line.split(" | ")[-1] for line in lines] == ["0.24 |", "0.03 |", "0.006 |", "0 |"]
    drawn = "".join(ElementTree.parse(tmp_path / "sweep-directions.svg").getroot().itertext())
    assert "exact" in drawn
    assert set(ledger(runs)["directions"]) == {"2", "4", "8", "exact"}


def test_scenes_with_other_settings_have_tables_of_their_own(tmp_path):
    steps = [row("good", scenario_parameters=json.dumps({"step": h})) for h in (0.01, 0.02)]
    append_rows(tmp_path / RUNS, RUN_COLUMNS, steps)
    assert len(list(groups(load_runs(tmp_path)))) == 2


def test_nothing_to_report_is_one_line(tmp_path):
    with pytest.raises(RecordsError, match="holds no results"):
        write_report(tmp_path)


def test_cold_and_warm_starts_stand_side_by_side(tmp_path):
    warm = {"solver_parameters": '{"warm": true}'}
    slow = {"solve_seconds_median": 0.03, "iterations_mean": 12, "distance_max": 1e-3}
    fast = {"solve_seconds_median": 0.02, "iterations_mean": 5, "distance_max": 2e-3}
    rows = [
        row("good-warm", **fast, **warm),
        row("other"),
        row("good", **slow),
        row("good", **slow, mode="replay"),
        row("alone-warm", **fast, **warm),
        row("misleading-warm", **fast),
        row("misleading", **slow),
    ]
    append_rows(tmp_path / RUNS, RUN_COLUMNS, rows)
    runs = load_runs(tmp_path)
    (pair,) = pairs(runs)
    expected = ("swing 10×10, simulate", "1%", "good", "1.50", "12", "5", "1.0", "2.0")
    assert pair.line() == expected
    first = next(group for group in groups(runs) if "simulate" in group.title)
    (cells,) = first.blocks()
    assert list(cells["solver"])[-2:] == ["good", "misleading"]  # as fast as each other
    markdown = as_markdown(runs, {})
    assert f"| {' | '.join(expected)} |" in markdown
    assert "Cold and warm" not in as_markdown(runs[runs["solver"] == "other"], {})


# --- what would mislead


def table_of(tmp_path, *rows):
    append_rows(tmp_path / RUNS, RUN_COLUMNS, rows)
    return as_markdown(load_runs(tmp_path), {})


def test_every_table_has_its_chart_and_the_page_has_all(tmp_path):
    rows = [row("good"), row("good", mode="replay"), row("other", scenario="twist")]
    append_rows(tmp_path / RUNS, RUN_COLUMNS, rows)
    paths = write_report(tmp_path)
    charts = [p.name for p in paths if p.name.startswith("speed") and p.suffix == ".svg"]
    assert charts == ["speed-accuracy.svg", "speed-accuracy-2.svg", "speed-accuracy-3.svg"]
    titles = ["".join(ElementTree.parse(tmp_path / c).getroot().itertext()) for c in charts]
    assert ["replay" in title for title in titles] == [True, False, False]
    page = (tmp_path / "index.html").read_text()
    names = ("", "-2", "-3")
    assert all(f'data-chart="speed-accuracy{name}"' in page for name in names)


def test_steps_that_differ_in_the_fifth_digit_are_told_apart(tmp_path):
    steps = [row("good", scenario_parameters=json.dumps({"step": h})) for h in (0.01666, 0.016664)]
    text = table_of(tmp_path, *steps)
    assert "step 0.01666," in text
    assert "step 0.016664," in text
    assert digits_of([1 / 60]) == 4


@pytest.mark.parametrize("seconds", ["", 0.0])
def test_there_is_no_row_of_implicit_euler_where_it_did_not_run(tmp_path, seconds):
    rows = [row("none", ie_seconds_mean=seconds), row("good", ie_seconds_mean=seconds)]
    text = table_of(tmp_path, *rows)
    assert "implicit Euler" not in text
    assert "0.0000" not in text


def test_a_mesh_from_a_file_is_called_by_it(tmp_path):
    about = {"scenario": "garment", "resolution": 20, "directions": 4, "constraints": 2048}
    text = table_of(
        tmp_path,
        row("good", scenario_parameters=json.dumps({"path": "of/shirt.obj"}), **about),
        row("skirt", scenario_parameters=json.dumps({"path": "", "resolution": 20}), **about),
    )
    assert "| shirt.obj, 512 elements |" in text
    assert "| resolution 20, 512 elements |" in text
    assert "20×20" not in text


def test_a_scene_without_limit_or_resolution_stays_in_table_and_ledger(tmp_path):
    bare = {"limit": "", "resolution": "", "variables": 9, "constraints": 8, "nonzeros": 7}
    text = table_of(tmp_path, row("good", **bare), row("better", **bare))
    assert "|  | 2 elements | **good** |" in text
    assert "|  | 2 elements | better |" in text
    assert "| swing |  | 2 elements | 4 | 9 | 8 |  | 7 |" in text


def test_the_ledger_keeps_meshes_of_other_sizes_apart(tmp_path):
    sizes = {"nonzeros": 7, "constraints": 800}
    rows = [
        row("good", scenario_parameters=json.dumps({"seed": k}), variables=v, **sizes)
        for k, v in ((1, 300), (2, 294))
    ]
    append_rows(tmp_path / RUNS, RUN_COLUMNS, rows)
    assert ledger(load_runs(tmp_path))["variables"].tolist() == [300, 294]


def test_a_distance_that_the_reference_does_not_resolve_is_a_bound(tmp_path):
    rows = [row("near", distance_max=2e-6, reference_error_max=3e-6)]
    append_rows(tmp_path / RUNS, RUN_COLUMNS, rows)
    (near,) = (r for _, r in load_runs(tmp_path).iterrows())
    assert accuracy_of(near) == ("3e-9", "2e-6", "<0.0030")


def test_a_line_is_broken_where_a_cell_has_no_answer(tmp_path):
    outcomes = {0.01: "optimal", 0.02: "no answer", 0.03: "violated", 0.05: "optimal"}
    swept = [
        row("good", outcome=o, scenario_parameters=json.dumps({"step": h}))
        for h, o in outcomes.items()
    ]
    append_rows(tmp_path / RUNS, RUN_COLUMNS, swept)
    runs = load_runs(tmp_path)
    runs = measured(runs, newest_steps(tmp_path, runs))
    chart, *_ = sweep(runs, Target.PAGE)["step"]
    layers = {layer["mark"]["type"]: layer["data"]["values"] for layer in chart.spec["layer"]}
    assert [(p["x"], p["part"]) for p in layers["line"]] == [(0.01, "good 0"), (0.05, "good 2")]
    assert [p["x"] for p in layers["point"]] == [0.01, 0.05]
    said = [
        row["text"]
        for layer in chart.spec["layer"]
        for row in layer["data"]["values"]
        if "text" in row
    ]
    assert "good at 0.02: no answer, at 0.03: by 3e-9" in said


def test_other_ways_to_run_are_other_lines_of_a_sweep(tmp_path):
    swept = [
        row("good", mode=mode, scenario_parameters=json.dumps({"step": h}))
        for h in (0.01, 0.02, 0.03)
        for mode in ("simulate", "replay")
    ]
    append_rows(tmp_path / RUNS, RUN_COLUMNS, swept)
    assert sweeps(load_runs(tmp_path))["step"]["line"].nunique() == 2


def test_steps_of_an_earlier_longer_run_have_no_part_in_its_energies(tmp_path):
    append_rows(tmp_path / RUNS, RUN_COLUMNS, [row("good", cell="c", projections=2, steps_done=2)])
    steps = [
        {"cell": "c", "step": k, "projection": k, "time": 0.1 * k, "kinetic_energy": energy}
        for energy, count in ((5e-3, 4), (1e-3, 2))
        for k in range(1, count + 1)
    ]
    append_rows(tmp_path / STEPS, STEP_COLUMNS, steps)
    table = energies(tmp_path, load_runs(tmp_path))
    assert table["energy"].tolist() == pytest.approx([1e-3, 1e-3])
    assert table["curve"].unique()[0].endswith("ended after 2 of 10 steps")


def test_no_ratio_of_a_start_that_failed(tmp_path):
    warm = {"solver_parameters": '{"warm": true}', "solve_seconds_median": 0.1}
    failed = row("good", outcome="no answer", steps_done=3, solve_seconds_median=0.2)
    append_rows(tmp_path / RUNS, RUN_COLUMNS, [failed, row("good-warm", **warm)])
    (pair,) = pairs(load_runs(tmp_path))
    assert pair.line()[3] == "no answer → optimal"


def test_cells_measured_beside_other_work_are_marked(tmp_path):
    rows = [row("calm", load=0.3), row("busy", load=2.13), row("unknown")]
    append_rows(tmp_path / RUNS, RUN_COLUMNS, rows)
    text = as_markdown(load_runs(tmp_path), {})
    assert "- swing 10×10 at 1%, busy: load 2.1\n" in text
    assert text.count(": load") == 1
    (tmp_path / RUNS).unlink()
    append_rows(tmp_path / RUNS, RUN_COLUMNS, [row("calm", load=0.3)])
    assert "beside other work" not in as_markdown(load_runs(tmp_path), {})
