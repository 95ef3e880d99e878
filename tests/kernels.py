"""Our solvers' compiled loops against the same loops in C (`make kernels`).

    python -m tests.kernels --resolution 60

Both start from the same numbers, in turns; printed is the median of C's share of thread CPU time,
and how far apart the two answers are. C is compiled by `cc -O3 -march=native`, numba's own target.
Fast projection has no loops of its own: its time is SuperLU's and SciPy's, in C already.
"""

from __future__ import annotations

import ctypes
import subprocess
from collections.abc import Callable, Iterator, Sequence
from functools import cache
from pathlib import Path
from shutil import which
from statistics import median
from tempfile import TemporaryDirectory
from time import thread_time_ns
from typing import Annotated, NamedTuple

import numpy as np
import typer
from rich.console import Console

from solvers import dykstra, xpbd
from solvers.admm import steps as admm
from solvers.augmented_lagrangian import minimum
from solvers.gauss_seidel import rows as gauss_seidel
from strainbench import FloatArray, Problem, StretchLimits, square_grid
from strainbench.document import Column, Table
from strainbench.document.writers import terminal
from strainbench.problem.leverage import Leverage

CALLS = 10
"""Sweeps, or passes, between two looks at the clock."""
COMPILER = which("cc")
FLAGS = ("-O3", "-march=native", "-shared", "-fPIC")


class Loop(NamedTuple):
    """One loop in both languages, and the arrays that both change in place."""

    name: str
    changed: Sequence[FloatArray]
    ours: Callable[[], object]
    theirs: Callable[[], object]


@cache
def library() -> ctypes.CDLL:
    """The loops in C."""
    with TemporaryDirectory() as folder:
        built = Path(folder) / "kernels.so"
        source = Path(__file__).with_suffix(".c")
        subprocess.run([COMPILER or "cc", *FLAGS, "-o", built, source, "-lm"], check=True)
        return ctypes.CDLL(str(built))


def in_c(name: str, *args: object) -> Callable[[], object]:
    """A call of a loop in C: arrays by where they lie, all else a whole number."""
    function = getattr(library(), name)
    passed = [
        ctypes.c_void_p(a.ctypes.data) if isinstance(a, np.ndarray) else ctypes.c_long(a)  # type: ignore[arg-type]
        for a in args
    ]
    kept = args  # the arrays live as long as the call

    def call() -> object:
        return function(*passed) if kept else None

    return call


def sheet(resolution: int) -> Problem:
    """A square, pinned at two corners, about half of whose directions are stretched too far."""
    rest, elements = square_grid(resolution, 1.0, "uniform")
    noise = np.random.default_rng(1).normal(0, 0.1 / resolution, (len(rest), 3))
    target = np.column_stack([rest, np.zeros(len(rest))]) + noise
    pinned = np.array([0, resolution])
    return Problem(rest, elements, target, StretchLimits.isotropic(1.01), pinned=pinned)


def loops(problem: Problem) -> Iterator[Loop]:
    """All that there are; a sampled direction is a row."""
    yield from sweeps(problem)
    yield from of_admm(problem)
    yield from of_augmented_lagrangian(problem)


def sweeps(problem: Problem) -> Iterator[Loop]:
    """Those that place one row after the other."""
    c, b, lower, levers = problem.rows, problem.bounds, problem.lower_bounds, Leverage.of(problem)
    x, l, Y = problem.target.copy(), np.zeros(c), np.zeros((c, 1, 3))  # noqa: E741
    d = gauss_seidel.Directions.of(problem)
    v, g = d.G.vertices, d.G.coefficients
    yield Loop(
        "gauss-seidel",
        [x],
        lambda: gauss_seidel.sweep_rows(d.G, d.steps, b, lower, x, 0.0, CALLS),
        in_c("gauss_seidel", c, v, g, d.steps, b, lower, x, CALLS),
    )
    yield Loop(
        "xpbd",
        [x, l],
        lambda: xpbd.sweep(d.G, levers, b, x, l, 0.0, True, 0.0, CALLS),
        in_c("xpbd", c, v, g, levers.moves, levers.total, b, x, l, CALLS),
    )
    mesh, norms = dykstra.blocks(problem), np.zeros(c)
    frame, run = dykstra.start(problem, mesh, np.zeros((c, 3)))
    run = run._replace(x=x, Y=Y)
    yield Loop(
        "dykstra",
        [x, Y],
        lambda: dykstra.plain(mesh, frame, run, CALLS),
        in_c("dykstra", c, v, g, mesh.moves, mesh.steps, b, x, Y, norms, CALLS),
    )


def of_admm(problem: Problem) -> Iterator[Loop]:
    """The local step, and the right-hand side of the global one."""
    c, b, G = problem.rows, problem.bounds, gauss_seidel.Directions.of(problem).G
    v = problem.G @ problem.target
    z, w, pull = np.zeros_like(v), np.ones(c), np.zeros_like(problem.target)
    yield Loop(
        "admm, local step",
        [z],
        repeated(lambda: admm.project_on_balls(v, b, z)),
        repeated(in_c("balls", c, v, b, z)),
    )
    yield Loop(
        "admm, right-hand side",
        [pull],
        repeated(lambda: admm.add_pull(G, w, v, z, v, pull)),
        repeated(in_c("pull", c, G.vertices, G.coefficients, w, v, z, v, pull)),
    )


def of_augmented_lagrangian(problem: Problem) -> Iterator[Loop]:
    """Value and gradient, and the Hessian's product."""
    n, c, b, t = problem.vertices, problem.rows, problem.bounds, problem.target
    mesh = minimum.Blocks.of(problem)
    local = minimum.Local(np.zeros((0, 1, 1)), np.zeros((c, 1)), np.zeros((c, 1, 3)))
    rho = np.ascontiguousarray(mesh.scale)
    K = minimum.Hessian(mesh, b, rho, local)
    Y, Y_new = np.zeros((c, 1, 3)), np.zeros((c, 1, 3))
    x, out, values = t.copy(), np.zeros_like(t), np.zeros(2)
    G = mesh.rows.vertices, mesh.rows.coefficients, mesh.pulls, mesh.M, b, rho
    yield Loop(
        "augmented-lagrangian, gradient",
        [local.s, local.Ut, Y_new, out],
        repeated(lambda: minimum.evaluate(K, t, Y, x, Y_new, out)),
        repeated(in_c("evaluate", n, c, *G, t, Y, x, local.s, local.Ut, Y_new, out, values)),
    )
    minimum.evaluate(K, t, Y, x, Y_new, out)
    yield Loop(
        "augmented-lagrangian, product",
        [out],
        repeated(lambda: minimum.product(K, x, out)),
        repeated(in_c("product", n, c, *G, local.s, local.Ut, x, out)),
    )


def repeated(call: Callable[[], object]) -> Callable[[], None]:
    """So many calls."""

    def calls() -> None:
        for _ in range(CALLS):
            call()

    return calls


class Compared(NamedTuple):
    """Our time over C's in each turn, and the largest difference of the answers."""

    name: str
    ratios: list[float]
    apart: float


def compare(loop: Loop, turns: int) -> Compared:
    """So many turns of the two, each from the same numbers, after one that does not count."""
    start = [array.copy() for array in loop.changed]

    def run(call: Callable[[], object]) -> tuple[int, list[FloatArray]]:
        for array, first in zip(loop.changed, start, strict=True):
            array[:] = first
        begin = thread_time_ns()
        call()
        spent = thread_time_ns() - begin
        return spent, [array.copy() for array in loop.changed]

    (_, mine), (_, other) = run(loop.ours), run(loop.theirs)
    apart = max(
        float(np.abs(a - b).max() / max(1.0, np.abs(b).max()))
        for a, b in zip(mine, other, strict=True)
    )
    ratios = [run(loop.ours)[0] / run(loop.theirs)[0] for _ in range(turns)]
    return Compared(loop.name, ratios, apart)


def table(compared: Sequence[Compared], title: str) -> Table:
    """A row a loop."""
    columns: list[str | Column] = ["loop"]
    columns += [Column(n, right=True) for n in ("ours / C", "quartiles", "apart")]
    lines = []
    for one in compared:
        low, high = np.quantile(one.ratios, [0.25, 0.75])
        lines.append(
            [one.name, f"{median(one.ratios):.2f}", f"{low:.2f} to {high:.2f}", f"{one.apart:.0e}"]
        )
    return Table(title, columns, lines, notes=["apart: largest difference, of the largest entry"])


def main(
    resolution: Annotated[int, typer.Option(min=2)] = 60,
    turns: Annotated[int, typer.Option(min=1)] = 31,
) -> None:
    """Print the table."""
    if not COMPILER:
        raise SystemExit("tests.kernels: no C compiler called cc")
    compared = [compare(loop, turns) for loop in loops(sheet(resolution))]
    title = f"compiled loops against C, {resolution}x{resolution} squares, {turns} turns"
    Console(width=110).print(terminal(table(compared, title)))


if __name__ == "__main__":
    typer.run(main)
