"""What the referee says of answers of the tables of stability: residuals, no optima.

Limits on principal stretches are not convex: no answer is certified as optimal, and none is ranked
by its objective, as those that violate limits have lower ones.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from itertools import islice

import numpy as np

from strainbench.arrays import FloatArray
from strainbench.problem.principal import PrincipalLimits
from strainbench.problem.principal_rows import SEPARATION
from strainbench.problem.problem import Problem
from strainbench.referee import certify
from strainbench.referee.kkt import smallest_gap
from strainbench.referee.reference import Reference
from strainbench.scenario.stage import Stage, StageError
from strainbench.solver.registry import find_solver
from strainbench.studies.volumes import pressed_past, repeated, violation
from strainbench.studies.volumes.march import in_metric, march
from strainbench.studies.volumes.part import Cell, Part, Plan, numbers, scene_of

STEP = 5e-3  # [s]
BEAMS = {"beam, 4%": violation.USUAL, "beam, 2%": violation.TIGHT}
FINGERS = {f"finger, {press}, 2.5 mm": press for press in pressed_past.PRESSES}
Answers = Iterator[tuple[Problem, FloatArray]]
"""Frames with finite answers."""


@dataclass(frozen=True)
class Certified:
    """An answer of a play."""

    case: str
    material: str
    method: str
    step: int
    steps: int  # with an answer
    outcome: str  # the referee's
    violation: float | None
    residual: float | None  # of the KKT conditions, in the norm of the metric
    gap: float | None  # of singular values where limits are active; None where none is
    reading: str  # of singular values, by which it is judged


def cells(plan: Plan) -> Iterable[Cell]:
    """Beams and starts by methods that take their limits, and fingers past them."""
    for material, method, _ in violation.tight_cells(plan):
        for case in (*BEAMS, *repeated.STARTS):
            yield case, material, method
    for case in FINGERS:
        for method in pressed_past.METHODS:
            yield case, "anisotropic", method


def answers(case: str, material: str, method: str) -> Answers:
    """Of the play that its own table is of, as far as it comes."""
    if case in repeated.STARTS:
        return _of_start(case, material, method)
    given: dict[str, object] = {"material": material, "step": STEP}
    if case in BEAMS:
        given |= {"limit": BEAMS[case], "alpha": 0.0}
        return _of_scene("beam", method, round(violation.LASTS / STEP), given)
    depth = 1e-3 * max(pressed_past.DEPTHS)
    given |= {"press": FINGERS[case], "friction": 0.0, "depth": depth}
    return _of_scene("finger", method, None, given)


def _of_scene(name: str, method: str, steps: int | None, settings: dict[str, object]) -> Answers:
    scene = scene_of(name, **settings)
    stage = Stage.opened(scene, find_solver(method))
    with suppress(StageError):  # told by the other table
        for _ in stage.steps(steps or scene.usual_steps):
            yield stage.frame, stage.positions


def _of_start(start: str, material: str, method: str) -> Answers:
    body, about = repeated.block()
    limits, (stretch, rate) = repeated.MATERIALS[material], repeated.STARTS[start]
    problem, x = Problem(body.rest, body.elements, body.rest, limits), about * np.array(stretch)
    played = march(body, in_metric(body, problem, STEP), method, STEP, x, rate * x)
    for stepped in islice(played, repeated.STEPS):
        if np.all(np.isfinite(y := stepped.solution.positions)):
            yield stepped.frame, y


def certified(case: str, material: str, method: str) -> Iterator[Certified]:
    """The referee's words on the last answer with a limit that is active, if any has one."""
    steps, judged = 0, None
    for steps, answer in enumerate(answers(case, material, method), 1):
        gap = smallest_gap(*answer)
        if judged is None or np.isfinite(gap):
            judged = steps, *answer, gap
    if judged is None:
        yield Certified(case, material, method, 0, 0, "no answer", None, None, None, "")
        return
    step, frame, x, gap = judged
    found = certify(frame, x, reference=Reference.local(frame, x))
    yield Certified(
        *(case, material, method, step, steps, found.outcome),
        violation=found.max_violation,
        residual=found.kkt_residual,
        gap=gap if np.isfinite(gap) else None,
        reading=_reading(frame, gap),
    )


def _reading(frame: Problem, gap: float) -> str:
    """Whether it matters how equal singular values are decomposed."""
    assert isinstance(frame.kind, PrincipalLimits)
    return "LAPACK's" if frame.kind.name != "isotropic" and gap <= SEPARATION else "any"


PART = Part(
    "certificates",
    3,
    cells,
    certified,
    "What is certified",
    "What the referee says of the plays above, at steps of 5 ms, of the last step that ends with "
    "an active limit, or the first one if none does: the violation of the limits themselves, depth "
    "within the table included; the residual of the KKT conditions in the norm of the step's "
    "metric, 0 at a local optimum or a saddle, 1 where the active limits explain nothing of the "
    "move from the candidate; the least difference of two singular values of an element with an "
    "active limit. Up to 1e-6 the normals are those of one decomposition of many, LAPACK's with "
    "rotations, and with limits by axis so is what is within them. None is more than a local "
    "optimum, and objectives are not compared: an answer that violates limits has a lower one.",
    [
        *("case", "limits", "method"),
        *numbers(("step", "", ""), ("of", "", "")),
        "outcome",
        *numbers(("violation", "", ".1e"), ("KKT residual", "", ".1e"), ("gap", "", ".1e")),
        "reading",
    ],
    nothing="none",
)
