"""Limits of volumes in the planes of their material axes, and what the elements did."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np
from matplotlib.figure import Figure
from matplotlib.projections.polar import PolarAxes
from matplotlib.ticker import MaxNLocator

from strainbench.arrays import FloatArray
from strainbench.escape import chart
from strainbench.problem.kinds import Limits, kind_of
from strainbench.problem.principal import PrincipalLimits
from strainbench.render.film import Film
from strainbench.report.identity import look

PLANES = tuple(combinations(range(3), 2))
AXES = "xyz"
ANGLES = np.pi * np.arange(360) / 180
FARTHEST = 10.0
"""A strain beyond which limits are taken for none."""


def directions(plane: tuple[int, int]) -> FloatArray:
    """(a, 3) unit vectors at ANGLES of a plane of material axes."""
    found = np.zeros((len(ANGLES), 3))
    found[:, plane[0]], found[:, plane[1]] = np.cos(ANGLES), np.sin(ANGLES)
    return found


def uniaxial(limits: Limits, u: FloatArray, sign: float) -> FloatArray:
    """(a,) strains along u (a, 3), of this sign, that limits on principal stretches just allow.

    Of F = I + a u u^T, by bisection; 0 where they allow none, infinite beyond `FARTHEST`, or a
    compression to nothing. Other kinds say how long they let a unit vector become.
    """
    kind = kind_of(limits)
    if not isinstance(kind, PrincipalLimits):
        longest: FloatArray = kind.longest(u[None]).max(axis=0) - 1
        return longest if sign > 0 else np.full(len(u), -np.inf)

    def within(amounts: FloatArray) -> FloatArray:
        F = np.eye(3) + (sign * amounts)[:, None, None] * u[:, :, None] * u[:, None, :]
        allowed: FloatArray = kind.values(F).min(axis=1) >= -1e-12
        return allowed

    most = FARTHEST if sign > 0 else 1.0
    low, high = np.zeros(len(u)), np.full(len(u), most)
    for _ in range(40):
        middle = (low + high) / 2
        keeps = within(middle)
        low, high = np.where(keeps, middle, low), np.where(keeps, high, middle)
    return np.where(low > 0.999 * most, sign * np.inf, sign * low)


def extremes(film: Film, plane: tuple[int, int]) -> tuple[FloatArray, FloatArray]:
    """(a,) the largest and the least strain of any element at ANGLES, at the last frame."""
    F = film.problem.deformation_gradients(film.states[-1].positions)
    strains = np.linalg.norm(np.einsum("exc,ac->eax", F, directions(plane)), axis=2) - 1
    return strains.max(axis=0), strains.min(axis=0)


def draw_planes(films: Sequence[Film]) -> Figure:
    """A polar plot for each plane: limits on uniaxial strain, and strains of each film's end."""
    figure = Figure(figsize=(11.0, 5.0))
    top, bottom = _range(films)
    for number, plane in enumerate(PLANES):
        ax = figure.add_axes((0.05 + 0.32 * number, 0.2, 0.26, 0.62), projection="polar")
        assert isinstance(ax, PolarAxes)
        _draw(ax, films, plane, (top, bottom))
    handles, labels = ax.get_legend_handles_labels()
    figure.legend(handles, labels, loc="lower center", ncols=3, frameon=False, fontsize=9)
    scene = chart(films[0].scene)
    figure.text(
        0.03, 0.94, f"{scene}: strain in the planes of the material axes", size=11, weight="bold"
    )
    return figure


def _range(films: Sequence[Film]) -> tuple[float, float]:
    """Ends of the axis [%]: room for strains, and for limits along the axes that are limited."""
    strains = np.concatenate([extremes(film, p) for film in films for p in PLANES], axis=1)
    limits = np.concatenate([uniaxial(films[0].problem.limits, np.eye(3), s) for s in (1.0, -1.0)])
    near = limits[np.isfinite(limits)]
    top = max(strains.max(), 2 * near.max(initial=0.0), 1e-3)
    return 108 * top, min(108 * min(strains.min(), near.min(initial=0.0)), -0.3 * top)


def _draw(
    ax: PolarAxes, films: Sequence[Film], plane: tuple[int, int], ends: tuple[float, float]
) -> None:
    top, bottom = ends
    turn = np.append(ANGLES, 2 * np.pi)

    def line(values: FloatArray, **how: object) -> None:
        cut = np.where((values > 1.01 * top) | (values < 1.01 * bottom), np.nan, values)
        ax.plot(turn, np.append(cut, cut[:1]), **how)  # type: ignore[arg-type]

    ax.plot(turn, 0 * turn, color="#999999", lw=0.8)
    for sign, label in ((1.0, "limits on uniaxial strain"), (-1.0, "")):
        allowed = 100 * uniaxial(films[0].problem.limits, directions(plane), sign)
        line(allowed, color="black", lw=1.3, label=label)
    for film in films:
        high, low = extremes(film, plane)
        how = {"color": look(film.solver).colour, "lw": 1.6}
        line(100 * high, label=f"{chart(film.solver)}: largest, least of any element", **how)
        line(100 * low, ls=(0, (3, 1.5)), **how)
    ax.set_rlim(bottom, top)
    ax.set_rorigin(bottom - 0.2 * (top - bottom))
    first, second = (AXES[k] for k in plane)
    ax.set_thetagrids(range(0, 360, 90), [first, second, f"-{first}", f"-{second}"], fontsize=9)
    ax.set_rlabel_position(30)
    ax.yaxis.set_major_locator(MaxNLocator(4))
    ax.yaxis.set_major_formatter(lambda r, _: f"{r:g}%")
    ax.tick_params(axis="y", labelsize=8, labelcolor="#555555")
    ax.grid(color="#dddddd", linewidth=0.6)
    ax.set_title(f"{first}{second}", fontsize=10, pad=14)
