"""Tables as an article sets them, with booktabs and siunitx."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from itertools import groupby

from strainbench import escape
from strainbench.document import Between, Column, Faint, Prose, Span, Strong, Table

COLUMN, PAGE = 238.0, 505.0
"""Points across a column of a two-column article of the narrow kind, and across both."""
LETTER, GAP = 4.4, 6.0
"""Points across a letter in \\footnotesize, and between columns."""
NUMBER = re.compile(r"(<?)-?(\d+)(?:\.(\d+))?(e-?\d+)?")
POWER = re.compile(r"(?<![\w.+-])\d(?:\.\d+)?e-?\d+(?![\w-])")
QUARTILES = r"@{\,}l"


def latex(tables: Iterable[Table]) -> str:
    """Floats with caption, label and notes, over both columns of an article where one is narrow."""
    return "\n\n".join(map(_float, tables)) + "\n"


def width(table: Table) -> float:
    """About how many points a table takes across."""
    letters = [max(map(_letters, texts)) for texts in zip(*table.texts(), strict=True)]
    for k, names in _headings(table.columns):
        room = sum(letters[k : k + len(names)])
        letters[k] += max(0, len(names[0].heading) - room)
    return sum(LETTER * count + GAP for count in letters)


def _letters(text: str) -> float:
    """How wide a text is, in letters."""
    if isinstance(text, Span | Faint):
        return 0
    if isinstance(text, Between):
        return 0.8 * max(len(text.low), len(text.high))
    return len(text) + 2.5 * ("e-" in text)


def _float(table: Table) -> str:
    kind = "table*" if width(table) > COLUMN else "table"
    above = [f"% {escape.plain(text)}" for text in (table.command,) if text]
    label = [rf"\label{{tab:{table.label}}}"] if table.label else []
    notes = " ".join(map(_words, table.notes))
    below = [rf"\par\smallskip\parbox{{\linewidth}}{{\scriptsize {notes}}}"] if notes else []
    return "\n".join(
        [
            *above,
            rf"\begin{{{kind}}}",
            r"\centering",
            rf"\caption{{{_words(table.title)}}}",
            *label,
            r"\footnotesize\setlength{\tabcolsep}{3pt}",
            *_tabular(table),
            *below,
            rf"\end{{{kind}}}",
        ]
    )


def _tabular(table: Table) -> Iterator[str]:
    """The tabular, line by line."""
    columns, texts = table.columns, table.texts()
    sides = [_side(c, line) for c, line in zip(columns, zip(*texts, strict=True), strict=True)]
    yield rf"\begin{{tabular}}{{@{{}}{''.join(sides)}@{{}}}}"
    yield r"\toprule"
    yield from _above(columns)
    yield " & ".join(_heading(names) for _, names in _headings(columns)) + r" \\"
    yield r"\midrule"
    yield from (_line(columns, line) for line in texts)
    yield r"\bottomrule"
    yield r"\end{tabular}"


def _side(column: Column, texts: Sequence[str]) -> str:
    """How the cells of a column are aligned: numbers by their points."""
    if any(isinstance(text, Between) for text in texts):
        return QUARTILES
    if not column.right:
        return "l"
    found = [match for text in texts if (match := NUMBER.fullmatch(text))]
    below, whole, places, power = ([len(m[k] or "") for m in found] for k in (1, 2, 3, 4))
    form = f"{'<' * max(below, default=0)}{max(whole, default=1)}.{max(places, default=0)}"
    exponent = f"e-{'1' * (max(power) - 2)}" if any(power) else ""
    return f"S[table-format={form}{exponent},mode=text,detect-weight]"


def _above(columns: Sequence[Column]) -> Iterator[str]:
    """The line above the headings, ruled below each name; nothing without names."""
    if not any(column.above for column in columns):
        return
    cells, rules, at = [], [], 1
    for name, group in groupby(columns, key=lambda column: column.above):
        count = len(list(group))
        cells += [rf"\multicolumn{{{count}}}{{c}}{{{_words(name)}}}"] if name else count * [""]
        rules += [rf"\cmidrule(l){{{at}-{at + count - 1}}}"] if name else []
        at += count
    yield " & ".join(cells) + r" \\"
    yield " ".join(rules)


def _headings(columns: Sequence[Column]) -> Iterator[tuple[int, list[Column]]]:
    """Columns that share a heading, with their place: those without a name share the last one's."""
    at = 0
    while at < len(columns):
        end = at + 1
        while end < len(columns) and not columns[end].name:
            end += 1
        yield at, list(columns[at:end])
        at = end


def _heading(columns: Sequence[Column]) -> str:
    words = _words(columns[0].heading)
    if len(columns) > 1:
        return rf"\multicolumn{{{len(columns)}}}{{c}}{{{words}}}"
    return f"{{{words}}}" if columns[0].right else words


def _line(columns: Sequence[Column], texts: Sequence[str]) -> str:
    if isinstance(texts[0], Span) and texts[0].width == len(columns):
        words = rf"\multicolumn{{{len(columns)}}}{{@{{}}l}}{{\itshape {_words(texts[0])}}}"
        return rf"\addlinespace {words} \\"
    cells, hidden = [], 0
    for column, text in zip(columns, texts, strict=True):
        if not hidden:
            cells.append(_cell(column, text))
        hidden = text.width - 1 if isinstance(text, Span) else max(hidden - 1, 0)
    return " & ".join(cells) + r" \\"


def _cell(column: Column, text: str) -> str:
    match text:
        case Span():
            return rf"\multicolumn{{{text.width}}}{{l}}{{{_words(text)}}}"
        case Faint():
            return ""
        case Between():
            return f"${{}}^{{{text.high}}}_{{{text.low}}}$" if text else ""
    if column.right and NUMBER.fullmatch(text):
        return rf"\bfseries {text}" if isinstance(text, Strong) else str(text)
    words = rf"\textbf{{{_words(text)}}}" if isinstance(text, Strong) else _words(text)
    return f"{{{words}}}" if column.right and words else words


def _words(text: str) -> str:
    """Text; in our own words a power of ten is set as one."""
    words = escape.latex(text)
    return POWER.sub(r"\\num{\g<0>}", words) if isinstance(text, Prose | Span) else words
