"""How many threads `solve` and `certify` run on."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from strainbench import Problem, Solution, Solver, StretchLimits, certify, solve

TARGET = np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]])
PROBLEM = Problem(TARGET[:, :2] / 2, [[0, 1, 2]], TARGET, StretchLimits.isotropic(1.01))


def threads():
    """Of each library loaded."""
    return {pool["filepath"]: pool["num_threads"] for pool in threadpool_info()}


class Looking(Solver):
    """Looks at its threads (nobody)."""

    name = "looking"
    seen: list = []

    def prepare(self, problem):
        self.seen.append(threads())

    def solve(self, problem, state, *, tolerance, monitor, deadline):
        self.seen.append(threads())
        return Solution(problem.target.copy(), "solved", 0)


@pytest.mark.parametrize("count", [1, 2])
def test_solve_runs_on_as_many_as_asked_and_restores(count):
    solve(PROBLEM, Looking())  # whatever that loads is there
    Looking.seen.clear()
    with threadpool_limits(count):
        asked = threads()  # a library may be built, or told, to have fewer
    with threadpool_limits(3):
        before = threads()
        solve(PROBLEM, Looking(), threads=count)
        assert threads() == before
    assert Looking.seen
    assert all(seen == asked for seen in Looking.seen)


def test_one_is_the_default():
    Looking.seen.clear()
    with threadpool_limits(3):
        solve(PROBLEM, Looking())
    assert all(set(seen.values()) == {1} for seen in Looking.seen)


def test_certify_asks_its_reference_on_as_many(monkeypatch):
    monkeypatch.setattr("strainbench.referee.reference._reference_solvers", lambda _: [Looking()])
    Looking.seen.clear()
    with threadpool_limits(3):
        certify(PROBLEM, TARGET)
    assert Looking.seen
    assert all(set(seen.values()) == {1} for seen in Looking.seen)


@pytest.mark.parametrize("bad", [0, -1, 1.5, True, "1", None])
def test_other_numbers_are_refused(bad):
    for call in (
        lambda: solve(PROBLEM, "none", threads=bad),
        lambda: certify(PROBLEM, TARGET, threads=bad),
    ):
        with pytest.raises(
            ValueError, match=r"threads is .*: a whole number of at least 1 is valid"
        ):
            call()


def test_a_library_that_is_loaded_later_takes_no_more():
    """MKL is loaded by the first factorisation: the limit set before holds for it."""
    pytest.importorskip("pypardiso")
    code = """
from threadpoolctl import threadpool_info, threadpool_limits
import numpy
def mkl(): return [p["num_threads"] for p in threadpool_info() if p["internal_api"] == "mkl"]
assert not mkl()
with threadpool_limits(1):
    from strainbench.physics.linear import _mkl
    _mkl()
    print(mkl())
"""
    found = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        check=True,
        env={"OMP_NUM_THREADS": "2", "PYTHONPATH": ":".join(sys.path)},
    )
    assert found.stdout.strip() == "[1]"
