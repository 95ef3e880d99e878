"""Compiled code is kept, and never that of an older source."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from strainbench.compiled import cache_folder
from strainbench.sources import ROOT

CALLER = """\
from strainbench.compiled import compiled
from inner import FACTOR, square

@compiled
def twice(x):
    return FACTOR * square(x)

print(twice(3.0), sum(twice.stats.cache_hits.values()))
"""
INNER = """\
from strainbench.compiled import compiled

FACTOR = {factor}

@compiled
def square(x):
    return x{power}
"""


def run(folder, factor, power):
    (folder / "inner.py").write_text(INNER.format(factor=factor, power=power))
    (folder / "caller.py").write_text(CALLER)
    call = [sys.executable, "caller.py"]
    environment = {"PYTHONPATH": str(ROOT), "PATH": "", "HOME": str(folder)}
    done = subprocess.run(call, cwd=folder, capture_output=True, text=True, env=environment)
    assert done.returncode == 0, done.stderr
    return done.stdout.split()


def test_an_edit_of_an_inlined_function_or_constant_of_another_file_counts(tmp_path):
    assert run(tmp_path, 2.0, " * x") == ["18.0", "0"]
    assert run(tmp_path, 2.0, " * x") == ["18.0", "1"]  # kept
    assert run(tmp_path, 2.0, " * x * x") == ["54.0", "0"]
    assert run(tmp_path, 5.0, " * x * x") == ["135.0", "0"]
    assert run(tmp_path, 2.0, " * x") == ["18.0", "1"]  # set back


def test_a_given_cache_folder_is_used(tmp_path):
    mine = tmp_path / "mine.py"
    mine.write_text("")
    assert cache_folder(mine, "/given").parent == Path("/given")
    assert cache_folder(mine).parent == tmp_path / "__pycache__"


def test_all_of_ours_is_compiled_this_way():
    for package in ("strainbench", "solvers", "scenarios"):
        for file in (ROOT / package).rglob("*.py"):
            text = file.read_text(encoding="utf-8")
            assert "import njit" not in text or file.name == "compiled.py", file
