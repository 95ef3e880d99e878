"""Cells on dask workers come back as the same rows as at home."""

from __future__ import annotations

import pytest
from distributed import LocalCluster

from strainbench.bench.cluster import run_on_cluster
from strainbench.bench.columns import STEP_COLUMNS
from strainbench.bench.plan import plan
from strainbench.bench.records import STEPS, latest_runs, read_machines, read_rows
from strainbench.bench.runner import Observer, Settings


def cells(steps=2):
    settings = ["resolution=3", "limit=0.1%,1%"]
    return plan(["swing"], ["none"], settings, "simulate", steps, [1e-6], None)


def test_rows_come_back_and_finished_cells_stay(tmp_path):
    with LocalCluster(
        n_workers=1, threads_per_worker=1, processes=False, dashboard_address=None
    ) as cluster:
        address = cluster.scheduler_address
        assert run_on_cluster(address, cells(), Settings(tmp_path), Observer()) == 2
        assert run_on_cluster(address, cells(), Settings(tmp_path), Observer()) == 0
    rows = latest_runs(tmp_path)
    assert set(rows) == {cell.key for cell in cells()}
    assert {row["machine"] for row in rows.values()} == set(read_machines(tmp_path))
    assert len(read_rows(tmp_path / STEPS, STEP_COLUMNS)) == 4


def test_an_address_where_nothing_answers(tmp_path):
    with pytest.raises(ValueError, match=r"--scheduler tcp://127\.0\.0\.1:9: nothing answers"):
        run_on_cluster("tcp://127.0.0.1:9", cells(), Settings(tmp_path), Observer())
