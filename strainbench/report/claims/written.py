"""The audit as a document and as a table of numbers."""

from __future__ import annotations

import shlex
from collections import Counter
from pathlib import Path

from strainbench.document import Code, Document, Prose, Strong, Table
from strainbench.document.html import page
from strainbench.document.writers import csv, markdown
from strainbench.files import write_whole
from strainbench.report.claims import (
    bdf2,
    cost,
    failing,
    hernandez,
    hernandez_shapes,
    methods,
    motion,
    others,
    projection,
    rest,
    robustness,
    scheme,
    table1,
)
from strainbench.report.claims.claim import CLAIMS as CLAIMS
from strainbench.report.claims.claim import PROGRAM, Claim, Finding, Verdict
from strainbench.report.claims.evidence import Evidence

PAPERS = {
    "T": "Tang, Coros and Thomaszewski 2022",
    "H": "Hernandez, Cirio, Perez and Otaduy 2013",
}
MODULES = (
    projection,
    methods,
    rest,
    scheme,
    bdf2,
    table1,
    failing,
    others,
    cost,
    robustness,
    motion,
    hernandez,
    hernandez_shapes,
)
"""Their import registers the claims."""
ABOUT = """\
What the papers claim, in our words, beside what is measured here. Each verdict follows from the
numbers by a rule in `strainbench/report/claims`; ratios hold within a folder, so on one machine."""


def write_claims(root: Path) -> tuple[str, list[Path]]:
    """claims.md, .html and .csv in `root`, from the folders of results below it; a line of them.

    Raises
    ------
    ValueError
        If there is no such folder.
    """
    found = audit(root)
    told = document(found)
    files = {
        "claims.md": markdown(told),
        "claims.csv": csv(table(found)),
        "claims.html": page(told),
    }
    for name, text in files.items():
        write_whole(root / name, text.encode())
    return counted(found), [root / name for name in files]


def audit(root: Path) -> list[tuple[Claim, Finding]]:
    """All claims, by paper and number, and what was found."""
    if not root.is_dir():
        raise ValueError(f"--results {root}: no such folder")
    evidence = Evidence(root)
    return [(claim, claim.find(evidence)) for claim in sorted(CLAIMS.values(), key=order)]


def missing(root: Path) -> list[str]:
    """The commands of claims that lack a verdict or numbers, with results in `root`."""
    unmeasured = (c for c, f in audit(root) if _lacks(f))
    commands = dict.fromkeys(command for claim in unmeasured for command in claim.commands)
    place = f" {shlex.quote(str(root))}/"
    return [c.replace(" results/", place) for c in commands if c.startswith((PROGRAM, "python "))]


def _lacks(finding: Finding) -> bool:
    """Whether it says of anything that it is not measured yet."""
    return Verdict.UNMEASURED in f"{finding.verdict} {finding.numbers} {finding.second}".lower()


def counted(found: list[tuple[Claim, Finding]]) -> str:
    """How many verdicts there are of each kind."""
    counts = Counter(finding.verdict for _, finding in found)
    told = ", ".join(f"{counts[v]} {v}" for v in Verdict if counts[v])
    return f"{len(found)} claims: {told}."


def order(claim: Claim) -> tuple[bool, int]:
    """By paper and number."""
    return claim.name[0] != "T", int(claim.name[1:])


def document(found: list[tuple[Claim, Finding]]) -> Document:
    """How many verdicts there are of each kind, then claim by claim."""
    papers = [
        Document(name, [_section(c, f) for c, f in found if c.name.startswith(letter)])
        for letter, name in PAPERS.items()
    ]
    return Document("Claims", [Prose(ABOUT), counted(found), *papers])


def _section(claim: Claim, finding: Finding) -> Document:
    second = [Prose(f"*From another side*: {finding.second}")] if finding.second else []
    fair = [Prose(f"*What could explain a difference*: {claim.fairness}")] if claim.fairness else []
    commands = [Code(command) for command in claim.commands]
    return Document(
        f"{claim.name} ({claim.where}): {claim.words}",
        [Strong(finding.verdict), Prose(finding.numbers), *second, *fair, *commands],
    )


def table(found: list[tuple[Claim, Finding]]) -> Table:
    """A line a claim."""
    header = ["claim", "where", "words", "verdict", "numbers", "from another side"]
    lines = [[c.name, c.where, c.words, str(f.verdict), f.numbers, f.second] for c, f in found]
    return Table("", header, lines)
