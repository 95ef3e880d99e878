"""What an article takes from records by name, so that none goes stale: numbers, tables, figures.

`python -m strainbench.report.cited paper` reads `paper/numbers.toml` and writes what LaTeX takes
into `paper/build`. Paths are from the folder above. In the file stand

- `[numbers.NAME]`: `folder` with runs, or a `file` with tables, as CSV or Markdown; the row `where`
  columns have given values, and a `column`; or any `file`, and what to `find` in it, once, as a
  regular expression whose one group is the number. `over` names what differs in another row, by
  whose value it is divided; `times` is a factor, `form` a format. In LaTeX it is `\\NAME{}`;
- `[tables.NAME]`: `folder`, `methods`, `columns` as of `strainbench report --paper`, `where`;
- `[figures.NAME]`: `folder`, `methods`, `where`, and `chart`, its file's name there.
"""

from __future__ import annotations

import re
import sys
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cache
from itertools import groupby
from pathlib import Path
from typing import Any

import pandas as pd

from strainbench.document.latex import latex
from strainbench.files import RecordsError
from strainbench.report.article import charts
from strainbench.report.charts import draw
from strainbench.report.paper import chosen_columns, chosen_methods, paper_tables
from strainbench.report.runs import load_runs

NUMBERS, BUILD = "numbers.toml", "build"
Entry = Mapping[str, Any]


class NotCitedError(ValueError):
    """A name of the file leads to no record, or to several."""


def write_cited(paper: Path) -> list[Path]:
    """Write numbers.tex, table-NAME.tex and figure-NAME.pdf.

    Raises
    ------
    NotCitedError
        For a name that leads nowhere.
    """
    asked = tomllib.loads((paper / NUMBERS).read_text(encoding="utf-8"))
    root, build = paper.parent, paper / BUILD
    build.mkdir(exist_ok=True)
    texts = {"numbers.tex": as_macros(numbers(root, asked.get("numbers", {})))}
    for name, entry in asked.get("tables", {}).items():
        texts[f"table-{name}.tex"] = _table(root, name, entry)
    for name, text in texts.items():
        (build / name).write_text(text, encoding="utf-8")
    figures = {build / f"figure-{n}.pdf": (n, e) for n, e in asked.get("figures", {}).items()}
    for path, (name, entry) in figures.items():
        _figure(root, name, entry, path)
    return [*(build / name for name in texts), *figures]


def numbers(root: Path, entries: Mapping[str, Entry]) -> dict[str, str]:
    """Each number as a text, by its name."""
    return {name: format(value(root, name, e), e.get("form", "g")) for name, e in entries.items()}


def as_macros(texts: Mapping[str, str]) -> str:
    """A command of LaTeX a number; siunitx sets it."""
    if odd := [name for name in texts if not re.fullmatch("[A-Za-z]+", name)]:
        raise NotCitedError(f"{odd[0]}: a name in LaTeX has letters alone")
    return "".join(f"\\newcommand{{\\{n}}}{{\\num{{{text}}}}}\n" for n, text in texts.items())


def value(root: Path, name: str, entry: Entry) -> float:
    """The number that an entry leads to."""
    if "find" in entry:
        return _found(root / entry["file"], name, entry["find"]) * float(entry.get("times", 1))
    source = entry.get("folder") or entry["file"]
    column, what = entry["column"], f"{name}: {source}"
    table = _with_columns(tables(root / source), what, [*entry["where"], column])
    first = _cell(table, what, entry["where"], column)
    if over := entry.get("over"):
        first /= _cell(table, what, entry["where"] | over, column)
    return first * float(entry.get("times", 1))


def _found(path: Path, name: str, pattern: str) -> float:
    """What a regular expression finds in a text, where that is once."""
    if not path.exists():
        raise NotCitedError(f"{name}: {path} is not there")
    found = re.findall(pattern, path.read_text(encoding="utf-8"), re.MULTILINE)
    if len(found) != 1:
        raise NotCitedError(
            f"{name}: {path} has {pattern!r} {len(found)} times where once is asked"
        )
    return float(found[0].replace(",", ""))


@cache
def tables(source: Path) -> list[pd.DataFrame]:
    """The rows of a folder of runs, or the tables of a file."""
    if source.is_dir():
        return [load_runs(source)]
    if not source.exists():
        raise NotCitedError(f"{source} is not there")
    return [pd.read_csv(source)] if source.suffix == ".csv" else list(_in_markdown(source))


def _in_markdown(path: Path) -> Iterator[pd.DataFrame]:
    """The tables of a text, cells as they are shown but for bold and code."""
    lines = re.sub(r"[*`]", "", path.read_text(encoding="utf-8")).splitlines()
    for is_table, block in groupby(lines, lambda line: line.startswith("|")):
        if is_table:
            header, _, *cells = [[c.strip() for c in li.strip("|").split("|")] for li in block]
            yield pd.DataFrame([line for line in cells if len(line) == len(header)], columns=header)


def _with_columns(found: Sequence[pd.DataFrame], what: str, columns: Sequence[str]) -> pd.DataFrame:
    """The one table that has some columns."""
    having = [table for table in found if set(columns) <= set(table.columns)]
    if len(having) != 1:
        told = ", ".join(columns)
        raise NotCitedError(f"{what} has {len(having)} tables with {told}, where one is asked")
    return having[0]


def _cell(table: pd.DataFrame, what: str, where: Entry, column: str) -> float:
    """The value of the one row that a condition holds for."""
    rows = _where(table, where)
    if len(rows) != 1 or rows[column].iloc[0] in ("", None) or pd.isna(rows[column].iloc[0]):
        told = ", ".join(f"{key} = {wanted}" for key, wanted in where.items())
        count = f"{len(rows)} rows" if len(rows) != 1 else f"no {column} in the row"
        raise NotCitedError(f"{what} has {count} with {told}, where one is asked")
    return float(rows[column].iloc[0])


def _where(table: pd.DataFrame, where: Entry) -> pd.DataFrame:
    """The rows whose columns have given values, numbers to rounding."""
    for key, wanted in where.items():
        if isinstance(wanted, str):
            table = table[table[key].astype(str) == wanted]
        else:
            table = table[(pd.to_numeric(table[key]) / wanted - 1).abs() < 1e-9]
    return table


def _chosen(root: Path, name: str, entry: Entry) -> pd.DataFrame:
    what = f"{name}: {entry['folder']}"
    table = _with_columns(tables(root / entry["folder"]), what, list(entry["where"]))
    rows = _where(table, entry["where"])
    if rows.empty:
        raise NotCitedError(f"{name}: {entry['folder']} has no such rows")
    return chosen_methods(rows, entry.get("methods"))


def _table(root: Path, name: str, entry: Entry) -> str:
    """Floats of LaTeX, of which an article refers to the first as tab:NAME."""
    floats = paper_tables(_chosen(root, name, entry), chosen_columns(entry.get("columns")))
    return latex([replace(floats[0], label=name), *floats[1:]])


def _figure(root: Path, name: str, entry: Entry, path: Path) -> None:
    """The chart of a folder that has a given name."""
    there = {c.name: c for c in charts(root / entry["folder"], _chosen(root, name, entry))}
    if entry["chart"] not in there:
        valid = ", ".join(there)
        raise NotCitedError(f"{name}: no chart called {entry['chart']!r}; valid are {valid}")
    draw(there[entry["chart"]], path)


def main(words: Sequence[str]) -> None:
    """Write what an article takes, or say in a line what is missing."""
    try:
        for path in write_cited(Path(words[0] if words else "paper")):
            print(path)
    except FileNotFoundError as missing:
        raise SystemExit(f"strainbench.report.cited: {missing.filename} is not there") from None
    except (NotCitedError, RecordsError, tomllib.TOMLDecodeError, OSError) as error:
        raise SystemExit(f"strainbench.report.cited: {error}") from None


if __name__ == "__main__":
    main(sys.argv[1:])
