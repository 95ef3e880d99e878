"""Table 1: the outcome of each cell, its time, and the accuracy reached."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd

from strainbench.bench.load import OTHER_WORK
from strainbench.document import Column, Document, Items, Part, Picture, Prose, Table
from strainbench.document.writers import markdown
from strainbench.report import warm
from strainbench.report.lines import MEASURES, marked, milliseconds, ranked
from strainbench.report.machine import machine_section
from strainbench.report.measures import COUNT, NO_ANSWER
from strainbench.report.names import digits_of
from strainbench.report.numbers import power
from strainbench.report.rows import Row, rows_of

GROUP = ["scenario", "mode", "exact", "tolerance", "steps_asked", "threads"]
UNCONSTRAINED = "none"  # the solver whose rows show implicit Euler alone
TITLE = "Table 1: time a projection, and the accuracy reached"
EXPLANATION = """\
A line a cell; those of one limit and mesh by outcome, then by time. Time: median of the seconds
inside the solver over the projections with active constraints, and its quartiles; one that has
nothing to move would make everybody fast. Mean, as in the paper: over all steps, those with
nothing to move too. Both without set-up, measured by the suite. Violation, relative gap to the
certified lower bound, and distance of a vertex from the reference optimum are the worst over all
steps done{error}; iterations are their mean.

✓ optimal on every step: violation at most {violation}, relative gap at most {gap}; ○ within the
limits on every step, but not the projection; ✗ what went wrong: out of time, 7 of 8:
so many steps were done before the clock ended the cell, or its last projection; a motion is stuck
where the physics can take no step from what a projection left. Numbers in brackets are of such a
cell and do not count. **Bold**: the fastest that is optimal."""
CERTIFIED = """,
itself certified to within {error:.1g} mm or, for most cells, better: `<` is said of a distance
that is smaller than what its own cell's reference is certified to"""
EULER = "implicit Euler, a step"
TIMES = {
    "time": "median_seconds",
    "time_low": "first_quartile_seconds",
    "time_high": "third_quartile_seconds",
    "time_count": "projections_with_active_constraints",
}
"""Columns of measures, and how table1.csv calls them."""
OLDER = "Older than what is installed, and to be had anew with `strainbench run ... --rerun`:"
BESIDE = "Measured beside other work, which kept as many cores busy as `load` says:"
LOCAL = """
*Local*: lower bounds on stretch make the problem nonconvex, and nothing is known of its optimum.
What such an answer is worth stands below: whether it is a local optimum, by the residual of the
KKT conditions, and its objective beside the best known."""


@dataclass(frozen=True)
class Group:
    """The rows of one table: all alike but for mesh, limit and solver."""

    title: str
    runs: pd.DataFrame

    @property
    def meshes(self) -> list[str]:
        """The finer the later."""
        return list(self.runs.sort_values(["resolution", "mesh"])["mesh"].unique())

    @property
    def limits(self) -> list[str]:
        """The looser the later."""
        return list(self.runs.sort_values(["limit", "bound"])["bound"].unique())

    def by_limit(self) -> Iterator[tuple[str, pd.DataFrame]]:
        """The cells of each limit."""
        yield from ((limit, self.runs[self.runs["bound"] == limit]) for limit in self.limits)

    def blocks(self) -> Iterator[pd.DataFrame]:
        """The cells of each limit and mesh, by outcome, then by time; implicit Euler left out."""
        for _, rows in self.by_limit():
            constrained = rows[rows["solver"] != UNCONSTRAINED]
            yield from (ranked(constrained[constrained["mesh"] == mesh]) for mesh in self.meshes)

    def implicit_euler(self) -> dict[str, float]:
        """Mean seconds a step of unconstrained implicit Euler on each mesh on which it ran to its
        end; nothing where there is no physics."""
        ran = self.runs[(self.runs["solver"] == UNCONSTRAINED) & (self.runs["ie_seconds_mean"] > 0)]
        means = (
            ran[ran["steps_done"] == ran["steps_asked"]].groupby("mesh")["ie_seconds_mean"].mean()
        )
        return {mesh: float(means[mesh]) for mesh in self.meshes if mesh in means}

    def table(self) -> Table:
        """A line a cell, below those of implicit Euler."""
        euler = [
            ["", mesh, EULER, "", "", "", milliseconds(mean), *[""] * 4]
            for mesh, mean in self.implicit_euler().items()
        ]
        header: list[str | Column] = ["limit", "mesh", "method", *MEASURES]
        cells = [
            [row["bound"], row["mesh"], *texts]
            for block in self.blocks()
            for row, texts in marked(block)
        ]
        return Table(self.title, header, [*euler, *cells])


def groups(runs: pd.DataFrame) -> Iterator[Group]:
    """The tables of a results folder."""
    precision = digits_of(runs["tolerance"])
    for _, rows in runs.groupby(GROUP, sort=False, dropna=False):
        first = rows.iloc[0]
        aim = f"tolerance {first['tolerance']:.{precision}g}, {first['steps_asked']:.0f} steps"
        many = f"{first['threads']:.0f} threads" if first["threads"] > 1 else ""
        parts = (first["scenario"], first["mode"], first["setting"], aim, many)
        yield Group(", ".join(filter(None, parts)), rows)


def mark(row: Row) -> str:
    """ "-" for no usable answer, "*" for some steps not converged, else nothing."""
    if row["ending"] == NO_ANSWER or row["steps_done"] == 0:
        return "-"
    return "" if row["ending"] in COUNT else "*"


def tidy(runs: pd.DataFrame) -> pd.DataFrame:
    """One line a cell, for further processing."""
    named = [name.replace("exact", "setting") for name in GROUP]
    table = runs[[*named, "resolution", "limit", "solver"]].copy()
    table["seconds"] = runs["solve_seconds_mean"]
    for column, name in TIMES.items():
        table[name] = runs[column]
    table["mark"] = [mark(row) for row in rows_of(runs)]
    table["ie_seconds_mean"] = runs["ie_seconds_mean"].where(runs["ie_seconds_mean"] > 0)
    for column in ("outcome", "max_violation", "relative_gap_max"):
        table[column] = runs[column]
    table["distance_mm"] = 1000 * runs["distance_max"]
    table["reference_error_mm"] = 1000 * runs["reference_error_max"]
    for column in ("max_principal_stretch", "iterations_mean", "steps_done", "reason", "machine"):
        table[column] = runs[column]
    table["ending"], table["done"], table["why"] = runs["ending"], runs["done"], runs["why"]
    table["mesh"] = runs["mesh"]
    table["older"] = runs["older"]
    return table


def explanation(runs: pd.DataFrame) -> str:
    """What the signs of a table mean."""
    thresholds = runs.iloc[0]
    errors = runs["reference_error_max"].replace(np.inf, np.nan).dropna()  # of infeasible frames
    local = runs["max_violation"].notna() & runs["relative_gap_max"].isna()
    return EXPLANATION.format(
        violation=power(thresholds["violation_threshold"]),
        gap=power(thresholds["gap_threshold"]),
        error=CERTIFIED.format(error=1000 * errors.max()) if len(errors) else "",
    ) + (LOCAL if local.any() else "")


def scene(row: Row) -> str:
    """A row's scene, with its mesh, its limit, and what tells it from others of the folder."""
    name = f"{row['scenario']} {row['mesh']}"
    return ", ".join(
        filter(None, (f"{name} at {row['bound']}" if row["bound"] else name, row["apart"]))
    )


def reasons(runs: pd.DataFrame) -> Document:
    """A line for each cell that is not optimal on every step, or not what its scene is about."""
    lines = [
        f"{scene(r)}, {r['mode']}, {r['solver']}: {r['outcome']}; {r['reason']}"
        for r in rows_of(runs)
        if r["reason"] and r["solver"] != UNCONSTRAINED
    ]
    return Document(
        "What kept a cell from optimal, or from what its scene is about", [Items(lines)]
    )


def older(runs: pd.DataFrame) -> list[str]:
    """A line for each way in which rows are older than what is installed, and which these are."""
    lines = []
    for how, rows in runs[runs["older"] != ""].groupby("older", sort=False):
        names = [f"{scene(r)}, {r['solver']}" for r in rows_of(rows)]
        which = "" if len(rows) == len(runs) else f": {'; '.join(names)}"
        lines.append(f"{len(rows)} of {len(runs)} cells were measured {how}{which}")
    return lines


def disturbed(runs: pd.DataFrame) -> list[str]:
    """A line for each cell that was measured beside other work, or one for all if all were."""
    beside = runs[runs["load"] > OTHER_WORK]
    if len(beside) == len(runs) > 1:
        low, high = beside["load"].min(), beside["load"].max()
        return [f"all {len(runs)} cells: load {low:.1f} to {high:.1f}"]
    return [f"{scene(r)}, {r['solver']}: load {r['load']:.1f}" for r in rows_of(beside)]


def details(runs: pd.DataFrame) -> Document:
    """A line for each cell whose solver tells more of its time, such as a modelling layer's."""
    lines = [
        f"{r['solver']}, {scene(r)}: "
        + ", ".join(
            f"{k.replace('_', ' ')} {v:.4f}" for k, v in json.loads(r["details_mean"]).items()
        )
        for r in rows_of(runs)
        if r["details_mean"]
    ]
    return Document("Inside the solve, means", [Items(lines)])


def ledger(runs: pd.DataFrame) -> pd.DataFrame:
    """What each scene models: physics, unknowns, constraints, most active ones, non-zeros."""
    sizes = ["variables", "constraints", "active_constraints_max", "nonzeros"]
    same = ["scenario", "needs", "mesh", "directions", "variables", "constraints", "nonzeros"]
    known = runs.dropna(subset=["variables"]).groupby(same, sort=False, dropna=False)
    return known["active_constraints_max"].max().reset_index()[[*same[:4], *sizes]]


def ledger_table(runs: pd.DataFrame) -> Table:
    """The same to be shown."""
    names = ["scene", "physics it needs", "mesh", "directions", "variables", "constraints"]
    columns = [Column(name, form=".0f") for name in (*names, "active at most", "non-zeros")]
    return replace(Table.of(ledger(runs)), title="Model ledger", header=columns)


SECTIONS: tuple[Callable[[pd.DataFrame], Part], ...] = (warm.table, reasons, details, ledger_table)
"""What stands below the tables of times, in table1.md and on the page."""


def as_document(
    runs: pd.DataFrame,
    machines: Mapping[str, Mapping[str, object]],
    title: str = TITLE,
    charts: Iterable[Path] = (),
) -> Document:
    """All tables, what their signs mean, the reasons of every failure, the machine."""
    pictures = [Picture(path, path.stem) for path in charts]
    parts: list[Part] = [
        Prose(explanation(runs)),
        Items(older(runs), Prose(OLDER)),
        Items(disturbed(runs), Prose(BESIDE)),
        Document("Charts", pictures),
        *(group.table() for group in groups(runs)),
        *(section(runs) for section in SECTIONS),
        machine_section(machines),
    ]
    return Document(title, parts)


def as_markdown(runs: pd.DataFrame, machines: Mapping[str, Mapping[str, object]]) -> str:
    """The same as a file, without charts."""
    return markdown(as_document(runs, machines))
