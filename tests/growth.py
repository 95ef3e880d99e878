"""How what is done with results grows with their rows: `python -m tests.growth`.

Printed are the thread CPU times at 100, 1,000 and 10,000 cells with a step each, and the exponent
between the last two: 1 is as fast as the input. The test beside it counts calls instead.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from time import thread_time

from rich.console import Console

from strainbench.bench.columns import RUN_COLUMNS, STEP_COLUMNS
from strainbench.bench.journal import EVENTS, read_journal
from strainbench.bench.records import (
    RUNS,
    STEPS,
    latest_runs,
    latest_steps,
    mend,
    read_rows,
    write_cell,
    write_rows,
)
from strainbench.bench.rows import times
from strainbench.document import Column, Table
from strainbench.document.writers import terminal
from strainbench.files import locked
from strainbench.sources import ROOT

SIZES = 100, 1_000, 10_000
Work = Callable[[], object]


def folder_of(cells: int, folder: Path) -> Path:
    """A results folder of so many cells with a step each, and a journal as long."""
    measured = ROOT / "results" / "swing-short"
    run = next(r for r in read_rows(measured / RUNS, RUN_COLUMNS) if r["projections"] != "0")
    step = read_rows(measured / STEPS, STEP_COLUMNS)[0]
    names = [f"{number:012x}" for number in range(cells)]
    folder.mkdir()
    write_rows(folder / RUNS, RUN_COLUMNS, [{**run, "cell": name} for name in names])
    write_rows(folder / STEPS, STEP_COLUMNS, [{**step, "cell": name} for name in names])
    (folder / EVENTS).write_text("".join(f"{json.dumps(e)}\n" for e in events(cells)))
    return folder


def events(projections: int) -> Iterator[dict[str, object]]:
    """Of a cell with so many projections, each repeated once."""
    clock = {"at": 1.0, "begin": 0.0, "end": 1.0, "seconds": 1.0}
    answer = {"iterations": 3, "status": "solved", "details": {}}
    for number in range(1, projections + 1):
        yield {"event": "projection", "step": number, **clock, **answer}
        yield {"event": "again", "projection": number, **clock}


def works(folder: Path) -> dict[str, Work]:
    """What is done with a folder: all of it, and one more cell."""
    run = read_rows(folder / RUNS, RUN_COLUMNS)[0]
    step = read_rows(folder / STEPS, STEP_COLUMNS)[0]

    def one_more() -> None:
        with locked(folder):
            write_cell(folder, run, [step])

    def resume() -> None:
        with locked(folder):
            mend(folder)

    return {
        "runs, the newest of each cell": lambda: latest_runs(folder),
        "steps, the newest of each cell": lambda: latest_steps(folder),
        "a journal and its times": lambda: times(read_journal(folder)[0]),
        "opening to resume": resume,
        "one more cell": one_more,
    }


def seconds(work: Work) -> float:
    """The least of three, of this thread."""
    found = []
    for _ in range(3):
        begin = thread_time()
        work()
        found.append(thread_time() - begin)
    return min(found)


def main() -> None:
    """Print the table."""
    columns: list[str | Column] = ["work"]
    columns += [Column(f"{n:,} [ms]", right=True) for n in SIZES] + [Column("exponent", right=True)]
    spent: dict[str, list[float]] = {}
    with TemporaryDirectory() as place:
        for size in SIZES:
            for name, work in works(folder_of(size, Path(place) / str(size))).items():
                spent.setdefault(name, []).append(seconds(work))
    lines = [
        [name, *(f"{1e3 * s:.1f}" for s in each), f"{math.log10(each[-1] / each[-2]):.2f}"]
        for name, each in spent.items()
    ]
    Console(width=110).print(terminal(Table("growth with the rows", columns, lines)))


if __name__ == "__main__":
    main()
