"""A projection from a file, as a scene."""

from __future__ import annotations

import csv

import numpy as np
import pytest

from strainbench.bench.plan import plan_one
from strainbench.bench.recording import record
from strainbench.export import write_problem
from strainbench.referee.reference import content_key
from strainbench.scenario.registry import find_scenario
from tests.command import command
from tests.problems import random_problem

Instance = find_scenario("instance")


@pytest.fixture
def written(tmp_path):
    """A file, and the problem in it."""
    problem = record(plan_one("swing", "none", ["resolution=3", "limit=0.7%"], 1, 1e-6), 4)
    write_problem(problem, tmp_path / "four.npz", "npz", "a test")
    return tmp_path / "four.npz", problem


def test_it_is_the_problem_of_the_file_again_and_again(written):
    path, problem = written
    scene = Instance(path=str(path))
    assert content_key(scene.problem()) == content_key(problem)
    assert (scene.resolution, scene.limit, scene.directions) == (3, 0.007, 4)
    assert scene.easier() is None
    assert scene.usual_steps == 1
    seen = []
    playing = scene.play(lambda target: seen.append(target) or target)
    next(playing), next(playing)
    assert all(np.array_equal(target, problem.target) for target in seen)


def test_limits_of_every_kind_are_told(tmp_path):
    rng = np.random.default_rng(0)
    for k, choices in enumerate(({"exact": True}, {"per_element": True, "directions": 7})):
        write_problem(random_problem(rng, **choices), tmp_path / f"{k}.npz", "npz", "a test")
    exact, curve = (Instance(path=str(tmp_path / f"{k}.npz")) for k in (0, 1))
    assert exact.directions == "exact"
    assert curve.directions == 7
    assert curve.limit == pytest.approx(curve.problem().bounds.min() - 1)
    assert exact.limits().spectral


def test_a_run_records_it_and_an_edited_file_is_another_cell(written, monkeypatch, capsys):
    path, _ = written
    folder = path.parent / "r"
    words = ["run", "instance", "--set", f"path={path}", "--solver", "newton-ipm"]
    done = command(monkeypatch, capsys, *words, "--results", folder)
    assert done.returncode == 0, done.stderr
    (row,) = csv.DictReader((folder / "runs.csv").read_text().splitlines())
    assert (row["scenario"], row["outcome"], row["steps_asked"]) == ("instance", "optimal", "1")
    assert float(row["limit"]) == 0.007
    assert "nothing to run" in command(monkeypatch, capsys, *words, "--results", folder).stdout
    before = plan_one("instance", "none", [f"path={path}"], 1, 1e-6).key
    write_problem(random_problem(np.random.default_rng(1)), path, "npz", "another")
    assert plan_one("instance", "none", [f"path={path}"], 1, 1e-6).key != before


@pytest.mark.parametrize("content", [None, b"", b"text"])
def test_a_file_that_is_none_is_one_line(content, monkeypatch, capsys, tmp_path):
    path = tmp_path / "a.npz"
    if content is not None:
        path.write_bytes(content)
    done = command(monkeypatch, capsys, "run", "instance", "--set", f"path={path}")
    assert done.returncode == 2
    assert "a.npz" in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1
