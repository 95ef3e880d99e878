"""What `strainbench claims` wrote into a folder, as a table of its page."""

from __future__ import annotations

import csv
from pathlib import Path

from strainbench.document import Items, Part, Strong, Table

FILE = "claims.csv"
SHOWN = ("claim", "where", "words", "verdict", "numbers")
SIGNS = {
    "holds": "✓",
    "holds under conditions": "○",
    "does not hold here": "✗",
    "not testable here": "-",
    "not measured yet": "?",
}
"""Before a verdict."""


def claims_table(folder: Path) -> Part:
    """A line a claim, its verdict with a sign; nothing where none were audited."""
    path = folder / FILE
    if not path.exists():
        return Items([])
    with path.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    lines = [[_shown(name, row.get(name) or "") for name in SHOWN] for row in rows]
    return Table("", SHOWN, lines)


def _shown(name: str, text: str) -> str:
    return Strong(f"{SIGNS.get(text, '')} {text}".strip()) if name == "verdict" else text
