"""Foreign text: what it holds is shown as it is in each output, and is markup in none."""

from __future__ import annotations

import csv
import io
import json
import re
from html import unescape
from html.parser import HTMLParser

import numpy as np
import pandas as pd
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from markdown_it import MarkdownIt
from matplotlib.figure import Figure
from rich.console import Console
from rich.table import Table

from strainbench import escape
from strainbench.bench.columns import RUN_COLUMNS, STEP_COLUMNS
from strainbench.bench.plan import plan
from strainbench.bench.records import RUNS, STEPS, append_rows
from strainbench.document import writers
from strainbench.studies.duel.racer import Racer
from strainbench.studies.duel.report import Outcome
from strainbench.studies.ledger.measure import Row
from strainbench.studies.ledger.report import as_markdown as ledger_markdown
from tests.command import command

NASTY = (
    "a[b] [/opt/key.dat] [bold] *x* _y_ __z__ `code` ``two`` |pipe| <script>alert(1)</script> "
    "&amp; &lt; $x_1$ 50% #1 ^ ~~gone~~ {brace} \\n \\textbf{z} :smile: [l](http://e.x) --"
)
CONTROL = "\x1b[31mred\x1b[0m \x1b]0;title\x07 two\nlines\ttab \x00\x07 \u202eback"
HEADS = ["=1+1", "+1+1", "-1-x", "@SUM(A1)", "# head", "- item", "1. item", "> quote", "[ ] task"]
TEXTS = [f"{NASTY} x {CONTROL}", *HEADS]
text = st.text(st.characters(codec="utf-8"), max_size=40)


def table_cells(markdown):
    """The text of each cell of a Markdown document's tables, as a reader sees it."""
    html = MarkdownIt("commonmark").enable(["table", "strikethrough"]).render(markdown)
    return [_seen(cell) for cell in re.findall(r"<td[^>]*>(.*?)</td>", html, re.DOTALL)], html


def _seen(html):
    assert "<" not in html, html
    return unescape(html)


@given(text)
def test_a_terminal_shows_text_as_it_is(words):
    file = io.StringIO()
    Console(file=file, width=500, force_terminal=False).print(escape.terminal(words))
    assert file.getvalue().strip() == escape.plain(words)


@given(text)
def test_plain_text_is_a_line_without_controls(words):
    plain = escape.plain(words)
    assert plain.isprintable() or not plain.isascii()
    assert len(plain.splitlines()) <= 1
    assert escape.plain(plain) == plain


def test_ansi_sequences_go_and_letters_stay():
    assert escape.plain("x " + CONTROL) == "x red two lines tab back"
    assert escape.plain("Größe 張力 ½") == "Größe 張力 ½"


@given(text)
def test_a_markdown_cell_reads_as_the_text(words):
    cells, _ = table_cells(f"| a | b |\n| --- | --- |\n| {escape.markdown(words)} | end |\n")
    assert cells == [escape.plain(words), "end"]


@example("--")
@example("a #")
@given(text)
def test_a_markdown_item_and_heading_read_as_the_text(words):
    plain = escape.plain(words)
    reader = MarkdownIt("commonmark").enable(["table", "strikethrough"])
    html = reader.render(f"- {escape.markdown(words)}\n\n## {escape.markdown(words)} \n")
    if plain not in ("", "-", "+"):  # a mark of ours in tables, never an item
        assert unescape(html) == f"<ul>\n<li>{plain}</li>\n</ul>\n<h2>{plain}</h2>\n"


@given(text)
def test_a_code_span_reads_as_the_text(words):
    plain = escape.plain(words)
    if plain:
        html = MarkdownIt("commonmark").render(f"a {escape.code(words)} b")
        assert unescape(html) == f"<p>a <code>{plain}</code> b</p>\n"


def test_latex_has_no_character_that_means_something():
    latex = escape.latex(NASTY + CONTROL)
    left = re.sub(r"\\text[a-z]+\{\}|\\[{}$&#%_]|-\{\}", "", latex)
    assert not set(left) & set("\\{}$&#%_^~<>|`")
    assert escape.latex("gauss-seidel[max_sweeps=100]") == r"gauss-seidel[max\_sweeps=100]"
    assert escape.latex("a--b → 5%") == r"a-{}-b $\to$ 5\%"


@given(text)
def test_a_chart_takes_any_text(words):
    figure = Figure()
    label = figure.text(0, 0, escape.chart(words))
    assert label._preprocess_math(label.get_text())[0].strip() == escape.plain(words).strip()
    assert label._preprocess_math(label.get_text())[1] in (False, "TeX")
    assert not escape.chart(words).startswith("_")


@pytest.mark.parametrize("word", ["=1+1", "+1+x", "-x", "@x", "\t=x", "\r=1+x", " =1+1"])
def test_a_cell_that_would_be_a_formula_is_quoted(word):
    assert escape.cell(word) == "'" + escape.plain(word)


@pytest.mark.parametrize("value", ["-1.5", "+2", "-1e-3", "-inf", -1.5, 3, None, "-", "a=b", ""])
def test_numbers_and_harmless_cells_are_left(value):
    assert escape.cell(value) == value


# --- through every output


def plugin_row(label, reason, name="swing", **changes):
    row = dict.fromkeys(RUN_COLUMNS, "") | {
        "schema": 1,
        "cell": f"{abs(hash(str((name, changes)))):x}",
        "finished_at": "2024-01-01T00:00:00+00:00",
        "scenario": name,
        "resolution": 4,
        "limit": 0.01,
        "directions": 4,
        "integrator": "sap",
        "solver": label,
        "tolerance": 1e-6,
        "mode": "simulate",
        "steps_asked": 1,
        "steps_done": 1,
        "outcome": "violated",
        "reason": reason,
        "solve_seconds_mean": 0.5,
        "solve_seconds_median": 0.5,
        "ie_seconds_mean": 0.1,
        "iterations_mean": 3,
        "max_violation": 1e-3,
        "max_principal_stretch": 1.02,
        "relative_gap_max": 0.1,
        "distance_max": 1e-3,
        "reference_error_max": 1e-9,
        "projections": 1,
        "projections_violated": 1,
        "variables": 12,
        "constraints": 8,
        "nonzeros": 9,
        "needs": "gravity",
        "active_constraints_max": 2,
        "violation_threshold": 1e-6,
        "gap_threshold": 1e-4,
        "scenario_parameters": json.dumps({"limit": 0.01, "path": label, "resolution": 4}),
        "solver_parameters": json.dumps({"file": label}),
        "machine": "a machine",
    }
    return row | changes


def step_row(row, status):
    energies = [c for c in STEP_COLUMNS if c.endswith("_energy")]
    known = {"cell": row["cell"], "step": 1, "projection": 1, "outcome": "violated"}
    return known | dict.fromkeys(energies, 1.0) | {"status": status, "time": 0.1}


@pytest.fixture(params=[TEXTS[0], HEADS[0]], ids=["nasty", "formula"])
def nasty(request):
    return request.param


@pytest.fixture
def folder(tmp_path, nasty):
    """Results of a solver and a scene whose every text is nasty."""
    rows = [
        plugin_row(nasty, nasty, name=nasty),
        plugin_row(nasty, nasty, outcome="no answer", steps_done=0),
        *(
            plugin_row(
                nasty,
                nasty,
                limit=limit,
                scenario_parameters=json.dumps(
                    {"limit": limit, "path": nasty, "resolution": 4, "directions": 4}
                ),
            )
            for limit in (0.005, 0.02, 0.03)
        ),
    ]
    append_rows(tmp_path / RUNS, RUN_COLUMNS, rows)
    append_rows(tmp_path / STEPS, STEP_COLUMNS, [step_row(row, nasty) for row in rows])
    return tmp_path


class Text(HTMLParser):
    """The text of a page, and its tags."""

    def __init__(self, page):
        super().__init__()
        self.text, self.tags = [], set()
        self.feed(page)

    def handle_data(self, data):
        self.text.append(data)

    def handle_starttag(self, tag, attrs):
        self.tags.add(tag)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:constrained_layout", "ignore:Glyph")
def test_a_report_shows_any_text_as_it_is(folder, nasty, monkeypatch, capsys):
    done = command(monkeypatch, capsys, "report", "--results", folder, width=500)
    assert done.returncode == 0, done.stderr
    plain = escape.plain(nasty)
    for file in ("table1.md", "sweeps.md", "energy.md"):
        cells, html = table_cells((folder / file).read_text())
        shown = cells if file == "table1.md" else [unescape(html)]
        assert any(plain in cell for cell in shown), file
    table = pd.read_csv(folder / "table1.csv", dtype=str, keep_default_na=False)
    assert set(table["solver"]) == {escape.cell(nasty)}
    assert not any(str(v)[:1] in "=+@" for v in table.to_numpy().ravel() if len(str(v)) > 1)
    tex = (folder / "table1.tex").read_text()
    assert escape.latex(nasty) in tex
    assert all(line.count("\n") == 0 for line in tex.splitlines())
    text = (folder / "index.html").read_text()
    page = Text(text)
    assert plain in " ".join(" ".join(page.text).split())
    assert page.tags.isdisjoint({"bold", "em"})
    scripts = re.findall("<script[^>]*>", text)
    ours = [tag for tag in scripts if not re.search(r'data-specs="(distance|gap|violation)?"', tag)]
    assert len(ours) == 4
    assert text.count("<script") == text.count("</script") == len(scripts)
    for chart in folder.glob("*.svg"):
        assert "\x1b" not in chart.read_text()


def test_a_comparison_shows_any_text_as_it_is(folder, nasty, monkeypatch, capsys, tmp_path):
    plain = escape.plain(nasty)
    for ending in ("md", "csv"):
        output = tmp_path / f"c.{ending}"
        done = command(monkeypatch, capsys, "compare", folder, folder, "-o", output, width=2000)
        assert done.returncode == 0, done.stderr
        assert plain in done.stdout
        assert "\x1b" not in done.stdout
    assert plain in table_cells((tmp_path / "c.md").read_text())[0]
    rows = list(csv.DictReader(io.StringIO((tmp_path / "c.csv").read_text())))
    assert {row["solver"] for row in rows} == {escape.cell(nasty)}


def test_a_duel_shows_any_text_as_it_is(nasty):
    entry = Racer(nasty, setups=[0.1], seconds=[0.5, 0.6])
    facts = {"memory_gb": 1, "system": nasty, "python": "3", "threads_per_solver": 1}
    outcome = Outcome(nasty, f"strainbench duel {nasty}", {nasty: facts}, [entry])
    file = io.StringIO()
    Console(file=file, width=2000).print(writers.terminal(outcome.table()))
    assert escape.plain(nasty) in file.getvalue()
    assert table_cells(writers.markdown(outcome.document()))[0][0] == escape.plain(nasty)
    (row,) = csv.DictReader(io.StringIO(writers.csv(outcome.cells())))
    assert row["method"] == escape.cell(nasty)


def test_a_ledger_shows_any_text_as_it_is(nasty):
    rows = [Row(nasty, 4, "as it is", "none"), Row(nasty, 4, nasty, "none", note=nasty)]
    cells, _ = table_cells(ledger_markdown(rows, nasty))
    assert cells.count(escape.plain(nasty)) == 4


PLUGIN = """
from dataclasses import dataclass

from strainbench import Solution, Solver
from strainbench.scenario.scenario import Scenario
from scenarios.stretch_square import StretchSquare

TEXT = {text!r}


@dataclass(frozen=True)
class Nasty(Solver):
    name = TEXT
    __doc__ = TEXT
    word: str = TEXT

    def missing(self):
        return TEXT

    def solve(self, problem, state, *, tolerance, monitor, deadline):
        raise OSError(TEXT)


@dataclass(frozen=True)
class Scene(StretchSquare):
    name = "scene " + TEXT
    __doc__ = TEXT
"""


def test_a_plugin_of_any_words_is_listed_and_run(nasty, monkeypatch, capsys, tmp_path):
    path = tmp_path / "nasty.py"
    path.write_text(PLUGIN.format(text=nasty))
    monkeypatch.chdir(tmp_path)
    done = command(monkeypatch, capsys, "list", path, width=2000)
    assert done.returncode == 0, done.stderr
    assert escape.plain(nasty) in done.stdout
    words = ["--solver", path, "--set", "resolution=2", "--steps", "1"]
    done = command(monkeypatch, capsys, "render", path, *words, "--format", "obj", width=2000)
    assert done.returncode == 0, done.stderr
    assert f"OSError: {escape.plain(nasty)}" in done.stdout
    (cell,) = plan([str(path)], [str(path)], [], "simulate", 1, [1e-6], None)
    assert cell.solver.solver().name == nasty
    assert cell.solver.solver().word == nasty


@pytest.mark.slow
def test_what_a_solver_raises_is_printed_as_it_is(monkeypatch, capsys, tmp_path):
    (tmp_path / "bad.py").write_text(PLUGIN.format(text=NASTY))
    monkeypatch.chdir(tmp_path)
    words = ["--solver", "./bad.py", "--set", "resolution=2", "--steps", "1", "--results", "out"]
    done = command(monkeypatch, capsys, "run", "stretch-square", *words, width=2000)
    assert done.returncode == 0, done.stderr
    assert f"no answer: OSError: {NASTY}" in done.stdout


def test_numbers_of_numpy_in_a_table_stay():
    table = pd.DataFrame({"a": [np.float64(-1.5)], "b": ["=1+1"]}).map(escape.cell)
    assert table.to_csv(index=False) == "a,b\n-1.5,'=1+1\n"


def test_a_table_of_the_terminal_takes_text_alone():
    table = Table(title=escape.terminal("[bold]"))
    table.add_column("x")
    table.add_row(escape.terminal("[/opt]"))
    file = io.StringIO()
    Console(file=file, width=40).print(table)
    assert "[/opt]" in file.getvalue()
    assert "[bold]" in file.getvalue()
