"""What is enough, as Markdown and CSV."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from strainbench.bench.cell import Cell
from strainbench.bench.machine import describe_machine
from strainbench.bench.records import open_folder
from strainbench.document import Column, Document, Prose, Table
from strainbench.document.writers import csv, markdown
from strainbench.files import locked, write_whole
from strainbench.progress import Track, untracked
from strainbench.report.provenance import remember_study
from strainbench.studies.ledger.enough import (
    APART,
    COARSER,
    DIRECTIONS,
    EXCESS,
    LONGER,
    RACED,
    Beyond,
    Level,
    beyond,
    levels,
)

STRETCH = (
    "How far the largest principal stretch of any triangle goes beyond the limit, over all steps. "
    f"Enough: within {EXCESS:.0%} of the limit's strain."
)
RANKING = (
    "Medians over the projections that have something to do, the same candidates for all: distance "
    f"of the farthest vertex from {RACED[0]}'s answer [mm], and processor time over its own. The "
    f"order holds where all pairs a factor {APART:g} or more apart in the first line stand so."
)


def write_enough(cell: Cell, folder: Path, track: Track = untracked) -> list[Path]:
    """Write enough.md, and directions.csv and levels.csv; their paths."""
    open_folder(folder)
    if cell.solver.unavailable:
        raise ValueError(cell.solver.unavailable)
    stretched = list(track(beyond(cell), "directions", len(DIRECTIONS)))
    found = list(track(levels(cell), "mesh and step", 1 + len(COARSER) + len(LONGER)))
    name, facts = describe_machine(1)
    tables = directions_table(stretched, cell.scenario.scenario().limit), levels_table(found)
    about = f"{cell.steps} steps, {cell.solver.label}, tolerance {cell.tolerance:g}; {name}."
    title = f"What is enough: {cell.scenario.label}"
    texts = {
        "enough.md": markdown(
            Document(title, [about, *sentences(cell, stretched, found), *tables])
        ),
        "directions.csv": csv(tables[0]),
        "levels.csv": csv(tables[1]),
    }
    with locked(folder):
        remember_study(folder, "ledger", name, facts)
        for file, text in texts.items():
            write_whole(folder / file, text.encode())
    return [folder / file for file in texts]


def sentences(cell: Cell, stretched: Sequence[Beyond], found: Sequence[Level]) -> Iterator[str]:
    """The smallest number of directions, the coarsest mesh, the longest step."""
    limit = cell.scenario.scenario().limit
    enough = next((s.directions for s in stretched if s.enough(limit)), None)
    most = f"not even {DIRECTIONS[-1]} directions keep" if enough is None else ""
    yield (
        f"{most or f'{enough} directions keep'} the true stretch within {EXCESS:.0%} of the "
        f"limit's strain of {limit:.10g}."
    )
    first = found[0]
    meshes = [at for at in found if at.step == first.step or at.step != at.step]
    steps = [at for at in found if at.resolution == first.resolution]
    coarsest, longest = _last(meshes), _last(steps)
    yield (
        f"The order of the methods holds down to {coarsest.resolution} cells a side"
        f"{_tried(coarsest, meshes, 'coarsest')}."
    )
    if first.step == first.step:
        yield f"It holds up to a step of {longest.step:.4g} s{_tried(longest, steps, 'longest')}."


def _last(found: Sequence[Level]) -> Level:
    """The farthest level before the first on which the order does not hold."""
    held = found[0]
    for at in found:
        if at.upset:
            break
        held = at
    return held


def _tried(last: Level, found: Sequence[Level], word: str) -> str:
    """Whether a level is the last one tried."""
    return f", the {word} tried" if last is found[-1] else ""


def directions_table(stretched: Sequence[Beyond], limit: float) -> Table:
    """A line a number of directions."""
    header = [
        Column("directions"),
        Column("stretch beyond the limit", form=".2g"),
        Column("enough"),
    ]
    lines = [(s.directions, s.excess, "yes" if s.enough(limit) else "no") for s in stretched]
    return Table("Directions", header, lines, Prose(STRETCH))


def levels_table(found: Sequence[Level]) -> Table:
    """A line a level, two columns a method."""
    columns = [c for m in RACED for c in (Column(m, "mm", ".2g"), Column(f"{m}, time", form=".2g"))]
    header = [Column("cells"), Column("step", "s", ".4g"), *columns, Column("does not hold")]
    return Table("Mesh and step", header, [list(_line(at)) for at in found], Prose(RANKING))


def _line(at: Level) -> Iterator[object]:
    yield from (at.resolution, at.step)
    own = at.scores[RACED[0]].seconds if at.scores else 1.0
    for method in RACED:
        score = at.scores.get(method)
        yield from (score.distance_mm, score.seconds / own) if score else (None, None)
    yield "; ".join(at.upset)
