"""Two results folders side by side, from rows whose every case is known."""

from __future__ import annotations

import csv
import io

import pytest

from strainbench.bench.columns import RUN_COLUMNS
from strainbench.bench.records import RUNS, RecordsError, append_rows
from strainbench.document.writers import csv as as_csv
from strainbench.report.compare import CSV_HEADER, compare
from strainbench.report.output import write_output
from tests.cli.test_cli import strainbench
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
        *("optimal → violated", "0.0200", "0.0400", "2.00"),
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
    assert "| 10×10 | 1% | worse | optimal → violated | 0.0200 | 0.0400 | 2.00 |" in text
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
