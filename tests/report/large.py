"""Results folders of any size, multiplied from the committed rows over a setting.

`python -m tests.report.large DIR 100 1000 2000` writes them, reports them, and says how the time
grows.
"""

from __future__ import annotations

import json
import os
import sys
import time
from itertools import count, islice, pairwise
from math import log
from pathlib import Path

from strainbench.bench.columns import RUN_COLUMNS, STEP_COLUMNS
from strainbench.bench.records import RUNS, STEPS, latest_runs, latest_steps, write_rows
from strainbench.report import write_report

RESULTS = Path(__file__).parents[2] / "results"
SOURCES = ("swing-short", "field", "failures")
MACHINES = "machines.json"


def multiply(folder: Path, cells: int) -> None:
    """Write a folder of so many cells; copies differ in the step of their scene."""
    runs, steps = [], []
    for source, row, row_steps, copy in islice(_rows(), cells):
        cell = f"{copy:03d}{source[:2]}{row['cell']}"
        scene = json.loads(row["scenario_parameters"]) | {"step": 1 / (60 + copy)}
        runs.append(row | {"cell": cell, "scenario_parameters": json.dumps(scene)})
        steps += [step | {"cell": cell} for step in row_steps]
    folder.mkdir(parents=True, exist_ok=True)
    write_rows(folder / RUNS, RUN_COLUMNS, runs)
    write_rows(folder / STEPS, STEP_COLUMNS, steps)
    machines = [json.loads((RESULTS / name / MACHINES).read_text()) for name in SOURCES]
    every = {key: facts for each in machines for key, facts in each.items()}
    (folder / MACHINES).write_text(json.dumps(every))


def _rows():
    """All rows of the sources with their steps, again and again."""
    found = []
    for source in SOURCES:
        of = {}
        for step in latest_steps(RESULTS / source):
            of.setdefault(step["cell"], []).append(step)
        runs = latest_runs(RESULTS / source)
        found += [(source, row, of.get(cell, [])) for cell, row in runs.items()]
    for copy in count():
        yield from ((*each, copy) for each in found)


def report(folder: Path, cells: int) -> float:
    """Seconds of CPU for its report, with what is drawn beside; what it took is printed."""
    multiply(folder, cells)
    wall, before = time.perf_counter(), os.times()
    write_report(folder)
    wall, after = time.perf_counter() - wall, os.times()
    cpu = sum(after[:4]) - sum(before[:4])
    size = (folder / "index.html").stat().st_size / 1e6
    print(f"{cells} cells: {wall:.1f} s, {cpu:.1f} s of CPU, page {size:.2f} MB", flush=True)
    return cpu


if __name__ == "__main__":
    times = {}
    for word in sys.argv[2:]:
        times[int(word)] = report(Path(sys.argv[1]) / word, int(word))
    for (few, before), (many, after) in pairwise(times.items()):
        print(f"from {few} to {many}: exponent {log(after / before) / log(many / few):.2f}")
