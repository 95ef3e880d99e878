"""Limits over the material angle, and what the cloth did (Tang et al. 2022, Fig. 2)."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from textwrap import wrap

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from matplotlib.projections.polar import PolarAxes
from matplotlib.ticker import MaxNLocator
from scipy.optimize import linprog

from strainbench.arrays import FloatArray
from strainbench.bench.plan import plan_available
from strainbench.bench.records import open_folder
from strainbench.escape import chart
from strainbench.problem.kinds import Limits, Sampled, kind_of
from strainbench.problem.problem import Problem
from strainbench.render.film import Film, Track, shoot, untracked
from strainbench.render.planes import draw_planes
from strainbench.report.identity import look

SUFFIXES = (".svg", ".png", ".pdf")
ANGLES = np.pi * np.arange(180) / 180 - np.pi / 2
"""[rad] where the cloth's stretch is measured: each degree of half a turn, d and -d being one."""
TANGENTS = 720
"""Half-planes that stand for the cone C >= 0 in `admissible`: 1e-5 of the truth, relatively."""
REPORTED = 99  # percentile beside the largest


def directional_stretches(
    problem: Problem, positions: FloatArray, angles: FloatArray
) -> FloatArray:
    """(e, a) stretch ||F d|| of every triangle in the material directions at `angles` (a,)."""
    d = np.column_stack([np.cos(angles), np.sin(angles)])
    F = problem.deformation_gradients(positions)
    stretches: FloatArray = np.linalg.norm(np.einsum("exc,ac->eax", F, d), axis=2)
    return stretches


def sampled_curve(limits: Limits) -> tuple[FloatArray, FloatArray] | None:
    """Angles (m,) [rad] and bounds (m,) of the samples; of the loosest element where they vary.

    None where limits are not sampled.
    """
    if not isinstance(kind_of(limits), Sampled):
        return None
    angles = np.arctan2(limits.directions[:, 1], limits.directions[:, 0])
    return angles, np.atleast_2d(limits.bounds).max(axis=0)


def admissible(limits: Limits, angles: FloatArray) -> FloatArray:
    """(a,) largest stretch at `angles` that the limits admit; infinite where they do not say.

    With C = F^T F = [[p + q, r], [r, p - q]], ||F d(a)||^2 = p + q cos 2a + r sin 2a is linear.
    So with samples this is a linear objective over their half-planes and the cone C >= 0. Other
    kinds of limits know how long they let a unit vector become.
    """
    curve = sampled_curve(limits)
    if curve is None:
        unit = np.column_stack([np.cos(angles), np.sin(angles)])
        longest: FloatArray = kind_of(limits).longest(unit[None]).max(axis=0)
        return longest
    samples, bounds = curve
    cone = np.pi * np.arange(TANGENTS) / TANGENTS
    A = np.concatenate([_squared_stretch(samples), -_squared_stretch(cone)])
    b = np.concatenate([bounds**2, np.zeros(TANGENTS)])
    free = [(None, None)] * 3
    found = [linprog(-c, A_ub=A, b_ub=b, bounds=free) for c in _squared_stretch(angles)]
    return np.sqrt([-f.fun if f.status == 0 else np.inf for f in found])


def _squared_stretch(angles: FloatArray) -> FloatArray:
    """(a, 3) coefficients of p, q, r."""
    return np.column_stack([np.ones(len(angles)), np.cos(2 * angles), np.sin(2 * angles)])


def polar(
    scenario: str,
    solvers: str,
    settings: Sequence[str],
    steps: int,
    path: Path,
    tolerance: float = 1e-6,
    track: Track = untracked,
) -> list[str]:
    """Play a scene with each solver and draw its last frame against the limits.

    Of a volume they are drawn in the planes of its material axes (`strainbench.render.planes`).

    Raises
    ------
    ValueError
        One line that names the wrong word and what is valid.
    """
    if path.suffix not in SUFFIXES:
        raise ValueError(f"-o {path}: a name that ends in {', '.join(SUFFIXES)} is valid")
    cells = plan_available(scenario, [solvers], settings, steps, tolerance)
    scene = cells[0].scenario.scenario()
    volume = scene.problem().rest.shape[-1] == 3
    open_folder(path.parent, "-o")
    films = [shoot(cell, every=steps, track=track) for cell in cells]
    figure = draw_planes(films) if volume else draw_polar(films, scene.curve())
    stamp = {".png": None, ".svg": {"Date": None}, ".pdf": {"CreationDate": None}}
    with mpl.rc_context({"svg.fonttype": "none", "svg.hashsalt": "strainbench"}):
        try:
            figure.savefig(path, dpi=150, metadata=stamp[path.suffix])
        except OSError as error:
            raise ValueError(f"-o {path} cannot be written to ({error.strerror})") from None
    return [*(film.stopped for film in films if film.stopped), f"wrote {path}"]


def draw_polar(films: Sequence[Film], curve: tuple[FloatArray, FloatArray] | None = None) -> Figure:
    """The limits of a scene and the stretches of each film's last frame.

    Parameters
    ----------
    curve : angles (a,) [rad] and bounds (a,) that the limits sample, or None if not known
    """
    limits = films[0].problem.limits
    figure = Figure(figsize=(8.6, 5.0))
    ax = figure.add_axes((0.075, 0.08, 0.46, 0.76), projection="polar")
    assert isinstance(ax, PolarAxes)
    strains = [_strains(film) for film in films]
    _draw_limits(ax, limits, curve)
    top = _top(limits, strains)
    for film, strain in zip(films, strains, strict=True):
        _draw_film(ax, film, strain, look(film.solver).colour, top)
    _axes(ax, strains, top)
    figure.legend(
        loc="center left", bbox_to_anchor=(0.65, 0.46), frameon=False, fontsize=9, labelspacing=0.7
    )
    figure.text(0.03, 0.94, _title(films), size=11, weight="bold")
    return figure


def _strains(film: Film) -> FloatArray:
    """(e, a) [%] over all triangles and ANGLES, at the last frame."""
    positions = film.states[-1].positions
    return 100 * (directional_stretches(film.problem, positions, ANGLES) - 1)


def _closed(angles: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Half a turn of values, sorted by angle, drawn round: d and -d are one direction."""
    half = np.mod(angles, np.pi)
    order = np.argsort(half, kind="stable")
    turn = np.concatenate([half[order], half[order] + np.pi, half[order][:1] + 2 * np.pi])
    return turn, np.concatenate([values[order], values[order], values[order][:1]])


def _draw_limits(
    ax: PolarAxes, limits: Limits, curve: tuple[FloatArray, FloatArray] | None
) -> None:
    if curve is not None:
        turn, bounds = _closed(*curve)
        ax.plot(turn, 100 * (bounds - 1), color="black", lw=1.2, label="limit")
    reach = 100 * (admissible(limits, ANGLES) - 1)
    samples = sampled_curve(limits)
    if samples is None:
        if curve is None and np.all(np.isfinite(reach)):
            ax.plot(*_closed(ANGLES, reach), color="black", lw=1.2, label="limit")
        return
    angles, bounds = samples
    its = "sample" if len(bounds) == 1 else f"{len(bounds)} samples"
    ax.plot(
        *_closed(angles, 100 * (bounds - 1)),
        linestyle="none",
        marker="o",
        markersize=5.5,
        markerfacecolor="white",
        markeredgecolor="black",
        zorder=5,
        label=f"its {its}" if curve is not None else f"limit: {its}",
    )
    if np.all(np.isfinite(reach)):
        ax.plot(
            *_closed(ANGLES, reach),
            color="#777777",
            lw=1.1,
            ls=":",
            label="largest that these samples admit",
        )


def _draw_film(ax: PolarAxes, film: Film, strain: FloatArray, colour: str, top: float) -> None:
    largest, usual = strain.max(axis=0), np.percentile(strain, REPORTED, axis=0)
    name = "\n".join(map(chart, wrap(film.solver, 28)))
    cut = "\n(beyond the axis)" if largest.min() > top else ""
    ax.plot(
        *_closed(ANGLES, largest),
        color=colour,
        lw=1.7,
        label=f"{name}\nall triangles, up to {largest.max():.2f}%{cut}",
    )
    ax.plot(
        *_closed(ANGLES, usual),
        color=colour,
        lw=1.3,
        ls=(0, (3, 1.5)),
        label=f"{REPORTED}% of them, up to {usual.max():.2f}%",
    )


def _top(limits: Limits, strains: Sequence[FloatArray]) -> float:
    """End of the axis [%]: room for the limits, and for strains that are not far beyond them."""
    reach = admissible(limits, ANGLES)
    loosest = 100 * max(float(limits.bounds.max()), *reach[np.isfinite(reach)]) - 100
    near = [float(s.max()) for s in strains if s.max() <= 2.5 * loosest]
    return float(1.08 * max(loosest, 1e-3, *near))


def _axes(ax: PolarAxes, strains: Sequence[FloatArray], top: float) -> None:
    """Strain in percent, outwards from a circle of rest length."""
    usual = min(float(np.percentile(s, REPORTED, axis=0).min()) for s in strains)
    bottom = max(min(0.0, 1.1 * usual), -top)
    ax.set_rlim(bottom, top)
    ax.set_rorigin(bottom - 0.35 * (top - bottom))
    ax.plot(np.linspace(0, 2 * np.pi, 181), np.zeros(181), color="#999999", lw=0.8, zorder=1)
    ax.set_thetagrids(
        range(0, 360, 45),
        ["0°, warp", "45°", "90°, weft", "135°", "180°", "225°", "270°", "315°"],
        fontsize=9,
    )
    ax.set_rlabel_position(45)
    ax.yaxis.set_major_locator(MaxNLocator(4))
    ax.yaxis.set_major_formatter(lambda r, _: f"{r:g}%")
    ax.tick_params(axis="y", labelsize=8, labelcolor="#555555")
    for label in ax.get_yticklabels():
        label.set(ha="center", va="center", bbox={"facecolor": "white", "pad": 0.6, "lw": 0})
    for label, angle in zip(ax.get_xticklabels(), range(0, 360, 45), strict=True):
        side = round(float(np.cos(np.deg2rad(angle))), 6)
        label.set_horizontalalignment("left" if side > 0 else "right" if side < 0 else "center")
    ax.grid(color="#dddddd", linewidth=0.6)


def _title(films: Sequence[Film]) -> str:
    last = films[0].states[-1]
    clock = f"step {last.step}" if last.time is None else f"t = {last.time:.3g} s"
    if len({film.states[-1].step for film in films}) > 1:
        clock = "last frame of each"
    return f"{chart(films[0].scene)}, {clock}: strain over the material angle"
