"""Two results folders side by side, from rows whose every case is known."""

from __future__ import annotations

import csv
import io

import numpy as np
import pytest

from strainbench.bench.columns import RUN_COLUMNS, STEP_COLUMNS
from strainbench.bench.records import RUNS, STEPS, RecordsError, append_rows
from strainbench.document.writers import csv as as_csv
from strainbench.report.compare import CSV_HEADER, compare
from strainbench.report.output import write_output
from strainbench.report.spread import interval
from tests.cli.test_cli import strainbench
from tests.command import command
from tests.report.test_report import row


def folder(path, *rows):
    path.mkdir()
    append_rows(path / RUNS, RUN_COLUMNS, rows)
    return path


@pytest.fixture
def found(tmp_path):
    a = folder(
        tmp_path / "a",
        row("fast"),
        row("worse"),
        row("slow", steps_done=4, outcome="no answer"),
        row("none", solve_seconds_mean=1e-6),
        row("gone", resolution=20),
        row("tuned", solver_parameters='{"gain": 1}'),
        row("fast", mode="replay"),
    )
    b = folder(
        tmp_path / "b",
        row("fast", solve_seconds_mean=0.9),  # superseded by the next
        row("fast", solve_seconds_mean=0.01),
        row("worse", outcome="violated", max_violation=2e-3, solve_seconds_mean=0.04),
        row("slow"),
        row("none", solve_seconds_mean=3e-6),
        row("new"),
        row("tuned", solver_parameters='{"gain": 2}'),
        row("fast", tolerance=1e-3),
    )
    return compare(a, b)


def test_ratios_are_of_cells_that_both_finished(found):
    ratios = {p.row["solver"]: p.ratio for p in found.matched}
    assert ratios == pytest.approx(
        {"fast": 0.5, "worse": 2.0, "slow": float("nan"), "none": float("nan"), "tuned": 1.0},
        nan_ok=True,
    )
    assert "geometric mean 1.00, from 0.50 to 2.00, over the 3 cells" in "\n".join(found.head())


def test_changes_are_shown_and_what_stays_is_shown_once(found):
    lines = {line[2]: line for table in found.tables() for line in table.lines}
    assert lines["worse"][3:] == (
        *("optimal → violated", "0.020", "0.040", "2.00"),
        *("3e-9 → 2e-3", "2e-6"),
    )
    assert lines["slow"][3] == "no answer (4/10) → optimal"
    assert lines["fast"][3] == "optimal"
    assert "5 cells in both, 2 with another outcome" in found.head()[0]


def test_another_mode_or_tolerance_is_another_cell(found):
    foot = found.foot()
    for text in ("only in A, swing, replay", "only in B, swing, simulate, tolerance 0.001"):
        assert any(line.startswith(text) and line.endswith(": fast") for line in foot)
    assert any("20 cells" in line and line.endswith(": gone") for line in foot)
    assert any("only in B" in line and line.endswith(": new") for line in foot)


def test_settings_behind_a_name_are_told(found):
    (note,) = [p.note for p in found.pairs if p.note]
    assert "tuned" in note
    assert note.endswith("gain 1 in A, gain 2 in B")


def test_other_machines_are_said_first(tmp_path):
    a = folder(tmp_path / "a", row("one"), row("two"))
    b = folder(tmp_path / "b", row("one"), row("two", machine="a better machine"))
    line = compare(a, b).head()[0]
    assert line.startswith("The machines differ")
    assert "B on a better machine; a machine" in line
    assert not compare(a, a).head()[0].startswith("The machines differ")


def test_csv_and_markdown(found, tmp_path):
    rows = list(csv.DictReader(io.StringIO(as_csv(found.cells()))))
    assert tuple(rows[0]) == CSV_HEADER
    assert [r["only_in"] for r in rows].count("") == 5
    worse = next(r for r in rows if r["solver"] == "worse")
    assert float(worse["max_violation_b"]) == 2e-3
    assert float(worse["seconds_ratio"]) == 2.0
    for name in ("c.csv", "c.md"):
        write_output(tmp_path / "new folder" / name, found.document(), found.cells())
    text = (tmp_path / "new folder/c.md").read_text()
    assert "| 10×10 | 1% | worse | optimal → violated | 0.020 | 0.040 | 2.00 |" in text
    with pytest.raises(ValueError, match=r"ends in .csv, .md is valid"):
        write_output(tmp_path / "c.html", found.document(), found.cells())


def test_a_folder_without_results(tmp_path):
    a = folder(tmp_path / "a", row("one"))
    with pytest.raises(RecordsError, match="holds no results to compare"):
        compare(a, tmp_path / "b")


def test_the_command_line(found, tmp_path):
    done = strainbench("compare", "a", "b", "-o", "c.csv", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    for text in ("5 cells in both", "worse", "only in B", "wrote c.csv"):
        assert text in done.stdout
    assert (tmp_path / "c.csv").read_text() == as_csv(found.cells())


@pytest.mark.parametrize(
    "change", [{"machine": "another"}, {"blas_threads": 4}, {"outcome": "no answer"}]
)
def test_what_does_not_compare_is_in_no_mean(tmp_path, change):
    a = folder(tmp_path / "a", row("one", blas_threads=1))
    b = folder(tmp_path / "b", row("one", **{"blas_threads": 1} | change))
    found = compare(a, b)
    assert "geometric mean" not in "\n".join(found.head())
    assert not found.matched[0].ratio > 0


def test_cells_of_other_step_sizes_are_in_other_tables(tmp_path):
    rows = [row("one", scenario_parameters=f'{{"step": {h}}}') for h in (0.01666, 0.016664)]
    a = folder(tmp_path / "a", *rows)
    titles = [table.title for table in compare(a, a).tables()]
    assert ["step 0.01666," in t for t in titles] == [True, False]
    assert ["step 0.016664," in t for t in titles] == [False, True]


# --- what changed first; how sure a ratio is; when it fails


def repeated(folder_, solver, *rounds, cell=None):
    """Steps of a cell, in each of `rounds` so many seconds a projection."""
    steps = [
        {"cell": cell or solver, "step": k + 1, "projection": k + 1, "outcome": "optimal"}
        | {"seconds": sorted(each)[len(each) // 2], "seconds_each": " ".join(map(repr, each))}
        for k, each in enumerate(zip(*rounds, strict=True))
    ]
    append_rows(folder_ / STEPS, STEP_COLUMNS, steps)


def measured(path, seconds, *rounds, **values):
    facts = {"cell": "one", "repeats": len(rounds), "solve_seconds_mean": seconds}
    made = folder(path, row(values.pop("solver", "one"), **(facts | values)))
    repeated(made, "one", *rounds)
    return made


def test_an_outcome_that_changed_stands_first_the_worse_before_the_better(found):
    changes = found.changes()
    assert [(line[0].split(", ")[2].split(" ")[0], line[1]) for line in changes.lines] == [
        ("worse", "worse"),
        ("slow", "better"),
    ]
    assert changes.lines[0][2] == "optimal → violated"
    parts = found.document().parts
    assert parts.index(changes) < min(parts.index(t) for t in found.tables())


def test_repeats_say_how_sure_a_ratio_is(tmp_path):
    a = measured(tmp_path / "a", 1.0, [1.0, 1.0], [1.1, 1.1], [0.9, 0.9], [1.0, 1.0])
    b = measured(tmp_path / "b", 2.0, [2.0, 2.0], [2.1, 2.1], [1.9, 1.9], [2.0, 2.0])
    (pair,) = compare(a, b).pairs
    low, high = pair.interval
    assert 1.7 < low < 2.0 < high < 2.4
    assert pair.ratio_text == f"2.00 ({low:.2f}-{high:.2f})"
    assert "1 of 1 such intervals leave out 1." in "\n".join(compare(a, b).head())
    (line,) = csv.DictReader(io.StringIO(as_csv(compare(a, b).cells())))
    assert (float(line["ratio_low"]), float(line["ratio_high"])) == (low, high)


def test_an_interval_holds_the_ratio_as_often_as_it_says():
    """Noise of 10% a round, a true ratio of 1.2."""
    rng = np.random.default_rng(7)
    held = 0
    for _ in range(40):
        a, b = (scale * np.ones((3, 1)) * rng.lognormal(0, 0.1, 9) for scale in (1.0, 1.2))
        low, high = interval(a.tolist(), b.tolist())
        held += low <= 1.2 <= high
    assert held >= 33


@pytest.mark.parametrize("rounds", [[[1.0]], [[1.0], [1.2]]])
def test_too_few_repeats_give_no_interval(tmp_path, rounds):
    a, b = (measured(tmp_path / name, 1.0, *rounds) for name in "ab")
    found = compare(a, b)
    assert found.pairs[0].interval is None
    assert "nothing is known of a ratio's spread" in "\n".join(found.head())


def test_rounds_that_a_projection_lacks_do_not_count():
    assert interval([[1.0, 1.0, 1.0, 9.0], [1.0, 1.0, 1.0]], [[2.0] * 3] * 2) == (2.0, 2.0)
    assert interval([[1.0, 1.0], [1.0] * 5], [[2.0] * 3] * 2) is None
    assert interval([], [[1.0] * 3]) is None


def test_cells_measured_beside_other_work_are_said(tmp_path):
    a = folder(tmp_path / "a", row("one", load=0.2))
    b = folder(tmp_path / "b", row("one", load=2.14))
    line = "1 cells of B were measured beside other work: load 2.1 at most"
    assert [x for x in compare(a, b).foot() if "other work" in x] == [line]


@pytest.mark.parametrize(
    ("words", "change", "status"),
    [
        ([], {"outcome": "violated"}, 0),
        (["outcome"], {}, 0),
        (["outcome"], {"outcome": "violated"}, 1),
        (["outcome"], {"outcome": "no answer", "steps_done": 3}, 1),
        (["ratio>1.1"], {"solve_seconds_mean": 0.021}, 0),
        (["ratio>1.1"], {"solve_seconds_mean": 0.03}, 1),
        (["ratio > 1.1"], {"solve_seconds_mean": 0.01}, 0),
        (["outcome", "ratio>1.1"], {"outcome": "feasible"}, 1),
    ],
)
def test_what_it_fails_on(tmp_path, monkeypatch, capsys, words, change, status):
    a = folder(tmp_path / "a", row("one"))
    b = folder(tmp_path / "b", row("one", **change))
    gates = [word for gate in words for word in ("--fail-on", gate)]
    done = command(monkeypatch, capsys, "compare", a, b, *gates)
    assert done.returncode == status
    assert ("fails on" in done.stderr) == bool(status)
    back = command(monkeypatch, capsys, "compare", b, a, "--fail-on", "outcome")
    assert back.returncode == 0


def test_a_ratio_within_the_noise_fails_nothing(tmp_path, monkeypatch, capsys):
    noisy = [[1.0], [2.0], [0.5], [1.0]]
    a = measured(tmp_path / "a", 1.0, *noisy)
    b = measured(tmp_path / "b", 1.2, *([1.2 * s for s in each] for each in noisy))
    assert compare(a, b).pairs[0].ratio == pytest.approx(1.2)
    done = command(monkeypatch, capsys, "compare", a, b, "--fail-on", "ratio>1.1")
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("word", ["speed", "ratio", "ratio>", "ratio>x", "ratio>0", "ratio<2", " "])
def test_nonsense_to_fail_on_is_one_line(tmp_path, monkeypatch, capsys, word):
    a = folder(tmp_path / "a", row("one"))
    done = command(monkeypatch, capsys, "compare", a, a, "--fail-on", word)
    assert done.returncode == 2
    assert "outcome, and ratio> with a number, such as 'ratio>1.1', are valid" in done.stderr
    assert done.stderr.count("\n") == 1


def test_what_cannot_be_looked_at_is_no_success(tmp_path, monkeypatch, capsys):
    a = folder(tmp_path / "a", row("one"))
    for name, other in (("b", row("two")), ("c", row("one", machine="another"))):
        b = folder(tmp_path / name, other)
        done = command(monkeypatch, capsys, "compare", a, b, "--fail-on", "ratio>1.1")
        assert done.returncode == 2
        assert "no cells that compare in it" in done.stderr


def test_at_80_columns_no_number_is_folded(tmp_path, monkeypatch, capsys):
    rounds = [[123.456], [123.4], [124.5], [123.0]]
    long = {"solver": "gauss-seidel-principal", "resolution": 200, "limit": 0.0001}
    a = measured(tmp_path / "a", 123.456, *rounds, **long)
    b = measured(tmp_path / "b", 987.654, *rounds, **long, outcome="violated")
    (pair,) = compare(a, b).pairs
    done = command(monkeypatch, capsys, "compare", a, b, width=80)
    for text in ("120", "990", pair.ratio_text, "gauss-seidel-principal", "violated"):
        assert any(text in line for line in done.stdout.splitlines()), text
    assert "…" not in done.stdout
    assert all(len(line) <= 80 for line in done.stdout.splitlines() if line.startswith("|"))
