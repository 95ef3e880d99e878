"""Imports run one way."""

from __future__ import annotations

import ast
import importlib
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import strainbench
from tests.imports import HERE, OURS, Graph, files, layers, report


def run(root, *command):
    """What a command says in a checkout."""
    env = {**os.environ, "PYTHONPATH": str(root), "COLUMNS": "200"}
    return subprocess.run(command, cwd=root, env=env, capture_output=True, text=True, check=False)


def lint(root):
    return run(root, Path(sys.executable).with_name("lint-imports"), "--no-cache", "--no-logo")


@pytest.fixture
def copy(tmp_path):
    """A copy of the sources, to be spoilt."""
    for package in OURS:
        shutil.copytree(HERE / package, tmp_path / package)
    shutil.copy(HERE / "pyproject.toml", tmp_path)
    return tmp_path


def test_rooms_keep_the_order_that_pyproject_declares():
    done = lint(HERE)
    assert done.returncode == 0, done.stdout


def test_an_import_upwards_a_circle_and_a_new_room_are_found(copy):
    below = layers()[-1]
    low = next(path for room in below for path in files(copy, room) if path.exists())
    low.write_text(low.read_text() + "\nimport strainbench.cli.app\n")
    (copy / "strainbench/drawer.py").touch()
    done = lint(copy)
    assert done.returncode == 1
    assert "Rooms import downwards BROKEN" in done.stdout
    assert "drawer" in done.stdout
    drawn = run(HERE, sys.executable, "-m", "tests.imports", str(copy)).stdout
    assert re.search(r"^circle: .*\bcli\b", drawn, re.MULTILINE)
    assert f"upward: {low.stem} imports cli" in drawn


def test_the_face_offers_what_it_says_from_where_it_is():
    imports = ast.walk(ast.parse((HERE / "strainbench/__init__.py").read_text()))
    homes = {
        node.module: tuple(alias.name for alias in node.names)
        for node in imports
        if isinstance(node, ast.ImportFrom) and node.module.startswith("strainbench.")
    }
    assert homes == {f"strainbench.{home}": names for home, names in strainbench._HOMES.items()}
    assert sorted(name for names in homes.values() for name in names) == strainbench.__all__
    for home, names in homes.items():
        for name in names:
            assert getattr(strainbench, name) is getattr(importlib.import_module(home), name)
    with pytest.raises(AttributeError, match="no attribute 'nowhere'"):
        strainbench.nowhere  # noqa: B018


def test_floors_circles_and_arrows_upwards():
    arrows = {("roof", "hall"), ("hall", "stair"), ("stair", "hall"), ("hall", "cellar")}
    house = Graph(("cellar", "hall", "roof", "stair"), frozenset(arrows))
    assert house.floors == {"cellar": 1, "hall": 2, "stair": 2, "roof": 3}
    assert house.circles == [["hall", "stair"]]
    order = [["roof"], ["hall"], ["stair"], ["cellar"]]
    assert house.upward(order) == [("stair", "hall")]


def test_the_report_counts_every_line():
    last = next(line for line in report(HERE) if line.endswith(" lines"))
    paths = [path for package in OURS for path in (HERE / package).rglob("*.py")]
    count = sum(len(path.read_text().splitlines()) for path in paths)
    assert last.endswith(f"; {count} lines")
