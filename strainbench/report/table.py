"""Table 1 in the shape of Tang et al. 2022, with the accuracy reached beside each time."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd

from strainbench import escape
from strainbench.report import warm

GROUP = ["scenario", "mode", "setting", "tolerance", "steps_asked"]
UNCONSTRAINED = "none"  # the solver whose rows show implicit Euler alone
EXPLANATION = """\
Seconds are means over projections of the time inside the solver, set-up apart, measured by the
suite. `*`: some steps did not converge (the referee finds a violation above {violation}) or the
cell's time ran out, the steps done in brackets and the time spent on the last one counted as far
as it went; `-`: no usable answer. Beside each time stands
what the referee found, at its worst over all steps: largest violation, relative gap to the
certified lower bound, largest distance of a vertex from the reference optimum in mm, itself
certified to within {error:.1g} mm. **Bold**:
optimal on every step (violation at most {violation}, relative gap at most {gap})."""
LOCAL = """
*Local*: lower bounds on stretch make the problem nonconvex, and nothing is known of its optimum.
What such an answer is worth stands below: whether it is a local optimum, by the residual of the
KKT conditions, and its objective beside the best known."""


@dataclass(frozen=True)
class Group:
    """The rows of one table: all alike but for resolution, limit and solver."""

    title: str
    runs: pd.DataFrame

    @property
    def resolutions(self) -> list[int]:
        """In rising order."""
        return sorted(int(r) for r in self.runs["resolution"].unique())

    def blocks(self) -> Iterator[tuple[str, str, list[pd.Series | None]]]:
        """(limit, solver, row or None for each resolution), implicit Euler left out."""
        constrained = self.runs[self.runs["solver"] != UNCONSTRAINED]
        for limit, block in constrained.groupby("limit"):
            for solver in warm.beside_twins(list(block["solver"].unique())):
                rows = block[block["solver"] == solver]
                by_resolution = {int(r["resolution"]): r for _, r in rows.iterrows()}
                yield (
                    f"{100 * limit:g}%",
                    solver,
                    [by_resolution.get(n) for n in self.resolutions],
                )

    def implicit_euler(self) -> list[float]:
        """Mean seconds a step of unconstrained implicit Euler; NaN where it did not run."""
        alone = self.runs[self.runs["solver"] == UNCONSTRAINED]
        means = alone.groupby("resolution")["ie_seconds_mean"].mean()
        return [float(means.get(n, float("nan"))) for n in self.resolutions]


def describe(parameters: str, without: tuple[str, ...] = ()) -> str:
    """Settings from their JSON, on a line."""
    return ", ".join(
        f"{key} {value:.4g}" if isinstance(value, float) else escape.plain(f"{key} {value}")
        for key, value in json.loads(parameters or "{}").items()
        if key not in without
    )


def groups(runs: pd.DataFrame) -> Iterator[Group]:
    """The tables of a results folder."""
    for key, rows in runs.groupby(GROUP, sort=False, dropna=False):
        scenario, mode, setting, tolerance, steps = key
        title = f"{scenario}, {mode}, {setting}, tolerance {tolerance:g}, {steps} steps"
        yield Group(title, rows)


def mark(row: pd.Series) -> str:
    """ "-" for no usable answer, "*" for some steps not converged, else nothing."""
    cut_off = row["steps_done"] < row["steps_asked"]
    if cut_off and (row["steps_done"] == 0 or not row["reason"].startswith("time limit")):
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
    return f"{mark(row)}{row['solve_seconds_mean']:.4f}{done}"


def accuracy_text(row: pd.Series | None) -> str:
    """Violation, relative gap, distance in mm."""
    if row is None or pd.isna(row["max_violation"]):
        return ""
    if pd.isna(row["relative_gap_max"]):
        return f"{power(row['max_violation'])} · local"
    return " · ".join(
        (
            power(row["max_violation"]),
            power(row["relative_gap_max"]),
            f"{1000 * row['distance_max']:.2g}",
        )
    )


def power(value: float) -> str:
    """One digit and a power of ten, as in 3e-9; 0 is 0."""
    return f"{value:.0e}".replace("e-0", "e-").replace("0e+00", "0").replace("e+00", "")


def tidy(runs: pd.DataFrame) -> pd.DataFrame:
    """One line a cell, for further processing."""
    table = runs[[*GROUP, "resolution", "limit", "solver"]].copy()
    table["seconds"] = runs["solve_seconds_mean"]
    table["mark"] = [mark(row) for _, row in runs.iterrows()]
    for column in ("ie_seconds_mean", "outcome", "max_violation", "relative_gap_max"):
        table[column] = runs[column]
    table["distance_mm"] = 1000 * runs["distance_max"]
    for column in ("max_principal_stretch", "iterations_mean", "steps_done", "reason", "machine"):
        table[column] = runs[column]
    return table


def explanation(runs: pd.DataFrame) -> str:
    """What the signs of a table mean."""
    thresholds = runs.iloc[0]
    errors = runs["reference_error_max"].replace(np.inf, np.nan)  # of infeasible frames
    local = runs["max_violation"].notna() & runs["relative_gap_max"].isna()
    return EXPLANATION.format(
        violation=thresholds["violation_threshold"],
        gap=thresholds["gap_threshold"],
        error=1000 * np.nan_to_num(errors.max()),
    ) + (LOCAL if local.any() else "")


def reasons(runs: pd.DataFrame) -> list[str]:
    """A line for each cell that is not optimal on every step."""
    return [
        f"{r['scenario']} {r['resolution']:.0f} at {100 * r['limit']:g}%, {r['mode']}, "
        f"{r['solver']}: {r['outcome']}; {r['reason']}"
        for _, r in runs.iterrows()
        if r["reason"] and r["solver"] != UNCONSTRAINED
    ]


def details(runs: pd.DataFrame) -> list[str]:
    """A line for each cell whose solver tells more of its time, such as a modelling layer's."""
    return [
        f"{r['solver']}, {r['scenario']} {r['resolution']:.0f} at {100 * r['limit']:g}%: "
        + ", ".join(
            f"{k.replace('_', ' ')} {v:.4f}" for k, v in json.loads(r["details_mean"]).items()
        )
        for _, r in runs.iterrows()
        if r["details_mean"]
    ]


def ledger(runs: pd.DataFrame) -> pd.DataFrame:
    """What each scene models: physics, unknowns, constraints, most active ones, non-zeros."""
    sizes = ["variables", "constraints", "active_constraints_max", "nonzeros"]
    keys = ["scenario", "needs", "resolution", "directions"]
    return runs.dropna(subset=["variables"]).groupby(keys, sort=False)[sizes].max().reset_index()


def _ledger_markdown(runs: pd.DataFrame) -> str:
    names = ["scene", "physics it needs", "cells", "directions", "variables", "constraints"]
    header = [*names, "active at most", "non-zeros"]
    lines = [_line(header), _line(["---"] * len(header))]
    for values in ledger(runs).itertuples(index=False):
        lines.append(
            _line([f"{v:.0f}" if isinstance(v, float) else escape.markdown(v) for v in values])
        )
    return "## Model ledger\n\n" + "\n".join(lines)


def as_markdown(runs: pd.DataFrame, machines: Mapping[str, Mapping[str, object]]) -> str:
    """All tables, what their signs mean, the reasons of every failure, the machine."""
    parts = ["# Table 1: seconds a projection, and the accuracy reached", explanation(runs)]
    parts += [_markdown_group(group) for group in groups(runs)]
    if twins := warm.pairs(runs):
        lines = [_line(list(warm.HEADER)), _line(["---"] * len(warm.HEADER))]
        lines += [_line([escape.markdown(text) for text in pair.line()]) for pair in twins]
        parts.append("## Cold and warm starts\n\n" + warm.EXPLANATION + "\n\n" + "\n".join(lines))
    if lines := [f"- {escape.markdown(reason)}" for reason in reasons(runs)]:
        parts.append("## What kept a cell from optimal\n\n" + "\n".join(lines))
    if lines := [f"- {escape.markdown(line)}" for line in details(runs)]:
        parts.append("## Inside the solve, means\n\n" + "\n".join(lines))
    parts.append(_ledger_markdown(runs))
    parts.append("## Machine\n\n" + "\n".join(machine_line(n, f) for n, f in machines.items()))
    return "\n\n".join(parts) + "\n"


def _markdown_group(group: Group) -> str:
    header = ["limit", "method"]
    for n in group.resolutions:
        header += [f"{n}×{n} [s]", "violation · gap · mm"]
    lines = [f"## {escape.markdown(group.title)}", "", _line(header), _line(["---"] * len(header))]
    euler = group.implicit_euler()
    cells = [f"{s:.4f}" if s == s else "" for s in euler]  # not NaN
    lines.append(_line(["", "implicit Euler", *(t for c in cells for t in (c, ""))]))
    for limit, solver, rows in group.blocks():
        texts = []
        for row in rows:
            bold = "**" if row is not None and row["outcome"] == "optimal" else ""
            texts += [f"{bold}{time_text(row)}{bold}", accuracy_text(row)]
        lines.append(_line([limit, escape.markdown(solver), *texts]))
    return "\n".join(lines)


def _line(cells: list[str]) -> str:
    return "| " + " | ".join(cells) + " |"


def machine_line(name: str, facts: Mapping[str, object]) -> str:
    """A machine and its facts in one line of Markdown."""
    packages = facts.get("packages")
    versions = packages.items() if isinstance(packages, Mapping) else ()
    return escape.markdown(
        f"{name}: {facts['memory_gb']} GB, {facts['system']}, Python {facts['python']}, "
        f"{facts['threads_per_solver']} thread a solver; "
        + ", ".join(f"{package} {version}" for package, version in versions)
    )


def as_latex(runs: pd.DataFrame) -> str:
    """The times alone, as tabulars in the paper's shape."""
    parts = []
    for group in groups(runs):
        columns = " & ".join(rf"${n}\times{n}$" for n in group.resolutions)
        lines = [
            f"% {escape.plain(group.title)}",
            rf"\begin{{tabular}}{{ll{'r' * len(group.resolutions)}}}",
            rf"limit & method & {columns} \\ \hline",
        ]
        euler = [f"{s:.3f}\\,s" if s == s else "" for s in group.implicit_euler()]
        lines.append(" & ".join(["", "implicit Euler", *euler]) + r" \\")
        for limit, solver, rows in group.blocks():
            texts = [time_text(r) for r in rows]
            lines.append(" & ".join([escape.latex(limit), escape.latex(solver), *texts]) + r" \\")
        parts.append("\n".join([*lines, r"\end{tabular}"]))
    return "\n\n".join(parts) + "\n"
