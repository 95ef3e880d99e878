"""One cell in two results folders."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from strainbench.bench.records import Row
from strainbench.report.names import (
    SPANNED,
    cells,
    describe,
    digits,
    limit_name,
    mesh_name,
    settings,
)
from strainbench.report.numbers import power, seconds_text
from strainbench.report.table import UNCONSTRAINED

SAME = (
    "scenario",
    "scenario_parameters",
    "mode",
    "tolerance",
    "steps_asked",
    "resolution",
    "limit",
    "solver",
    "threads",
)
"""What the rows of one cell share; machine and the settings behind a solver's name may differ."""
PLACE = ("machine", "blas_threads")
"""What they must share for their times to compare."""


@dataclass(frozen=True)
class Pair:
    """One cell's rows in the two folders; None in the folder that has none.

    Parameters
    ----------
    digits : that tell the values of each setting apart
    """

    a: Row | None
    b: Row | None
    digits: Mapping[str, int] = field(default_factory=dict)

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
        about = describe(r["scenario_parameters"], SPANNED, self.digits)
        last = f"tolerance {float(r['tolerance']):.10g}, {r['steps_asked']} steps"
        return ", ".join(part for part in (r["scenario"], r["mode"], about, last) if part)

    @property
    def alike(self) -> tuple[str, ...]:
        """What the cells of a table share, to the last digit."""
        r = self.row
        exact = {k: v for k, v in settings(r["scenario_parameters"]).items() if k not in SPANNED}
        return (r["scenario"], r["mode"], str(exact), r["tolerance"], r["steps_asked"])

    @property
    def limit(self) -> str:
        """In percent, or the file of its curve."""
        return limit_name(self.row["scenario_parameters"], _number(self.row["limit"]))

    @property
    def mesh(self) -> str:
        """Its cells, or its file."""
        r = self.row
        known = [row["constraints"] for row in (self.a, self.b) if row and row["constraints"]]
        numbers = (_number(r["resolution"]), _number("".join(known[:1])))
        return mesh_name(r["scenario_parameters"], *numbers, r["directions"])

    @property
    def title(self) -> str:
        """The cell in one line."""
        return f"{cells(self.mesh)}, {self.limit}, {self.row['solver']} ({self.group})"

    @property
    def comparable(self) -> bool:
        """Whether times compare: a solver's, both with all steps, on one machine, threads alike."""
        if not (self.a and self.b) or self.row["solver"] == UNCONSTRAINED:
            return False
        return self.in_one_place and all(
            r["steps_done"] == r["steps_asked"] and r["outcome"] != "no answer" for r in self.both
        )

    @property
    def in_one_place(self) -> bool:
        """Whether both ran on one machine, on as many threads."""
        before, after = ([row[name] for name in PLACE] for row in self.both)
        return before == after

    @property
    def ratio(self) -> float:
        """Seconds a solve in B over those in A; NaN unless these compare."""
        if not self.comparable:
            return float("nan")
        before, after = (_number(r["solve_seconds_mean"]) for r in self.both)
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
        texts = [r["solver_parameters"] for r in self.both]
        before, after = (describe(text, (), digits(texts)) or "none" for text in texts)
        return f"settings differ, {self.title}: {before} in A, {after} in B"

    def cells(self) -> tuple[str, ...]:
        """A line of the table; what changed reads "before → after"."""
        times = [seconds_text(_number(r["solve_seconds_mean"])) or "-" for r in self.both]
        return (
            self.mesh,
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


def _number(text: str) -> float:
    """A number of a row, NaN where there is none."""
    return float(text or "nan")


def _power(text: str) -> str:
    return power(float(text)) if text else "-"
