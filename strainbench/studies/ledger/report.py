"""The ledger's rows as CSV and as Markdown."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

import pandas as pd

from strainbench.bench.cell import Cell
from strainbench.bench.machine import describe_machine
from strainbench.bench.records import open_folder
from strainbench.document import Column, Document, Prose, Table
from strainbench.document.writers import csv, markdown
from strainbench.files import locked, write_whole
from strainbench.progress import Track, untracked
from strainbench.report.provenance import remember_study
from strainbench.studies.ledger.measure import AS_IT_IS, PARTS, Row, account

MODELS = (
    *("scene", "needs", "cells", "variables", "constraints", "active"),
    *("non-zeros of the constraints", "of the energy's Hessian", "Newton iterations"),
)
EFFECTS = (
    *("scene", "change", Column("farthest vertex", "mm", ".2g")),
    *(Column("in edge lengths", form=".2g"), Column("energy", "mJ", ".2g"), "active"),
    *("Hessian's non-zeros", "Newton iterations", "after step"),
    *(
        "variables",
        "non-zeros it adds",
        Column("share of a step's time", form=".0%"),
        "verdict",
        "",
    ),
)
EXPLANATION = (
    "How far the farthest vertex is from where it is in the scene as it is, and how much more "
    "energy the scene's own parts count (so a part left out is counted in both). A part that moves "
    "the cloth by no more than a hundredth of the tolerance does, or another exact solver, is "
    "negligible at this size. What a part costs: it adds no variables, but non-zeros of the "
    "energy's Hessian, and a share of the processor time of a step with it (medians), the "
    "solver's included; below 0% a step without it takes longer, as Newton's method or the solver "
    "has more to do."
)


def write_ledger(cells: Sequence[Cell], folder: Path, track: Track = untracked) -> list[Path]:
    """The ledger of the scenes of `cells`: ledger.csv, ledger.md and machines.json.

    Raises
    ------
    ValueError
        In one line: a solver that is unavailable or does not take a scene.
    """
    open_folder(folder)
    for cell in cells:
        if cell.solver.unavailable:
            raise ValueError(cell.solver.unavailable)
    plays = (row for cell in cells for row in account(cell))
    name, facts = describe_machine(1)
    first = cells[0]
    about = f"{first.steps} steps, {first.solver.label}, tolerance {first.tolerance:g}; {name}."
    paths = [folder / "ledger.csv", folder / "ledger.md"]
    with locked(folder):
        rows = list(track(plays, "playing", len(cells) * (3 + len(PARTS))))
        remember_study(folder, "ledger", name, facts)
        table = pd.DataFrame([asdict(row) for row in rows]).convert_dtypes()
        write_whole(paths[0], csv(Table.of(table)).encode())
        write_whole(paths[1], as_markdown(rows, about).encode())
    return paths


def as_markdown(rows: list[Row], about: str) -> str:
    """What each scene models, then what each part changes."""
    models = [
        (r.scene, r.needs, r.cells, r.variables, r.constraints, r.active, *_sparsity(r))
        for r in rows
        if r.change == AS_IT_IS
    ]
    effects = [
        (r.scene, r.change, r.distance_mm, r.distance_edges, r.energy_mj, *_effort(r))
        for r in rows
        if r.change != AS_IT_IS
    ]
    changes = Table("What each part changes", EFFECTS, effects, Prose(EXPLANATION))
    return markdown(Document("Model ledger", [about, Table("", MODELS, models), changes]))


def _sparsity(row: Row) -> tuple[int | None, int | None, int | None]:
    return row.nonzeros, row.hessian_nonzeros, row.newton_iterations


def _effort(row: Row) -> tuple[object, ...]:
    failures = f"; Newton fails on {row.newton_failures} steps" if row.newton_failures else ""
    return (
        row.active,
        row.hessian_nonzeros,
        row.newton_iterations,
        row.compared_after,
        row.variables,
        row.added_nonzeros,
        row.time_share,
        row.verdict,
        (row.note + failures).removeprefix("; "),
    )
