"""What a file depends on is found from its imports; its digest follows their contents."""

from __future__ import annotations

import ast

import pytest

from strainbench import sources
from strainbench.sources import PACKAGES, ROOT, SUITE, TELLING, closure, digest


@pytest.fixture
def write(tmp_path):
    def write(name, text):
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
        return path

    return write


def names(files, folder):
    return [file.relative_to(folder).as_posix() for file in files]


@pytest.mark.parametrize(
    "statement",
    [
        "import helper",
        "import helper as h",
        "from helper import f",
        "def late():\n    import helper",
        "if True:\n    from helper import (\n        f,\n        g,\n    )",
    ],
)
def test_a_module_beside_is_found(write, tmp_path, statement):
    mine = write("mine.py", statement)
    write("helper.py", "import deeper")
    write("deeper.py", "import mine")  # a circle ends
    write("unrelated.py", "")
    assert names(closure(mine), tmp_path) == ["deeper.py", "helper.py", "mine.py"]


def test_packages_beside_are_followed_by_name(write, tmp_path):
    mine = write("mine.py", "from package import f\nfrom package.b import g\nfrom package import c")
    write("package/__init__.py", "from package.a import f\nfrom package.d import unused")
    for stem in "abcd":
        write(f"package/{stem}.py", "")
    expected = ["mine.py", "package/a.py", "package/b.py", "package/c.py"]
    assert names(closure(mine), tmp_path) == expected


def test_relative_imports_are_followed(write, tmp_path):
    start = write("package/__init__.py", "from .a import f\nfrom . import b")
    write("package/a.py", "from ..top import g")
    write("package/b.py", "")
    write("top.py", "")
    expected = ["package/__init__.py", "package/a.py", "package/b.py", "top.py"]
    assert names(closure(start), tmp_path) == expected


def test_packages_from_elsewhere_are_left_out(write, tmp_path):
    mine = write("mine.py", "import numpy as np\nfrom scipy import sparse")
    assert closure(mine) == [mine]


def test_the_suite_is_followed_where_it_is_asked_for(write):
    mine = write("mine.py", "from strainbench import Solver\nfrom solvers.none import Unlimited")
    assert SUITE / "solver" / "solver.py" in closure(mine)
    assert SUITE / "referee" / "certificate.py" not in closure(
        mine
    )  # the package only passes Solver on
    assert closure(mine, suite=False) == sorted([mine, ROOT / "solvers" / "none.py"])


def test_a_file_that_does_not_parse_has_no_imports(write):
    mine = write("mine.py", "import helper\n)")
    write("helper.py", "")
    assert closure(mine) == [mine]


def test_ours_do_not_follow_packages_that_are_installed_beside_them(write, monkeypatch, tmp_path):
    monkeypatch.setattr(sources, "ROOT", tmp_path)
    for package in ("solvers", "numpy", "plugin"):
        write(f"{package}/__init__.py", "from numpy import array" if package == "numpy" else "")
    ours = write("solvers/ours.py", "import numpy\nfrom numpy import array\nimport solvers.more")
    theirs = write("plugin/theirs.py", "from numpy import array\nimport plugin.more")
    more = write("solvers/more.py", ""), write("plugin/more.py", "")
    assert closure(ours) == sorted([ours, more[0]])
    assert closure(theirs) == sorted([theirs, more[1]])


def test_a_digest_follows_the_contents_and_not_the_place(write):
    one, two = write("one.py", "a = 1"), write("elsewhere/other.py", "a = 1")
    assert digest([one]) == digest([two])
    two.write_text("a = 2")
    assert digest([one]) != digest([two])
    assert digest([one, two]) == digest([two, one])


def test_nothing_that_measures_imports_the_rooms_that_only_tell():
    """So an edit of a page makes no row look as if another version had measured it."""
    measuring = [SUITE / name for name in ("bench", "physics", "referee", "scenario", "solver")]
    measuring += [ROOT / name for name in PACKAGES[1:]]
    files = [file for room in measuring for file in room.rglob("*.py")]
    rooms = {f.relative_to(SUITE).parts[0] for f in closure(*files) if f.is_relative_to(SUITE)}
    assert {"bench", "problem", "referee", "physics", "solver", "scenario"} <= rooms
    assert rooms.isdisjoint(TELLING)


def test_no_file_of_ours_depends_on_the_locale():
    """Text is opened as UTF-8, said so at each place."""
    for package in PACKAGES:
        for file in (ROOT / package).rglob("*.py"):
            for call in ast.walk(ast.parse(file.read_bytes())):
                if isinstance(call, ast.Call) and isinstance(call.func, ast.Attribute | ast.Name):
                    name = call.func.attr if isinstance(call.func, ast.Attribute) else call.func.id
                    binary = any("b" in str(getattr(a, "value", "")) for a in call.args)
                    text = name in ("read_text", "write_text") or (
                        name == "open" and isinstance(call.func, ast.Name) and not binary
                    )
                    said = "encoding" in {k.arg for k in call.keywords}
                    assert said or not text, f"{file}, line {call.lineno}"
