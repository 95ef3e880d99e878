"""The step within limits: its cost, its answers, and what it keeps."""

from __future__ import annotations

from dataclasses import replace
from itertools import islice, pairwise

import numpy as np
import pytest
from scipy.optimize import minimize

from scenarios.stretch_square import StretchSquare
from scenarios.swing import Swing
from strainbench import StretchLimits
from strainbench.physics.constrained import LAST, PROJECTED, constrained_step, projected
from strainbench.physics.constrained.iterate import Iteration, LimitSettings
from strainbench.physics.implicit_euler import NewtonSettings, minimise_step
from strainbench.scenario.stage import Stage, StageError
from strainbench.solver.registry import find_solver
from strainbench.solver.solver import run_solver

STRICT = LimitSettings(tolerance=1e-9)


class Motion:
    """A swing, stepped."""

    def __init__(self, scene, settings=None):
        self.scene, self.settings = scene, settings
        self.cloth, self.problem = scene.cloth(), scene.problem()
        self.x = scene.sheet()[2]
        self.v = np.zeros_like(self.x)

    def steps(self, number):
        return [self.step() for _ in range(number)]

    def step(self):
        x, report = self.at(self.x)
        self.v, self.x = (x - self.x) / self.scene.step, x
        return report

    def at(self, start):
        """The answer of the next step, from a start."""
        h = self.scene.step
        inertial = self.x + h * self.v
        return constrained_step(self.cloth, self.problem, start, inertial, h, self.settings)

    @property
    def energy(self):
        kinetic = 0.5 * np.sum(self.cloth.mass[:, None] * self.v**2)
        return kinetic + sum(self.cloth.potential(self.x)[0].values())


def moving(steps=10, settings=STRICT, **fields):
    """A swing on its way."""
    motion = Motion(Swing(**{"resolution": 4, "step": 1 / 30} | fields), settings)
    motion.steps(steps)
    return motion


@pytest.mark.parametrize(
    ("limit", "rate", "mean"),
    [
        (0.01, 20, 7.8),
        (0.001, 20, 8.9),
        pytest.param(0.01, 60, 6.9, marks=pytest.mark.slow),
        pytest.param(0.001, 60, 8.3, marks=pytest.mark.slow),
    ],
)
def test_factorisations_a_step(limit, rate, mean):
    """Measured by another program, to 1; over a second."""
    motion = Motion(Swing(resolution=10, limit=limit, step=1 / rate))
    reports = motion.steps(rate)
    assert all(report.converged and report.start == LAST for report in reports)
    assert np.mean([report.factorisations for report in reports]) == pytest.approx(mean, abs=1)


def test_it_is_the_minimum_that_a_general_method_finds():
    motion = moving(6, resolution=2)
    cloth, problem, h = motion.cloth, motion.problem, motion.scene.step
    free = cloth.pattern.free
    found, _ = motion.at(motion.x)
    inertial = motion.x + h * motion.v + h**2 * cloth.gravity
    inertia = cloth.mass[:, None] / h**2

    def placed(z):
        x = motion.x.copy()
        x[free] = z.reshape(-1, 3)
        return x

    def phi(z):
        values, gradient = cloth.gradient(placed(z))
        apart = placed(z) - inertial
        value = sum(values.values()) + 0.5 * np.sum(inertia * apart**2)
        return 1e3 * value, 1e3 * (gradient + inertia * apart)[free].ravel()

    def room(z):
        return problem.bounds**2 - np.sum((problem.G @ placed(z)) ** 2, axis=1)

    def slopes(z):
        G, y = problem.G.toarray()[:, free], problem.G @ placed(z)
        return -2 * (G[:, :, None] * y[:, None, :]).reshape(len(y), -1)

    within = {"type": "ineq", "fun": room, "jac": slopes}
    options = {"maxiter": 500, "ftol": 1e-12}
    first = motion.x[free].ravel()
    other = minimize(phi, first, jac=True, method="SLSQP", constraints=within, options=options)
    assert other.success or other.status == 8  # to rounding no descent is left
    assert np.any(room(other.x) < 1e-6), "no limit plays a part"
    assert np.abs(placed(other.x) - found).max() < 1e-7  # [m]


def test_starts_lead_to_one_answer():
    motion = moving(10, settings=None, resolution=6, step=1 / 60)
    phi = Iteration(
        motion.cloth,
        motion.problem,
        motion.x + motion.scene.step * motion.v,
        motion.scene.step,
        LimitSettings(),
        motion.cloth.linear_solver,
    )
    rest = motion.scene.sheet()[2]
    projection = projected(phi, motion.x, motion.x + motion.scene.step * motion.v)
    answers = [motion.at(start)[0] for start in (motion.x, projection, 0.5 * (motion.x + rest))]
    for other in answers[1:]:
        assert np.abs(other - answers[0]).max() < 3e-6  # [m]


def test_energy_never_rises():
    motion = Motion(Swing(resolution=6, step=1 / 60))
    energies = [motion.energy]
    for _ in range(30):
        motion.step()
        energies.append(motion.energy)
    assert all(after < before + 1e-9 for before, after in pairwise(energies))  # [J]
    assert energies[-1] < energies[0] - 1e-3


def test_a_free_sheet_keeps_its_momentum():
    motion = moving(8)
    none = np.array([], dtype=np.int64)
    motion.cloth = replace(motion.cloth, pinned=none)
    motion.problem = replace(motion.problem, pinned=none)
    mass, h = motion.cloth.mass[:, None], motion.scene.step
    before = np.sum(mass * motion.v, axis=0)
    _ = [motion.step() for _ in range(3)]
    gained = np.sum(mass * motion.v, axis=0) - before - 3 * h * mass.sum() * motion.cloth.gravity
    assert np.abs(gained).max() < 1e-9 * mass.sum() * 9.81 * h


def test_its_projection_is_the_one_in_the_mass_norm():
    motion = moving(10, resolution=6, step=1 / 60)
    h, linear = motion.scene.step, motion.cloth.linear_solver
    phi = Iteration(motion.cloth, motion.problem, motion.x, h, STRICT, linear)
    inertial = motion.x + h * motion.v
    candidate, _ = minimise_step(motion.cloth, motion.x, inertial, h, NewtonSettings())
    problem = replace(motion.problem, mass=motion.cloth.mass).with_target(candidate)
    assert problem.violations(candidate).max() > 1e-4
    solver = find_solver("newton-ipm")
    exact = run_solver(solver, problem, solver.prepare(problem), 1e-9).positions
    assert np.abs(projected(phi, motion.x, inertial) - exact).max() < 2e-6  # [m]


def test_without_progress_it_starts_again_from_the_projection():
    jammed = Motion(Swing(resolution=10, step=1 / 5), LimitSettings(first_mu=0.1))
    report = jammed.step()
    assert report.converged
    assert report.start == PROJECTED


def test_what_is_unsolved_is_no_answer():
    motion = moving(4)
    motion.settings = LimitSettings(max_iterations=1)
    x, report = motion.at(motion.x)
    assert not report.converged
    assert report.reason.count("1 iterations") == 2
    assert np.all(np.isnan(x))


def test_and_ends_the_motion(monkeypatch):
    import strainbench.physics.constrained as package

    monkeypatch.setattr(package, "LimitSettings", lambda: LimitSettings(max_iterations=1))
    scene = Swing(resolution=3, integrator="constrained")
    with pytest.raises(StageError, match="the constrained step is unsolved: from the last"):
        list(Stage.opened(scene, find_solver("none")).steps(3))


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"limits": StretchLimits.exact(1.01)}, "limits: the constrained step takes sampled"),
        (
            {"limits": StretchLimits([[1.0, 0.0]], [1.1], lower=[0.9])},
            "limits.lower: the constrained step has no form",
        ),
        ({"pinned": [0]}, "pinned: the problem's pins are not the body's"),
    ],
)
def test_what_it_cannot_do_is_one_line(change, reason):
    motion = Motion(Swing(resolution=3))
    motion.problem = replace(motion.problem, **change)
    with pytest.raises(ValueError, match=reason):
        motion.step()


def test_pins_too_far_apart_are_one_line():
    motion = Motion(Swing(resolution=3))
    apart = motion.x.copy()
    apart[motion.cloth.pinned[0], 2] -= 0.1
    with pytest.raises(ValueError, match="pin"):
        motion.at(apart)
    with pytest.raises(ValueError, match="start: shape"):
        motion.at(motion.x[1:])


def test_solvers_that_project_are_not_taken():
    scene = Swing(resolution=3, integrator="constrained")
    with pytest.raises(StageError, match="it takes no projection; the solver none alone"):
        Stage.opened(scene, find_solver("newton-ipm"))
    reports = list(Stage.opened(scene, find_solver("none")).steps(5))
    assert len(reports) == 5
    assert all(report.newton_converged for report in reports)
    assert StretchSquare().projects


def test_it_differs_from_step_and_project():
    scenes = [Swing(resolution=4, norm="mass", integrator=name) for name in ("sap", "constrained")]
    ends = []
    for scene, solver in zip(scenes, ("newton-ipm", "none"), strict=True):
        stage = Stage.opened(scene, find_solver(solver))
        list(islice(stage.steps(20), 20))
        ends.append(stage.positions)
    apart = np.linalg.norm(ends[0] - ends[1], axis=1).max()
    assert 1e-4 < apart < 0.05  # [m]
