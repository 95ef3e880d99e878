"""Earlier sources count as today's where history shows that edits since change no number."""

from __future__ import annotations

import pytest

from strainbench.bench.machine import describe_machine
from strainbench.bench.records import remember_machine
from strainbench.report import freshness, history, provenance, versions
from strainbench.report.freshness import age
from strainbench.report.history import ENDED, WATCHING, alike
from strainbench.report.provenance import CODE, suite_files
from strainbench.sources import PACKAGES, ROOT, SUITE, closure, digest, suite_digest
from tests.report.test_freshness import git
from tests.report.test_versions import UNKNOWN, measure, shown

CODE_BEFORE = '''\
"""What it does."""

def half(x):
    """Half of it."""
    return x / 2  # exactly
'''
EDITS = {
    "a comment": (CODE_BEFORE.replace("exactly", "as a float"), True),
    "a docstring": (CODE_BEFORE.replace("Half of it", "One half"), True),
    "no docstring": (CODE_BEFORE.replace('    """Half of it."""\n', ""), True),
    "layout": (CODE_BEFORE.replace("x / 2", "(\n        x / 2\n    )"), True),
    "a number": (CODE_BEFORE.replace("/ 2", "/ 3"), False),
    "a name": (CODE_BEFORE.replace("half", "third"), False),
    "a string that is used": (CODE_BEFORE + 'name = "a"\n', False),
    "no Python": (CODE_BEFORE + ")\n", False),
}


@pytest.fixture
def checkout(tmp_path, monkeypatch):
    """A history of its own, with a module that measures and one that watches."""
    top = tmp_path / "checkout"
    for name in ("measuring.py", "watching.py"):
        path = top / PACKAGES[0] / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(CODE_BEFORE)
    monkeypatch.setattr(history, "ROOT", top)
    monkeypatch.setattr(history, "WATCHING", (top / PACKAGES[0] / "watching.py",))
    git(tmp_path, "init", "-q", str(top))
    commit(top)
    return top


def commit(top):
    git(top, "add", "-A")
    git(top, "commit", "-qm", "an edit")


def files(top):
    alike.cache_clear()
    return tuple(sorted((top / PACKAGES[0]).rglob("*.py")))


@pytest.mark.parametrize("committed", [True, False])
@pytest.mark.parametrize("edit", EDITS)
def test_only_edits_of_words_leave_numbers_what_they_were(checkout, edit, committed):
    text, same = EDITS[edit]
    before = digest(files(checkout))
    (checkout / PACKAGES[0] / "measuring.py").write_text(text)
    if committed:
        commit(checkout)
    assert digest(files(checkout)) != before
    assert (before in alike(files(checkout), watched=True)) == same


def test_an_edit_of_what_ends_cells_counts_for_those_that_it_ended(checkout):
    before = digest(files(checkout))
    (checkout / PACKAGES[0] / "watching.py").write_text(EDITS["a number"][0])
    commit(checkout)
    assert before in alike(files(checkout), watched=False)
    assert before not in alike(files(checkout), watched=True)


def test_no_state_before_an_edit_that_counts_is_looked_for(checkout):
    """Though a later edit undid it: what lies before is not looked at."""
    first = digest(files(checkout))
    path = checkout / PACKAGES[0] / "measuring.py"
    for text in (EDITS["a number"][0], EDITS["a comment"][0]):
        path.write_text(text)
        commit(checkout)
    second = digest(files(checkout))
    path.write_text(EDITS["a docstring"][0])
    assert second in alike(files(checkout), watched=True)
    assert first not in alike(files(checkout), watched=True)


def test_a_module_that_came_or_went_is_another_state(checkout):
    before = digest(files(checkout))
    new = checkout / PACKAGES[0] / "new.py"
    new.write_text("x = 1\n")
    commit(checkout)
    with_it = digest(files(checkout))
    assert before not in alike(files(checkout), watched=False)
    new.unlink()
    commit(checkout)
    assert digest(files(checkout)) == before
    assert with_it not in alike(files(checkout), watched=False)


def test_without_a_history_sources_are_known_to_the_letter(checkout, tmp_path, monkeypatch):
    before = digest(files(checkout))
    (checkout / PACKAGES[0] / "measuring.py").write_text(EDITS["a comment"][0])
    (checkout / ".git").rename(tmp_path / "gone")
    assert alike(files(checkout), watched=False) == {digest(files(checkout))}
    (tmp_path / "gone").rename(checkout / ".git")
    monkeypatch.setenv("PATH", "")
    assert before not in alike(files(checkout), watched=False)


def test_nothing_that_measures_or_judges_imports_what_watches():
    files = [SUITE / "bench" / name for name in ("play.py", "preload.py", "judge.py", "rows.py")]
    rooms = [SUITE / name for name in ("physics", "problem", "referee", "scenario", "solver")]
    files += [
        f for room in (*rooms, ROOT / "solvers", ROOT / "scenarios") for f in room.rglob("*.py")
    ]
    assert set(WATCHING).isdisjoint(closure(*files))
    assert all(file.is_file() for file in WATCHING)


def test_the_suite_of_rows_is_the_one_looked_for():
    assert digest(suite_files()) == suite_digest()


def before(monkeypatch, digests_of):
    """Let the sources have had these digests before edits of what watches."""
    monkeypatch.setattr(
        digests_of, "alike", lambda files, watched: {"now", *["before"] * (not watched)}
    )


@pytest.mark.parametrize(
    ("failure", "older"),
    [("", ""), ("time limit", ""), ("over-stretched", ""), *((e.value, UNKNOWN) for e in ENDED)],
)
def test_rows_that_were_ended_are_older_than_an_edit_of_what_ended_them(
    tmp_path, monkeypatch, failure, older
):
    before(monkeypatch, versions)
    measure(tmp_path, "none", seconds=1, suite="before", failure=failure)
    assert shown(tmp_path) == [("none", "1", older)]


def test_so_are_studies_that_tell_of_such_cells(tmp_path, monkeypatch):
    before(monkeypatch, provenance)
    remember_machine(tmp_path, "m", describe_machine(1)[1] | {CODE: {"stability": "before"}})
    (tmp_path / "map.csv").write_text("method,failure\na,time limit\n")
    assert age(tmp_path) == []
    (tmp_path / "map.csv").write_text("method,failure\na,memory\n")
    assert age(tmp_path) == ["not known: its numbers stand in no history"]


def test_a_study_without_digests_is_held_against_the_edits_that_count(checkout, monkeypatch):
    monkeypatch.setattr(freshness, "study_files", lambda study: files(checkout))
    study = checkout / "results/study"
    study.mkdir(parents=True)
    (study / "a.md").write_text("numbers\n")
    commit(checkout)
    path = checkout / PACKAGES[0] / "measuring.py"
    for edit, told in (("a comment", []), ("a number", ["2 edits since a.md"]), ("layout", [])):
        path.write_text(EDITS[edit][0])
        commit(checkout)
        assert [said.split(" of ")[0] for said in age(study)] == told
    (checkout / PACKAGES[0] / "watching.py").unlink()
    commit(checkout)
    assert [said.split(" of ")[0] for said in age(study)] == ["4 edits since a.md"]


def test_words_of_a_plug_in_of_ours_make_its_rows_no_older(tmp_path, monkeypatch):
    measure(tmp_path, "none", seconds=1, content="scene solver")
    assert shown(tmp_path) == [("none", "1", "with scenarios/swing.py before its latest edit")]
    known = {ROOT / "scenarios/swing.py": "scene", ROOT / "solvers/none.py": "solver"}
    monkeypatch.setattr(
        versions, "alike", lambda files, watched: {known.get(files[0], suite_digest())}
    )
    assert shown(tmp_path) == [("none", "1", "")]
