"""One table through every writer: what it holds is shown as it is, and is markup in none."""

from __future__ import annotations

import csv
import io
import re
from html import unescape
from pathlib import Path

import pandas as pd
import pytest
from hypothesis import given
from markdown_it import MarkdownIt
from rich import box
from rich.console import Console

from strainbench import escape
from strainbench.document import (
    Between,
    Code,
    Column,
    Document,
    Faint,
    Items,
    Picture,
    Prose,
    Span,
    Strong,
    Table,
    writers,
)
from strainbench.document.html import html
from tests.test_escape import TEXTS, Text, text

COLUMNS = [
    "method",
    Column("time", "s", ".3g", right=True, whole=True),
    Column("said", aside=True),
    Column("share", form=lambda share: f"{share:.0%}"),
]
LINES = [("newton", 1.23456, "a", 0.5), (Strong("best"), 2, None, float("nan"))]
TABLE = Table("Times", COLUMNS, LINES, Prose("Of *one* run."), ["a note"], "run --it", "-")


def on_terminal(table, width=2000, **look):
    file = io.StringIO()
    Console(file=file, width=width).print(writers.terminal(table, **look))
    return file.getvalue()


def test_a_table_in_markdown():
    assert writers.markdown(TABLE) == (
        "# Times\n\n`run --it`\n\nOf *one* run.\n\n"
        "| method | time [s] | said | share |\n"
        "| --- | ---: | --- | --- |\n"
        "| newton | 1.23 | a | 50% |\n"
        "| **best** | 2 | - | - |\n\n"
        "- a note\n"
    )


def test_a_table_in_latex_stands_in_an_article():
    written = writers.latex([TABLE])
    for words in (
        "% run --it\n\\begin{table}\n\\centering\\caption{Times}\n",
        "\\begin{tabular}{@{}lS[table-format=1.2,detect-weight]ll@{}}\n\\toprule\n",
        "method & {time [s]} & said & share \\\\\n\\midrule\n",
        "newton & 1.23 & a & 50\\% \\\\\n\\textbf{best} & 2 & - & - \\\\\n\\bottomrule\n",
        "\\parbox{\\linewidth}{\\scriptsize a note}\n\\end{table}\n",
    ):
        assert words in written


NUMBERS = Table(
    "",
    ["m", Column("t", "s", right=True, above="fine"), Column("", above="fine")],
    [
        [Span.of("worse", 3)],
        ["a", Strong("12"), Between.of("8.5", "13")],
        ["b", "<0.010", ""],
        ["c", Span.of("× by 3e-2", 2)],
        ["d", Faint("7"), ""],
    ],
    notes=[Prose("At most 1e-6.")],
    label="here",
)


def test_numbers_of_a_paper_are_aligned_and_what_spans_columns_does():
    written = writers.latex([NUMBERS]).splitlines()
    lines = [line for line in written if line.endswith(r"\\")]
    assert lines == [
        r" & \multicolumn{2}{c}{fine} \\",
        r"m & \multicolumn{2}{c}{t [s]} \\",
        r"\addlinespace \multicolumn{3}{@{}l}{\itshape worse} \\",
        r"a & \bfseries 12 & \quartiles{13}{8.5} \\",
        r"b & <0.010 &  \\",
        r"c & \multicolumn{2}{l}{$\times$ by \num{3e-2}} \\",
        r"d &  &  \\",
    ]
    assert r"\cmidrule(l){2-3}" in written
    assert r"\begin{tabular}{@{}lS[table-format=<2.3,detect-weight]@{\,}l@{}}" in written
    assert r"\label{tab:here}" in written
    assert any(r"At most \num{1e-6}." in line for line in written)


def test_what_spans_columns_stands_in_the_first_of_them_elsewhere():
    written = writers.markdown(NUMBERS)
    for line in ("| worse |  |  |", "| a | **12** | 8.5 to 13 |", "| d | (7) |  |"):
        assert line in written
    assert writers.csv(NUMBERS).splitlines()[1:3] == ["worse,,", "a,12,8.5 to 13"]


def test_a_figure_in_latex():
    written = writers.latex([Picture(Path("a/b.pdf"), "50% done")])
    assert r"\includegraphics[width=\linewidth]{a/b.pdf}" in written
    assert r"\caption{50\% done}" in written


def test_csv_has_every_digit():
    table = Table.of(pd.DataFrame({"a": [1 / 3, float("nan")], "b": [1, 2], "c": ["=x", None]}))
    assert writers.csv(table) == f"a,b,c\n{1 / 3},1,'=x\n,2,\n"


@pytest.mark.parametrize("look", [box.MARKDOWN, box.SIMPLE_HEAD])
def test_a_narrow_terminal_folds_what_may_be_folded(look):
    shown = on_terminal(TABLE, 30, look=look)
    for words in ("Times", "time [s]", "1.23", "a note"):
        assert words in shown
    assert max(map(len, shown.splitlines())) <= 30


def test_a_page_has_headings_classes_and_what_prose_marks():
    shown = html(Document("All", [TABLE, Code("a <b>"), Items(["one"], "these:")]))
    for words in (
        *("<h1>All</h1>", "<h2>Times</h2>", "<p>Of <em>one</em> run.</p>"),
        *('<th class="right">time [s]</th>', '<td class="right">1.23</td>', '<td class="aside">a'),
        *("<strong>best</strong>", "<code>a &lt;b&gt;</code>", "<p>these:</p>", "<li>one</li>"),
    ):
        assert words in shown


def test_pictures(tmp_path):
    (tmp_path / "a.svg").write_text("<?xml?><svg>here</svg>")
    drawn = Document("Charts", [Picture(tmp_path / "a.svg", "a [chart]")])
    assert '<div class="scroll"><svg>here</svg></div>' in html(drawn)
    shown = MarkdownIt("commonmark").render(writers.markdown(drawn))
    assert 'alt="a [chart]"' in shown
    assert "a.svg" in shown


def test_what_is_empty_is_left_out_with_its_title():
    empty = [Table("none", ["a"], [], "about", ["note"]), Items([], "head"), Document("in", [""])]
    parts = [*empty, Document("deep", [Document("deeper", ["words"])])]
    assert writers.markdown(Document("All", parts)) == ("# All\n\n## deep\n\n### deeper\n\nwords\n")


def test_a_line_of_another_length_is_noticed():
    with pytest.raises(ValueError, match="zip"):
        writers.markdown(Table("", ["a", "b"], [["alone"]]))


# --- hostile text, in each place that takes text


def everywhere(words):
    table = Table(
        words, [words, Column(words, words)], [[words, Strong(words)]], words, [words], words, words
    )
    return Document(words, [table, Items([words], words), Code(words), words])


@pytest.mark.parametrize("words", TEXTS)
def test_markdown_reads_as_the_text(words):
    written = writers.markdown(everywhere(words))
    read = MarkdownIt("commonmark").enable(["table", "strikethrough"]).render(written)
    ours = {"h1", "h2", "p", "code", "table", "thead", "tbody", "tr", "th", "td", "strong", "ul"}
    assert set(re.findall(r"<(\w+)", read)) == ours | {"li"}
    assert unescape(read).count(escape.plain(words)) == 14


@given(text)
def test_a_page_takes_any_text(words):
    plain = escape.plain(words)
    shown = Text(html(everywhere(words)))
    assert shown.tags <= {
        *("div", "h1", "h2", "p", "code", "table", "thead", "tbody", "tr", "th", "td"),
        *("strong", "ul", "li"),
    }
    pieces = [piece.strip() for piece in shown.text]
    assert not plain or pieces.count(plain) == 12


@pytest.mark.parametrize("words", TEXTS)
def test_latex_has_no_character_that_means_something(words):
    written = writers.latex([everywhere(words).parts[0]])
    plain, latex = escape.plain(words), escape.latex(words)
    assert written.splitlines()[0] == f"% {plain}"
    assert f"\\caption{{{latex}}}" in written
    assert f"{latex} & \\textbf{{{latex}}} \\\\" in written


@pytest.mark.parametrize("words", TEXTS)
def test_csv_has_no_formula(words):
    header, line = csv.reader(io.StringIO(writers.csv(everywhere(words).parts[0])))
    assert header[0] == line[0] == line[1] == escape.cell(words)


@pytest.mark.parametrize("words", TEXTS)
def test_a_terminal_shows_the_text(words):
    shown = on_terminal(everywhere(words).parts[0])
    assert shown.count(escape.plain(words)) == 7  # the column has it twice
    assert "\x1b" not in shown
