"""What pytest-benchmark measured becomes a table a group, with what the referee says."""

from __future__ import annotations

import csv
import json
import os
import subprocess
import sys
from xml.etree import ElementTree

import pytest

from strainbench.files import RecordsError
from strainbench.report.perf import by_group, read_perf, tables
from tests.command import command

BENCHMARKS = """
import time
import pytest

@pytest.mark.parametrize("wait", [0.002, 0.001])
def test_wait(benchmark, wait):
    benchmark.group = "waits"
    benchmark.pedantic(time.sleep, args=(wait,), rounds=3)
    benchmark.extra_info.update(solver=f"wait-{wait}", outcome="optimal", max_violation=1e-9)
"""


def entry(method, median, group="g", **facts):
    stats = {"median": median, "q1": 0.9 * median, "q3": 1.2 * median, "rounds": 5}
    facts = {"solver": method, "outcome": "optimal", "max_violation": 4e-9} | facts
    facts = {"relative_gap": 2e-7, "distance": 3e-6, "reference_error": 1e-6} | facts
    return {"name": f"test[{method}]", "group": group, "stats": stats, "extra_info": facts}


def written(path, *entries):
    path.write_text(json.dumps({"benchmarks": entries}))
    return path


def test_a_table_a_group_the_better_outcome_first_then_the_faster(tmp_path):
    path = written(
        tmp_path / "p.json",
        entry("slow", 0.2),
        entry("rough", 0.001, outcome="violated", max_violation=0.03),
        entry("near", 0.002, outcome="feasible", relative_gap=0.5, distance=1e-3),
        entry("fast", 0.0123),
        entry("other", 0.5, group="f"),
    )
    first, second = tables(read_perf(path))
    assert (first.title, second.title) == ("f", "g")
    assert [line[1] for line in second.lines] == ["fast", "slow", "near", "rough"]
    assert second.lines[0] == ["✓", "fast", "12", "11-15", "4e-9", "2e-7", "0.0030"]
    assert second.lines[2] == ["○", "near", "2.0", "1.8-2.4", "4e-9", "5e-1", "1.0"]
    assert second.lines[3][0] == "✗"
    assert second.notes == ["5 rounds each"]


def test_what_nobody_certified_is_empty_and_no_zero(tmp_path):
    bare = entry("x", 0.1) | {"extra_info": {}, "group": None}
    lost = entry("y", 0.1, relative_gap=float("nan"), distance=float("nan"), group=None)
    first, second = tables(read_perf(written(tmp_path / "p.json", bare, lost)))[0].lines
    assert first[4:] == ["4e-9", "", ""]
    assert second == ["", "test[x]", "100", "90-120", "", "", ""]


def test_a_distance_below_what_is_known_says_so(tmp_path):
    path = written(tmp_path / "p.json", entry("a", 0.1, distance=1e-8, reference_error=2e-6))
    assert tables(read_perf(path))[0].lines[0][-1] == "<0.0020"


@pytest.mark.slow
def test_report_reads_what_pytest_benchmark_writes(tmp_path, monkeypatch, capsys):
    (tmp_path / "test_waits.py").write_text(BENCHMARKS)
    file = tmp_path / "perf.json"
    words = ["-m", "pytest", "-q", "-p", "no:cacheprovider", f"--benchmark-json={file}", "."]
    alone = {k: v for k, v in os.environ.items() if not k.startswith("PYTEST_XDIST")}
    made = subprocess.run(
        [sys.executable, *words],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
        env=alone,  # beside others it would not measure
    )
    assert made.returncode == 0, made.stdout
    done = command(monkeypatch, capsys, "report", "--results", file, width=80)
    assert done.returncode == 0, done.stderr
    assert "waits" in done.stdout
    raw = {
        b["extra_info"]["solver"]: b["stats"] for b in json.loads(file.read_text())["benchmarks"]
    }
    rows = list(csv.DictReader(file.with_suffix(".csv").read_text().splitlines()))
    assert {row["method"] for row in rows} == {"wait-0.001", "wait-0.002"}
    for row in rows:
        stats = raw[row["method"]]
        assert [float(row[n]) for n in ("seconds", "seconds_low", "seconds_high")] == [
            stats[n] for n in ("median", "q1", "q3")
        ]
    drawn = ElementTree.fromstring(file.with_suffix(".svg").read_text())
    assert "wait-0.001" in "".join(drawn.itertext())
    assert "| method |" in file.with_suffix(".md").read_text()


def test_signs_in_names_are_text(tmp_path, monkeypatch, capsys):
    name = "a|b & 5%_<i>[red]"
    file = written(tmp_path / "p.json", entry(name, 0.1, group=name))
    done = command(monkeypatch, capsys, "report", "--results", file)
    assert done.returncode == 0, done.stderr
    assert name in done.stdout
    drawn = ElementTree.fromstring(file.with_suffix(".svg").read_text())
    assert name in "".join(drawn.itertext())


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "no file of pytest-benchmark's"),
        ("{", "no file of pytest-benchmark's"),
        ("[1]", "no file of pytest-benchmark's"),
        ('{"runs": []}', "no file of pytest-benchmark's"),
        ('{"benchmarks": [1]}', "no file of pytest-benchmark's"),
        ('{"benchmarks": [{"name": "a", "stats": {"median": "x"}}]}', "no file of pytest-bench"),
        ('{"benchmarks": [{"name": "a", "stats": {}}]}', "no file of pytest-benchmark's"),
        ('{"benchmarks": []}', "no benchmark was run"),
    ],
)
def test_nonsense_is_one_line(tmp_path, monkeypatch, capsys, text, said):
    file = tmp_path / "p.json"
    file.write_text(text)
    done = command(monkeypatch, capsys, "report", "--results", file)
    assert done.returncode in (1, 2)
    assert str(file) in done.stderr
    assert said in done.stderr
    assert done.stderr.count("\n") == 1


def test_a_file_that_is_not_there_is_said(tmp_path):
    with pytest.raises(RecordsError, match="No such file"):
        read_perf(tmp_path / "none.json")


def test_groups_stand_in_the_order_of_their_names(tmp_path):
    path = written(tmp_path / "p.json", entry("a", 1.0, "z"), entry("a", 1.0, "b"))
    assert list(by_group(read_perf(path))) == ["b", "z"]
