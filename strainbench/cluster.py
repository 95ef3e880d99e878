"""Cells on other machines, through a dask scheduler.

A worker runs each cell as `python -m strainbench.cluster`, in a process tree of its own, with the
same runner, limits and referee as at home, and sends its rows back.
"""

from __future__ import annotations

import pickle
import subprocess
import sys
from collections.abc import Sequence
from concurrent.futures import Future, as_completed
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from strainbench.cell import Cell
from strainbench.folder import locked
from strainbench.records import (
    STEP_COLUMNS,
    STEPS,
    latest_runs,
    read_machines,
    read_rows,
    remember_machine,
    write_cell,
)
from strainbench.runner import Observer, Runner, Settings

Results = tuple[list[dict[str, str]], list[dict[str, str]], dict[str, dict[str, object]]]
"""Rows of runs.csv, rows of steps.csv, machines."""


def run_on_cluster(
    address: str, cells: Sequence[Cell], settings: Settings, observer: Observer
) -> int:
    """Run what is not finished on the workers of the scheduler at `address`.

    Returns the number of cells run. Worker machines need strainbench, and the files of solvers
    and scenarios from outside at the same paths; each worker should have one thread.

    Raises
    ------
    ValueError
        If dask's `distributed` is not installed, or nothing answers at the address.
    """
    try:
        from distributed import Client
    except ImportError as error:
        raise ValueError(
            f"--scheduler needs the extra: pip install strainbench[cluster] ({error})"
        ) from None
    home = Runner(settings)
    wanted = [cell for cell in cells if not home.is_finished(cell)]
    observer.planned(wanted, len(cells) - len(wanted))
    try:
        client = Client(address, timeout="10s")
    except (OSError, ValueError) as error:
        raise ValueError(f"--scheduler {address}: nothing answers there ({error})") from None
    with locked(settings.folder), client:
        executor = client.get_executor(retries=0)
        futures: dict[Future[Results], Cell] = {
            executor.submit(run_elsewhere, cell, settings): cell for cell in wanted
        }
        for future in as_completed(futures):
            rows, steps, machines = future.result()
            for name, facts in machines.items():
                remember_machine(settings.folder, name, facts)
            write_cell(settings.folder, rows[0], steps)
            observer.ended(futures[future], dict(rows[0]))
    return len(wanted)


def run_elsewhere(cell: Cell, settings: Settings) -> Results:
    """On a worker: one cell in a process that may have children, as dask's own may not."""
    done = subprocess.run(
        [sys.executable, "-m", "strainbench.cluster"],
        input=pickle.dumps((cell, settings)),
        stdout=subprocess.PIPE,
        check=True,
    )
    results: Results = pickle.loads(done.stdout)
    return results


def _run_here(cell: Cell, settings: Settings) -> Results:
    with TemporaryDirectory() as folder:
        here = replace(settings, folder=Path(folder), jobs=1)
        Runner(here).run([cell])
        steps: list[dict[str, Any]] = read_rows(Path(folder) / STEPS, STEP_COLUMNS)
        return list(latest_runs(Path(folder)).values()), steps, read_machines(Path(folder))


if __name__ == "__main__":
    received: tuple[Cell, Settings] = pickle.loads(sys.stdin.buffer.read())
    sys.stdout.buffer.write(pickle.dumps(_run_here(*received)))
