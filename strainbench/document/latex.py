"""Tables as an article sets them, with booktabs and siunitx."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from itertools import groupby
from typing import NamedTuple

from strainbench import escape
from strainbench.document import Between, Column, Faint, Picture, Prose, Span, Strong, Table

COLUMN, PAGE = 238.0, 505.0
"""Points across a column of a two-column article of the narrow kind, and across both."""
SIZES = {r"\footnotesize": 1.0, r"\scriptsize": 0.94}
"""Sizes of type that a table may have, and how wide they are."""
LETTER, DIGIT, SMALL_DIGIT, GAP = 3.8, 4.4, 3.5, 4.5
"""Points across letters in \\footnotesize of Computer Modern, a wide type, and between columns."""
NUMBER = re.compile(r"(<?)-?(\d+)(?:\.(\d+))?(e-?\d+)?")
POWER = re.compile(r"(?<![\w.+-])\d(?:\.\d+)?e-?\d+(?![\w-])")
SETUP = (
    r"\setlength{\tabcolsep}{2pt}\sisetup{exponent-product=\cdot,tight-spacing=true,"
    r"group-minimum-digits=12}%",
    r"\newcommand{\quartiles}[2]{$\vcenter{\offinterlineskip"
    r"\hbox{\tiny #1}\kern0.9pt\hbox{\tiny #2}}$}%",
    r"\renewcommand{\arraystretch}{1.08}%",
)


def latex(parts: Iterable[Table | Picture]) -> str:
    """Floats with captions: tables, over both columns where one is narrow, and figures."""
    floats = [_figure(p) if isinstance(p, Picture) else _float(p) for p in parts if _shown(p)]
    return "\n\n".join(floats) + "\n"


def _shown(part: Table | Picture) -> bool:
    return isinstance(part, Picture) or bool(part.lines)


def _figure(picture: Picture) -> str:
    return "\n".join(
        [
            r"\begin{figure}",
            rf"\centering\includegraphics[width=\linewidth]{{{picture.path.as_posix()}}}",
            rf"\caption{{{_words(picture.about)}}}",
            rf"\label{{fig:{picture.path.stem}}}",
            r"\end{figure}",
        ]
    )


def width(table: Table) -> float:
    """About how many points a table takes across in \\footnotesize."""
    points = [
        max(_Form.of(texts).points, *map(_points, texts))
        for texts in zip(*table.texts(), strict=True)
    ]
    for k, names in _headings(table.columns):
        _widen(points, k, len(names), LETTER * len(names[0].heading))
    for line in table.texts():
        for k, text in enumerate(line):
            if isinstance(text, Span) and text.width < len(points):
                _widen(points, k, text.width, LETTER * len(text))
    return sum(points) + GAP * (len(points) - 1)


def _widen(points: list[float], first: int, count: int, needed: float) -> None:
    """Make columns as wide as what spans them."""
    there = sum(points[first : first + count]) + GAP * (count - 1)
    points[first + count - 1] += max(0.0, needed - there)


def _points(text: str) -> float:
    """How wide a text is, if it neither spans columns nor is a number."""
    if isinstance(text, Span | Faint):
        return 0.0
    if NUMBER.fullmatch(text):
        return 0.0
    if isinstance(text, Between):
        return SMALL_DIGIT * max(len(text.low), len(text.high))
    return LETTER * len(text)


def _float(table: Table) -> str:
    across = width(table)
    fits = (
        (room, size) for room in (COLUMN, PAGE) for size in SIZES if across * SIZES[size] <= room
    )
    room, size = next(fits, (PAGE, list(SIZES)[-1]))
    kind = "table" if room == COLUMN else "table*"
    above = [f"% {escape.plain(text)}" for text in (table.command,) if text]
    label = [rf"\label{{tab:{table.label}}}"] if table.label else []
    notes = " ".join(map(_words, table.notes))
    below = [rf"\par\smallskip\parbox{{\linewidth}}{{\scriptsize {notes}}}"] if notes else []
    return "\n".join(
        [
            *above,
            rf"\begin{{{kind}}}",
            rf"\centering\caption{{{_words(table.title)}}}",
            *label,
            rf"\medskip{size}",
            *SETUP,
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
        return r"@{\,}l"
    return f"S[table-format={_Form.of(texts)},detect-weight]" if column.right else "l"


class _Form(NamedTuple):
    """What the numbers of a column have at most: letters in each part of a number."""

    below: int
    whole: int
    places: int
    power: int

    @classmethod
    def of(cls, texts: Iterable[str]) -> _Form:
        found = [match for text in texts if (match := NUMBER.fullmatch(text))]
        most = (max((len(m[k] or "") for m in found), default=0) for k in (1, 2, 3, 4))
        return cls(*most)

    def __str__(self) -> str:
        exponent = f"e-{self.power - 2}" if self.power else ""
        return f"{'<' * self.below}{max(self.whole, 1)}.{self.places}{exponent}"

    @property
    def points(self) -> float:
        """How wide."""
        digits = self.whole + self.places + 0.6 * (self.places > 0)
        return DIGIT * digits + 9 * self.below + (self.power > 0) * (7 + DIGIT * self.power)


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
            return rf"\quartiles{{{text.high}}}{{{text.low}}}" if text else ""
    if column.right and NUMBER.fullmatch(text):
        return rf"\bfseries {text}" if isinstance(text, Strong) else str(text)
    words = rf"\textbf{{{_words(text)}}}" if isinstance(text, Strong) else _words(text)
    return f"{{{words}}}" if column.right and words else words


def _words(text: str) -> str:
    """Text; in our own words a power of ten is set as one."""
    words = escape.latex(text)
    return POWER.sub(r"\\num{\g<0>}", words) if isinstance(text, Prose | Span) else words
