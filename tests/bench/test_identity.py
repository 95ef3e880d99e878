"""A cell is another one where anything differs that its numbers depend on."""

from __future__ import annotations

import shutil
import subprocess
import sys
from dataclasses import replace

import pytest

from strainbench.bench.cell import PluginRef
from strainbench.bench.machine import describe_machine
from strainbench.bench.plan import plan
from strainbench.physics.linear import available_linear_solvers
from strainbench.scenario.registry import find_scenario
from strainbench.solver.registry import find_solver
from strainbench.sources import PACKAGES, ROOT

MINE = """\
from dataclasses import dataclass
from strainbench import Solution, Solver
from helper import scale

@dataclass(frozen=True)
class Mine(Solver):
    name = "mine"
    file: str = ""

    def solve(self, problem, state, *, tolerance, monitor, deadline):
        return Solution(scale(problem.target), "solved", 1)
"""
KEYS = """\
from strainbench.bench.plan import plan
(cell,) = plan(["swing"], ["gauss-seidel"], ["resolution=3"], "replay", 2, [1e-6], None)
print(cell.key, cell.recording_key)
"""


def cells(solvers=("none",), settings=("resolution=2",), scenarios=("swing",), **more):
    return plan(scenarios, solvers, settings, "simulate", 3, [1e-6], None, **more)


def edit(path):
    path.write_text(path.read_text() + "\n# edited\n")


@pytest.fixture(scope="module")
def copied(tmp_path_factory):
    """Keys of a cell of ours, in a copy of the project whose files can be edited."""
    top = tmp_path_factory.mktemp("project")
    for package in PACKAGES:
        shutil.copytree(ROOT / package, top / package, ignore=shutil.ignore_patterns("__pycache__"))

    def keys():
        call = [sys.executable, "-c", KEYS]
        done = subprocess.run(call, cwd=top, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        return done.stdout.split()

    return top, keys


@pytest.mark.slow
@pytest.mark.parametrize(
    ("file", "cell", "recording"),
    [
        ("solvers/gauss_seidel/rows.py", True, False),
        ("scenarios/swing.py", True, True),
        ("solvers/clarabel.py", False, False),
        ("strainbench/problem/limits.py", False, True),
        ("strainbench/physics/energies/membrane.py", False, True),
        ("solvers/newton_ipm/iterate.py", False, True),
        ("strainbench/report/table.py", False, False),
    ],
)
def test_the_source_of_ours_counts_where_numbers_depend_on_it(copied, file, cell, recording):
    top, keys = copied
    before = keys()
    edit(top / file)
    after = keys()
    assert (before[0] != after[0], before[1] != after[1]) == (cell, recording)


@pytest.fixture
def mine(tmp_path):
    (tmp_path / "mine.py").write_text(MINE)
    (tmp_path / "helper.py").write_text("from deeper import scale")
    (tmp_path / "deeper.py").write_text("scale = lambda x: x.copy()")
    (tmp_path / "unrelated.py").write_text("")
    return tmp_path / "mine.py"


@pytest.mark.parametrize(
    ("name", "counts"),
    [("mine.py", True), ("helper.py", True), ("deeper.py", True), ("unrelated.py", False)],
)
def test_modules_beside_a_plugin_count(mine, monkeypatch, name, counts):
    monkeypatch.syspath_prepend(mine.parent)
    before = cells([str(mine)])[0].key
    edit(mine.parent / name)
    assert (cells([str(mine)])[0].key != before) == counts


def test_the_contents_of_a_mesh_count_wherever_the_scene_finds_it(tmp_path):
    mesh = tmp_path / "skirt.obj"
    mesh.write_bytes((ROOT / "scenarios" / "data" / "skirt.obj").read_bytes())
    garment = find_scenario("garment")
    before = PluginRef.of(garment(path=str(mesh))).content
    assert PluginRef.of(garment(path="skirt.obj")).content == before  # ours, beside the scene
    assert PluginRef.of(garment()).content != before
    mesh.write_bytes(mesh.read_bytes() + b"# edited\n")
    assert PluginRef.of(garment(path=str(mesh))).content != before


def test_threads_and_every_digit_count():
    keys = [cells(threads=n)[0].key for n in (1, 2)]
    keys += [c.key for c in cells(settings=["resolution=2", "step=0.01666,0.016664,0.016664001"])]
    assert len(set(keys)) == 5


@pytest.mark.parametrize("threads", [0, -1])
def test_threads_are_checked(threads):
    with pytest.raises(ValueError, match=rf"--threads {threads}: a whole number above 0"):
        cells(threads=threads)


def test_a_source_that_is_missing_is_not_passed_over(mine, monkeypatch):
    monkeypatch.syspath_prepend(mine.parent)
    (cell,) = cells([str(mine)])
    gone = replace(cell, scenario=replace(cell.scenario, source="scenarios/gone.py"))
    with pytest.raises(FileNotFoundError, match="gone"):
        _ = gone.recording_key


def test_what_was_edited_after_the_plan_does_not_run_under_its_name(mine, monkeypatch):
    monkeypatch.syspath_prepend(mine.parent)
    (cell,) = cells([str(mine)])
    assert cell.solver.solver().name == "mine"
    edit(mine.parent / "deeper.py")
    with pytest.raises(ValueError, match="was edited during the run"):
        cell.solver.solver()


def test_a_machine_is_what_times_depend_on():
    name, facts = describe_machine(threads=1)
    assert facts["linear_solver"] == available_linear_solvers()[0].name
    assert facts["blas"]
    assert {"pypardiso", "cvxopt", "qoco", "scs", "ecos", "clarabel"} <= set(facts["packages"])
    assert describe_machine(threads=2)[0] != name


def test_ours_are_known_by_their_place_in_the_project():
    assert PluginRef.of(find_solver("gauss-seidel")).source == "solvers/gauss_seidel"
    assert PluginRef.of(find_solver("none")).source == "solvers/none.py"
    assert PluginRef.of(find_scenario("swing")()).source == "scenarios/swing.py"
