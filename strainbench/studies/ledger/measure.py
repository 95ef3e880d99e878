"""The model ledger: what a scene models, and what each part of its physics changes in the answer.

    strainbench ledger swing flag --set resolution=10 --steps 60 --results results/local/ledger

1. play the scene as it is
2. play it again with a hundredth of the tolerance, and with another exact solver: what these two
   controls change is the solvers' own difference
3. play it with each part added that it does not need, and with each left out that it needs
4. compare positions and energy after the last step that both have, and the time of a step
5. a verdict a part: needed, or wrong to leave out, if it moves the cloth by more than the controls
   do; else negligible at this size

Left out, inertia means that each step starts at rest. Added, contact is a floor beyond the reach
of the sheet. A scene without physics gets an implicit Euler step of the added part alone on each
candidate that it proposes, with the constants of `Material`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from statistics import median
from time import thread_time

import numpy as np

from strainbench.arrays import FloatArray
from strainbench.bench.cell import Cell
from strainbench.physics.body import gravity_of
from strainbench.physics.cloth import Cloth, Material
from strainbench.physics.energies.contact import Contact, Floor
from strainbench.physics.implicit_euler import NewtonSettings, minimise_step
from strainbench.referee.reference import reference_of
from strainbench.scenario.cloth import ClothScenario
from strainbench.scenario.registry import find_scenario, list_scenarios
from strainbench.scenario.scenario import Scenario, SheetScenario
from strainbench.scenario.stage import Stage, StageError, Who
from strainbench.scenario.volume import VolumeScenario
from strainbench.solver.registry import find_solver
from strainbench.solver.solver import Solver

PARTS = ("inertia", "gravity", "membrane", "bending", "contact", "wind")
CONTROL = 0.01  # of the tolerance
EXACT = "clarabel", "newton-ipm"  # another one than the ledger's is the second control
NEEDED, WRONG, NEGLIGIBLE = "needed", "wrong to leave out", "negligible at this size"
ELSEWHERE, OMITTED = "no part of it: it has no physics", "no part of what it models"
FLOOR = Contact(10.0, 5e-3, (Floor(-1.0),))
"""Below the reach of all sheets of our scenes: half a metre and their limit from y = 0."""
AS_IT_IS = "as it is"
MEANINGLESS = {
    "inertia": "no time passes in it",
    "contact": "its method knows no contact",
    "wind": "it states no wind",
}


@dataclass(frozen=True)
class Row:
    """A scene with certain parts, beside the scene as it is; None where there is no such number."""

    scene: str
    cells: int
    change: str
    needs: str
    variables: int | None = None
    constraints: int | None = None
    active: int | None = None  # at the reference of the last projection
    nonzeros: int | None = None  # of the constraints
    hessian_nonzeros: int | None = None  # of the energy, in the lower triangle
    newton_iterations: int | None = None
    newton_failures: int | None = None
    compared_after: int | None = None  # steps
    distance_mm: float | None = None  # of the vertex that is farthest from where it was
    distance_edges: float | None = None  # the same in mean edge lengths
    energy_mj: float | None = None  # more than as it is, both counted with the scene's own parts
    note: str = ""
    time_share: float | None = None  # of a step with the part, in processor time
    added_nonzeros: int | None = None  # of the energy's Hessian, by the part
    verdict: str = ""


def of_cloth() -> list[str]:
    """Our scenes but those of volumes, whose limits the solvers of cloth do not take."""
    names = (entry.name for entry in list_scenarios())
    return [name for name in names if not issubclass(find_scenario(name), VolumeScenario)]


def account(cell: Cell) -> Iterator[Row]:
    """The rows of a cell's scene, as they are measured."""
    scene, solver = cell.scenario.scenario(), cell.solver.solver()
    base = Run(scene, solver, cell.tolerance).play(cell.steps)
    yield compared(AS_IT_IS, base, base)
    control = Run(scene, solver, CONTROL * cell.tolerance)
    controls = [compared("tolerance / 100", control.play(cell.steps), base), another(cell, base)]
    yield from controls
    noise = max((row.distance_mm for row in controls if row.distance_mm is not None), default=0.0)
    for part in PARTS:
        change = f"without {part}" if part in scene.needs else f"with {part}"
        if reason := meaningless(scene, part):
            yield replace(empty(scene, change), note=reason)
            continue
        run = changed(scene, part, solver, cell.tolerance).play(cell.steps)
        yield judged(compared(change, run, base), scene, part, noise, run, base)


def another(cell: Cell, base: Run) -> Row:
    """The scene as it is, solved by another exact solver than the cell's."""
    name = next(name for name in EXACT if name != cell.solver.name)
    try:
        run = Run(base.scene, find_solver(name), cell.tolerance)
    except StageError as error:
        return replace(empty(base.scene, f"solver {name}"), note=str(error))
    return compared(f"solver {name}", run.play(cell.steps), base)


def judged(row: Row, scene: Scenario, part: str, noise: float, run: Run, base: Run) -> Row:
    """A part's row with what it costs and whether the scene can do without it.

    Parameters
    ----------
    noise : what the solvers' own differences move [mm]
    run, base : the scene changed, and as it is
    """
    if row.distance_mm is None:
        return row
    with_it, without = (base, run) if part in scene.needs else (run, base)
    return replace(
        row,
        time_share=1 - median(without.times) / median(with_it.times),
        added_nonzeros=with_it.nonzeros - without.nonzeros,
        verdict=verdict(row.distance_mm, noise, scene, part),
        note="; ".join(filter(None, [row.note, scene.omits.get(part, "")])),
    )


def verdict(moved: float, noise: float, scene: Scenario, part: str) -> str:
    """Whether a scene can do without a part that moves it by so much; both in mm."""
    if moved <= noise:
        return NEGLIGIBLE
    if not scene.needs:
        return ELSEWHERE
    if part in scene.omits:
        return OMITTED
    return NEEDED if part in scene.needs else WRONG


def meaningless(scene: Scenario, part: str) -> str:
    """Why a scene cannot have a part that it does not need, or ""."""
    if part in scene.needs:
        return ""
    has_clock, is_sheet = hasattr(scene, "step"), isinstance(scene, SheetScenario)
    possible = {"inertia": has_clock, "contact": is_sheet, "wind": False}
    return "" if possible.get(part, True) else MEANINGLESS[part]


def changed(scene: Scenario, part: str, solver: Solver, tolerance: float) -> Run:
    """The scene without `part` where it needs it, else with it."""
    if isinstance(scene, SheetScenario) and not isinstance(scene, ClothScenario):
        return Run(scene, solver, tolerance, Added(scene, part))
    own: dict[str, object] = {"needs": scene.needs ^ {part}}
    if part == "contact":
        obstacles = None if part in scene.needs else FLOOR
        own["contact"] = lambda _: obstacles
    if part == "wind":
        own["force"] = ClothScenario.force
    kind = type(type(scene).__name__, (type(scene),), own)
    return Run(kind(**scene.parameters), solver, tolerance)


class Added:
    """One part of physics, as implicit Euler steps, for a sheet that has none of its own."""

    def __init__(self, scene: SheetScenario, part: str) -> None:
        rest, elements, self.before, pinned = scene.sheet()
        contact = FLOOR if part == "contact" else None
        material, gravity = Material().only({part}), gravity_of({part})
        self.cloth = Cloth(rest, elements, material, pinned, contact, gravity)
        self.step: float = getattr(scene, "step", 1 / 60)
        self.inertia = float(part == "inertia")
        self.velocities = np.zeros_like(self.before)
        self.iterations, self.failures = 0, 0

    def candidate(self, x: FloatArray) -> FloatArray:
        """Where the scene's candidate x (n, 3) goes in a step."""
        h = self.step
        inertial = x + self.inertia * h * self.velocities
        found, report = minimise_step(self.cloth, x, inertial, h, NewtonSettings())
        self.iterations += report.iterations
        self.failures += not report.converged
        return found

    def keep(self, x: FloatArray) -> None:
        """Remember how far the step has come."""
        self.velocities = (x - self.before) / self.step
        self.before = x


class Run:
    """A scene played with one solver: positions, kinetic energies, what Newton's method did."""

    def __init__(
        self, scene: Scenario, solver: Solver, tolerance: float, added: Added | None = None
    ) -> None:
        self.scene, self.added = scene, added
        self.stage = Stage.opened(scene, solver, tolerance)
        self.positions: list[FloatArray] = []
        self.kinetic: list[float] = []
        self.iterations, self.failures = 0, 0
        self.times: list[float] = []  # of steps, this thread's processor time [s]
        self.note = ""

    def play(self, steps: int) -> Run:
        """So many steps, or as many as have an answer; the run itself."""
        begin = thread_time()
        try:
            for report in self.stage.steps(steps, self._project):
                self.positions.append(self.stage.positions)
                self.kinetic.append(report.kinetic_energy)
                self.iterations += report.newton_iterations
                self.failures += not report.newton_converged
                self.times.append(thread_time() - begin)
                begin = thread_time()
        except StageError as error:  # a failing solver is data here too
            ended = "no answer" if error.who is Who.SOLVER else f"{error.who} ended"
            self.note = f"{ended} in step {self.stage.step}: {error}"
        return self

    def _project(self, target: FloatArray) -> FloatArray:
        if self.added is None:
            return self.stage.project(target)
        answer = self.stage.project(self.added.candidate(target))
        self.added.keep(answer)
        return answer

    @property
    def cloth(self) -> Cloth | None:
        """The energies that candidates come from, if any."""
        make: Callable[[], Cloth] | None = getattr(self.scene, "cloth", None)
        if make:
            return make()
        return self.added.cloth if self.added else None

    @property
    def nonzeros(self) -> int:
        """Of the energies' Hessian, in the lower triangle."""
        return len(self.cloth.pattern.indices) if self.cloth else 0


def energy(run: Run, base: Run, step: int) -> float | None:
    """Of `run` after a step [J]; its potential is that of `base`, so that both are comparable."""
    cloth, x = base.cloth, run.positions[step]
    if cloth is None:
        return None
    return run.kinetic[step] + sum(cloth.potential(x)[0].values())


def empty(scene: Scenario, change: str) -> Row:
    """A row without a measurement."""
    needs = ", ".join(sorted(scene.needs)) or "none"
    return Row(scene.name, scene.resolution, change, needs)


def compared(change: str, run: Run, base: Run) -> Row:
    """The row of a run."""
    problem, cloth, added = run.stage.problem, run.cloth, run.added
    row = replace(
        empty(base.scene, change),
        variables=3 * len(problem.free),
        constraints=problem.constraints,
        nonzeros=3 * problem.G.nnz,
        hessian_nonzeros=run.nonzeros if cloth else None,
        newton_iterations=run.iterations + (added.iterations if added else 0),
        newton_failures=run.failures + (added.failures if added else 0),
        note=run.note,
    )
    steps = min(len(run.positions), len(base.positions))
    if steps == 0:
        return row
    moved = run.positions[steps - 1] - base.positions[steps - 1]
    distance = float(np.linalg.norm(moved, axis=1).max())
    mine, reference = (energy(r, base, steps - 1) for r in (run, base))
    return replace(
        row,
        active=reference_of(run.stage.frame).active_constraints,
        compared_after=steps,
        distance_mm=1000 * distance,
        distance_edges=distance / problem.edge_length,
        energy_mj=1000 * (mine - reference) if mine is not None and reference is not None else None,
    )
