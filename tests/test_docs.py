"""The documentation builds, and says what the code and the README say."""

from __future__ import annotations

import importlib.util
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
PARTS = ("mkdocs", "material", "mkdocstrings", "griffe")
MISSING = [part for part in PARTS if importlib.util.find_spec(part) is None]
pytestmark = pytest.mark.skipif(
    bool(MISSING), reason=f"pip install 'strainbench[docs]' brings {', '.join(MISSING)}"
)


@pytest.fixture
def tool(monkeypatch):
    """A module of docs/, which is no package."""
    monkeypatch.syspath_prepend(ROOT / "docs")
    return importlib.import_module


def build(source, site):
    return subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", site],
        cwd=source,
        env={**os.environ, "PYTHONPATH": str(source)},
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.mark.slow
def test_the_site_builds_strictly_and_needs_no_other_host(tmp_path):
    done = build(ROOT, tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
    pages = {p.relative_to(tmp_path).as_posix(): p.read_text() for p in tmp_path.rglob("*.html")}
    assert "make bench" in pages["index.html"]
    assert "sum_i &lt;Y_i, (G x)_i&gt; - b_i" in pages["reference/referee.html"]
    assert "<svg" in (tmp_path / "projection.svg").read_text()
    for name in ("examples/project_a_sheet", "methods/newton-ipm", "scenes/swing", "changelog"):
        assert f"{name}.html" in pages
    for name, page in pages.items():
        loaded = re.findall(r"<(?:script|link|img)[^>]*(?:src|href)=\"?(https?:[^\s\">]+)", page)
        assert not loaded, f"{name} loads {loaded}"
        assert "{{ README" not in page


@pytest.mark.parametrize("link", ["nowhere.md", "index.md#nowhere", "data/none.csv"])
def test_a_broken_link_fails_the_build(tmp_path, link):
    (tmp_path / "docs").mkdir()
    (tmp_path / "docs/index.md").write_text(f"# Here\n[there]({link})\n")
    own = f"INHERIT: {ROOT / 'mkdocs.yml'}\ndocs_dir: docs\nhooks: []\nplugins: []\n"
    (tmp_path / "mkdocs.yml").write_text(own)
    done = build(tmp_path, tmp_path / "site")
    assert done.returncode == 1
    assert link in done.stderr


def test_every_plugin_example_and_room_has_a_page(tool):
    pages = tool("hooks").made()
    for package, folder in (("solvers", "methods"), ("scenarios", "scenes")):
        for path in (ROOT / package).iterdir():
            if path.suffix == ".py" and path.stem != "__init__":
                assert f"{folder}/{path.stem.replace('_', '-')}.md" in pages
    for path in (ROOT / "examples").glob("*.py"):
        assert path.read_text() in pages[f"examples/{path.stem}.md"]
    assert "reference/problem.md" in pages


def test_every_section_of_the_readme_is_on_a_page(tool):
    hooks = tool("hooks")
    assert set(hooks.sections("README.md")) == set(hooks.README)


def test_a_heading_in_a_code_block_is_none(tool, tmp_path, monkeypatch):
    hooks = tool("hooks")
    monkeypatch.setattr(hooks, "ROOT", tmp_path)
    (tmp_path / "A.md").write_text("# A\nintro\n## B\n```\n## no\n# no\n```\n## C\nc\n")
    parts = hooks.sections("A.md")
    assert parts == {hooks.INTRO: "intro\n", "B": "```\n## no\n# no\n```\n", "C": "c\n"}


def test_links_between_files_become_links_between_pages(tool):
    hooks = tool("hooks")
    text = (
        "[a](strainbench/referee/kkt.py) [b](results/README.md#newton-ipm) "
        "[c](https://x.org) [d](LICENSE)"
    )
    assert hooks.relinked(text, ".", "methods/index.md") == (
        "[a](../reference/referee.md) [b](../results/README.md#newton-ipm) [c](https://x.org) "
        "[d](../LICENSE)"
    )
    assert hooks.relinked("[e](swing-short/table1.md)", "results", "results/README.md") == (
        "[e](swing-short/table1.md)"
    )
    assert hooks.relinked("[f](README.md#scenes)", ".", "index.md") == "[f](scenes/index.md#scenes)"
    assert hooks.relinked("[g](../solvers/none.py) [h](concepts.md)", "docs", "use.md") == (
        "[g](methods/none.md) [h](concepts.md)"
    )


def test_docstrings_become_numpydoc(tool):
    text = "Sum of x* and <Y, x>.\n\nParameters\n----------\n"
    text += "a, b : (n,)\n    Both [m].\nc : how\n    many.\n\nMore.\n"
    assert tool("docstrings").as_numpydoc(text) == (
        "Sum of x\\* and &lt;Y, x>.\n\nParameters\n----------\n"
        "a\n    (n,). Both [m].\nb\n    (n,). Both [m].\nc\n    how many.\n\nNotes\n-----\nMore.\n"
    )


def test_a_norm_in_a_table_is_no_empty_cell(tool):
    table = "| a | ||x|| <= b |\n"
    assert tool("docstrings").as_numpydoc(table) == "| a | \\|\\|x\\|\\| <= b |\n"


def test_in_the_picture_only_the_closest_point_touches_the_lower_bound(tool):
    projection = tool("projection")
    import numpy as np

    from strainbench import certify, solve

    problem = projection.triangle()
    found = certify(problem, solve(problem, "gauss-seidel", 1e-9).positions)
    x = solve(problem, "newton-ipm", 1e-9).positions
    t = problem.target[2, :2]
    assert np.hypot(*(x[2, :2] - t)) == pytest.approx(np.sqrt(2 * found.lower_bound), rel=1e-6)
    inside = [r - np.hypot(*(x[2, :2] - c)) for c, r in projection.disks(problem)]
    assert min(inside) == pytest.approx(0, abs=1e-6)
    assert projection.draw() == projection.draw()
