"""Scenes made to break methods: each is what it says, and can be met or is certified not to."""

from __future__ import annotations

from dataclasses import replace
from itertools import islice

import numpy as np
import pytest

from scenarios.spike import Spike
from scenarios.stress import CASES, Stress
from strainbench import certify
from strainbench.problem.grid import lumped_areas
from strainbench.scenario.stage import NoAnswerError, Stage, StageError
from strainbench.solver.registry import find_solver
from tests import misbehaving

SAME = ("shuffled", "rotated", "millimetres", "kilometres", "far")
SHRUNK = ("collapsed", "flattened", "inverted")
PLAIN = Stress(case="displaced", severity=0, resolution=4)
"""The candidate of which the others are made."""


def certificates(scene, steps=1, solver="newton-ipm"):
    """What the referee finds in each step, and what the solver says."""
    stage = Stage.opened(scene, find_solver(solver))
    found = []

    def project(target):
        answer = stage.solve(target)
        found.append((certify(answer.frame, answer.solution.positions), answer.solution.status))
        return stage.accept(answer)

    list(stage.steps(steps, project))
    return found


@pytest.mark.parametrize(
    "settings",
    [
        *({"case": case} for case in (*SAME, *SHRUNK)),
        {"case": "slivers", "severity": 3.0},
        {"case": "mass-ratio", "severity": 2.0},
        {"case": "displaced", "severity": 10.0},
        {"case": "displaced", "severity": 0.1, "limit": 1e-4},
        {"case": "displaced", "severity": 0.1, "limit": 0.0},
    ],
    ids=str,
)
def test_each_is_beyond_its_limits_and_its_optimum_certified(settings):
    scene = Stress(resolution=4, **settings)
    problem = scene.problem()
    assert problem.violations(problem.target).max() > 0.05
    ((certificate, status),) = certificates(scene)
    assert (certificate.outcome, status) == ("optimal", "solved")


def test_aspects_and_mass_ratios_go_as_far_as_asked():
    widths = np.diff(Stress(severity=3.0).sheet()[0][::11, 0])
    assert widths.max() / widths.min() == pytest.approx(1e6, rel=1e-6)
    heavy = Stress(case="mass-ratio", severity=2.0, resolution=4)
    ratios = heavy.mass() / lumped_areas(*heavy.sheet()[:2])
    assert (ratios.max(), ratios.min()) == pytest.approx((1e8, 1))


def test_shrunk_candidates_are_a_point_a_line_and_inside_out():
    free = np.setdiff1d(np.arange(25), PLAIN.sheet()[3])
    x = PLAIN.sheet()[2][free]
    point, line, out = (Stress(case=c, resolution=4).sheet()[2][free] for c in SHRUNK)
    assert np.ptp(point, axis=0) == pytest.approx([0, 0, 0], abs=1e-15)
    assert np.ptp(line, axis=0) == pytest.approx([0, np.ptp(x[:, 1]), 0], abs=1e-15)
    np.testing.assert_allclose(out + x, 2 * point, atol=1e-15)


@pytest.mark.parametrize("case", SAME)
def test_the_same_cloth_in_other_numbers(case):
    scene = Stress(case=case, resolution=4)
    unit = {"millimetres": 1e3, "kilometres": 1e-3}.get(case, 1.0)
    one, other = PLAIN.problem(), scene.problem()
    assert not np.array_equal(one.target, other.target)
    stretches = [np.sort(p.stretches(p.target)) for p in (one, other)]
    np.testing.assert_allclose(*stretches, atol=1e-7)
    assert other.edge_length == pytest.approx(unit * one.edge_length)
    apart = np.linalg.norm(np.diff(other.target[other.pinned], axis=0))
    assert apart == pytest.approx(0.5 * unit)


def test_a_part_of_the_order_is_shuffled():
    scene = Stress(case="shuffled", resolution=10)
    rest = Stress(case="displaced").sheet()[0]
    moved = [
        np.mean(np.any(replace(scene, severity=s).sheet()[0] != rest, axis=1))
        for s in (0.0, 0.1, 1.0)
    ]
    assert moved[0] == 0
    assert 0 < moved[1] <= 0.1
    assert moved[2] > 0.9


def test_pins_pulled_past_the_limit_are_certified_infeasible_and_met_again():
    found = certificates(Stress(case="pulled-pins", resolution=4), 5)
    outcomes = [certificate.outcome for certificate, _ in found]
    assert outcomes == ["optimal", "no answer", "optimal", "optimal", "optimal"]
    assert found[1][1] == "infeasible"
    stuck = certificates(Stress(case="pulled-pins", resolution=4), 2, "none")[1][0]
    assert stuck.reason.startswith("infeasible: pinned vertices 0 and 20")


def test_other_cases_end_without_an_answer():
    stage = Stage.opened(Stress(resolution=4), misbehaving.NaN())
    with pytest.raises(NoAnswerError, match="not finite"):
        list(stage.steps(1))


def test_a_solver_at_fault_ends_pulled_pins_too():
    stage = Stage.opened(Stress(case="pulled-pins", resolution=4), misbehaving.Raise())
    with pytest.raises(StageError, match="by a solver"):
        list(stage.steps(4))


def test_a_sheet_falls_on_a_spike_and_is_held_by_it():
    scene = Spike(resolution=6)
    stage = Stage.opened(scene, find_solver("newton-ipm"))
    reports = list(stage.steps(100))
    heights = stage.positions[:, 1]
    assert int(np.argmax(heights)) == 24  # the middle
    assert heights.max() > -0.03 > -0.15 > heights.min()
    assert max(r.penetration for r in reports) < 1e-3


@pytest.mark.parametrize("kind", [Stress, Spike])
def test_the_easier_neighbour_is_less_severe(kind):
    assert kind().easier() == kind(severity=0.1)
    assert kind().easier().easier() is None


def test_a_wrong_severity_is_named():
    with pytest.raises(ValueError, match="severity is -1"):
        Spike(severity=-1.0)


def test_all_cases_are_known_to_the_docstring():
    assert all(case in str(Stress.__doc__) for case in CASES)


def test_playing_on_after_an_infeasible_step_repeats_the_cycle():
    seen = []
    scene = Stress(case="pulled-pins", resolution=4)
    list(islice(scene.play(lambda target: seen.append(target) or target), 5))
    pins = scene.sheet()[3]
    apart = [float(np.ptp(x[pins, 0]) / 0.5 - 1) for x in seen]
    assert apart == pytest.approx([0.0075, 0.015, 0.0075, 0, 0.0075])
