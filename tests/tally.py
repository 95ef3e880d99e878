"""What became of the answers to many problems: per solver, and certificates contradicted."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from strainbench.bench.machine import describe_machine
from strainbench.referee.certificate import OUTCOMES, Certificate
from strainbench.report.machine import machine_line
from strainbench.report.provenance import remember_study

BROKEN = "solved, but violated"
COLUMNS = (*OUTCOMES, BROKEN, "refused")
TIME_LIMIT = 0.2  # [s] a solve


@dataclass
class Tally:
    """Counts of problems, of contradicted certificates, and of each solver's outcomes."""

    problems: int = 0
    certificates: int = 0
    contradictions: list[str] = field(default_factory=list)
    answers: dict[str, Counter[str]] = field(default_factory=dict)

    def refused(self, name: str) -> None:
        """A problem with limits that the solver does not take."""
        self.answers.setdefault(name, Counter())["refused"] += 1

    def answer(self, name: str, status: str, found: Certificate) -> None:
        """An answer, with what the solver says and what the referee finds."""
        counts = self.answers.setdefault(name, Counter())
        counts[found.outcome] += 1
        counts[BROKEN] += status == "solved" and found.outcome == "violated"
        self.certificates += found.outcome != "no answer"

    def problem(self, contradictions: Sequence[str]) -> None:
        """A problem is done, with what contradicts its certificates."""
        self.problems += 1
        self.contradictions += contradictions

    def lines(self) -> Iterator[str]:
        """The counts as a table."""
        found = f"{len(self.contradictions)} of {self.certificates} certificates contradicted"
        yield f"{self.problems} problems, {len(self.answers)} solvers: {found}"
        yield from self.contradictions
        width = max(map(len, self.answers), default=0)
        yield "  ".join([" " * width, *COLUMNS])
        for name in sorted(self.answers):
            counts = (f"{self.answers[name][c]:{len(c)}}" for c in COLUMNS)
            yield "  ".join([name.ljust(width), *counts])

    def write(self, file: Path) -> None:
        """The table as Markdown, with command and machine; a digest of the code goes beside it."""
        machine, facts = describe_machine(threads=1)
        about = (
            f"`make certificates CERTIFICATES={file.parent}`, {TIME_LIMIT:g} s a projection, on "
            f"{machine_line(machine, facts)}"
        )
        title = f"# Certificates on {self.problems} random problems"
        text = "\n".join([title, "", about, "", "```text", *self.lines(), "```", ""])
        file.write_text(text, encoding="utf-8")
        remember_study(file.parent, "certificates", machine, facts)
