"""Each example says what the mathematics says."""

from __future__ import annotations

import os
import runpy
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
EXAMPLES = sorted((ROOT / "examples").glob("*.py"))


def result(name):
    """What `main` of an example returns."""
    return runpy.run_path(str(ROOT / f"examples/{name}.py"))["main"]()


def strainbench(*words, cwd):
    command = [sys.executable, *words]
    env = {**os.environ, "PYTHONWARNINGS": "error", "PYTHONPATH": str(ROOT)}
    return subprocess.run(command, cwd=cwd, env=env, capture_output=True, text=True, check=False)


def test_a_square_blown_up_shrinks_to_the_limit_in_both_directions():
    assert result("project_a_sheet") == pytest.approx(1.01**2, rel=1e-5)


def test_an_added_solver_finds_the_projection():
    found = result("add_a_solver")
    assert found.outcome == "optimal"
    assert found.relative_gap < 2e-6


def test_an_added_scene_hangs_as_long_as_its_limit():
    assert result("add_a_scene") == pytest.approx(1.1, rel=1e-6)


def test_a_sheet_on_an_added_energy_sinks_in_as_deep_as_its_weight_asks():
    assert result("add_an_energy") == pytest.approx(9.81 / 10**2, rel=1e-5)


def test_the_gap_of_an_own_answer_is_what_it_moves_in_vain():
    whole, along = result("certify_your_own")
    in_vain, needed = 1 - 1.01 / 1.2, 1.2 - 1.01
    assert (whole.outcome, along.outcome) == ("feasible", "optimal")
    assert whole.relative_gap == pytest.approx((in_vain / needed) ** 2, rel=1e-6)


def test_methods_on_a_garment_obey_pythagoras():
    steps = result("compare_on_a_garment")
    for closest, other, between in steps:
        assert (closest.outcome, other.outcome) == ("optimal", "feasible")
        assert other.objective - closest.objective >= between * (1 - 1e-3) > 0
    assert max(other.distance for _, other, _ in steps) > 1e-4  # [m]


@pytest.mark.slow
def test_an_exported_projection_has_the_objective_that_it_had():
    by_the_file, by_the_referee = result("export_and_read_back")
    assert by_the_referee > 0
    assert by_the_file == pytest.approx(by_the_referee, rel=1e-12)


def test_an_example_runs_as_it_is():
    done = strainbench("examples/project_a_sheet.py", cwd=ROOT)
    assert done.returncode == 0, done.stderr
    assert "optimal" in done.stdout


@pytest.mark.slow
def test_the_suite_runs_the_added_solver_on_the_added_scene(tmp_path):
    words = ["run", ROOT / "examples/add_a_scene.py", "--solver", ROOT / "examples/add_a_solver.py"]
    settings = ["--set", "resolution=3", "--steps", "2", "--results", "out"]
    done = strainbench("-m", "strainbench", *map(str, words), *settings, cwd=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "dual-ascent" in (tmp_path / "out/runs.csv").read_text()


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_an_example_is_short_and_stays_on_public_ground(path):
    lines = path.read_text().split('"""', 2)[2].splitlines()
    assert len([line for line in lines if line.strip()]) <= 40
    ours = [line.split()[1] for line in lines if line.startswith("from strainbench")]
    assert set(ours) <= {"strainbench", "strainbench.export"}


def test_there_are_seven():
    assert len(EXAMPLES) == 7
