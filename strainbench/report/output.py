"""What `-o` names: CSV or Markdown, by the ending."""

from __future__ import annotations

from pathlib import Path

from strainbench.bench.records import open_folder
from strainbench.document import Document, Table
from strainbench.document.writers import csv, markdown

ENDINGS = (".csv", ".md")


def check_ending(path: Path) -> None:
    """ValueError for a name whose ending says no form; its folder is made."""
    if path.suffix not in ENDINGS:
        raise ValueError(f"-o {path}: a name that ends in {', '.join(ENDINGS)} is valid")
    open_folder(path.parent, "-o")


def write_output(path: Path, document: Document, cells: Table) -> None:
    """The document as Markdown, or the cells alone as CSV."""
    check_ending(path)
    text = csv(cells) if path.suffix == ".csv" else markdown(document)
    path.write_text(text, encoding="utf-8")
