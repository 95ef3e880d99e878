"""Cells on other machines, through a dask scheduler.

A worker runs each cell as `python -m strainbench.bench.cluster`, in a process tree of its own, with
the same runner, limits and referee as at home, and sends its rows back. What the worker's end, or
an interrupt at home, leaves behind: that process ends with its worker; a cell that was running when
its run was interrupted is played to its end there, and its rows are thrown away.

Dask asks nobody who they are, unless it is set up with TLS: whoever reaches the scheduler's port
runs code on every worker, and so does a plug-in. Use it on a network of your own.
"""

from __future__ import annotations

import errno
import os
import pickle
import subprocess
import sys
import threading
from collections.abc import Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, CancelledError, Future, wait
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from strainbench.bench.cell import Cell
from strainbench.bench.columns import STEP_COLUMNS
from strainbench.bench.ending import Ending
from strainbench.bench.process import OUTPUT
from strainbench.bench.records import (
    STEPS,
    latest_runs,
    read_machines,
    read_rows,
    remember_machine,
    write_cell,
)
from strainbench.bench.rows import identity
from strainbench.bench.runner import Runner, Settings
from strainbench.files import locked
from strainbench.plugins import told
from strainbench.progress import Observer

Results = tuple[list[dict[str, str]], list[dict[str, str]], dict[str, dict[str, object]]]
"""Rows of runs.csv, rows of steps.csv, machines."""
ALONE = threading.Lock()  # a worker's
ASK_SECONDS = 2.0  # between two looks at whether there are workers


def run_on_cluster(
    address: str, cells: Sequence[Cell], settings: Settings, observer: Observer
) -> int:
    """Run what is not finished on the workers of the scheduler at `address`.

    Returns the number of cells run. Worker machines need strainbench, and the files of solvers
    and scenarios from outside at the same paths; each worker should have one thread. A cell whose
    worker fails has a row that says so, and is run again by the next run.

    Raises
    ------
    ValueError
        If dask's `distributed` is not installed, or nothing answers at the address.
    OSError
        If the scheduler is lost: what has come back is kept.
    """
    try:
        from distributed import Client
    except ImportError as error:
        raise ValueError(
            f"--scheduler needs the extra: pip install strainbench[cluster] ({error})"
        ) from None
    home = Runner(settings, observer)
    wanted = [cell for cell in cells if not home.is_finished(cell)]
    observer.planned(wanted, len(cells) - len(wanted))
    try:
        client = Client(address, timeout="10s")
    except (OSError, ValueError) as error:
        raise ValueError(f"--scheduler {address}: nothing answers there ({error})") from None
    with locked(settings.folder), client, _one_line(address):
        executor = client.get_executor(retries=0)
        futures = {executor.submit(run_elsewhere, cell, settings): cell for cell in wanted}
        for future in _as_completed(futures, client, address, observer):
            cell = futures[future]
            if failure := future.exception():
                reason = f"{Ending.LOST}: {told(failure)}"
                row = {"steps_done": 0, "outcome": "no answer", "reason": reason}
                home.write(cell, identity(cell) | row, [])
            else:
                _keep(settings.folder, future.result())
                observer.ended(cell, future.result()[0][0])
    return len(wanted)


@contextmanager
def _one_line(address: str) -> Iterator[None]:
    """Say in one line that the scheduler is lost, where it is."""
    from distributed.comm import CommClosedError

    try:
        yield
    except (CancelledError, CommClosedError):
        said = "it was lost; every cell that came back is kept, run the same again to go on"
        raise OSError(errno.ECONNRESET, said, f"--scheduler {address}") from None


def _as_completed(
    futures: dict[Future[Results], Cell], client: Any, address: str, observer: Observer
) -> Iterator[Future[Results]]:
    """The futures as they are done; the observer hears where no worker is there to do them."""
    left, told = set(futures), False
    while left:
        if not client.scheduler_info()["workers"] and not told:
            observer.waiting(f"workers: none has come to {address} (dask worker {address})")
            told = True
        done, left = wait(left, ASK_SECONDS, FIRST_COMPLETED)
        told &= not done
        yield from done


def _keep(folder: Path, results: Results) -> None:
    """Write down what has come back."""
    rows, steps, machines = results
    for name, facts in machines.items():
        remember_machine(folder, name, facts)
    write_cell(folder, rows[0], steps)


def run_elsewhere(cell: Cell, settings: Settings) -> Results:
    """On a worker: one cell in a process that may have children, as dask's own may not.

    What it prints is no part of its answer. It ends with this one: see `_end_with_worker`. A worker
    of several threads has one cell at a time, so that no two share its cores.
    """
    with ALONE, TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "task").write_bytes(pickle.dumps((cell, settings)))
        with (folder / OUTPUT).open("wb") as output:
            process = subprocess.Popen(
                [sys.executable, "-m", "strainbench.bench.cluster", name],
                stdin=subprocess.PIPE,
                stdout=output,
                stderr=output,
            )
            with process:
                code = process.wait()
        if code:
            lines = (folder / OUTPUT).read_text(encoding="utf-8", errors="replace").split("\n")
            last = next((line for line in reversed(lines) if line), "")
            raise RuntimeError(f"its process ended with exit code {code} ({last})")
        results: Results = pickle.loads((folder / "results").read_bytes())
    return results


def _run_here(cell: Cell, settings: Settings, folder: Path) -> Results:
    here = replace(settings, folder=folder, jobs=1)
    Runner(here).run([cell])
    steps: list[dict[str, Any]] = read_rows(folder / STEPS, STEP_COLUMNS)
    return list(latest_runs(folder).values()), steps, read_machines(folder)


def _end_with_worker() -> None:
    """End this process, and by its end its children, when its input does."""
    os.read(0, 1)  # not sys.stdin, whose lock Python wants back at its end
    os._exit(1)


def main(folder: Path) -> None:
    """Run the cell that lies in a folder, and leave the results there."""
    threading.Thread(target=_end_with_worker, daemon=True).start()
    received: tuple[Cell, Settings] = pickle.loads((folder / "task").read_bytes())
    (folder / "results").write_bytes(pickle.dumps(_run_here(*received, folder / "records")))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
