"""The distances as tables, CSV and charts."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from fractions import Fraction
from math import isfinite
from pathlib import Path

import numpy as np
import pandas as pd

from strainbench.bench.machine import describe_machine
from strainbench.bench.records import open_folder
from strainbench.document import Column, Document, Part, Prose, Table
from strainbench.document.writers import csv, markdown
from strainbench.files import locked, write_whole
from strainbench.report.charts import Chart, Target, draw_sheet
from strainbench.report.charts.axes import Axis, decades, even_ticks, length_tick
from strainbench.report.charts.canvas import about
from strainbench.report.charts.curves import Curve, Curves, point
from strainbench.report.machine import machine_section
from strainbench.report.numbers import power
from strainbench.report.provenance import remember_study
from strainbench.studies.step.measure import Distance

EXPLANATION = (
    "How far the farthest vertex of a closed loop is from where it is in the motion whose steps "
    "minimise implicit Euler's energy within the limits (`integrator=constrained`), with the same "
    "step: the largest over time / the mean over time. *Order*: of the largest in the step, by "
    "a line through all of three steps or more; about 1 is what a scheme that converges to the "
    "constrained motion has, and a negative one moves away as the step shrinks."
)
RESIDUALS = (
    "From positions alone: the part of a step's force, M (x - x~)/h² and the gradient of the "
    "energy, that no forces of the limits balance; of the cell's motion the median over a few "
    "steps, of the reference's the largest. 0 is the constrained step, 1 no part balanced."
)
CAPTION = "Filled: projection in the mass norm; hollow: in the norm as printed, without masses."
LEAST = 1e-5  # of the largest distance: what is nearer is not drawn
STEPS, TIMES = "step.csv", "times.csv"


def write_distances(rows: Sequence[Distance], command: str, folder: Path) -> list[Path]:
    """Write step.md, step.csv, times.csv, step.svg and machines.json; the paths of the first four.

    Parameters
    ----------
    command : that made them
    """
    open_folder(folder)
    name, facts = describe_machine(1)
    table = pd.DataFrame([asdict(row) for row in rows]).drop(columns="over_time")
    document = as_document(rows, command, {name: facts})
    texts = {
        "step.md": markdown(document),
        STEPS: csv(Table.of(table)),
        TIMES: csv(Table("", TIME_COLUMNS, list(_times(rows)))),
    }
    with locked(folder):
        remember_study(folder, "step", name, facts)
        for file, text in texts.items():
            write_whole(folder / file, text.encode())
        if found := charts(rows, Target.PAGE):
            draw_sheet(found, [folder / "step.svg"], columns=2)
    return [folder / file for file in (*texts, *(["step.svg"] if found else []))]


TIME_COLUMNS = ("scene", "method", "step", "time", "distance_mm")


def _times(rows: Sequence[Distance]) -> Iterator[tuple[object, ...]]:
    """What the chart over time shows: each scene's shortest step."""
    for row in shortest(rows):
        for k, distance in enumerate(row.over_time, start=1):
            yield row.scene, row.method, row.step, round(k * row.step, 9), round(distance, 5)


def shortest(rows: Sequence[Distance]) -> list[Distance]:
    """The rows of each scene's shortest step."""
    least: dict[str, float] = {}
    for row in rows:
        least[row.scene] = min(row.step, least.get(row.scene, row.step))
    return [row for row in rows if row.step == least[row.scene]]


def as_document(
    rows: Sequence[Distance], command: str, machines: Mapping[str, Mapping[str, object]]
) -> Document:
    """Tables of each scene, command and machine."""
    parts: list[Part] = [Prose(EXPLANATION), f"Made by {command}"]
    parts += tables(rows)
    title = "Step-and-project beside the constrained step"
    return Document(title, [*parts, machine_section(machines)])


def tables(rows: Sequence[Distance]) -> list[Table]:
    """Distances and residuals of each scene."""
    found = []
    for scene in dict.fromkeys(row.scene for row in rows):
        own = [row for row in rows if row.scene == scene]
        found += [distances(scene, own), residuals(scene, own)]
    return found


def _step(seconds: float) -> str:
    """1/60 s where it is one."""
    whole = Fraction(seconds).limit_denominator(10_000)
    unit = whole.numerator == 1 and abs(float(whole) - seconds) < 1e-9
    return f"1/{whole.denominator} s" if unit else f"{seconds:g} s"


def _grid(rows: Sequence[Distance]) -> tuple[list[float], dict[str, dict[float, Distance]]]:
    """The steps, the longest first; each method's row by its step."""
    steps = sorted({row.step for row in rows}, reverse=True)
    methods: dict[str, dict[float, Distance]] = {}
    for row in rows:
        methods.setdefault(row.method, {})[row.step] = row
    return steps, methods


def distances(scene: str, rows: Sequence[Distance]) -> Table:
    """A line a method, a column a step."""
    notes = [f"{row.method}, step {_step(row.step)}: {row.note}" for row in rows if row.note]
    steps, methods = _grid(rows)
    columns = [Column(_step(s), "mm") for s in steps]
    header = [Column("method", whole=True), *columns, Column("order")]
    lines = [
        [method, *(_pair(own.get(s)) for s in steps), _order(own)]
        for method, own in methods.items()
    ]
    return Table(f"Distance: {scene}", header, lines, notes=notes, nothing="-")


def _pair(row: Distance | None) -> str | None:
    return f"{row.largest_mm:.3g} / {row.mean_mm:.3g}" if row else None


def _order(own: Mapping[float, Distance]) -> str | None:
    found = order(own)
    return None if found is None else f"{found:.2f}"


def order(own: Mapping[float, Distance]) -> float | None:
    """The slope of the logarithm of the largest distance in that of the step."""
    known = [(s, row.largest_mm) for s, row in own.items() if row.largest_mm > 0 and not row.note]
    if len(known) < 3:
        return None
    x, y = np.log(np.array(known)).T
    return float(np.polyfit(x, y, 1)[0])


def residuals(scene: str, rows: Sequence[Distance]) -> Table:
    """The same for the residuals of steps, with a line for the reference."""
    steps, methods = _grid(rows)
    header = [Column("method", whole=True), *(Column(_step(s)) for s in steps)]
    lines: list[list[object]] = [
        [method, *(power(own[s].step_residual) if s in own else None for s in steps)]
        for method, own in methods.items()
    ]
    certified = {row.step: row.reference_residual for row in rows}
    lines.append(["constrained", *(power(certified[s]) for s in steps)])
    return Table(f"Residual of a step: {scene}", header, lines, Prose(RESIDUALS), nothing="-")


def charts(rows: Sequence[Distance], target: Target) -> list[Chart]:
    """Of each scene the distance against the step, then over time at the shortest step."""
    found = []
    for scene in dict.fromkeys(row.scene for row in rows):
        own = [row for row in rows if row.scene == scene and isfinite(row.largest_mm)]
        steps, methods = _grid(own)
        if len(steps) > 1:
            found.append(_against_steps(scene, steps, methods, target))
        if steps:
            found.append(_over_time(scene, shortest(own), target))
    return found


def _curve(method: str, row: Distance, points: Sequence[tuple[float, float]]) -> Curve:
    filled = row.norm == "mass"
    marked = [point(x, y, filled) for x, y in points if y > 0]
    return Curve({**about(row.solver), "line": method}, method, marked)


def _against_steps(
    scene: str,
    steps: Sequence[float],
    methods: Mapping[str, Mapping[float, Distance]],
    target: Target,
) -> Chart:
    curves = [
        _curve(
            method,
            next(iter(own.values())),
            [(1 / s, own[s].largest_mm) for s in sorted(own)[::-1]],
        )
        for method, own in methods.items()
    ]
    every = [row.largest_mm for own in methods.values() for row in own.values()]
    rates = [1 / s for s in steps]
    ticks = {rate: f"{rate:.4g}" for rate in rates}
    x = Axis("steps a second", rates[0] / 1.2, 1.2 * rates[-1], ticks)
    y = decades("largest distance", every, length_tick)
    title = f"Distance from the constrained motion as the step shrinks: {scene}"
    return Chart("step", title, CAPTION, Curves(title, x, y, curves).spec(target))


def _over_time(scene: str, rows: Sequence[Distance], target: Target) -> Chart:
    curves = [
        _curve(row.method, row, [(k * row.step, d) for k, d in enumerate(row.over_time, start=1)])
        for row in rows
    ]
    last = max(len(row.over_time) * row.step for row in rows)
    floor = LEAST * max(row.largest_mm for row in rows)
    every = [d for row in rows for d in row.over_time if d > floor]
    x = Axis("time [s]", 0.0, last, even_ticks(0.0, last), log=False)
    y = decades("distance", every, length_tick)
    title = f"Distance from the constrained motion, step {_step(rows[0].step)}: {scene}"
    drawn = Curves(title, x, y, curves, marks=False)
    return Chart("times", title, CAPTION, drawn.spec(target))
