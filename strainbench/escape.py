"""Foreign text (names, labels, reasons, what solvers say) in each form that the suite writes.

A plug-in's words are its own: whatever they hold is shown as it is, and is markup nowhere.
"""

from __future__ import annotations

import re

from rich.text import Text

ANSI = re.compile(r"\x1b(?:\][^\x07\x1b]*(?:\x07|\x1b\\)|\[[0-?]*[ -/]*[@-~]|[@-Z\\-_])")
UNSEEN = re.compile(r"[\x00-\x1f\x7f-\x9f\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff]")
"""Controls, those of the direction of writing, line separators, halves of surrogate pairs."""
FORMULA = re.compile(r"'*[=+\-@\t\r\uff1d\uff0b\uff0d\uff20]")
"""What a spreadsheet takes for one, the quote that keeps it from that included."""
MARKDOWN = (
    (re.compile(r"([\\`*|~])"), r"\\\1"),
    (re.compile(r"&"), "&amp;"),
    (re.compile(r"<(?=[A-Za-z/!?])"), "&lt;"),  # else it begins no tag
    (re.compile(r"(?<![^\W_])_|_(?![^\W_])"), r"\\_"),  # within a word it is no emphasis
    (re.compile(r"\](?=[(:\[])"), r"\\]"),  # a link's; other brackets are plain
    (re.compile(r"^([#>=\[]|[+-](?=\s|-))"), r"\\\1"),  # what would begin a heading, an item,
    (re.compile(r"^(\d+)([.)])(?=\s|$)"), r"\1\\\2"),  # or a numbered one
    (re.compile(r"(?<=\s)(#+)$"), r"\\\1"),  # what would end a heading
)
LATEX = str.maketrans(
    {
        "\\": r"\textbackslash{}",
        "{": r"\{",
        "}": r"\}",
        "$": r"\$",
        "&": r"\&",
        "#": r"\#",
        "%": r"\%",
        "_": r"\_",
        "^": r"\textasciicircum{}",
        "~": r"\textasciitilde{}",
        "<": r"\textless{}",
        ">": r"\textgreater{}",
        "|": r"\textbar{}",
        "`": r"\textasciigrave{}",
        "·": r"$\cdot$",
        "×": r"$\times$",
        "°": r"$^\circ$",
        "µ": r"$\mu$",
        "→": r"$\to$",
        "≤": r"$\le$",
        "≥": r"$\ge$",
        "…": r"\dots{}",
    }
)
"""Letters beyond Latin stay as they are: LuaLaTeX and XeLaTeX read them."""


def plain(text: object) -> str:
    """One line that changes nothing on a terminal: no control characters, no ANSI sequences."""
    return " ".join(seen(str(text)).split())


def seen(text: str) -> str:
    """Without control characters and ANSI sequences, all spaces as they are."""
    return UNSEEN.sub(" ", ANSI.sub("", text))


def terminal(text: object) -> Text:
    """For rich, which reads a string as markup, and `:name:` as an emoji."""
    return Text(plain(text))


def markdown(text: object) -> str:
    """For a cell of a table, a heading or an item of a list."""
    words = plain(text)
    for pattern, replacement in MARKDOWN:
        words = pattern.sub(replacement, words)
    return words


def code(text: object) -> str:
    """A span of code in Markdown, fenced by more backticks than the text has in a row."""
    words = plain(text)
    fence = "`" * (1 + max((len(run) for run in re.findall("`+", words)), default=0))
    room = " " if words.startswith("`") or words.endswith("`") else ""
    return f"{fence}{room}{words}{room}{fence}"


def latex(text: object) -> str:
    """For text in LaTeX."""
    return plain(text).translate(LATEX).replace("--", "-{}-")  # two would be a dash


def chart(text: object) -> str:
    """For matplotlib, which reads what stands between two dollars as mathematics."""
    words = plain(text).replace("$", r"\$")
    return f" {words}" if words.startswith("_") else words  # it keeps such names out of legends


def cell(value: object) -> object:
    """A cell of a derived CSV: text that a spreadsheet would take for a formula is quoted."""
    if not isinstance(value, str):
        return value
    words = plain(value)
    return words if len(words) < 2 or _is_number(words) else quoted(words)


def quoted(text: str) -> str:
    """Text that no spreadsheet takes for a formula: an apostrophe stands before one."""
    return f"'{text}" if FORMULA.match(text) else text


def unquoted(text: str) -> str:
    """What `quoted` was given."""
    return text[1:] if text.startswith("'") and FORMULA.match(text) else text


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
