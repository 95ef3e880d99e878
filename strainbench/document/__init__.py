"""Tables and documents, and what writes them as Markdown, LaTeX, CSV, on a terminal, as a page.

Texts are given as they are, whatever they hold: the writers escape them, each in its own way. That
of pages is `strainbench.document.page.page`, kept apart for what it imports.
"""

from strainbench.document.model import (
    Code,
    Column,
    Document,
    Items,
    Part,
    Picture,
    Prose,
    Strong,
    Table,
)
from strainbench.document.writers import csv, latex, markdown, terminal

__all__ = [
    "Code",
    "Column",
    "Document",
    "Items",
    "Part",
    "Picture",
    "Prose",
    "Strong",
    "Table",
    "csv",
    "latex",
    "markdown",
    "terminal",
]
