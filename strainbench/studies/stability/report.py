"""A map as files: its sentences and grids, every cell that was run, a chart a method."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator
from pathlib import Path

from strainbench.bench.machine import describe_machine
from strainbench.document import Column, Document, Prose, Table
from strainbench.document.writers import csv, markdown
from strainbench.files import write_whole
from strainbench.report.charts import Target, draw, draw_sheet
from strainbench.report.measures import COUNT, NO_ANSWER, OPTIMAL, OUT_OF_TIME, SIGNS
from strainbench.report.provenance import remember_study
from strainbench.report.versions import shown_runs
from strainbench.studies.stability.chart import key_chart, map_chart
from strainbench.studies.stability.measure import Map, Spot
from strainbench.studies.stability.refine import Point
from strainbench.studies.stability.words import FAILS, HOLDS, LATE, boundary

EXPLANATION = (
    "✓ optimal on every step, ○ within the limits on every step, ✗ limits violated, ◔ out of time, "
    "∅ no answer. In brackets: not run, as the cells around agree. A sentence names the two cells "
    "between which a method changes; where outcomes along a line change more than once it says "
    "irregular."
)
SHARES = (
    "Shares of the whole map, what is inferred counted too; what is missing to 100 is not known."
)
MARKS = SIGNS | {OUT_OF_TIME: "◔", NO_ANSWER: "∅"}
CELLS = (
    *("method", "x", "y", "outcome", "why", "failure", Column("first failing step")),
    *(Column("time of that", "s"), Column("share of failed steps"), Column("median", "s"), "cell"),
)


def write_map(found: Map, title: str, command: str, folder: Path) -> list[Path]:
    """map.md, map.csv, map-METHOD.svg and .pdf, and all of them on one sheet, map.png.

    Where no row is older than the sources, machines.json has their digest: a map is kept without
    its rows.
    """
    if not any(row["older"] for row in shown_runs(folder)):
        remember_study(folder, "stability", *describe_machine(threads=1))
    texts = {
        "map.md": markdown(as_document(found, title, command)),
        "map.csv": csv(Table("", CELLS, list(_cells(found)))),
    }
    for name, text in texts.items():
        write_whole(folder / name, text.encode())
    paths = [folder / name for name in texts]
    for method in found.spots:
        for ending, target in ((".svg", Target.PAGE), (".pdf", Target.PAPER)):
            paths.append(folder / f"map-{method.replace('/', '-')}{ending}")
            draw(map_chart(found, method, target), paths[-1])
    paths.append(folder / "map.png")
    maps = [map_chart(found, method, Target.PAPER) for method in found.spots]
    draw_sheet([*maps, key_chart(found, Target.PAPER)], paths[-1:], columns=4)
    return paths


def as_document(found: Map, title: str, command: str) -> Document:
    """The boundary of each method in words, then its grid."""
    about = f"{found.counted}. {found.lasts}".strip()
    if found.open:
        about += f" The budget ended it with {found.open} more to run: the same command goes on."
    sections = [_section(found, method) for method in found.spots]
    made = f"Made by {command}"
    return Document(title, [about, Prose(EXPLANATION), made, SHARES, _shares(found), *sections])


def _shares(found: Map) -> Table:
    """How much of the map each method holds, those that hold most first."""
    whole = found.shape[0] * found.shape[1]
    counts = {method: Counter(found.endings(method).values()) for method in found.spots}
    endings = [e for e in MARKS if any(count[e] for count in counts.values())]
    order = sorted(counts, key=lambda m: [counts[m][e] for e in MARKS], reverse=True)
    lines = [[m, *(round(100 * counts[m][e] / whole) for e in endings)] for m in order]
    columns = [Column("method", whole=True), *(Column(e, "%", right=True) for e in endings)]
    return Table("", columns, lines)


def _section(found: Map, method: str) -> Document:
    across, endings, run = range(len(found.x.words)), found.endings(method), found.spots[method]
    lines = [
        [found.y.shown[j], *(_sign(endings.get((i, j)), (i, j) in run) for i in across)]
        for j in reversed(range(len(found.y.words)))
    ]
    corner = f"{found.y.title} \\ {found.x.title}"
    return Document(method, [*sentences(found, method), Table("", [corner, *found.x.shown], lines)])


def sentences(found: Map, method: str) -> list[str]:
    """Where a method keeps the limits, and where it reaches the optimum."""
    far = "So far: " if found.open else ""
    kept, best = _verbs(found, method, COUNT), _verbs(found, method, (OPTIMAL,))
    said = [f"{far}{method} {line}." for line in boundary(found.x, found.y, kept)]
    reached = any(spot.ending == OPTIMAL for spot in found.spots[method].values())
    if reached and best != kept and (lines := boundary(found.x, found.y, best)):
        said.append(f"{far}{method}, with the optimum on every step, {'; '.join(lines)}.")
    return said


def _verbs(found: Map, method: str, good: Collection[str]) -> dict[Point, str]:
    """What was seen at the points run, on the levels of y that it says something of.

    These are the ones on which it changes, and those known from end to end to be alike: where a
    refinement has only touched a level, what it touched says nothing of the rest.
    """
    spots, endings = found.spots[method], found.endings(method)

    def says(level: int) -> bool:
        seen = {spot.ending in good for (_, j), spot in spots.items() if j == level}
        line = [endings.get((i, level)) for i in range(len(found.x.words))]
        return len(seen) > 1 or (None not in line and len({e in good for e in line}) == 1)

    told = {j for j in range(len(found.y.words)) if says(j)}
    verbs = {at: HOLDS if s.ending in good else _failing(s) for at, s in spots.items()}
    return {at: verb for at, verb in verbs.items() if at[1] in told}


def _failing(spot: Spot) -> str:
    return LATE if spot.ending == OUT_OF_TIME else FAILS


def _sign(ending: str | None, run: bool) -> str:
    """Of a cell, in brackets where it was not run; nothing where it is not known."""
    if ending is None:
        return ""
    return MARKS[ending] if run else f"({MARKS[ending]})"


def _cells(found: Map) -> Iterator[tuple[object, ...]]:
    for method, spots in found.spots.items():
        for (i, j), spot in sorted(spots.items()):
            where = found.x.shown[i], found.y.shown[j]
            end = spot.ending, spot.why, spot.failure, spot.step, spot.time, spot.share
            yield (method, *where, *end, spot.seconds, spot.cell)
