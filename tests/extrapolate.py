"""What a larger sheet would take: `python -m tests.extrapolate results/field --squares 1000`.

The time of a projection grows on paper by the exponent between the two largest resolutions, that of
the medians; peak memory by the megabytes that an unknown more has cost between them. Fill-in grows
a little faster than that, so that the memory of what factorises is a lower bound.
"""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from strainbench.bench.records import Row, latest_runs
from strainbench.document import Column, Table
from strainbench.document.writers import terminal


def grown(small: Row, large: Row, unknowns: float) -> tuple[float, float, float]:
    """The exponent, and seconds and gigabytes at so many unknowns."""
    (t, m, n), (T, M, N) = (
        [float(row[k]) for k in ("solve_seconds_median", "peak_memory_mb", "variables")]
        for row in (small, large)
    )
    exponent = math.log(T / t) / math.log(N / n)
    gigabytes = (M + (M - m) / (N - n) * (unknowns - N)) / 1000
    return exponent, T * (unknowns / N) ** exponent, gigabytes


def main(
    folder: Annotated[Path, typer.Argument(help="results of several resolutions")],
    squares: Annotated[int, typer.Option(min=1, help="a side")] = 1000,
) -> None:
    """Print the table, of the solvers that did all steps at the two largest resolutions."""
    whole = [row for row in latest_runs(folder).values() if row["steps_done"] == row["steps_asked"]]
    sizes = sorted({int(row["resolution"]) for row in whole})[-2:]
    lines = []
    for solver in dict.fromkeys(row["solver"] for row in whole):
        rows = {int(r["resolution"]): r for r in whole if r["solver"] == solver}
        if solver == "none" or not set(sizes) <= set(rows):
            continue
        ((low, high),) = pairwise(sizes)
        exponent, seconds, memory = grown(rows[low], rows[high], 3 * (squares + 1) ** 2)
        lines.append([solver, f"{exponent:.2f}", f"{seconds / 60:.2g}", f"{memory:.2g}"])
    columns: list[str | Column] = ["method"]
    columns += [Column(name, right=True) for name in ("exponent", "minutes", "GB")]
    title = f"a projection at {squares:,}x{squares:,} squares, on paper"
    Console(width=110).print(terminal(Table(title, columns, lines)))


if __name__ == "__main__":
    typer.run(main)
