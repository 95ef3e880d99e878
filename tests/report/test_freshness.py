"""What results are older than is told of each folder, with the command that measures it anew."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from strainbench.bench.machine import PACKAGES, describe_machine, installed
from strainbench.bench.records import RUNS, RecordsError, remember_machine
from strainbench.report.freshness import FRESH, NO_COMMAND, RULE, age, commands, freshness, main
from strainbench.report.provenance import CODE, _counts, code_digest, remember_study
from strainbench.sources import SUITE
from tests.report.test_versions import measure

RESULTS = Path(__file__).parents[2] / "results"
README = """\
| folder | command |
|---|---|
| [runs](runs/table1.md) | `make bench`, then `strainbench run swing --steps 2` |
| [named](#below) | `strainbench duel ...`, of `solver` |
"""


def lines(root):
    return {
        name: [measured, "; ".join(older), "; ".join(told)]
        for name, measured, older, told in freshness(root)
    }


def git(folder, *words):
    who = ["-c", "user.name=a", "-c", "user.email=a@b.c"]
    subprocess.run(["git", *who, *words], cwd=folder, check=True, capture_output=True)


@pytest.fixture
def root(tmp_path):
    (tmp_path / "README.md").write_text(README)
    (tmp_path / "runs").mkdir()
    remember_machine(tmp_path / "runs", "m", describe_machine(1)[1])
    return tmp_path


def test_rows_of_the_code_as_it_is_are_older_than_nothing(root):
    measure(root / "runs", "none", seconds=1)
    command = "make bench; strainbench run swing --steps 2"
    assert lines(root) == {"runs": ["1 cells", "", command]}


def test_it_is_printed_with_commands_on_lines_of_their_own(root, capsys):
    measure(root / "runs", "none", seconds=1)
    main([str(root)])
    assert capsys.readouterr().out.splitlines() == [
        f"runs (1 cells): {FRESH}",
        "    make bench",
        "    strainbench run swing --steps 2",
        "",
        "0 of 1 folders are older than the code.",
        *RULE.splitlines(),
    ]


def test_rows_of_another_version_are_counted(root):
    measure(root / "runs", "none", seconds=1)
    measure(root / "runs", "clarabel", seconds=1, suite="0123456789abcdef")
    assert lines(root)["runs"][1] == "1 of 2 cells by another version of strainbench"


def test_a_study_is_held_against_the_history_of_its_code(tmp_path):
    study = tmp_path / "results/study"
    for path in ("results/study/a.csv", "results/study/b.csv", "solvers/s.py"):
        (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / path).write_text("a,b\n")
    assert age(study) == ["not known: its numbers stand in no history"]
    git(tmp_path, "init", "-q")
    git(tmp_path, "add", "-A")
    git(tmp_path, "commit", "-qm", "measured")
    assert age(study) == []
    for room, edits in (("strainbench/cli", 0), ("strainbench/studies", 1), ("solvers", 2)):
        (tmp_path / room).mkdir(parents=True, exist_ok=True)
        (tmp_path / room / "new.py").touch()
        git(tmp_path, "add", "-A")
        git(tmp_path, "commit", "-qm", room)
        assert [told.split(" edits since a.csv")[0] for told in age(study)] == [str(edits)][:edits]


def test_a_clone_of_the_last_commit_alone_has_no_history(tmp_path):
    study = tmp_path / "whole/results/study"
    study.mkdir(parents=True)
    (study / "a.csv").write_text("a\n1\n")
    git(tmp_path, "init", "-q", "whole")
    for message in ("measured", "later"):
        (tmp_path / "whole/README.md").write_text(message)
        git(tmp_path / "whole", "add", "-A")
        git(tmp_path / "whole", "commit", "-qm", message)
    git(tmp_path, "clone", "-q", "--depth", "1", (tmp_path / "whole").as_uri(), "last")
    assert age(study) == []
    assert age(tmp_path / "last/results/study") == ["not known: its numbers stand in no history"]


def test_of_studies_those_count_that_the_commands_of_a_folder_call(tmp_path):
    study = tmp_path / "results/study"
    study.mkdir(parents=True)
    (study / "a.csv").write_text("a\n1\n")
    git(tmp_path, "init", "-q")
    git(tmp_path, "add", "-A")
    git(tmp_path, "commit", "-qm", "measured")
    for file in ("duel/measure.py", "duel/report.py", "euler.py"):
        path = tmp_path / "strainbench/studies" / file
        path.parent.mkdir(parents=True, exist_ok=True)
        path.touch()
        git(tmp_path, "add", "-A")
        git(tmp_path, "commit", "-qm", file)
    told = {
        command: [said.split()[0] for said in age(study, [command])]
        for command in (
            *("strainbench duel swing", "strainbench map swing", "make certificates"),
            "python -m strainbench.studies.euler swing",
        )
    }
    assert list(told.values()) == [["1"], [], ["2"], ["1"]]


def test_a_study_that_keeps_the_digest_of_what_it_measured_needs_no_history(tmp_path):
    (tmp_path / "a.csv").write_text("a\n1\n")
    machine, facts = describe_machine(1)
    remember_study(tmp_path, "step", machine, facts)
    assert age(tmp_path) == []
    remember_machine(tmp_path, machine, facts | {CODE: {"step": code_digest("ledger")}})
    assert age(tmp_path) == ["not known: its numbers stand in no history"]


def test_each_file_of_a_study_has_its_digest(tmp_path):
    machine, facts = describe_machine(1)
    for name in ("a.csv", "b.csv"):
        (tmp_path / name).write_text("a\n1\n")
        remember_study(tmp_path, "looks", machine, facts, name)
    assert age(tmp_path) == []
    code = {"looks/a.csv": code_digest("ledger"), "looks/b.csv": code_digest("looks")}
    remember_machine(tmp_path, machine, facts | {CODE: code})
    assert age(tmp_path) == ["not known: its numbers stand in no history"]
    remember_study(tmp_path, "looks", machine, facts, "a.csv")
    assert age(tmp_path) == []
    (tmp_path / "c.csv").write_text("a\n1\n")
    assert age(tmp_path) == ["not known: its numbers stand in no history"]


def test_the_digest_of_a_study_is_of_what_it_measures():
    assert code_digest("step") != code_digest("ledger")
    assert _counts(SUITE / "studies/step/measure.py", "step")
    assert not _counts(SUITE / "studies/ledger/measure.py", "step")
    assert not _counts(SUITE / "studies/step/report.py", "step")
    assert not _counts(SUITE / "report/table.py", "step")
    assert _counts(SUITE / "studies/looks.py", "looks")
    assert not _counts(SUITE / "studies/looks.py", "drapes")
    assert _counts(SUITE / "bench/runner.py", "step")
    assert _counts(SUITE.parent / "solvers/clarabel.py", "step")


def test_packages_of_a_study_that_have_changed_are_named(tmp_path):
    facts = describe_machine(1)[1] | {"packages": installed(PACKAGES) | {"numpy": "1.0"}}
    (tmp_path / "a.csv").write_text("a\n1\n")
    remember_machine(tmp_path, "m", facts)
    assert age(tmp_path)[-1] == f"with numpy 1.0 (now {installed(['numpy'])['numpy']})"


def test_a_study_says_what_made_it_and_a_folder_without_a_command_that_none_is_known(tmp_path):
    for name, text in (("a", "# A\n\n`strainbench duel swing -o a.md`\n"), ("b", "# B\n")):
        (tmp_path / name).mkdir()
        (tmp_path / name / "x.md").write_text(text)
    told = lines(tmp_path)
    assert told["a"][2] == "strainbench duel swing -o a.md"
    assert told["b"][2] == NO_COMMAND


def test_commands_stand_beside_links_or_names(root):
    assert commands(root / "README.md") == {
        "runs": ["make bench", "strainbench run swing --steps 2"],
        "named": ["strainbench duel ..."],
    }


def test_local_results_and_pictures_are_no_folders_of_results(root):
    (root / "local").mkdir()
    (root / "local/table1.md").touch()
    with pytest.raises(SystemExit, match="has no folder of results"):
        main([str(root)])


def test_damage_is_one_line(root):
    (root / "runs" / RUNS).write_text("damaged\n")
    with pytest.raises(RecordsError, match=r"runs\.csv, line 1"):
        freshness(root)


def test_every_committed_folder_has_a_command_that_can_be_typed():
    for name, (_, _, command) in lines(RESULTS).items():
        assert command.startswith(("strainbench ", "make ", "python -m ")), name
