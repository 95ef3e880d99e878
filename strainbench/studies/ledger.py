"""The model ledger: what a scene models, and what each part of its physics changes in the answer.

    strainbench ledger swing flag --set resolution=10 --steps 60 --results results/local/ledger

1. play the scene as it is
2. play it again with a hundredth of the tolerance: what this control changes is noise
3. play it with each part added that it does not need, and with each left out that it needs
4. compare positions and energy after the last step that both have

Left out, inertia means that each step starts at rest. Added, contact is a floor beyond the reach
of the sheet. A scene without physics gets an implicit Euler step of the added part alone on each
candidate that it proposes, with the constants of `Material`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd

from strainbench.arrays import FloatArray
from strainbench.bench.cell import Cell
from strainbench.bench.machine import describe_machine
from strainbench.bench.records import open_folder, remember_machine
from strainbench.document import Column, Document, Prose, Table
from strainbench.document.writers import csv, markdown
from strainbench.files import locked, write_whole
from strainbench.physics.cloth import Cloth, Material
from strainbench.physics.energies.contact import Contact, Floor
from strainbench.physics.implicit_euler import GRAVITY, NewtonSettings, minimise_step
from strainbench.physics.statics import potential
from strainbench.referee.reference import reference_of
from strainbench.render.film import Track, untracked
from strainbench.scenario.cloth import ClothScenario
from strainbench.scenario.scenario import Scenario, SheetScenario
from strainbench.solver.solver import Solver, run_solver

PARTS = ("inertia", "gravity", "membrane", "bending", "contact", "wind")
CONTROL = 0.01  # of the tolerance
FLOOR = Contact(10.0, 5e-3, (Floor(-1.0),))
"""Below the reach of all sheets of our scenes: half a metre and their limit from y = 0."""
AS_IT_IS = "as it is"
MODELS = (
    *("scene", "needs", "cells", "variables", "constraints", "active"),
    *("non-zeros of the constraints", "of the energy's Hessian", "Newton iterations"),
)
EFFECTS = (
    *("scene", "change", Column("farthest vertex", "mm", ".2g")),
    *(Column("in edge lengths", form=".2g"), Column("energy", "mJ", ".2g"), "active"),
    *("Hessian's non-zeros", "Newton iterations", "after step", ""),
)
EXPLANATION = (
    "How far the farthest vertex is from where it is in the scene as it is, and how much more "
    "energy the scene's own parts count (so a part left out is counted in both). Changes no larger "
    "than that of a hundredth of the solver's tolerance say nothing."
)
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


def ledger(cell: Cell) -> Iterator[Row]:
    """The rows of a cell's scene, as they are measured."""
    scene, solver = cell.scenario.scenario(), cell.solver.solver()
    base = Run(scene, solver, cell.tolerance).play(cell.steps)
    yield compared(AS_IT_IS, base, base)
    control = Run(scene, solver, CONTROL * cell.tolerance)
    yield compared("tolerance / 100", control.play(cell.steps), base)
    for part in PARTS:
        change = f"without {part}" if part in scene.needs else f"with {part}"
        if reason := meaningless(scene, part):
            yield replace(empty(scene, change), note=reason)
        else:
            other = changed(scene, part, solver, cell.tolerance)
            yield compared(change, other.play(cell.steps), base)


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
        self.cloth = Cloth(rest, elements, Material().only({part}), pinned, contact)
        self.step: float = getattr(scene, "step", 1 / 60)
        self.gravity = GRAVITY if part == "gravity" else np.zeros(3)
        self.inertia = float(part == "inertia")
        self.velocities = np.zeros_like(self.before)
        self.iterations, self.failures = 0, 0

    def candidate(self, x: FloatArray) -> FloatArray:
        """Where the scene's candidate x (n, 3) goes in a step."""
        h = self.step
        inertial = x + self.inertia * h * self.velocities + h**2 * self.gravity
        found, report = minimise_step(self.cloth, x, inertial, h, NewtonSettings())
        self.iterations += report.iterations
        self.failures += not report.converged
        return found

    def keep(self, x: FloatArray) -> None:
        """Remember how far the step has come."""
        self.velocities = (x - self.before) / self.step
        self.before = x


class NoAnswer(Exception):  # noqa: N818
    """Ends a run early, with what the solver says."""


class Run:
    """A scene played with one solver: positions, kinetic energies, what Newton's method did."""

    def __init__(
        self, scene: Scenario, solver: Solver, tolerance: float, added: Added | None = None
    ) -> None:
        self.scene, self.solver, self.tolerance, self.added = scene, solver, tolerance, added
        self.problem = self.last = scene.problem()
        if refusal := solver.supports(self.problem):
            raise ValueError(f"{solver.label} cannot take {scene.name}: {refusal}")
        self.state = solver.prepare(self.problem)
        self.positions: list[FloatArray] = []
        self.kinetic: list[float] = []
        self.iterations, self.failures = 0, 0
        self.note = ""

    def play(self, steps: int) -> Run:
        """So many steps, or as many as have an answer; the run itself."""
        playing = self.scene.play(self._project)
        for k in range(1, steps + 1):
            try:
                report = next(playing)
            except NoAnswer as answer:
                self.note = f"no answer in step {k}: {answer}"
                break
            self.positions.append(self._answer)
            self.kinetic.append(report.kinetic_energy)
            self.iterations += report.newton_iterations
            self.failures += not report.newton_converged
        return self

    def _project(self, target: FloatArray) -> FloatArray:
        if self.added:
            target = self.added.candidate(target)
        problem = self.problem.with_target(target)
        try:
            solution = run_solver(self.solver, problem, self.state, self.tolerance)
        except Exception as error:  # a failing solver is data here too
            raise NoAnswer(f"{type(error).__name__}: {error}") from error
        if not np.all(np.isfinite(solution.positions)):
            raise NoAnswer(str(solution.status))
        if self.added:
            self.added.keep(solution.positions)
        self.last, self._answer = problem, solution.positions
        return solution.positions

    @property
    def cloth(self) -> Cloth | None:
        """The energies that candidates come from, if any."""
        make: Callable[[], Cloth] | None = getattr(self.scene, "cloth", None)
        if make:
            return make()
        return self.added.cloth if self.added else None


def energy(run: Run, base: Run, step: int) -> float | None:
    """Of `run` after a step [J]; its potential is that of `base`, so that both are comparable."""
    cloth, x = base.cloth, run.positions[step]
    if cloth is None:
        return None
    gravity = GRAVITY if "gravity" in base.scene.needs else np.zeros(3)
    contact = cloth.add_contact_gradient(x, np.zeros_like(x))
    return run.kinetic[step] + sum(potential(cloth, x, gravity)[:3]) + contact


def empty(scene: Scenario, change: str) -> Row:
    """A row without a measurement."""
    needs = ", ".join(sorted(scene.needs)) or "none"
    return Row(scene.name, scene.resolution, change, needs)


def compared(change: str, run: Run, base: Run) -> Row:
    """The row of a run."""
    problem, cloth, added = run.problem, run.cloth, run.added
    row = replace(
        empty(base.scene, change),
        variables=3 * len(problem.free),
        constraints=problem.constraints,
        nonzeros=3 * problem.G.nnz,
        hessian_nonzeros=len(cloth.pattern.indices) if cloth else None,
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
        active=reference_of(run.last).active_constraints,
        compared_after=steps,
        distance_mm=1000 * distance,
        distance_edges=distance / problem.edge_length,
        energy_mj=1000 * (mine - reference) if mine is not None and reference is not None else None,
    )


def write_ledger(cells: Sequence[Cell], folder: Path, track: Track = untracked) -> list[Path]:
    """The ledger of the scenes of `cells`: ledger.csv, ledger.md and machines.json.

    Raises
    ------
    ValueError
        In one line: a solver that is unavailable or does not take a scene.
    """
    open_folder(folder)
    for cell in cells:
        if cell.solver.unavailable:
            raise ValueError(cell.solver.unavailable)
    plays = (row for cell in cells for row in ledger(cell))
    name, facts = describe_machine(1)
    first = cells[0]
    about = f"{first.steps} steps, {first.solver.label}, tolerance {first.tolerance:g}; {name}."
    paths = [folder / "ledger.csv", folder / "ledger.md"]
    with locked(folder):
        rows = list(track(plays, "playing", len(cells) * (2 + len(PARTS))))
        remember_machine(folder, name, facts)
        table = pd.DataFrame([asdict(row) for row in rows]).convert_dtypes()
        write_whole(paths[0], csv(Table.of(table)).encode())
        write_whole(paths[1], as_markdown(rows, about).encode())
    return paths


def as_markdown(rows: list[Row], about: str) -> str:
    """What each scene models, then what each part changes."""
    models = [
        (r.scene, r.needs, r.cells, r.variables, r.constraints, r.active, *_sparsity(r))
        for r in rows
        if r.change == AS_IT_IS
    ]
    effects = [
        (r.scene, r.change, r.distance_mm, r.distance_edges, r.energy_mj, *_effort(r))
        for r in rows
        if r.change != AS_IT_IS
    ]
    changes = Table("What each part changes", EFFECTS, effects, Prose(EXPLANATION))
    return markdown(Document("Model ledger", [about, Table("", MODELS, models), changes]))


def _sparsity(row: Row) -> tuple[int | None, int | None, int | None]:
    return row.nonzeros, row.hessian_nonzeros, row.newton_iterations


def _effort(row: Row) -> tuple[object, ...]:
    failures = f"; Newton fails on {row.newton_failures} steps" if row.newton_failures else ""
    return (
        row.active,
        row.hessian_nonzeros,
        row.newton_iterations,
        row.compared_after,
        (row.note + failures).removeprefix("; "),
    )
