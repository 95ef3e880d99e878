"""One cell in two results folders."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from strainbench.records import Row
from strainbench.report.table import UNCONSTRAINED, describe, power

SAME = (
    "scenario",
    "scenario_parameters",
    "mode",
    "tolerance",
    "steps_asked",
    "resolution",
    "limit",
    "solver",
)
"""What the rows of one cell share; machine and the settings behind a solver's name may differ."""


@dataclass(frozen=True)
class Pair:
    """One cell's rows in the two folders; None in the folder that has none."""

    a: Row | None
    b: Row | None

    @property
    def row(self) -> Row:
        """Either row, for what they have in common."""
        row = self.a or self.b
        assert row is not None
        return row

    @property
    def group(self) -> str:
        """What a table has in its title."""
        r = self.row
        about = describe(r["scenario_parameters"], ("resolution", "limit"))
        last = f"tolerance {float(r['tolerance']):g}, {r['steps_asked']} steps"
        return ", ".join(part for part in (r["scenario"], r["mode"], about, last) if part)

    @property
    def limit(self) -> str:
        """In percent."""
        return f"{100 * float(self.row['limit']):g}%" if self.row["limit"] else ""

    @property
    def title(self) -> str:
        """The cell in one line."""
        return f"{self.row['resolution']} cells, {self.limit}, {self.row['solver']} ({self.group})"

    @property
    def ratio(self) -> float:
        """Seconds a solve in B over those in A; NaN unless both did all their steps."""
        unsolved = not (self.a and self.b) or self.row["solver"] == UNCONSTRAINED
        if unsolved or any(r["steps_done"] != r["steps_asked"] for r in self.both):
            return float("nan")
        before, after = (float(r["solve_seconds_mean"] or "nan") for r in self.both)
        return after / before if before > 0 else float("nan")

    @property
    def both(self) -> tuple[Row, Row]:
        """The two rows, where there are two."""
        assert self.a is not None
        assert self.b is not None
        return self.a, self.b

    @property
    def note(self) -> str:
        """Which settings differ behind the solver's name."""
        if not (self.a and self.b) or self.a["solver_parameters"] == self.b["solver_parameters"]:
            return ""
        before, after = (describe(r["solver_parameters"]) or "none" for r in self.both)
        return f"settings differ, {self.title}: {before} in A, {after} in B"

    def cells(self) -> tuple[str, ...]:
        """A line of the table; what changed reads "before → after"."""
        times = [f"{float(s):.4f}" if (s := r["solve_seconds_mean"]) else "-" for r in self.both]
        return (
            self.row["resolution"],
            self.limit,
            self.row["solver"],
            self._change(_outcome),
            *times,
            f"{self.ratio:.2f}" if self.ratio > 0 else "",
            self._change(lambda r: _power(r["max_violation"])),
            self._change(lambda r: _power(r["relative_gap_max"])),
        )

    def _change(self, text: Callable[[Row], str]) -> str:
        return " → ".join(dict.fromkeys(text(row) for row in self.both))


def _outcome(row: Row) -> str:
    cut_off = row["steps_done"] != row["steps_asked"]
    return row["outcome"] + (f" ({row['steps_done']}/{row['steps_asked']})" if cut_off else "")


def _power(text: str) -> str:
    return power(float(text)) if text else "-"
