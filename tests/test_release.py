"""A release is of one version, and its wheel holds what an installed strainbench needs."""

from __future__ import annotations

import re
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest

import solvers
import strainbench
from strainbench.plugins import ShadowedError, stems
from strainbench.sources import PACKAGES

ROOT = Path(__file__).parent.parent
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]


def test_all_places_name_one_version():
    version = PROJECT["version"]
    assert strainbench.__version__ == version
    cited = re.search(r"^version: (.*)$", (ROOT / "CITATION.cff").read_text(), re.MULTILINE)
    assert cited[1] == version
    assert f"\n## {version} " in (ROOT / "CHANGELOG.md").read_text()


def test_a_package_of_one_of_our_names_that_is_found_first_is_named(tmp_path, monkeypatch):
    monkeypatch.setattr(solvers, "__path__", [str(tmp_path)])
    with pytest.raises(ShadowedError, match="another package of that name is in the way"):
        stems("solvers")


def test_such_a_package_is_one_line_of_the_command_line(tmp_path):
    (tmp_path / "solvers").mkdir()
    (tmp_path / "solvers/__init__.py").touch()
    done = subprocess.run(
        [sys.executable, "-m", "strainbench", "list", "solvers"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 2
    (line,) = " ".join(done.stderr.split()).split("strainbench: ")[1:]
    assert line.startswith(f"the package solvers was found at {tmp_path / 'solvers'}, not at ")


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    """The names in the wheel that the checkout makes."""
    pytest.importorskip("hatchling")
    folder = tmp_path_factory.mktemp("wheel")
    command = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder)]
    subprocess.run(command, cwd=ROOT, capture_output=True, check=True)
    (path,) = folder.glob("*.whl")
    with zipfile.ZipFile(path) as archive:
        return set(archive.namelist())


@pytest.mark.slow
def test_a_wheel_holds_all_of_our_packages_and_nothing_else(wheel):
    files = {
        path.relative_to(ROOT).as_posix()
        for package in PACKAGES
        for path in (ROOT / package).rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }
    about = {name for name in wheel if ".dist-info/" in name}
    assert wheel - about == files
    assert {name.partition(".dist-info/")[2] for name in about} >= {
        "METADATA",
        "entry_points.txt",
        "licenses/LICENSE",
    }


@pytest.mark.slow
@pytest.mark.parametrize(
    "kind", ["page.html", "page.js", "part.html", "skirt.obj", "ours.csv", "solvers/py.typed"]
)
def test_a_wheel_has_its_data(wheel, kind):
    assert any(name.endswith(f"/{kind}") or name == kind for name in wheel)
