"""A third kind of limit is a third class: CONTRIBUTING's, and one that is not convex."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from strainbench import Problem, StretchLimits, certify, solve
from strainbench.problem.conic import ConicForm
from strainbench.problem.export import as_cbf, as_npz
from strainbench.problem.kinds import Exact, Kind, Sampled, kind_of
from strainbench.referee.kkt import kkt_residual
from strainbench.referee.reference import Reference
from strainbench.render.polar import admissible
from strainbench.solver.registry import find_solver, list_solvers
from strainbench.solver.solver import warm_up
from tests.problems import central_difference, random_mesh

CONTRIBUTING = (Path(__file__).parents[2] / "CONTRIBUTING.md").read_text()
SECTION = CONTRIBUTING.split("## Adding a kind of limit\n")[1]
DEFINED: dict = {"__name__": "third"}
exec(compile(re.search(r"```python\n(.*?)```", SECTION, re.DOTALL)[1], "third", "exec"), DEFINED)
FrobeniusLimits, ClarabelFrobenius = DEFINED["FrobeniusLimits"], DEFINED["ClarabelFrobenius"]

CORNERS = {  # of a regular simplex about the origin
    2: np.array([[1.0, 0.0], [-0.5, 0.75**0.5], [-0.5, -(0.75**0.5)]]),
    3: np.array([[1.0, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]),
}


def stretched(bound=1.45, pinned=()):
    """A sheet pulled to 1.2 in one direction: ||F||_F is 1.56."""
    rest, elements = random_mesh(np.random.default_rng(5), 12)
    target = np.column_stack([1.2 * rest[:, 0], rest[:, 1], 0.1 * rest[:, 0]])
    return Problem(rest, elements, target, FrobeniusLimits(bound), pinned)


# --- CONTRIBUTING's: the Frobenius norm


def test_the_referee_measures_it():
    problem = stretched()
    F = problem.deformation_gradients(problem.target)
    beyond = np.linalg.norm(F.reshape(len(F), -1), axis=1) - 1.45
    assert problem.constraints == len(problem.elements)
    assert problem.violations(problem.target) == pytest.approx(np.maximum(beyond, 0))
    found = certify(problem, problem.target)
    assert (found.outcome, found.max_violation) == ("violated", pytest.approx(beyond.max()))


def test_a_solver_that_takes_it_finds_the_certified_optimum():
    problem, solver = stretched(), ClarabelFrobenius()
    warm_up(solver, problem, 1e-6)
    found = solve(problem, solver)
    inside = solve(problem.tightened(1e-8), solver, tolerance=1e-9)
    reference = Reference.verified(problem, inside.positions, inside.multipliers)
    certificate = certify(problem, found.positions, reference=reference)
    assert certificate.outcome == "optimal", certificate.reason
    assert certificate.active_constraints > 3
    assert certify(problem, found.positions).outcome == "feasible"  # no reference solver takes it


@pytest.mark.parametrize("name", [e.name for e in list_solvers() if not e.unavailable])
def test_all_others_refuse_with_the_reason(name):
    assert "limits on the Frobenius norm" in find_solver(name).supports(stretched())


def test_a_solver_that_refuses_is_not_run():
    with pytest.raises(ValueError, match="limits on the Frobenius norm"):
        solve(stretched(), "newton-ipm")


def test_it_is_a_cone_program_and_no_npz():
    problem = stretched()
    assert (ConicForm(problem).order, ConicForm(problem).count) == (7, len(problem.elements))
    text = as_cbf(problem, "a sheet").decode()
    assert "such that ||F_e||_F <= b" in text
    assert "\nQ 7\n" in text
    with pytest.raises(ValueError, match=r"--format npz: limits of another kind"):
        as_npz(problem, "a sheet")


def test_pins_and_polar_plots_know_how_far_it_reaches():
    edge = stretched().elements[0, :2]
    assert "the limits allow at most" in stretched(bound=0.8, pinned=edge).infeasible_pins()
    assert stretched(bound=1.45, pinned=edge).infeasible_pins() is None
    np.testing.assert_allclose(admissible(FrobeniusLimits(1.3), np.array([0.0, 0.7])), 1.3)


def test_limits_that_do_not_fit_are_refused():
    problem = stretched()
    with pytest.raises(ValueError, match=r"limits\.directions: 3 coordinates"):
        Problem(problem.rest, problem.elements, problem.target, FrobeniusLimits(1.4, dim=3))
    with pytest.raises(ValueError, match=r"limits\.bounds\[0\] is nan"):
        FrobeniusLimits(float("nan"))
    with pytest.raises(ValueError, match=r"1\.01 is not a StretchLimits"):
        Problem(problem.rest, problem.elements, problem.target, 1.01)


# --- one that is not convex: an element's area or volume over that at rest


class ContentLimits(Kind):
    """det(F^T F)^(1/2) <= b."""

    formula = "det(F_e' F_e)^1/2 <= b"
    needs = {"takes_content": "it has no form for limits on areas and volumes"}
    convex = False

    def __init__(self, bound, dim):
        super().__init__(np.eye(dim), [bound])

    def blocks(self, rows):
        return rows.reshape(-1, len(self.directions), 3)

    def measure(self, rows):
        Y = self.blocks(rows)
        return np.sqrt(np.linalg.det(Y @ np.swapaxes(Y, 1, 2)))

    def derivatives(self, rows, active):
        Y = self.blocks(rows)[active]
        inverse = np.linalg.inv(Y @ np.swapaxes(Y, 1, 2))
        m = Y.shape[1]
        slopes = self.measure(rows)[active, None, None] * (inverse @ Y)
        return m * active[:, None] + np.arange(m), slopes

    def tightened(self, margin):
        return ContentLimits(self.bounds[0] - margin, len(self.directions))


def simplex(dim, scale):
    """One regular element and what it is when scaled so: stationary by symmetry."""
    rest = CORNERS[dim]
    target = scale * rest @ np.eye(dim, 3)
    return Problem(rest, [range(dim + 1)], target, ContentLimits(1.1**dim, dim))


@pytest.mark.parametrize("dim", [2, 3])
def test_derivatives_are_those_of_the_measure(dim, rng):
    kind, rows = ContentLimits(1.0, dim), rng.normal(size=(4 * dim, 3))
    gradient = central_difference(lambda y: kind.measure(y).sum(), rows)
    where, slopes = kind.derivatives(rows, np.arange(4))
    np.testing.assert_array_equal(where.ravel(), np.arange(4 * dim))
    np.testing.assert_allclose(slopes.reshape(-1, 3), gradient, rtol=1e-6, atol=1e-8)


@pytest.mark.parametrize("dim", [2, 3])
def test_a_local_optimum_has_no_kkt_residual(dim):
    problem = simplex(dim, 1.3)
    assert not problem.convex
    optimum = problem.target * (1.1 / 1.3)
    assert problem.violations(optimum).max() < 1e-12
    assert kkt_residual(problem, optimum) < 2e-5
    assert kkt_residual(problem, optimum * [1, 1.1, 1]) > 0.1
    found = certify(problem, optimum)
    assert found.outcome == "feasible"
    assert "at best a local optimum" in found.reason
    assert problem.largest_objective == np.inf


def test_a_measure_near_0_is_no_active_limit():
    problem = simplex(2, 1.3)
    flat = problem.target * [1, 1e-6, 1]
    assert kkt_residual(problem, flat) == pytest.approx(1)
    assert certify(problem, flat).active_constraints == 0


def test_tightened_limits_of_it_are_its_own():
    assert simplex(2, 1.3).tightened(0.01).bounds == pytest.approx([1.2])


# --- the two of StretchLimits


@pytest.mark.parametrize(
    ("limits", "kind", "each"),
    [
        (StretchLimits.isotropic(1.1, 3), Sampled, 3),
        (StretchLimits.isotropic(1.1, 3, lower=0.9), Sampled, 3),
        (StretchLimits.exact(1.1, 1.2), Exact, 1),
        (StretchLimits.exact([1.1, 1.2]), Exact, 1),
    ],
)
def test_stretch_limits_stand_for_two_kinds(limits, kind, each):
    found = kind_of(limits)
    assert type(found) is kind
    assert found.bounds.shape[-1] == each
    assert kind_of(found) is found
    assert found.convex == (limits.lower is None)
    first = limits.first()
    assert first.bounds.shape == limits.bounds.shape[-1:]
    assert first.spectral == limits.spectral
