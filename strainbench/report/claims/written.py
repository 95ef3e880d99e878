"""The audit as a document and as a table of numbers."""

from __future__ import annotations

import re
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
    hernandez_beams,
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
    *(projection, methods, rest, scheme, bdf2, table1, failing, others, cost, robustness, motion),
    *(hernandez, hernandez_beams, hernandez_shapes),
)
"""Their import registers the claims."""
ABOUT = """\
What the papers claim, in our words, beside what is measured here. Each verdict follows from the
numbers by a rule in `strainbench/report/claims`; ratios hold within a folder, so on one machine."""
ANEW = """\
To measure anew, call a claim's commands in the checkout, in its environment (`make setup`, then
`source .venv/bin/activate`, or `.venv/bin/strainbench` in place of `strainbench`). A folder keeps
what it has: add `--rerun` to `strainbench run`, or give another folder (`--results`, `-o`,
`PAPER=`), such as `/tmp/new/claims/field` for `results/claims/field`, and have the verdicts from
there by `strainbench claims --results /tmp/new`. `strainbench claims --measure` runs the commands
of claims that are not measured yet, which takes hours."""
SAID = {
    Verdict.HOLDS: ("holds", "hold"),
    Verdict.CONDITIONS: ("holds under conditions", "hold under conditions"),
    Verdict.FAILS: ("does not hold here", "do not hold here"),
    Verdict.NOT_TESTABLE: ("is not testable here", "are not testable here"),
    Verdict.UNMEASURED: ("is not measured yet", "are not measured yet"),
}
"""Of one claim, and of several."""
ITSELF = "Computed by `strainbench claims` itself, from no measured folder."
PROGRAMS = (PROGRAM, "python ", "make ")


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
    place = f"{shlex.quote(str(root))}/"
    return [
        re.sub(r"(?<=[ =])results/", lambda _: place, c) for c in commands if c.startswith(PROGRAMS)
    ]


def _lacks(finding: Finding) -> bool:
    """Whether it says of anything that it is not measured yet."""
    return Verdict.UNMEASURED in f"{finding.verdict} {finding.numbers} {finding.second}".lower()


def counted(found: list[tuple[Claim, Finding]]) -> str:
    """How many verdicts there are of each kind."""
    counts = Counter(finding.verdict for _, finding in found)
    told = ", ".join(f"{counts[v]} {SAID[v][counts[v] > 1]}" for v in Verdict if counts[v])
    return f"{len(found)} claim{'s' * (len(found) != 1)}: {told}."


def order(claim: Claim) -> tuple[bool, int]:
    """By paper and number."""
    return claim.name[0] != "T", int(claim.name[1:])


def document(found: list[tuple[Claim, Finding]]) -> Document:
    """How many verdicts there are of each kind, then claim by claim."""
    papers = [
        Document(name, [_section(c, f) for c, f in found if c.name.startswith(letter)])
        for letter, name in PAPERS.items()
    ]
    return Document("Claims", [Prose(ABOUT), Prose(ANEW), counted(found), *papers])


def _section(claim: Claim, finding: Finding) -> Document:
    second = [Prose(f"*From another side*: {finding.second}")] if finding.second else []
    fair = [Prose(f"*What could explain a difference*: {claim.fairness}")] if claim.fairness else []
    return Document(
        f"{claim.name} ({claim.where}): {claim.words}",
        [Strong(finding.verdict), Prose(finding.numbers), *second, *fair, *_measured_by(claim)],
    )


def _measured_by(claim: Claim) -> list[str]:
    """Its commands, or how else it is looked at."""
    return [Code(command) for command in claim.commands] or [Prose(ITSELF)]


def table(found: list[tuple[Claim, Finding]]) -> Table:
    """A line a claim."""
    header = ["claim", "where", "words", "verdict", "numbers", "from another side"]
    lines = [
        [c.name, c.where, c.words, str(f.verdict), f.numbers, f.second, c.fairness, _called(c)]
        for c, f in found
    ]
    return Table("", [*header, "what could explain a difference", "command"], lines)


def _called(claim: Claim) -> str:
    """Its commands in a line of a shell."""
    return " && ".join(claim.commands) or "strainbench claims"
