"""Where on the cloth an answer fails, in words."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from strainbench.arrays import FloatArray
from strainbench.bench.ending import VIOLATION
from strainbench.bench.failure import Failure
from strainbench.problem.elements import rest_corners
from strainbench.problem.problem import Problem
from strainbench.referee.conduct import inverted
from strainbench.referee.reference import reference_of
from strainbench.render.film import principal_stretches
from strainbench.report.measures import length

FAR = {Failure.NOT_OPTIMAL.value, Failure.ITERATION_LIMIT.value, Failure.TIME_LIMIT.value}


@dataclass(frozen=True)
class Place:
    """An element, and what is wrong with it in a sentence."""

    element: int
    sentence: str


def place(problem: Problem, positions: FloatArray, kind: str) -> Place:
    """The element that is turned round or stretched the farthest, or that lies the farthest off."""
    with np.errstate(all="ignore"):  # an answer may be infinitely wrong
        excess = problem.violations(positions).reshape(len(problem.elements), -1).max(axis=1)
        turned = inverted(problem, positions) & ~inverted(problem, problem.target)
        if kind == Failure.INVERTED and turned.any():
            element = int(np.flatnonzero(turned)[0])
            count = f"{turned.sum()} of {len(turned)} elements are inside out, among them"
            return Place(element, f"{count} {_name(problem, element)}.")
        if excess.max() <= VIOLATION and kind in FAR:
            return _farthest(problem, positions)
        stretches = principal_stretches(problem, positions)[:, 0]
        element = int(np.argmax(excess if excess.max() > 0 else stretches))
        beyond = f", {100 * excess[element]:.3g}% beyond its limit" if excess[element] > 0 else ""
        strain = f"{100 * (stretches[element] - 1):.4g}% strain{beyond}"
        others = f"{(excess > VIOLATION).sum()} of {len(excess)} elements are beyond theirs"
        return Place(element, f"Worst is {_name(problem, element)}: {strain}; {others}.")


def _farthest(problem: Problem, positions: FloatArray) -> Place:
    """Where the answer is the farthest from the optimum."""
    apart = np.linalg.norm(positions - reference_of(problem).positions, axis=1)
    vertex = int(np.argmax(apart))
    element = int(np.flatnonzero((problem.elements == vertex).any(axis=1))[0])
    far = length(1000 * float(apart[vertex]))
    return Place(
        element, f"Vertex {vertex}, of {_name(problem, element)}, is {far} off the optimum."
    )


def _name(problem: Problem, element: int) -> str:
    """An element by its number, its vertices, and where it is on the material."""
    vertices = ", ".join(map(str, problem.elements[element]))
    where = rest_corners(problem.rest, problem.elements)[element].mean(axis=0)
    at = ", ".join(f"{c:.3g}" for c in where)
    return f"element {element} (vertices {vertices}; at {at} m of the material)"
