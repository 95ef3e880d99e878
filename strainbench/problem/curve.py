"""A limit curve that was measured, from a CSV file; see `StretchLimits.from_csv`."""

from __future__ import annotations

import csv
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from strainbench.arrays import FloatArray
from strainbench.textfile import read_lines

SAME_DIRECTION = 1e-9
"""Directions whose unit vectors differ by less than this, up to sign, are one direction."""
PLAUSIBLE = (0.5, 3.0)
"""Bounds of a measured curve, as stretches: cloth neither halves nor triples its length."""
ANGLES = {"angle_degrees": np.pi / 180, "angle_radians": 1.0}
STRETCHES = {"bound": (0.0, 1.0), "strain": (1.0, 1.0), "percent": (1.0, 0.01)}
"""Columns, and what stretch a value v is: a + b v."""


def read_curve(path: Path) -> tuple[FloatArray, FloatArray]:
    """Angles [rad] and stretches (m,) of a CSV file.

    Raises
    ------
    ValueError
        One line that names the file, and the line in it where it is about one.
    """
    if not path.is_file():
        raise ValueError(f"{path}: no such file")
    lines = read_lines(path)
    separator = next((c for c in ";\t" if c in lines[0]), ",")
    try:
        header, *rows = [[w.strip() for w in r] for r in csv.reader(lines, delimiter=separator)]
    except (csv.Error, ValueError) as error:
        raise ValueError(f"{path}: no CSV file ({error})") from None
    angle, stretch = (_column(path, header, names) for names in (ANGLES, STRETCHES))
    samples = []
    for number, row in enumerate(rows, start=2):
        where = f"{path}, line {number}: {separator.join(row)}"
        if any(row) and len(row) != len(header):
            raise ValueError(f"{where}: {len(row)} values for {len(header)} columns")
        if any(row):
            a, b = (_number(where, row[i], separator != ",") for i in (angle, stretch))
            samples.append((where, a, b))
    if not samples:
        raise ValueError(f"{path}: no samples below the header")
    return _checked(path, samples, header[angle], header[stretch])


def _checked(
    path: Path, samples: list[tuple[str, float, float]], angle: str, stretch: str
) -> tuple[FloatArray, FloatArray]:
    """The samples of two columns, which are where words say, in radians and as stretches."""
    unit, (shift, factor) = ANGLES[angle], STRETCHES[stretch]
    curve: list[tuple[float, float]] = []
    for where, a, value in samples:
        bound = shift + factor * value
        if not PLAUSIBLE[0] <= bound <= PLAUSIBLE[1]:
            raise ValueError(
                f"{where}: {bound:g} is no stretch of cloth; {PLAUSIBLE[0]:g} to {PLAUSIBLE[1]:g} "
                "is valid, 1.05 for 5%, or a column strain or percent instead of bound"
            )
        for other, known in curve:
            if abs(np.sin(unit * a - other)) < SAME_DIRECTION and known != bound:
                raise ValueError(f"{where}: this direction has another bound above, {known:g}")
        curve.append((unit * a, bound))
    largest = max(abs(a) for _, a, _ in samples)
    if len(samples) > 1 and angle == "angle_degrees" and 0 < largest < 3.15:
        raise ValueError(
            f"{path}: angle_degrees up to {largest:g} are radians; a column angle_radians is valid"
        )
    angles, bounds = np.array(curve).T
    return angles, bounds


def _column(path: Path, header: list[str], names: Iterable[str]) -> int:
    """The index of the one column that has one of the names."""
    found = [i for i, name in enumerate(header) if name in names]
    if len(found) != 1:
        valid = "valid are angle_degrees, bound, once each"
        raise ValueError(f"{path}: columns {header}; {valid} ({' or '.join(names)})")
    return found[0]


def _number(where: str, text: str, decimal_commas: bool) -> float:
    try:
        value = float(text.replace(",", ".") if decimal_commas else text)
    except ValueError:
        raise ValueError(f"{where}: {text!r} is not a number") from None
    if not np.isfinite(value):
        raise ValueError(f"{where}: {text} is not finite")
    return value
