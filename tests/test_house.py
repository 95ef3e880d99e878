"""What developers are given is there, and does what is said of it."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import numpy as np
import pytest

from strainbench.problem.export import load_problem

ROOT = Path(__file__).parent.parent
MAKEFILE = (ROOT / "Makefile").read_text()
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]


def yaml(path):
    return pytest.importorskip("yaml").safe_load((ROOT / path).read_text())


def test_the_workflow_runs_make_check_on_two_systems_and_three_pythons():
    (job,) = yaml(".github/workflows/check.yml")["jobs"].values()
    matrix = job["strategy"]["matrix"]
    assert {os.split("-")[0] for os in matrix["os"]} == {"ubuntu", "macos"}
    assert matrix["python"] == ["3.11", "3.12", "3.13"]
    assert PROJECT["requires-python"] == f">={matrix['python'][0]}"
    assert "make check" in [step.get("run") for step in job["steps"]]


def test_hooks_before_a_commit_fetch_nothing_and_are_those_of_make_check():
    (repository,) = yaml(".pre-commit-config.yaml")["repos"]
    assert repository["repo"] == "local"
    check = MAKEFILE.split("\ncheck:")[1].split("\n\n")[0]
    for hook in repository["hooks"]:
        assert hook["language"] == "system"
        tool = hook["entry"].split()[0]
        assert f"$(BIN)/{tool}" in check or tool == "lint-imports"  # a test runs that


@pytest.mark.parametrize("path", sorted((ROOT / ".github/ISSUE_TEMPLATE").glob("*.md")))
def test_an_issue_template_says_what_it_is_for(path):
    head = pytest.importorskip("yaml").safe_load(path.read_text().split("---\n")[1])
    assert head["name"]
    assert head["about"]


def test_an_npz_that_would_run_code_is_refused(tmp_path):
    class Trap:
        def __reduce__(self):
            return (tmp_path.joinpath("sprung").touch, ())

    np.savez(tmp_path / "trap.npz", rest=np.array([Trap()], dtype=object))
    (tmp_path / "sprung").unlink(missing_ok=True)
    with pytest.raises(ValueError, match=re.escape("trap.npz holds no exported problem")):
        load_problem(tmp_path / "trap.npz")
    assert not (tmp_path / "sprung").exists()


def test_make_help_lists_every_target_that_is_for_people():
    phony = re.search(r"^\.PHONY: (help .*)$", MAKEFILE, re.MULTILINE)[1].split()
    listed = re.findall(r"^([a-z-]+):.*## ", MAKEFILE, re.MULTILINE)
    assert sorted(phony) == sorted(listed)


def test_the_change_log_keeps_its_form():
    text = (ROOT / "CHANGELOG.md").read_text()
    assert text.startswith("# Changelog\n")
    kinds = {"Added", "Changed", "Deprecated", "Removed", "Fixed", "Security"}
    assert set(re.findall(r"^### (.*)$", text, re.MULTILINE)) <= kinds
    assert PROJECT["version"] in text
