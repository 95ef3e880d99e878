"""The article's numbers are those of records, by name; a record that is missing is a clear line."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pandas as pd
import pytest

from strainbench.report.cited import NotCitedError, as_macros, main, numbers, tables, write_cited

ROOT = Path(__file__).parents[2]
ARTICLE = (ROOT / "paper/article.tex").read_text()
ASKED = tomllib.loads((ROOT / "paper/numbers.toml").read_text())
TABLE = """\
# Table

12 of 345 things

| method | time [s] | gap |
| --- | ---: | ---: |
| **a** | 0.5 | 1e-3 |
| `b` | 2.0 |  |
"""


@pytest.fixture
def root(tmp_path):
    (tmp_path / "t.md").write_text(TABLE)
    pd.DataFrame({"solver": ["a", "a"], "limit": [0.01, 0.1], "mm": [1.5, 3]}).to_csv(
        tmp_path / "t.csv", index=False
    )
    tables.cache_clear()
    return tmp_path


def read(root, **entry):
    return numbers(root, {"it": entry})["it"]


def test_a_number_is_read_by_its_row_and_column(root):
    assert read(root, file="t.md", where={"method": "a"}, column="gap") == "0.001"
    assert read(root, file="t.csv", where={"solver": "a", "limit": 0.1}, column="mm") == "3"


def test_a_number_may_be_a_quotient_of_two_rows_and_in_another_unit(root):
    ratio = {"where": {"method": "b"}, "over": {"method": "a"}, "column": "time [s]"}
    assert read(root, file="t.md", **ratio) == "4"
    assert read(root, file="t.md", **ratio, times=1000, form=".1e") == "4.0e+03"


def test_a_number_may_be_found_in_words(root):
    assert read(root, file="t.md", find=r"^(\d+) of \d+ things") == "12"


@pytest.mark.parametrize(
    ("entry", "words"),
    [
        ({"file": "t.md", "where": {"method": "c"}, "column": "gap"}, "0 rows with method = c"),
        ({"file": "t.md", "where": {"method": "b"}, "column": "gap"}, "no gap in the row"),
        ({"file": "t.md", "where": {"method": "a"}, "column": "mm"}, "0 tables with method, mm"),
        ({"file": "t.csv", "where": {"solver": "a"}, "column": "mm"}, "2 rows with solver = a"),
        ({"file": "u.csv", "where": {"solver": "a"}, "column": "mm"}, "u.csv is not there"),
        ({"file": "t.md", "find": r"(\d+) people"}, "0 times where once is asked"),
        ({"file": "t.md", "find": r"(\d)"}, "times where once is asked"),
        ({"file": "u.md", "find": r"(\d)"}, "u.md is not there"),
    ],
)
def test_a_name_that_leads_nowhere_is_an_error_that_says_where(root, entry, words):
    with pytest.raises(NotCitedError, match=re.escape(words)):
        read(root, **entry)


def test_it_is_one_line_of_the_command(root):
    (root / "paper").mkdir()
    (root / "paper/numbers.toml").write_text('[numbers.it]\nfile = "u.md"\nfind = "(1)"\n')
    with pytest.raises(SystemExit, match=r"strainbench\.report\.cited: it: .*u\.md is not there"):
        main([str(root / "paper")])


def test_numbers_are_written_as_commands_of_latex(root):
    (root / "paper").mkdir()
    (root / "paper/numbers.toml").write_text(
        '[numbers.things]\nfile = "t.md"\nfind = "of ([0-9]+) things"\n'
    )
    (path,) = write_cited(root / "paper")
    assert path.read_text() == "\\newcommand{\\things}{\\num{345}}\n"
    with pytest.raises(NotCitedError, match="letters alone"):
        as_macros({"in2": "1"})


def test_what_the_article_takes_is_in_the_records():
    assert len(numbers(ROOT, ASKED["numbers"])) == len(ASKED["numbers"])


def test_the_article_uses_what_is_named_and_names_what_it_uses():
    used = set(re.findall(r"\\([A-Za-z]+)\{\}", ARTICLE.partition(r"\maketitle")[2]))
    assert used == set(ASKED["numbers"])
    assert set(re.findall(r"input\{build/table-(\w+)\}", ARTICLE)) == set(ASKED["tables"])
    assert set(re.findall(r"\{figure-(\w+)\}", ARTICLE)) == set(ASKED["figures"])


def test_what_the_article_cites_is_in_its_references():
    cited = {key for keys in re.findall(r"\\cite\{([^}]*)\}", ARTICLE) for key in keys.split(",")}
    there = re.findall(r"^@\w+\{(\w+),$", (ROOT / "paper/references.bib").read_text(), re.MULTILINE)
    assert sorted(there) == sorted(cited)


def test_no_measured_number_stands_in_the_article():
    """Nothing with a decimal point, a time, a length or a ratio; settings and formulas may."""
    prose = ARTICLE.partition(r"\begin{abstract}")[2].partition(r"\bibliographystyle")[0]
    prose = re.sub(r"\\begin\{verbatim\}.*?\\end\{verbatim\}", "", prose, flags=re.DOTALL)
    assert not re.findall(r"\d+\.\d+|\d(?:\.\d+)?~(?:ms|mm|mJ)|\d times", prose)
