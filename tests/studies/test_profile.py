"""Where a solver's time goes."""

from __future__ import annotations

import pytest

from strainbench import Solution, Solver, section
from strainbench.bench.plan import plan_one
from strainbench.bench.recording import record_all, recorder
from strainbench.solver.registry import find_solver
from strainbench.studies.profile import UNNAMED, profile
from tests.command import command


@pytest.fixture(scope="module")
def recording():
    return record_all(recorder(plan_one("swing", "none", ["resolution=4"], 1, 1e-6)), 6)


class Busy(Solver):
    """Sections that are known (nobody)."""

    name = "busy"

    def prepare(self, problem):
        with section("sort"):
            return None

    def solve(self, problem, state, **_):
        for _ in range(4):
            with section("sweep"), section("row"):
                pass
        return Solution(problem.target, "done", 4)


def parts(found):
    table = found.table("a title")
    return {str(line[0]): line for line in table.lines}


def test_parts_add_up_and_are_in_units(recording):
    found = profile(Busy(), recording, 2, repeats=3, tolerance=1e-6)
    lines = parts(found)
    inside = "- sort", "- sweep", "- row", "- the rest"
    assert set(lines) == {"prepare, once a mesh", "solve", *inside}
    assert lines["- sweep"][1] == lines["- row"][1] == 4
    unit = sorted(found.unit_seconds)[1]
    for _, _, milliseconds, _, units in lines.values():
        assert units == pytest.approx(milliseconds / 1e3 / unit)
    for turn in found.turns:
        inside = sum(part.seconds for part in turn.solving.values())
        assert 0 < inside <= turn.answer.seconds
    assert "factorisation + solve" in found.unit


def test_a_solver_without_sections_is_told_of_them(recording):
    found = profile(find_solver("none"), recording, 2, repeats=1, tolerance=1e-6)
    assert UNNAMED in found.table("").notes


def test_ours_name_theirs_and_a_warm_one_is_given_the_frame_before(recording):
    cold, warm = (
        profile(find_solver(name), recording, 6, repeats=1, tolerance=1e-6)
        for name in ("newton-ipm", "newton-ipm-warm")
    )
    assert {"- measure", "- assemble", "- factorise", "- back-substitute"} <= set(parts(cold))
    assert warm.turns[0].answer.iterations <= cold.turns[0].answer.iterations


def test_the_verb_and_a_solver_that_refuses(monkeypatch, capsys):
    words = ["profile", "swing", "--frame", "3", "--repeats", "1", "--set", "resolution=4"]
    done = command(monkeypatch, capsys, *words, "--solver", "clarabel")
    assert done.returncode == 0
    assert "| - Clarabel " in done.stdout
    exact = ["--set", "directions=exact", "--solver", "qoco"]
    done = command(monkeypatch, capsys, *words, *exact)
    assert done.returncode == 2
    assert "qoco cannot take this scene" in done.stderr
