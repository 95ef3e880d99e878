"""What `strainbench claims` wrote into a folder or the one above, as a table of its page."""

from __future__ import annotations

import csv
from collections import Counter
from collections.abc import Mapping
from pathlib import Path

from strainbench import escape
from strainbench.document import Prose, Strong, Table

FILE = "claims.csv"
SHOWN = ("claim", "where", "words", "verdict", "what it rests on")
BESIDE = ("from another side", "what could explain a difference")
SIGNS = {
    "holds": "✓",
    "holds under conditions": "○",
    "does not hold here": "✗",
    "not testable here": "-",
    "not measured yet": "?",
}
"""Before a verdict."""


def claims_table(folder: Path) -> Table:
    """A line a claim, its verdict with a sign; none where none were audited."""
    own, above = (_claims(place / FILE) for place in (folder, folder.absolute().parent))
    return Table("", SHOWN, [_line(row) for row in own or above])


def counted(claims: Table) -> str:
    """How many claims there are, and of each verdict by its sign."""
    signs = Counter(str(line[SHOWN.index("verdict")]).partition(" ")[0] for line in claims.lines)
    told = ", ".join(f"{signs[sign]} {sign}" for sign in SIGNS.values() if signs[sign])
    return f"{len(claims.lines)} claims: {told}"


def _claims(path: Path) -> list[dict[str, str]]:
    """The rows of such a file, none of another one's."""
    if not path.exists():
        return []
    with path.open(encoding="utf-8", newline="") as file:
        rows = csv.DictReader(file)
        return list(rows) if {"claim", "verdict"} <= {*(rows.fieldnames or ())} else []


def _line(row: Mapping[str, str]) -> list[str]:
    verdict = row["verdict"]
    shown = Strong(f"{SIGNS.get(verdict, '')} {verdict}".strip())
    return [row["claim"], row.get("where") or "", row.get("words") or "", shown, _rests_on(row)]


def _rests_on(row: Mapping[str, str]) -> Prose:
    """Numbers, those from another side, what is fair to say, and commands, a line each."""
    commands = (row.get("command") or "").split(" && ")
    lines = [
        row.get("numbers") or "",
        *(f"*{name.capitalize()}*: {row[name]}" for name in BESIDE if row.get(name)),
        *(escape.code(command) for command in commands if command),
    ]
    return Prose("\\\n".join(filter(None, lines)))
