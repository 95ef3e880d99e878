"""Two runs agree to the last digit in all that is no time, whatever the number of threads."""

from __future__ import annotations

from pathlib import Path

import pytest

from strainbench.bench.plan import plan
from strainbench.bench.records import latest_runs, latest_steps
from strainbench.bench.runner import Runner, Settings

METHODS = ["newton-ipm", "gauss-seidel", "fast-projection", "dykstra"]
"""They compute with numba, BLAS and sparse factorisations; none draws random numbers."""
ACCURACY = ("outcome", "status", "iterations", "objective", "max_violation", "relative_gap")
MORE = ("max_principal_stretch", "distance", "lower_bound", "failure", "energy_rise")
ENERGIES = ("kinetic_energy", "gravity_energy", "membrane_energy", "bending_energy")
RUN = ("outcome", "max_violation", "relative_gap_max", "distance_max", "failure", "failure_step")


def found(folder: Path, threads: int):
    """What is no time of each cell, by method."""
    cells = plan(["swing"], METHODS, ["resolution=6"], "simulate", 5, [1e-6], None, threads=threads)
    Runner(Settings(folder)).run(cells)
    names = {cell.key: cell.solver.label for cell in cells}
    rows = {names[k]: [[row[c] for c in RUN]] for k, row in latest_runs(folder).items()}
    for step in latest_steps(folder):
        rows[names[step["cell"]]].append([step[c] for c in ACCURACY + MORE + ENERGIES])
    return rows


@pytest.mark.slow
def test_accuracy_agrees_to_the_last_digit_with_one_thread_and_with_two(tmp_path):
    one = found(tmp_path / "one", 1)
    assert set(one) == set(METHODS)
    assert {len(rows) for rows in one.values()} == {6}
    other = found(tmp_path / "two", 2)
    for method in METHODS:
        assert other[method] == one[method], method
