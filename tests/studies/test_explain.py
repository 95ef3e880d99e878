"""The verb explain: one cell by a word, its story, and the frame that is solved again."""

from __future__ import annotations

from pathlib import Path

import pytest

from strainbench import solve
from strainbench.bench.columns import RUN_COLUMNS
from strainbench.bench.plan import plan
from strainbench.bench.records import RUNS, append_rows, latest_runs
from strainbench.bench.rows import identity
from strainbench.bench.runner import Runner, Settings
from strainbench.export import load_problem
from strainbench.studies.explain import cell_of, choose, explain, listed
from strainbench.studies.explain.choose import command
from tests.cli.test_cli import strainbench

FAILING = str(Path(__file__).parents[1] / "failing.py")
MISBEHAVING = str(Path(__file__).parents[1] / "misbehaving.py")


def cells(solvers=("gauss-seidel", "none"), settings=(), scene="swing"):
    words = ["resolution=2", *settings]
    return plan([scene], list(solvers), words, "simulate", 3, [1e-6], 9.0)


@pytest.fixture
def folder(tmp_path):
    rows = [
        identity(cell) | {"outcome": "violated", "reason": "much", "failure": "over-stretched"}
        for cell in cells(settings=["limit=1%,2%"])
    ]
    append_rows(tmp_path / RUNS, RUN_COLUMNS, rows)
    return tmp_path


def test_a_cell_by_its_number_its_key_or_its_name(folder):
    keys = list(latest_runs(folder))
    assert choose(folder, "2")["cell"] == keys[1]
    assert choose(folder, keys[2][:8])["cell"] == keys[2]
    assert choose(folder, "swing 2 at 2%, none")["cell"] == keys[3]


@pytest.mark.parametrize("word", ["0", "5", "nobody", "", "-1", "½"])
def test_nonsense_is_told_what_is_valid(folder, word):
    with pytest.raises(ValueError, match=r"no such cell; a number from 1 to 4, a key such as .*"):
        choose(folder, word)


def test_several_are_told_their_numbers(folder):
    with pytest.raises(ValueError, match=r"^CELL none is 2 cells: one of 2, 4 is valid$"):
        choose(folder, "none")


@pytest.mark.parametrize(
    ("solvers", "settings", "scene"),
    [
        (["fast-projection-full-step"], ["limit=0.3%", "step=0.02"], "swing"),
        (["newton-ipm", "xpbd"], ["xpbd.max_sweeps=7", "limit=2%"], "swing"),
        ([FAILING], ["slack.status=why", "scale_x=1.3"], "stretch-square"),
    ],
)
def test_a_cell_is_as_its_row_says(tmp_path, solvers, settings, scene):
    wanted = cells(solvers, settings, scene)
    append_rows(tmp_path / RUNS, RUN_COLUMNS, [identity(cell) for cell in wanted])
    rows = latest_runs(tmp_path)
    assert [cell_of(rows[cell.key]).key for cell in wanted] == [cell.key for cell in wanted]


def test_the_command_has_what_is_not_as_by_default():
    (cell,) = cells(["xpbd"], ["xpbd.max_sweeps=7", "limit=2%"])
    said = "strainbench run swing --solver xpbd --set xpbd.max_sweeps=7 --set resolution=2 "
    assert command(cell) == said + "--set limit=0.02 --steps 3 --tolerance 1e-06 --time-limit 9"


def test_what_never_began_is_told_without_a_replay(tmp_path):
    (cell,) = cells(["none"])
    reason = {"outcome": "no answer", "reason": "unsupported: it takes none", "failure": "refused"}
    append_rows(tmp_path / RUNS, RUN_COLUMNS, [identity(cell) | reason])
    story = explain(choose(tmp_path, "1"), tmp_path, tmp_path / "out", 500)
    assert story.sentences == ["swing 2, none: refused. Unsupported: it takes none."]
    assert not story.paths
    (line,) = listed(tmp_path).lines
    assert list(line[-3:-1]) == ["refused", ""]


@pytest.mark.slow
def test_the_story_of_a_cell_and_its_frame_solved_again(tmp_path):
    settings = ["limit=0.5%", "xpbd.max_sweeps=3"]
    (cell,) = plan(["swing"], ["xpbd"], ["resolution=3", *settings], "simulate", 5, [1e-6], 30.0)
    Runner(Settings(tmp_path / "in")).run([cell])
    row = choose(tmp_path / "in", "1")
    assert row["failure"] == "iteration limit"
    words = ["explain", "1", "--results", "in", "-o", "out"]
    said = " ".join(strainbench(*words, cwd=tmp_path).stdout.split())
    assert f"iteration limit since step {row['failure_step']} of 5" in said
    assert "Worst is element" in said
    assert "The solver says 'iteration limit' after 3 iterations." in said
    assert "The easier neighbour, limit 0.01, is " in said
    assert (tmp_path / "out" / "picture.png").stat().st_size > 1000
    assert "`strainbench run instance " in (tmp_path / "out" / "story.md").read_text()
    frame = tmp_path / "out" / "frame.npz"
    assert load_problem(frame).constraints == cell.scenario.scenario().problem().constraints
    again = solve(load_problem(frame), cell.solver.solver())
    assert again.status == "iteration limit"


@pytest.mark.slow
def test_the_frame_to_which_there_is_no_answer(tmp_path):
    found = plan(["stretch-square"], [MISBEHAVING], ["resolution=3"], "simulate", 2, [1e-6], 9.0)
    (cell,) = (c for c in found if c.solver.name == "crash")
    Runner(Settings(tmp_path / "in")).run([cell])
    story = explain(choose(tmp_path / "in", "1"), tmp_path / "in", tmp_path / "out", 800)
    assert "crashed since step 1 of 2" in story.sentences[0]
    assert (load_problem(tmp_path / "out" / "frame.npz").target == story_target(cell)).all()


def story_target(cell):
    return cell.scenario.scenario().problem().target
