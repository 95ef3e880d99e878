"""Solvers in turns: who is given what, and when; what is made of it."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest

from strainbench import Solution, Solver
from strainbench.bench.plan import plan_one
from strainbench.bench.recording import record, record_all, recorded, recorder
from strainbench.document.writers import markdown
from strainbench.report.output import check_ending
from strainbench.solver.registry import find_solver
from strainbench.studies.duel.measure import duel, parse_frames
from strainbench.studies.duel.racer import Racer
from strainbench.studies.duel.report import CSV_HEADER, HEADER, Outcome
from strainbench.studies.duel.trees import HERE, check_tree
from tests.cli.test_cli import strainbench

MACHINE = {
    "here": {"memory_gb": 1, "system": "Linux", "python": "3.11", "threads_per_solver": 1},
}


def cell(steps=1):
    return recorder(plan_one("swing", "clarabel", ["resolution=3"], steps, 1e-6))


@pytest.fixture(scope="module")
def recording():
    return record_all(cell(), 6)


class Told(Solver):
    """Notes what it is given, in a state of its own (nobody)"""

    name = "told"

    def __init__(self, name, diary):
        object.__setattr__(self, "diary", diary)
        object.__setattr__(self, "mark", name)

    label = property(lambda self: self.mark)

    def prepare(self, problem):
        return []

    def solve(self, problem, state, *, tolerance, monitor, deadline):
        state.append(problem.target)
        if problem.vertices == 16:  # not in the warm-up
            self.diary.append((self.mark, problem.target.copy(), len(state)))
        return Solution(problem.target.copy(), "solved", len(state))


def test_turns_alternate_and_states_are_fresh_each_repeat(recording):
    diary = []
    entries = duel(
        [Told("a", diary), Told("b", diary)], recording, [[2], [4, 5]], repeats=2, tolerance=1e-6
    )
    assert "".join(mark for mark, _, _ in diary) == "ab" * 3 + "ba" * 3
    assert [count for _, _, count in diary[::2]] == [1, 1, 2, 1, 1, 2]
    for (_, target, _), number in zip(diary[::2], [2, 4, 5] * 2, strict=True):
        assert np.array_equal(target, recording.targets[number - 1])
    for entry in entries:
        assert len(entry.seconds) == 6
        assert len(entry.setups) == 4
        assert sorted(entry.answers) == [2, 4, 5]
        assert entry.iterations == 1


def test_the_referee_judges_the_answers(recording):
    solvers = [find_solver(name) for name in ("newton-ipm", "none")]
    exact, none = duel(solvers, recording, [[6]], repeats=1, tolerance=1e-8)
    assert exact.worst_violation < 1e-6 > exact.worst_gap
    excess = recording.frame(6).violations(recording.targets[5]).max()
    assert none.worst_violation == pytest.approx(excess)
    assert exact.worst_distance < 1e-6 < none.worst_distance
    assert exact.unsolved == []


def test_an_answer_that_is_not_usable_shows(recording):
    class Lost(Solver):
        """No answer (nobody)"""

        name = "lost"

        def solve(self, problem, state, *, tolerance, monitor, deadline):
            return Solution(np.full_like(problem.target, np.nan), "lost", 1)

    (entry,) = duel([Lost()], recording, [[2, 3]], repeats=1, tolerance=1e-6)
    assert np.isnan(entry.worst_gap)
    assert entry.unsolved == ["lost"]


def test_a_solver_that_cannot_take_the_scene():
    exact = record_all(plan_one("swing", "clarabel", ["resolution=2", "directions=exact"], 1, 1), 1)
    with pytest.raises(ValueError, match="xpbd cannot take this scene"):
        duel([find_solver("xpbd")], exact, [[1]], repeats=1, tolerance=1e-6)


@pytest.mark.parametrize(
    ("text", "sequences"),
    [("7", [[7]]), ("5,14-16", [[5], [14, 15, 16]]), ("3-3", [[3]]), ("4,2", [[4], [2]])],
)
def test_frames(text, sequences):
    assert parse_frames(text) == sequences


@pytest.mark.parametrize("text", ["", "0", "x", "3-2", "1-2-3", "1,,2", "-4"])
def test_frames_that_are_none(text):
    with pytest.raises(ValueError, match="whole numbers above 0 and ranges"):
        parse_frames(text)


def test_all_projections_are_those_recorded_one_by_one(recording):
    for number in (1, 4, 6):
        assert np.array_equal(record(cell(), number).target, recording.frame(number).target)
    assert len(recording.step_seconds) == 5
    assert np.all(recording.step_seconds > 0)


def test_recordings_are_kept(tmp_path, recording, monkeypatch):
    first = recorded(cell(), 6, tmp_path)
    monkeypatch.setattr("strainbench.bench.recording.record_all", None)
    again = recorded(cell(), 6, tmp_path)
    assert np.array_equal(first.targets, recording.targets)
    assert np.array_equal(again.targets, first.targets)


def outcome(*entries):
    return Outcome("a scene", "strainbench duel", MACHINE, entries)


def test_ratios_and_units():
    found = outcome(
        Racer("first", [0.5, 0.7, 0.6], [6.0, 2.0, 4.0]),
        Racer("second", [0.1], [8.0]),
        Racer("factorisation + solve (superlu)", seconds=[0.5]),
    )
    first, second, unit = found.rows()
    assert (first["setup_seconds"], first["seconds"]) == pytest.approx((0.6, 4.0))
    assert (first["first_quartile"], first["third_quartile"]) == pytest.approx((3.0, 5.0))
    assert [r["times_faster"] for r in (first, second, unit)] == pytest.approx([1, 0.5, 8])
    assert [r["per_factorisation"] for r in (first, second, unit)] == pytest.approx([8, 16, 1])
    table = found.table()
    missing = ("/ implicit Euler", "CPU")
    assert table.columns == [c for c in HEADER.values() if c.name not in missing]
    assert all(len(line) == len(table.columns) for line in table.lines)
    for text in ("strainbench duel", "here: 1 GB", "| second | 0.1 | 8 | 8 to 8 | 0.50 |"):
        assert text in markdown(found.document())


def test_no_columns_for_units_that_were_not_measured():
    headings = outcome(Racer("only", [1.0], [1.0])).table().headings
    assert not [name for name in headings if name.startswith("/")]


def test_another_ending():
    with pytest.raises(ValueError, match=r"ends in \.csv, \.md"):
        check_ending(Path("here.txt"))


@pytest.mark.parametrize("ending", ["md", "csv"])
def test_the_command_line(tmp_path, ending):
    words = ["duel", "swing", "--set", "resolution=3", "--frame", "2,3-4", "--repeats", "2"]
    solvers = ["--solver", "newton-ipm,newton-ipm-warm,gauss-seidel"]
    output = f"out.{ending}"
    done = strainbench(*words, *solvers, "--units", "-o", output, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    text = (tmp_path / output).read_text()
    assert "strainbench duel swing --set resolution=3" in text
    for name in ("newton-ipm-warm", "gauss-seidel", "factorisation + solve", "implicit Euler step"):
        assert name in text
        assert name in done.stdout
    if ending == "csv":
        rows = list(csv.DictReader(text.splitlines()))
        assert tuple(rows[0]) == CSV_HEADER
        assert [float(r["max_violation"]) < 1e-5 for r in rows[:3]] == [True] * 3
        assert all(float(r["per_factorisation"]) > 0 < float(r["seconds"]) for r in rows)


def test_a_checkout_against_itself(tmp_path):
    words = ["duel", "swing", "--set", "resolution=4", "--frame", "2-4", "--repeats", "3"]
    both = ["--solver", "newton-ipm,newton-ipm-warm", "--against", str(HERE)]
    done = strainbench(*words, *both, "-o", "out.md", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    lines = (tmp_path / "out.md").read_text().splitlines()
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]
    for label in ("newton-ipm", "newton-ipm-warm"):
        (compared,) = [line for line in cells if line[0] == label]
        faster, _, clock, now, before, apart = compared[1:]
        assert 0.2 < float(faster) < 5  # what else the machine does is in it
        assert float(clock) > 0
        assert (now, float(apart)) == (before, 0)


def test_two_versions_are_compared_turn_by_turn():
    x = np.zeros((2, 3))
    here = Racer("a", [1.0], [1.0, 9.0, 2.0], {1: Solution(x, "solved", 3)}, version="new")
    there = Racer("a", [1.0], [2.0, 9.0, 6.0], {1: Solution(x + 1e-9, "solved", 4)}, version="old")
    here.cpu, there.cpu = [1.0, 2.0, 4.0], [2.0, 8.0, 4.0]
    table = outcome(here, there).versions()
    assert table.title == "new over old"
    (line,) = table.lines
    assert line == ["a", 2.0, "1.50 to 3.00", 2.0, 3.0, 4.0, pytest.approx(1e-9)]
    assert "a (old)" in markdown(outcome(here, there).document())


def test_a_checkout_that_cannot_race(tmp_path, recording):
    with pytest.raises(ValueError, match="another checkout of strainbench is valid"):
        check_tree(tmp_path)
    package = tmp_path / "strainbench"
    package.mkdir()
    (package / "__init__.py").write_text("raise ImportError('worn out')")
    newton = [find_solver("newton-ipm")]
    with pytest.raises(ValueError, match=r"ended: ImportError: worn out"):
        duel(newton, recording, [[2]], 1, 1e-6, against=check_tree(tmp_path))
    with pytest.raises(ValueError, match="told is no solver of the suite's own"):
        duel([Told("told", [])], recording, [[2]], 1, 1e-6, against=HERE)


def test_a_wrong_word_is_one_line(tmp_path):
    words = ["duel", "swing", "--solver", "clarabel", "--frame"]
    for more, line in ((["0"], "--frame 0"), (["1", "--repeats", "0"], "--repeats 0")):
        done = strainbench(*words, *more, cwd=tmp_path)
        assert done.returncode == 2
        assert line in done.stderr
