"""What was found of the sensitivity of methods: a table of all, one a method, and every trial."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from strainbench.document import Code, Column, Document, Part, Prose, Table
from strainbench.document.writers import csv, markdown
from strainbench.files import locked, open_folder, write_whole
from strainbench.report.machine import machine_section
from strainbench.report.measures import digits
from strainbench.report.numbers import power
from strainbench.studies.sensitivity.measure import Sensitivity, Trial
from strainbench.studies.sensitivity.writings import AS_IT_IS, FARTHEST, GROUPS

EXPLANATION = f"""\
The same projection written down in other ways, which make no difference to its optimum: the
vertices and elements in random orders; rotated; moved by 1 m to {FARTHEST:g} m; in m, mm and km.
*{AS_IT_IS}* is the same writing again and again, so what differs there is noise."""
SPREAD = """\
Spread: the largest distance of a vertex between two answers, taken back to the projection as it is,
in mean edge lengths. In brackets how many outcomes differ from the first as it is."""
DETAILS = """\
Iterations: least, median, most. CPU time: quartiles, without set-up. Changed: outcomes that differ
from the first as it is."""
HEADER = (
    *("written", Column("spread", "mm", power), Column("in edges", form=power)),
    *("iterations", Column("CPU time", "ms"), "changed", "outcomes", "says"),
)
TRIALS = (
    *("method", "group", "writing", "outcome", "status", "iterations"),
    *("cpu_seconds", "max_violation", "relative_gap", "moved_edges"),
)


@dataclass(frozen=True, eq=False)
class Outcome:
    """What a study found, and where.

    Parameters
    ----------
    title : the scene and its frame
    command : that made it
    machines : name and facts
    """

    title: str
    command: str
    machines: Mapping[str, Mapping[str, object]]
    found: Sensitivity

    def write(self, folder: Path) -> list[Path]:
        """sensitivity.md and sensitivity.csv."""
        texts = {
            "sensitivity.md": markdown(self.document()),
            "sensitivity.csv": csv(self.trials()),
        }
        open_folder(folder)
        with locked(folder):
            for name, text in texts.items():
                write_whole(folder / name, text.encode())
        return [folder / name for name in texts]

    def document(self) -> Document:
        """All methods, then each of them, and the machine."""
        sections = [self._section(method) for method in self.found.methods]
        parts: list[Part] = [self.title, Code(self.command), Prose(EXPLANATION), self.table()]
        each = Document("Each method", [Prose(DETAILS), *sections])
        return Document("Sensitivity", [*parts, each, machine_section(self.machines)])

    def table(self) -> Table:
        """The spread of each method in each group."""
        header: list[str | Column] = [Column("method", whole=True), *GROUPS]
        lines = [
            [method, *(self._cell(method, group) for group in GROUPS)]
            for method in self.found.methods
        ]
        return Table("", header, lines, Prose(SPREAD), nothing="-")

    def _cell(self, method: str, group: str) -> str:
        changes = self.found.changes(method, group)
        spread = self._edges(self.found.spread(method, group))
        shown = "-" if np.isnan(spread) else power(spread)
        return f"{shown} ({changes} of {len(self.found.of(method, group))})" if changes else shown

    def _edges(self, length: float) -> float:
        return length / self.found.problem.edge_length

    def _section(self, method: str) -> Table:
        lines = [self._line(method, group) for group in GROUPS]
        return Table(method, HEADER, lines, nothing="-")

    def _line(self, method: str, group: str) -> Sequence[object]:
        trials, spread = self.found.of(method, group), self.found.spread(method, group)
        iterations = np.percentile([t.solution.iterations for t in trials], [0, 50, 100])
        times = np.percentile([1000 * t.solution.seconds for t in trials], [25, 50, 75])
        return (
            group,
            1000 * spread,
            self._edges(spread),
            ", ".join(f"{k:g}" for k in iterations),
            ", ".join(map(digits, times)),
            f"{self.found.changes(method, group)} of {len(trials)}",
            tally(t.certificate.outcome for t in trials),
            tally(t.solution.status for t in trials),
        )

    def trials(self) -> Table:
        """One line a trial."""
        lines = [(t.method, t.group, t.words, *self._numbers(t)) for t in self.found.trials]
        return Table("", TRIALS, lines)

    def _numbers(self, t: Trial) -> Sequence[object]:
        s, c = t.solution, t.certificate
        moved = np.linalg.norm(t.positions - self.found.first(t.method).positions, axis=1).max()
        numbers = s.seconds, c.max_violation, c.relative_gap, self._edges(float(moved))
        return c.outcome, str(s.status), s.iterations, *(_known(n) for n in numbers)


def _known(number: float) -> float | None:
    return None if np.isnan(number) else number


def tally(words: Iterable[object]) -> str:
    """Which there are, the most frequent first: `19 optimal, 1 violated`; a single one alone.

    What follows a colon, the numbers and reasons of one case, is left out.
    """
    counts = Counter(str(word).partition(":")[0] for word in words).most_common()
    if len(counts) == 1:
        return counts[0][0]
    return ", ".join(f"{number} {word}" for word, number in counts)
