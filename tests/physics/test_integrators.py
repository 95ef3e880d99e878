"""Time stepping: orders of convergence, what the schemes share, energy and momentum."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import islice

import numpy as np
import pytest

from scenarios.swing import Swing
from strainbench.physics.body import GRAVITY
from strainbench.physics.integrators import INTEGRATORS, Motion
from strainbench.scenario.cloth import ClothScenario

OMEGA = 3.0  # [1/s] of a spring to the origin, W = 1/2 m OMEGA^2 x^2, with gravity


def spring(start, inertial, step, time):
    """The minimisation of a step for the spring, in closed form."""
    inertial = inertial + step**2 * GRAVITY
    return inertial / (1 + (step * OMEGA) ** 2)


def swing_spring(name, steps, duration=1.0):
    """Error of the last position after `duration` against the exact oscillation [m]."""
    rest = -9.81 / OMEGA**2
    motion = Motion(np.array([[0.3, 0.0, 0.0]]), np.zeros((1, 3)), 0.0)
    for _ in range(steps):
        motion = INTEGRATORS[name](motion, duration / steps, spring, lambda x: x)
    phase = np.cos(OMEGA * motion.time)
    exact = np.array([[0.3 * phase, rest * (1 - phase), 0.0]])
    return float(np.abs(motion.positions - exact).max())


@pytest.mark.parametrize(
    ("name", "order"), [("sap", 1), ("sar", 1), ("sar-projected", 1), ("bap", 2)]
)
def test_order_of_convergence_without_limits(name, order):
    errors = [swing_spring(name, n) for n in (200, 400, 800)]
    rates = np.log2(np.array(errors[:-1]) / errors[1:])
    assert rates == pytest.approx(order, abs=0.15)


@pytest.mark.parametrize("name", INTEGRATORS)
def test_time_advances_by_a_step(name):
    motion = Motion(np.zeros((1, 3)), np.zeros((1, 3)), 0.0)
    for k in range(3):
        motion = INTEGRATORS[name](motion, 0.1, spring, lambda x: x)
        assert motion.time == pytest.approx(0.1 * (k + 1))


@pytest.mark.parametrize("name", INTEGRATORS)
def test_a_cloth_at_rest_stays(name):
    """With the projection holding everything where it is, nothing gains speed but by schemes."""
    motion = Motion(np.zeros((2, 3)), np.zeros((2, 3)), 0.0)
    for _ in range(4):
        motion = INTEGRATORS[name](motion, 0.1, spring, np.zeros_like)
    assert np.abs(motion.positions).max() == 0


@pytest.mark.parametrize("name", ["sap", "sar-projected", "bap", "bar-stable"])
def test_and_has_no_velocity(name):
    motion = Motion(np.zeros((2, 3)), np.zeros((2, 3)), 0.0)
    for _ in range(4):
        motion = INTEGRATORS[name](motion, 0.1, spring, np.zeros_like)
    assert np.abs(motion.velocities).max() == 0


def test_printed_sar_leaves_a_velocity_at_rest():
    motion = Motion(np.zeros((2, 3)), np.zeros((2, 3)), 0.0)
    motion = INTEGRATORS["sar"](motion, 0.1, spring, np.zeros_like)
    assert np.abs(motion.velocities).max() > 0


@pytest.mark.parametrize("name", INTEGRATORS)
def test_projections_a_step(name):
    seen = []
    list(islice(Swing(resolution=3, integrator=name).play(lambda x: seen.append(x) or x), 4))
    per_step = {"sap": 1, "bap": 1, "constrained": 1}.get(name, 2)
    assert len(seen) == 4 * per_step


def test_energy_is_what_the_positions_say():
    scene = Swing(resolution=4)
    seen = []
    report = list(islice(scene.play(lambda x: seen.append(x) or x), 5))[-1]
    cloth = scene.cloth()
    mass = cloth.mass[:, None]
    velocity = (seen[-1] - seen[-2]) / scene.step
    assert report.kinetic_energy == pytest.approx(0.5 * np.sum(mass * velocity**2))
    assert report.gravity_energy == pytest.approx(9.81 * np.sum(mass[:, 0] * seen[-1][:, 1]))
    energies, _ = cloth.gradient(seen[-1])
    assert report.membrane_energy == energies["membrane"]
    assert report.bending_energy == energies["bending"]
    momentum = [report.momentum_x, report.momentum_y, report.momentum_z]
    assert momentum == pytest.approx(np.sum(mass * velocity, axis=0))


def test_implicit_euler_loses_energy_and_less_at_smaller_steps():
    def total(step):
        scene = Swing(resolution=4, step=step)
        reports = list(islice(scene.play(lambda x: x), round(0.5 / step)))
        r = reports[-1]
        return r.kinetic_energy + r.gravity_energy + r.membrane_energy + r.bending_energy

    coarse, fine = total(1 / 50), total(1 / 200)
    assert coarse < fine < 1e-9


@dataclass(frozen=True)
class Lifted(Swing):
    """A swing whose pins rise (a test)."""

    name = "lifted"

    def pin_positions(self, time):
        _, _, positions, pinned = self.sheet()
        return positions[pinned] + [0.0, 0.2 * time, 0.0]


def test_pins_go_where_the_scene_has_them_and_their_work_is_counted():
    scene = Lifted(resolution=4, integrator="sar", step=1 / 30)
    seen = []
    reports = list(islice(scene.play(lambda x: seen.append(x) or x), 30))
    pinned = scene.sheet()[3]
    assert seen[-1][pinned, 1] == pytest.approx(0.2)
    assert sum(r.pin_work for r in reports) > 0
    still = replace(Swing(resolution=4), step=1 / 30)
    assert sum(r.pin_work for r in islice(still.play(lambda x: x), 5)) == 0


def test_constrained_steps_do_the_same_with_pins_and_keep_within_the_limits():
    scene = Lifted(resolution=4, integrator="constrained", step=1 / 30)
    seen = []
    reports = list(islice(scene.play(lambda x: seen.append(x) or x), 30))
    assert seen[-1][scene.sheet()[3], 1] == pytest.approx(0.2)
    assert scene.problem().violations(seen[-1]).max() < 1e-7
    energies = [r.kinetic_energy + r.gravity_energy + r.membrane_energy for r in reports]
    work = np.cumsum([r.pin_work for r in reports])
    assert np.all(np.array(energies) < work + 1e-6)  # [J]; what pins do is all that comes in
    assert work[-1] > 0


def test_constrained_steps_need_sampled_directions():
    with pytest.raises(ValueError, match="integrator constrained: directions exact has none"):
        Swing(integrator="constrained", directions="exact")


def test_a_scheme_that_is_not_there_is_named():
    with pytest.raises(ValueError, match="integrator is 'rk4': valid are sap, sar"):
        Swing(integrator="rk4")
    assert issubclass(Swing, ClothScenario)
