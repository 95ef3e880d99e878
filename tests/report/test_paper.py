"""Tables and figures for papers: what they say, and that an article with them compiles."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest

from strainbench.bench.columns import RUN_COLUMNS
from strainbench.bench.records import RUNS, RecordsError, append_rows
from strainbench.document.latex import COLUMN, PAGE, width
from strainbench.report import load_runs
from strainbench.report.article import write_paper
from strainbench.report.paper import as_latex, chosen_columns, chosen_methods, paper_tables
from tests.command import command
from tests.report.test_report import row

RESULTS = Path(__file__).parents[2] / "results"
NASTY = r"a|b & 50% _x_ <i> ~^ $y$ #1 {z} \end{document} 3e-2"
LATE = {"outcome": "no answer", "reason": "time limit of 9 s (4 of 10 steps)", "steps_done": 4}
WRONG = {"outcome": "violated", "max_violation": 0.031, "projections_violated": 1}


def lines_of(text):
    """The lines of a tabular, by their first cell."""
    lines = [line for line in text.splitlines() if line.endswith(r"\\")]
    return {line.split(" & ")[0]: line for line in lines}


@pytest.fixture
def runs(tmp_path):
    rows = [
        row("wrong", **WRONG),
        row("near", solve_seconds_median=0.001, outcome="feasible", distance_max=2e-3),
        row("slow", **LATE),
        row("second", solve_seconds_median=0.044),
        row("first", solve_seconds_median=0.0312, distance_max=5e-7),
        row("first", resolution=20, solve_seconds_median=1.2),
        row("second", resolution=20, **LATE),
        row("none", **WRONG),
    ]
    append_rows(tmp_path / RUNS, RUN_COLUMNS, rows)
    return chosen_methods(load_runs(tmp_path), None)


def test_methods_stand_in_three_groups_by_time(runs):
    (table,) = paper_tables(runs)
    assert [line[0] for line in table.lines] == [
        *("first", "second", "within the limits, but not the projection", "near"),
        *("limits violated, or out of time", "wrong", "slow"),
    ]


def test_a_cell_is_a_number_or_what_went_wrong(runs):
    lines = lines_of(as_latex(runs))
    assert lines["first"] == (
        r"first & \bfseries 31 &  & \bfseries <0.0010 & \bfseries 1200 &  & \bfseries 0.0090 \\"
    )
    assert r"\multicolumn{3}{l}{$\times$ 4 of 10 steps}" in lines["second"]
    assert r"\multicolumn{3}{l}{$\times$ violates by \num{3e-2}}" in lines["wrong"]
    assert lines["near"].endswith(r"2.0 & \multicolumn{3}{l}{not run} \\")


def test_every_mark_is_explained_and_no_other(runs):
    text = as_latex(runs)
    for words in ("Bold:", r"\textless{}:", r"$\times$:", "Optimal: violation at most"):
        assert words in text
    for words in ("Small:", "Gap:", "local:"):
        assert words not in text
    assert "nan" not in text
    near = as_latex(runs[runs["solver"] == "near"])
    for words in ("Bold:", r"$\times$:", "Optimal:"):
        assert words not in near


def test_columns_and_methods_are_chosen(runs):
    kept = chosen_methods(runs, "second, first")
    text = as_latex(kept, chosen_columns("gap,mean,gap"))
    assert list(lines_of(text))[-2:] == ["first", "second"]
    assert r"{gap} & {mean [ms]} & {gap} & {mean [ms]} \\" in text
    assert r"\bfseries 2e-6 & \bfseries 20" in text


def test_a_method_with_settings_is_one_name(tmp_path):
    names = ["a[x=1,y=2]", "b"]
    append_rows(tmp_path / RUNS, RUN_COLUMNS, [row(name) for name in names])
    runs = load_runs(tmp_path)
    assert list(chosen_methods(runs, ",".join(names))["solver"]) == names


def test_meshes_that_are_too_many_go_on_in_the_next_table(tmp_path):
    many = [row(name, resolution=n) for n in range(5, 25) for name in ("a", "b")]
    append_rows(tmp_path / RUNS, RUN_COLUMNS, many)
    tables = paper_tables(load_runs(tmp_path))
    assert all(width(table) <= PAGE for table in tables)
    headings = {column.above for table in tables for column in table.columns if column.above}
    assert len(headings) == 20
    assert as_latex(load_runs(tmp_path)).count(r"\begin{table*}") == len(tables) > 1


def test_two_meshes_fit_a_column():
    (table,) = paper_tables(chosen_methods(load_runs(RESULTS / "field"), None))
    assert width(table) * 0.94 <= COLUMN


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (["--paper", "--columns", "seconds,speed"], "no column called 'speed'; valid are seconds,"),
        (["--paper", "--columns", ""], "no column called ''"),
        (["--paper", "--methods", "good,bad"], "no method called 'bad'; valid are good, none"),
        (["--paper", "--methods", ""], "no method called ''"),
        (["--methods", "good"], "choose what --paper writes"),
    ],
)
def test_a_wrong_word_is_one_line(tmp_path, monkeypatch, capsys, words, line):
    append_rows(tmp_path / RUNS, RUN_COLUMNS, [row("good"), row("none", **WRONG)])
    done = command(monkeypatch, capsys, "report", "--results", tmp_path, *words, width=500)
    assert done.returncode == 2
    assert line in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1


def test_a_folder_without_a_method_says_so(tmp_path):
    with pytest.raises(RecordsError, match="holds no results"):
        write_paper(tmp_path, None, None)
    append_rows(tmp_path / RUNS, RUN_COLUMNS, [row("none", **WRONG)])
    with pytest.raises(RecordsError, match="no method but the unlimited cloth"):
        write_paper(tmp_path, None, None)


# --- in an article

TEX = shutil.which("pdflatex")


def compiled(folder):
    """What LaTeX says of the sample."""
    if not TEX:
        pytest.skip("no pdflatex: Debian's texlive-science has one with siunitx")
    for name in ("booktabs.sty", "siunitx.sty"):
        if subprocess.run(["kpsewhich", name], capture_output=True, check=False).returncode:
            pytest.skip(f"this TeX has no {name}")
    words = [TEX, "-interaction=nonstopmode", "-halt-on-error", "article.tex"]
    done = subprocess.run(words, cwd=folder, capture_output=True, timeout=200, check=False)
    assert done.returncode == 0, done.stdout.decode(errors="replace")[-2000:]
    return (folder / "article.log").read_text(errors="replace")


@pytest.mark.slow
def test_three_tables_and_three_figures_stand_in_two_columns(tmp_path):
    rows = [
        row(name, limit=limit, resolution=n, solve_seconds_median=n * k / 1000)
        for limit in (0.001, 0.01, 0.1)
        for n in (20,)
        for k, name in enumerate(("good", "better", NASTY), start=1)
    ]
    rows += [row("late", limit=0.1, resolution=20, **LATE)]
    append_rows(tmp_path / RUNS, RUN_COLUMNS, rows)
    written = [path.name for path in write_paper(tmp_path, None, "seconds,violation,gap,mm")]
    assert [name for name in written if name.endswith(".tex")] == [
        *(f"table-{k}.tex" for k in (1, 2, 3, 4)),
        "article.tex",
    ]
    scored = lines_of((tmp_path / "paper/table-4.tex").read_text(encoding="utf-8"))
    assert re.fullmatch(r"good & 100 & 1\.0 & 1\.0 & 1\.0 & 1\.0 & 1 .*", scored["good"])
    assert re.fullmatch(r"better & 100 & 2\.0 & 2\.0 & 2\.0 & 2\.0 & 1 .*", scored["better"])
    assert sum(name.startswith("speed-accuracy") for name in written) == 3
    log = compiled(tmp_path / "paper")
    assert "Overfull" not in log
    assert "LaTeX Warning: Reference" not in log


@pytest.mark.slow
@pytest.mark.parametrize("columns", ["seconds,mm", "seconds,mean,violation,gap,mm"])
@pytest.mark.parametrize("name", ["field", "swing-short"])
def test_what_was_measured_compiles_without_an_overfull_box(tmp_path, name, columns):
    for file in ("runs.csv", "steps.csv", "machines.json"):
        shutil.copy(RESULTS / name / file, tmp_path)
    write_paper(tmp_path, None, columns)
    assert not re.search("Overfull|Missing character", compiled(tmp_path / "paper"))
