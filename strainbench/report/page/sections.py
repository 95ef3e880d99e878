"""The sections of the page; one without anything to show is left out."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import pandas as pd
from markdown_it import MarkdownIt
from markupsafe import Markup

from strainbench.bench.columns import RUN_COLUMNS
from strainbench.bench.records import RUNS, read_rows
from strainbench.document import Items, Part, Picture, Prose, Table
from strainbench.document.html import html
from strainbench.progress import Track
from strainbench.report import warm
from strainbench.report.charts import Makers, scores
from strainbench.report.failures import EXPLANATION
from strainbench.report.local import local_table
from strainbench.report.machine import machine_section
from strainbench.report.page.claimed import claims_table, counted
from strainbench.report.page.drawn import Drawn, drawings_of
from strainbench.report.sweep import BEYOND
from strainbench.report.table import LOCAL, OLDER, details, ledger_table, older, reasons

OURS = {"table1.md", "sweeps.md", "failures.md", "energy.md", "local.md", "claims.md"}
HEAVY = 1_500_000  # bytes of a folder's pictures that stand in the page; the others are linked
MOST = 500  # lines of sweeps in numbers that stand in the page
NOTE = """\
✓ optimal on every step (violation at most {violation}, relative gap at most {gap}); ○ within the
limits on every step, not optimal; ✗ a limit violated, out of time or no answer. Time: the median
over projections with active constraints, inside the solver, set-up apart, with first and third
quartile; beside it, in the list of cells, the mean over all steps, those included in which nothing
had to move. Distance, violation and gap: the worst step; `<` stands before the reference's own
error where a distance is smaller."""
HEADS = {
    "speed": (
        "Speed and accuracy",
        "Lower left is better. The grey stair is the front that no method beats in both; the "
        "yellow box is the question above. Hollow: within the limits, not the optimum.",
    ),
    "table": (
        "Table 1",
        "Bold is the fastest method that is optimal on every step. Grey numbers belong to runs "
        "that do not count: they violate or did not finish. A row opens its record.",
    ),
    "profile": (
        "Profile and growth",
        "In how many cases a method is within a factor of the fastest; how its time grows with "
        "the number of unknowns.",
    ),
    "failures": (
        "Where methods fail",
        "A square says what was found, what an easier neighbour gave, and whose fault it is. "
        "A line of a sweep ends where its method fails; a map shows over which settings it holds.",
    ),
    "convergence": (
        "Convergence and energy",
        "How far an answer is from the optimum as time goes on; what happens to the energy.",
    ),
    "claims": (
        "Claims of the papers",
        "✓ holds, ○ holds under conditions, ✗ does not hold here, - not testable here, ? not "
        "measured yet; beside each verdict stand what it rests on, in whatever folder, and the "
        "commands that measure it.",
    ),
    "pictures": ("Pictures", "Of the scenes."),
    "protocol": (
        "Protocol and machine",
        "What was measured, how, where, and what is older than what is installed.",
    ),
}
"""The name of each section, its title, and how to read it."""
Machines = Mapping[str, Mapping[str, object]]


@dataclass(frozen=True)
class Section:
    """A heading, how to read what is below, charts, places that the script fills, the rest."""

    name: str
    title: str
    how: str
    charts: Sequence[Drawn] = ()
    boxes: Sequence[str] = ()
    body: Markup = field(default=Markup())


def sections(
    folder: Path,
    runs: pd.DataFrame,
    steps: pd.DataFrame,
    failed: pd.DataFrame,
    machines: Machines,
    make: Makers,
    mapped: bool,
    track: Track,
) -> list[Section]:
    """Those that have something to show."""
    drawings = drawings_of(folder, runs, make, track)
    hard = [name for name, there in (("matrix", len(failed)), ("maps", mapped)) if there]
    boxes: dict[str, Sequence[str]] = {"table": ("table1", "cells"), "failures": hard}
    swept, claims = _swept(make.swept()), claims_table(folder)
    bodies = {
        "speed": Markup(),
        "table": _note(runs) + html(warm.table(runs), 3),
        "profile": Markup().join(html(table, 3) for table in scores(runs, steps)),
        "failures": _signs(failed, runs) + swept,
        "convergence": _folded("Energies in numbers", [make.energies()]),
        "claims": _folded(counted(claims), [claims]),
        "pictures": _pictures(folder),
        "protocol": _protocol(folder, runs, machines),
    }
    every = [
        Section(name, title, how, drawings.get(name, ()), boxes.get(name, ()), bodies[name])
        for name, (title, how) in HEADS.items()
    ]
    return [part for part in every if part.charts or part.boxes or part.body]


def _note(runs: pd.DataFrame) -> Markup:
    """What the signs and numbers of the tables are."""
    first = runs.iloc[0]
    local = runs["max_violation"].notna() & runs["relative_gap_max"].isna()
    note = NOTE.format(violation=first["violation_threshold"], gap=first["gap_threshold"])
    return html(Prose(note + LOCAL * bool(local.any())))


def _signs(failed: pd.DataFrame, runs: pd.DataFrame) -> Markup:
    """What the signs of the matrix are; nothing without one."""
    if failed.empty:
        return Markup()
    first = runs.iloc[0]
    said = EXPLANATION.format(violation=first["violation_threshold"], gap=first["gap_threshold"])
    return html(Prose(said.replace("\n\n", " ")))


def _swept(tables: Sequence[Table]) -> Markup:
    """The sweeps in numbers; a link to their file where they are too many to stand in the page."""
    if sum(len(table.lines) for table in tables) > MOST:
        return Markup('<p>Sweeps in numbers: <a href="{0}">{0}</a></p>').format("sweeps.md")
    return _folded("Sweeps in numbers", tables, Prose(BEYOND))


def _folded(title: str, parts: Iterable[Part], *before: Part) -> Markup:
    """Behind a line that opens it; nothing if there is nothing."""
    body = Markup().join(html(part, 4) for part in parts)
    above = Markup().join(html(part, 4) for part in before)
    form = Markup("<details><summary>{}</summary>{}{}</details>")
    return form.format(title, above, body) if body else Markup()


def _protocol(folder: Path, runs: pd.DataFrame, machines: Machines) -> Markup:
    kept = reasons(runs)
    return Markup().join(
        [
            html(Items(older(runs), Prose(OLDER))),
            html(machine_section(machines), 3),
            _folded(kept.title, kept.parts),
            _folded("Inside the solve, means", details(runs).parts),
            _folded("Answers under lower bounds", [local_table(folder, runs)]),
            _folded("Model ledger", [ledger_table(runs)]),
            _folded("Rows that newer ones stand for", [_superseded(folder, runs)]),
            *(_text(path) for path in sorted(folder.glob("*.md")) if path.name not in OURS),
        ]
    )


def _superseded(folder: Path, runs: pd.DataFrame) -> Table:
    """Cells of runs.csv that are not shown, as the code has changed since."""
    shown = set(runs["cell"])
    rows = {row["cell"]: row for row in read_rows(folder / RUNS, RUN_COLUMNS)}
    names = ("cell", "scenario", "resolution", "limit", "mode", "solver", "outcome", "finished_at")
    lines = [[row[name] for name in names] for cell, row in rows.items() if cell not in shown]
    return Table("", names, lines)


def _text(path: Path) -> Markup:
    """What else was written about the folder, such as a comparison."""
    reader = MarkdownIt("commonmark", {"html": False}).enable("table")
    body = Markup(reader.render(path.read_text(encoding="utf-8")))
    return Markup("<details><summary>{}</summary>{}</details>").format(path.name, body)


def _pictures(folder: Path) -> Markup:
    """The folder's pictures that are not charts of ours, the small ones in the page."""
    drawn = ("speed-accuracy", "energy", "sweep-", "profile", "growth", "map-")
    paths = [
        path
        for path in sorted(folder.iterdir())
        if path.suffix in (".png", ".gif", ".svg") and not path.name.startswith(drawn)
    ]
    room, shown = HEAVY, []
    for path in paths:
        room -= path.stat().st_size
        form = Markup("<figure>{}<figcaption>{}</figcaption></figure>")
        linked = Markup('<a href="{0}"><img src="{0}" alt="{0}" loading="lazy"></a>').format(
            path.name
        )
        shown.append(form.format(html(Picture(path, path.stem)) if room > 0 else linked, path.stem))
    return (
        Markup('<div class="pictures">{}</div>').format(Markup().join(shown)) if shown else Markup()
    )
