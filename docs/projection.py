"""The projection's picture, drawn from the suite itself: `python docs/projection.py OUT.svg`.

One triangle with two pinned corners: the third has a place in the plane, and each limited
direction keeps it in a disk, |(G x)_i| = |g_i x_3 + c_i| <= b_i. Objectives and lower bounds are
halves of squared distances from the candidate, circles around it.
"""

from __future__ import annotations

import sys
from io import BytesIO

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from numpy.typing import NDArray

from strainbench import Problem, StretchLimits, certify, solve

Array = NDArray[np.float64]
BLUE, RED, GREEN, GREY = "#0072b2", "#d55e00", "#00805f", "#808080"


def triangle() -> Problem:
    """Corners 0 and 1 pinned; the candidate of corner 2 is stretched and sheared."""
    rest = np.array([[0.0, 0.0], [1.0, 0.0], [0.35, 0.9]])
    return Problem(
        rest=rest,
        elements=np.array([[0, 1, 2]]),
        target=np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.97, 1.28, 0.0]]),
        limits=StretchLimits.sampled(np.deg2rad([-90, -45, 0, 45]), [1.05, 1.1, 1.05, 1.1]),
        pinned=np.array([0, 1]),
    )


def disks(problem: Problem) -> list[tuple[Array, float]]:
    """Centre and radius of the disk that each direction leaves the free corner."""
    at_zero = problem.target.copy()
    at_zero[2] = 0
    g, c = problem.row_coefficients[:, 2], problem.G @ at_zero
    seen = np.abs(g) > 1e-9
    centres, radii = -c[seen, :2] / g[seen, None], problem.bounds[seen] / np.abs(g[seen])
    return list(zip(centres, radii.tolist(), strict=True))


def ring(ax: Axes, centre: Array, radius: float, colour: str, style: str, label: str = "") -> None:
    """A circle."""
    patch = Circle(tuple(centre), radius, fill=False, ec=colour, ls=style, lw=1.3)
    ax.add_patch(patch)
    if label:
        ax.plot([], [], color=colour, ls=style, lw=1.3, label=label)


def point(ax: Axes, place: Array, colour: str, text: str, side: str, label: str = "") -> None:
    """A point and its name, `side` of it."""
    ax.plot(*place, "o", color=colour, ms=7, zorder=5, label=label)
    away, align = (0.05, "left") if side == "right" else (-0.05, "right")
    ax.text(place[0] + away, place[1], text, color=colour, zorder=6, va="center", ha=align)


def draw() -> bytes:
    """The picture, as SVG."""
    problem = triangle()
    target, within = problem.target, disks(problem)
    closest = solve(problem, "newton-ipm", 1e-9).positions[2, :2]
    other = solve(problem, "gauss-seidel", 1e-9)
    found = certify(problem, other.positions)
    t, y = target[2, :2], other.positions[2, :2]

    figure = Figure(figsize=(7.2, 5.2), layout="constrained")
    ax = figure.add_subplot()
    x, h = np.meshgrid(np.linspace(-0.6, 1.5, 800), np.linspace(-0.6, 1.6, 800))
    inside = np.all([np.hypot(x - c[0], h - c[1]) <= r for c, r in within], axis=0)
    ax.contourf(x, h, inside, levels=[0.5, 1.5], colors=[GREEN], alpha=0.18)
    for centre, radius in within:
        ring(ax, centre, radius, GREEN, ":", "" if ax.lines else "limit of one direction")
    for corners, style in ((target, "--"), (np.vstack([target[:2, :2], closest]), "-")):
        ax.fill(*np.asarray(corners)[:, :2].T, fill=False, ec=GREY, ls=style, lw=1)
    low, high = np.sqrt(2 * found.lower_bound), np.sqrt(2 * found.objective)
    ring(ax, t, low, BLUE, "-", "lower bound: no admissible point is inside")
    ring(ax, t, high, RED, "-", "objective of y; between the two the gap")
    ring(ax, y, found.distance_bound, RED, "--", "distance bound: x* is inside")
    ax.text(0.42, 0.2, "admissible", color=GREEN, ha="center")
    point(ax, t, "black", "candidate", "right")
    point(ax, closest, BLUE, "x*", "left", "closest point, x*")
    point(ax, y, RED, "y", "left", "another answer, y")
    return svg(figure, ax)


def svg(figure: Figure, ax: Axes) -> bytes:
    """The finished figure, the same bytes each time."""
    ax.set(aspect="equal", xlim=(-0.35, 1.75), ylim=(-0.5, 1.5), xticks=[], yticks=[])
    ax.set_frame_on(False)
    ax.legend(loc="lower right", frameon=True, framealpha=1, edgecolor="none", fontsize=9)
    content = BytesIO()
    with matplotlib.rc_context({"svg.hashsalt": "strainbench", "svg.fonttype": "none"}):
        figure.savefig(content, format="svg", metadata={"Date": None})
    return content.getvalue()


if __name__ == "__main__":
    with open(sys.argv[1], "wb") as file:
        file.write(draw())
