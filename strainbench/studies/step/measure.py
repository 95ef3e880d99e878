"""How far closed loops are from the motion whose steps are constrained whole.

    strainbench step swing --solver newton-ipm,gauss-seidel --set norm=mass,unweighted \
        --set step=1/30,1/60 --set resolution=10

1. the reference: the scene with integrator=constrained, once for all cells that differ in norm,
   integrator and solver alone
2. each cell as it is; after each step the distance of the vertex that is farthest from where it is
   in the reference at the same time
3. of a few steps of each the step's residual, from positions alone
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from strainbench.arrays import FloatArray
from strainbench.bench.cell import Cell
from strainbench.physics.body import GRAVITY
from strainbench.physics.integrators import CONSTRAINED
from strainbench.referee.kkt import kkt_residual
from strainbench.scenario.cloth import ClothScenario
from strainbench.scenario.stage import UNLIMITED, Stage, StageError
from strainbench.solver.registry import find_solver

CERTIFIED = 8  # steps of a motion whose residual is computed


@dataclass(frozen=True)
class Motion:
    """Positions (n, 3) after each step [m], those at the start first; why there are no more."""

    positions: list[FloatArray]
    note: str = ""


@dataclass(frozen=True)
class Distance:
    """A cell beside the reference.

    Parameters
    ----------
    scene : what the scene has besides step, norm and integrator
    step : [s]
    steps : that both have
    largest_mm, mean_mm, last_mm : over time, of the farthest vertex
    step_residual : median over a few steps of the cell's motion
    reference_residual : the largest of the reference's
    """

    scene: str
    solver: str
    norm: str
    integrator: str
    step: float
    steps: int
    largest_mm: float
    mean_mm: float
    last_mm: float
    step_residual: float
    reference_residual: float
    note: str
    over_time: list[float] = field(default_factory=list)

    @property
    def method(self) -> str:
        """Solver and norm, and the integrator where it is not step-and-project."""
        scheme = "" if self.integrator == "sap" else f", {self.integrator}"
        return f"{self.solver} [{self.norm}{scheme}]"


def measure(cells: Sequence[Cell]) -> Iterator[Distance]:
    """A row a cell, in order.

    Raises
    ------
    ValueError
        In one line: a solver that is unavailable, a scene that has no time steps of cloth or
        cannot be constrained, a reference that ends before its time.
    """
    known: dict[str, tuple[Motion, float]] = {}
    for cell in cells:
        if cell.solver.unavailable:
            raise ValueError(cell.solver.unavailable)
        scene = cell.scenario.scenario()
        reference = reference_of(scene)
        key = json.dumps([reference.name, reference.parameters, cell.steps], default=str)
        if key not in known:
            motion = play(reference, UNLIMITED, cell)
            if motion.note:
                raise ValueError(f"{reference.label}: {motion.note}")
            known[key] = motion, max(residuals(reference, motion), default=np.nan)
        yield beside(cell, *known[key])


def reference_of(scene: object) -> ClothScenario:
    """The same scene with its steps constrained whole; the norm plays no part in it."""
    if not isinstance(scene, ClothScenario):
        name = getattr(scene, "name", scene)
        raise ValueError(f"{name} has no time steps of a cloth; swing is valid, for one")
    return replace(scene, integrator=CONSTRAINED, norm="mass")


def play(scene: ClothScenario, solver: str | None, cell: Cell) -> Motion:
    """A scene's motion with a solver by name, or with the cell's own."""
    method = find_solver(solver) if solver else cell.solver.solver()
    try:
        stage = Stage.opened(scene, method, cell.tolerance)
    except StageError as error:
        raise ValueError(str(error)) from None
    positions = [scene.sheet()[2]]
    try:
        for _ in stage.steps(cell.steps):
            positions.append(stage.positions)
    except StageError as error:  # a failing solver is data here too
        return Motion(positions, f"{error.who} ended it in step {stage.step}: {error}")
    return Motion(positions)


def beside(cell: Cell, motion: Motion, certified: float) -> Distance:
    """The row of a cell; `motion` is the reference's, `certified` its residual."""
    scene = cell.scenario.scenario()
    assert isinstance(scene, ClothScenario)
    mine = play(scene, None, cell)
    pairs = list(zip(mine.positions, motion.positions, strict=False))[1:]
    apart = [1000 * float(np.linalg.norm(x - y, axis=1).max()) for x, y in pairs]
    found = residuals(scene, mine)
    return Distance(
        scene=without_step(scene),
        solver=cell.solver.label,
        norm=scene.norm,
        integrator=scene.integrator,
        step=scene.step,
        steps=len(apart),
        largest_mm=max(apart, default=np.nan),
        mean_mm=float(np.mean(apart)) if apart else np.nan,
        last_mm=apart[-1] if apart else np.nan,
        step_residual=float(np.median(found)) if found else np.nan,
        reference_residual=certified,
        note=mine.note,
        over_time=apart,
    )


def without_step(scene: ClothScenario) -> str:
    """What to call it, whatever its step, norm and integrator."""
    kind = type(scene)
    return replace(scene, step=kind.step, norm=kind.norm, integrator=kind.integrator).label


def residuals(scene: ClothScenario, motion: Motion) -> list[float]:
    """The step's residual at a few evenly spaced steps of a motion, its last among them.

    The first is not: from rest, forces are hardly larger than what the step leaves of them.
    """
    last = len(motion.positions) - 1
    first = max(2.0, last / CERTIFIED)
    chosen = sorted({round(k) for k in np.linspace(first, last, CERTIFIED)}) if last > 1 else []
    residual = certifier(scene)
    return [residual(k * scene.step, *motion.positions[k - 2 : k + 1]) for k in chosen]


def certifier(
    scene: ClothScenario,
) -> Callable[[float, FloatArray, FloatArray, FloatArray], float]:
    """Of a scene, the function of a time and three positions that is the last step's residual.

    The force F = M (x - x~)/h^2 + grad W(x) at the free vertices, x~ from the two positions
    before, is to be balanced by forces of the limits that x reaches. What the best multipliers
    leave of it, in the norm of M^-1 and relative to it, is the KKT residual of the projection of
    x - c M^-1 F in the norm of the masses for any c > 0. With c of an edge for each g_0, forces
    below a thousandth of the weight count as that large.
    """
    cloth, h = scene.cloth(), scene.step
    problem = replace(scene.problem(), mass=cloth.mass)
    mass, free = cloth.mass[:, None], problem.free

    def residual(time: float, before: FloatArray, last: FloatArray, x: FloatArray) -> float:
        v = (last - before) / h if "inertia" in scene.needs else np.zeros_like(x)
        force = cloth.potential(x)[1] + mass * (x - last - h * v) / h**2
        if (push := scene.force(last, v, time)) is not None:
            force -= push
        move = np.zeros_like(x)
        move[free] = (force / mass)[free] * problem.edge_length / np.linalg.norm(GRAVITY)
        return kkt_residual(problem.with_target(x - move), x)

    return residual
