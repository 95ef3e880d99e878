"""What the README, docs/use.md and CONTRIBUTING tell a person to type works."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
README = (ROOT / "README.md").read_text()
CONTRIBUTING = (ROOT / "CONTRIBUTING.md").read_text()
USE = (ROOT / "docs/use.md").read_text()
CONCEPTS = (ROOT / "docs/concepts.md").read_text()


def blocks(text, language):
    return re.findall(rf"```{language}\n(.*?)```", text, re.DOTALL)


COMMANDS = [
    line.removeprefix("$ ")
    for block in blocks(README + USE, "console")
    for line in block.splitlines()
    if line.startswith("$ strainbench")
]


def test_there_are_commands():
    assert len(COMMANDS) >= 4


def test_commands_in_their_order(tmp_path):
    (tmp_path / "mine.py").write_text(blocks(CONTRIBUTING, "python")[0])
    for command in COMMANDS:
        done = subprocess.run(
            [sys.executable, "-m", *shlex.split(command)],
            cwd=tmp_path,
            env={**os.environ, "PYTHONWARNINGS": "error"},
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, f"{command}\n{done.stdout}{done.stderr}"
    report = tmp_path / "results/local/first"
    for name in ("table1.csv", "table1.md", "table1.tex", "speed-accuracy.svg", "index.html"):
        assert (report / name).stat().st_size > 0


def test_python_example():
    exec(compile(blocks(README, "python")[0], "README.md", "exec"), {})


def test_example_solver_is_short_and_honest(tmp_path):
    source = blocks(CONTRIBUTING, "python")[0]
    assert len(source.strip().splitlines()) <= 30
    path = tmp_path / "mine.py"
    path.write_text(source)
    import numpy as np

    from strainbench import certify, solve
    from strainbench.solver.registry import solvers_of
    from tests.problems import random_problem

    (solver,) = solvers_of(str(path))
    problem = random_problem(np.random.default_rng(0), directions=4, limit=0.1)
    assert certify(problem, solve(problem, solver()).positions).outcome == "feasible"


def test_example_table_is_short_and_stands_in_the_report(tmp_path, monkeypatch):
    from strainbench.bench.columns import RUN_COLUMNS
    from strainbench.bench.records import RUNS, append_rows
    from strainbench.report import load_runs, table
    from tests.report.test_report import row

    source = next(b for b in blocks(CONTRIBUTING, "python") if "Table(" in b)
    assert len(source.strip().splitlines()) <= 30
    exec(compile(source, "CONTRIBUTING.md", "exec"), space := {})
    cells = [row("a"), row("a", resolution=20, solve_seconds_mean=0.1), row("b")]
    append_rows(tmp_path / RUNS, RUN_COLUMNS, cells)
    monkeypatch.setattr(table, "SECTIONS", (space["spread"],))
    written = table.as_markdown(load_runs(tmp_path), {})
    assert "## Fastest and slowest cells\n" in written
    for line in (
        "| --- | --- | ---: | ---: |",
        "| a | 2 | 0.02 | 0.1 |",
        "| b | 1 | 0.02 | 0.02 |",
    ):
        assert line in written


def test_the_papers_table_is_that_of_its_record():
    def rows(text):
        found, limit = [], ""
        for line in text.splitlines():
            if line.startswith("|"):
                first, *cells = (cell.strip() for cell in line.strip("|").split("|"))
                limit = first or limit  # it stands in its first line alone
                found.append((limit, *cells))
        return found

    record = rows((ROOT / "results/paper/table1-paper.md").read_text(encoding="utf-8"))
    told = rows(README.partition("## Table 1 of the paper\n")[2].partition("\n## ")[0])
    told = [row for row in told if row[1] not in ("method", "---")]
    assert len(told) == 2 * (8 + 4)
    assert not set(told) - set(record)


def test_the_table_of_results_is_what_the_committed_rows_come_to():
    from strainbench.document.writers import markdown
    from strainbench.report import load_runs
    from strainbench.report.table import groups

    (group,) = groups(load_runs(ROOT / "results/swing-short"))
    measured = set(markdown(group.table()).replace("**", "").splitlines())
    head = "| method | | time [ms] |"
    table = README[README.index(head) :].partition("\n\n")[0].replace("**", "").splitlines()[2:]
    for line in table:
        name, *cells = [cell.strip() for cell in line.strip("|").split("|")]
        method = f"| 1% | 20×20 | {name.split(' (')[0]} | {cells[0].removesuffix(' in 30 s')} | "
        (row,) = (line for line in measured if line.startswith(method))
        assert not cells[1] or row == f"{method}{' | '.join(cells[1:])} |"
    assert len(table) == 8


def test_distances_from_the_constrained_step_are_those_measured():
    import pandas as pd

    measured = pd.read_csv(ROOT / "results/stability/constrained/shrinking/step.csv")
    head = "| | 1/30 s | 1/60 s | 1/120 s |"
    table = CONCEPTS[CONCEPTS.index(head) :].partition("\n\n")[0].splitlines()[2:]
    norms = {"mass norm": "mass", "as printed": "unweighted"}
    for line in table:
        name, *cells = [cell.strip() for cell in line.strip("|").split("|")]
        solver, norm = name.replace("`", "").split(", ")
        own = measured[(measured["solver"] == solver) & (measured["norm"] == norms[norm])]
        for cell, value in zip(cells, own["largest_mm"], strict=True):
            digits = len(cell.partition(".")[2])
            assert cell == f"{value:.{digits}f}", line
    assert len(table) == 5


@pytest.mark.parametrize("target", sorted(set(re.findall(r"`make ([a-z-]+)`", README + USE))))
def test_make_targets_exist(target):
    assert re.search(rf"^{target}:", (ROOT / "Makefile").read_text(), re.MULTILINE)


def test_the_map_names_files_that_exist():
    (tree,) = blocks(README, "text")
    for line in tree.splitlines():
        names = line.split("  ")[0].strip()
        for name in names.split(", ") if names else ():
            assert list(ROOT.glob(name)), name
