"""Table 1 in the shape of Tang et al. 2022, with the accuracy reached beside each time."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd

from strainbench.bench.ending import Ending
from strainbench.document import Column, Document, Items, Part, Picture, Prose, Strong, Table
from strainbench.document.writers import latex, markdown
from strainbench.report import warm
from strainbench.report.machine import machine_section
from strainbench.report.names import digits_of
from strainbench.report.numbers import distance_text, power, seconds_text

GROUP = ["scenario", "mode", "exact", "tolerance", "steps_asked", "threads"]
UNCONSTRAINED = "none"  # the solver whose rows show implicit Euler alone
TITLE = "Table 1: seconds a projection, and the accuracy reached"
ACCURACY = "violation · gap · mm"
EXPLANATION = """\
Seconds are means over projections of the time inside the solver, set-up apart, measured by the
suite. `*`: some steps did not converge (the referee finds a violation above {violation}) or the
cell's time ran out, the steps done in brackets and the time spent on the last one counted as far
as it went; `-`: no usable answer. Beside each time stands
what the referee found, at its worst over all steps done: largest violation, relative gap to the
certified lower bound, largest distance of a vertex from the reference optimum in mm{error}.
**Bold**: optimal on every step (violation at most {violation}, relative gap at most {gap})."""
CERTIFIED = """,
itself certified to within {error:.1g} mm or, for most cells, better: `<` is a bound on a distance
that is smaller than what its own cell's reference is certified to"""
OLDER = "Older than what is installed, and to be had anew with `strainbench run ... --rerun`:"
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

    def blocks(self) -> Iterator[tuple[str, str, list[pd.Series | None]]]:
        """(limit, solver, row or None for each mesh), implicit Euler left out."""
        constrained = self.runs[self.runs["solver"] != UNCONSTRAINED]
        for limit in self.limits:
            block = constrained[constrained["bound"] == limit]
            for solver in warm.beside_twins(list(block["solver"].unique())):
                rows = block[block["solver"] == solver]
                by_mesh = {r["mesh"]: r for _, r in rows.iterrows()}
                yield limit, solver, [by_mesh.get(name) for name in self.meshes]

    def implicit_euler(self) -> list[float]:
        """Mean seconds a step of unconstrained implicit Euler, NaN for a mesh on which it did not
        run to its end; nothing where it did on none, or where there is no physics."""
        ran = self.runs[(self.runs["solver"] == UNCONSTRAINED) & (self.runs["ie_seconds_mean"] > 0)]
        means = (
            ran[ran["steps_done"] == ran["steps_asked"]].groupby("mesh")["ie_seconds_mean"].mean()
        )
        return [float(means.get(n, float("nan"))) for n in self.meshes] if len(means) else []

    def table(self) -> Table:
        """A line a limit and solver, a time and what it reached a mesh."""
        header: list[str | Column] = ["limit", "method"]
        for name in self.meshes:
            header += [Column(name, "s", right=True), Column(ACCURACY, aside=True)]
        means = [cell for mean in self.implicit_euler() for cell in (seconds_text(mean), "")]
        lines = [["", "implicit Euler", *means]] if means else []
        for limit, solver, rows in self.blocks():
            lines.append([limit, solver, *(text for row in rows for text in measured(row))])
        return Table(self.title, header, lines)


def groups(runs: pd.DataFrame) -> Iterator[Group]:
    """The tables of a results folder."""
    precision = digits_of(runs["tolerance"])
    for _, rows in runs.groupby(GROUP, sort=False, dropna=False):
        first = rows.iloc[0]
        aim = f"tolerance {first['tolerance']:.{precision}g}, {first['steps_asked']:.0f} steps"
        many = f"{first['threads']:.0f} threads" if first["threads"] > 1 else ""
        parts = (first["scenario"], first["mode"], first["setting"], aim, many)
        yield Group(", ".join(filter(None, parts)), rows)


def mark(row: pd.Series) -> str:
    """ "-" for no usable answer, "*" for some steps not converged, else nothing."""
    cut_off = row["steps_done"] < row["steps_asked"]
    by_clock = Ending.of(row["reason"]) is Ending.TIME_LIMIT
    if cut_off and (row["steps_done"] == 0 or not by_clock):
        return "-"
    return "*" if cut_off or row["projections_violated"] > 0 else ""


def time_text(row: pd.Series | None) -> str:
    """Seconds a projection with its mark."""
    if row is None:
        return ""
    if mark(row) == "-":
        return "-"
    steps = row["steps_asked"] - row["steps_done"]
    done = f" ({row['steps_done']:.0f}/{row['steps_asked']:.0f})" if steps else ""
    return f"{mark(row)}{seconds_text(row['solve_seconds_mean'])}{done}"


def measured(row: pd.Series | None) -> tuple[str, str]:
    """Time and accuracy; the time of what is optimal stands out."""
    time = time_text(row)
    optimal = row is not None and row["outcome"] == "optimal"
    return Strong(time) if optimal else time, accuracy_text(row)


def accuracy_text(row: pd.Series | None) -> str:
    """Violation, relative gap, distance in mm."""
    if row is None or mark(row) == "-" or pd.isna(row["max_violation"]):
        return ""
    if pd.isna(row["relative_gap_max"]):
        return f"{power(row['max_violation'])} · local"
    return " · ".join(
        (
            power(row["max_violation"]),
            power(row["relative_gap_max"]),
            distance_text(row),
        )
    )


def tidy(runs: pd.DataFrame) -> pd.DataFrame:
    """One line a cell, for further processing."""
    named = [name.replace("exact", "setting") for name in GROUP]
    table = runs[[*named, "resolution", "limit", "solver"]].copy()
    table["seconds"] = runs["solve_seconds_mean"]
    table["mark"] = [mark(row) for _, row in runs.iterrows()]
    table["ie_seconds_mean"] = runs["ie_seconds_mean"].where(runs["ie_seconds_mean"] > 0)
    for column in ("outcome", "max_violation", "relative_gap_max"):
        table[column] = runs[column]
    table["distance_mm"] = 1000 * runs["distance_max"]
    table["reference_error_mm"] = 1000 * runs["reference_error_max"]
    for column in ("max_principal_stretch", "iterations_mean", "steps_done", "reason", "machine"):
        table[column] = runs[column]
    table["mesh"] = runs["mesh"]
    table["older"] = runs["older"]
    return table


def explanation(runs: pd.DataFrame) -> str:
    """What the signs of a table mean."""
    thresholds = runs.iloc[0]
    errors = runs["reference_error_max"].replace(np.inf, np.nan).dropna()  # of infeasible frames
    local = runs["max_violation"].notna() & runs["relative_gap_max"].isna()
    return EXPLANATION.format(
        violation=thresholds["violation_threshold"],
        gap=thresholds["gap_threshold"],
        error=CERTIFIED.format(error=1000 * errors.max()) if len(errors) else "",
    ) + (LOCAL if local.any() else "")


def scene(row: pd.Series) -> str:
    """A row's scene, with its mesh, its limit, and what tells it from others of the folder."""
    name = f"{row['scenario']} {row['mesh']}"
    return ", ".join(
        filter(None, (f"{name} at {row['bound']}" if row["bound"] else name, row["apart"]))
    )


def reasons(runs: pd.DataFrame) -> Document:
    """A line for each cell that is not optimal on every step, or not what its scene is about."""
    lines = [
        f"{scene(r)}, {r['mode']}, {r['solver']}: {r['outcome']}; {r['reason']}"
        for _, r in runs.iterrows()
        if r["reason"] and r["solver"] != UNCONSTRAINED
    ]
    return Document(
        "What kept a cell from optimal, or from what its scene is about", [Items(lines)]
    )


def older(runs: pd.DataFrame) -> list[str]:
    """A line for each way in which rows are older than what is installed, and which these are."""
    lines = []
    for how, rows in runs[runs["older"] != ""].groupby("older", sort=False):
        names = [f"{scene(r)}, {r['solver']}" for _, r in rows.iterrows()]
        which = "" if len(rows) == len(runs) else f": {'; '.join(names)}"
        lines.append(f"{len(rows)} of {len(runs)} cells were measured {how}{which}")
    return lines


def details(runs: pd.DataFrame) -> Document:
    """A line for each cell whose solver tells more of its time, such as a modelling layer's."""
    lines = [
        f"{r['solver']}, {scene(r)}: "
        + ", ".join(
            f"{k.replace('_', ' ')} {v:.4f}" for k, v in json.loads(r["details_mean"]).items()
        )
        for _, r in runs.iterrows()
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
        Document("Charts", pictures),
        *(group.table() for group in groups(runs)),
        *(section(runs) for section in SECTIONS),
        machine_section(machines),
    ]
    return Document(title, parts)


def as_markdown(runs: pd.DataFrame, machines: Mapping[str, Mapping[str, object]]) -> str:
    """The same as a file, without charts."""
    return markdown(as_document(runs, machines))


def as_latex(runs: pd.DataFrame) -> str:
    """The times alone, as tabulars in the paper's shape."""
    return latex(group.table() for group in groups(runs))
