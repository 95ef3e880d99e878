"""Factorising matrices of one pattern: every solver against numpy, and against each other."""

from __future__ import annotations

import sys

import numpy as np
import pytest
import scipy.sparse as sp

from scenarios.swing import Swing
from strainbench.physics import linear
from strainbench.physics.implicit_euler import NewtonSettings, minimise_step
from strainbench.physics.linear import (
    PACKAGES,
    NotPositiveDefiniteError,
    SuperLU,
    available_linear_solvers,
    best_linear_solver,
    symmetric,
)
from strainbench.solver.registry import find_solver
from strainbench.studies.euler import profile, projection, run, table


@pytest.fixture(params=PACKAGES, ids=lambda kind: kind.name)
def kind(request):
    pytest.importorskip(PACKAGES[request.param])
    return request.param


def positive_definite(rng, n=40, density=0.1):
    """Of a random pattern, and the lower triangle that a solver is given."""
    A = sp.random_array((n, n), density=density, rng=rng, format="csc")
    A = sp.csc_array(A @ A.T + sp.eye_array(n))
    lower = sp.csc_array(sp.tril(A))
    lower.sort_indices()
    return A.toarray(), lower


def test_solves_as_numpy_does(rng, kind):
    A, lower = positive_definite(rng)
    solver = kind(lower)
    solver.factorise(lower.data)
    b = rng.normal(size=len(A))
    np.testing.assert_allclose(solver.solve(b), np.linalg.solve(A, b), rtol=1e-9)


def test_several_right_hand_sides_at_once(rng, kind):
    A, lower = positive_definite(rng)
    solver = kind(lower)
    solver.factorise(lower.data)
    b = rng.normal(size=(len(A), 3))
    np.testing.assert_allclose(solver.solve(b), np.linalg.solve(A, b), rtol=1e-9)


def test_the_pattern_serves_other_values(rng, kind):
    A, lower = positive_definite(rng)
    solver = kind(lower)
    for scale in rng.uniform(0.5, 2, size=(5, len(A))):
        other = sp.csc_array(lower * scale[:, None] * scale[None])
        solver.factorise(other.data)
        b = rng.normal(size=len(A))
        expected = np.linalg.solve(scale[:, None] * A * scale, b)
        np.testing.assert_allclose(solver.solve(b), expected, rtol=1e-9)


def test_what_is_stored_above_the_diagonal_is_ignored(rng, kind):
    A, _ = positive_definite(rng)
    whole = sp.csc_array(A)
    rows, columns = whole.indices, np.repeat(np.arange(len(A)), np.diff(whole.indptr))
    garbled = np.where(rows < columns, 1e3, whole.data)
    solver = kind(whole)
    solver.factorise(garbled)
    b = rng.normal(size=len(A))
    np.testing.assert_allclose(solver.solve(b), np.linalg.solve(A, b), rtol=1e-9)


@pytest.mark.parametrize("value", [-1e3, 0.0, np.nan])
def test_an_indefinite_matrix_is_refused_and_the_next_one_solved(rng, kind, value):
    A, lower = positive_definite(rng)
    solver = kind(lower)
    bad = sp.csc_array(lower, copy=True)
    bad[20, 20] = value
    with pytest.raises(NotPositiveDefiniteError):
        solver.factorise(bad.data)
    solver.factorise(lower.data)
    b = rng.normal(size=len(A))
    np.testing.assert_allclose(solver.solve(b), np.linalg.solve(A, b), rtol=1e-9)


def test_symmetric_mirrors_the_lower_triangle(rng):
    A, lower = positive_definite(rng)
    np.testing.assert_allclose(symmetric(lower).toarray(), A)


def test_superlu_serves_where_only_scipy_is(rng, monkeypatch):
    monkeypatch.setattr(linear, "find_spec", lambda name: name == "scipy" or None)
    assert available_linear_solvers() == [SuperLU]
    assert isinstance(best_linear_solver(positive_definite(rng)[1]), SuperLU)


def test_every_linear_solver_steps_the_swing_alike():
    scene = Swing(resolution=8)
    cloth, x = scene.cloth(), scene.sheet()[2]
    settings = NewtonSettings(tolerance=1e-9)
    found = []
    for kind in available_linear_solvers():
        solver = kind(cloth.pattern.matrix())
        positions, report = minimise_step(cloth, x, x, 1 / 60, settings, solver)
        assert report.converged
        found.append(positions)
    for positions in found[1:]:
        np.testing.assert_allclose(positions, found[0], atol=1e-10)


@pytest.mark.parametrize("h", [1 / 240, 1 / 60, 1 / 5])
def test_newton_converges_on_the_swing(h):
    measured = profile(Swing(resolution=10, step=h), steps=20)
    assert set(measured) == {kind.name for kind in available_linear_solvers()}
    for steps in measured.values():
        assert all(m.report.converged for m in steps)
        assert all(m.ratio >= 1 for m in steps)
    assert len(table(measured, "swing").lines) == len(measured)


def test_limits_change_what_newton_is_given():
    scene = Swing(resolution=6)
    free, limited = (
        profile(scene, 8, *project)
        for project in ((), (projection(scene, find_solver("clarabel")),))
    )
    for name, steps in limited.items():
        assert all(m.report.converged for m in steps)
        assert [m.report.residual for m in steps] != [m.report.residual for m in free[name]]


@pytest.mark.parametrize(
    ("scene", "step", "line"),
    [
        ("swim", 0.01, "no scenario called 'swim'; valid are"),
        ("twist", 0.01, "twist has no cloth that moves by implicit Euler"),
        ("swing", -1.0, "step is -1.0: a number of seconds above 0 is valid"),
    ],
)
def test_a_wrong_word_to_the_profile_is_one_line(scene, step, line):
    with pytest.raises(SystemExit, match=line):
        run(scene, 2, 1, step)


def test_a_solver_that_the_profile_does_not_know_is_one_line():
    with pytest.raises(SystemExit, match="no solver called 'mosek'; valid are"):
        run("swing", 2, 1, 0.01, "mosek")


def test_the_profile_writes_what_it_prints_with_its_command(tmp_path, monkeypatch, capsys):
    path = tmp_path / "euler.md"
    monkeypatch.setattr(sys, "argv", ["euler.py", "swing", "--resolution", "2", "-o", str(path)])
    run("swing", 2, 1, 0.01, output=path)
    printed, text = capsys.readouterr().out, path.read_text()
    assert f"`python -m strainbench.studies.euler swing --resolution 2 -o {path}`" in text
    (line,) = (line for line in text.splitlines() if line.startswith("| superlu"))
    assert [c.strip() for c in line.split("|")] == [
        c.strip() for row in printed.splitlines() if "superlu" in row for c in row.split("|")
    ]
    assert "Python" in text
    with pytest.raises(SystemExit, match=r"-o .*x\.pdf: a name that ends in"):
        run("swing", 2, 1, 0.01, output=tmp_path / "x.pdf")
