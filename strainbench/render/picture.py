"""A state as a picture: an orthographic painter's view, coloured by the largest principal strain.

Camera and colour scale are chosen once for a whole film.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.collections import PolyCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.text import Text
from numpy.typing import NDArray

from strainbench.arrays import FloatArray, IntArray
from strainbench.escape import chart
from strainbench.render.export import surface
from strainbench.render.film import Film
from strainbench.render.obstacles import patches

SIZE, DPI = (7.2, 5.2), 150  # [in]: 1080 x 780 pixels, both even as video needs
MAP = "viridis_r"  # light where the cloth is slack, so that its folds are seen
OBSTACLE_GREY = 0.88
LIMIT_COLOUR = "#D55E00"  # Okabe and Ito's vermilion
ROUND = (1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0)
ROUNDER = (1.0, 2.0, 5.0, 10.0)
PIN: dict[str, Any] = {
    "marker": "o",
    "markersize": 6.5,
    "markerfacecolor": "white",
    "markeredgecolor": "black",
    "markeredgewidth": 1.3,
    "zorder": 4,
}


def nice_above(value: float, steps: Sequence[float] = ROUND) -> float:
    """The next round number, a power of ten times one of `steps`, not below `value` > 0."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(power * next(s for s in steps if s * power >= value * (1 - 1e-9)))


def colour_top(film: Film) -> float:
    """End of the colour scale: above the limits, and above 99.9% of what any state shows."""
    limits = film.problem.limits.bounds - 1
    seen = max(float(np.quantile(strains, 0.999)) for strains in film.strains)
    return nice_above(max(seen, 1.1 * float(limits.max()), 1e-6))


@dataclass(frozen=True)
class Camera:
    """An orthographic view at `azimuth` about the vertical y axis and `elevation` [degrees].

    Azimuth 0 looks along -z, 90 along -x.
    """

    azimuth: float = 30.0
    elevation: float = 32.0

    @property
    def axes(self) -> FloatArray:
        """(3, 3) rows: to the right, upwards, towards the viewer."""
        a, e = np.deg2rad([self.azimuth, self.elevation])
        right = np.array([np.cos(a), 0.0, -np.sin(a)])
        towards = np.array([np.sin(a) * np.cos(e), np.sin(e), np.cos(a) * np.cos(e)])
        return np.stack([right, np.cross(towards, right), towards])

    def view(self, positions: FloatArray) -> FloatArray:
        """(n, 3) right, up and depth [m], the depth growing towards the viewer."""
        seen: FloatArray = positions @ self.axes.T
        return seen


def shades(seen: FloatArray, faces: IntArray) -> FloatArray:
    """(f,) light on each face, between 0.74 and 1, smoothed over neighbours; both sides alike."""
    a, b, c = (seen[faces[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    at_vertex = np.zeros_like(seen)
    for k in range(3):
        np.add.at(at_vertex, faces[:, k], normals)
    smooth = at_vertex[faces].sum(axis=1)
    length = np.linalg.norm(smooth, axis=1)
    light = np.array([-0.3, 0.45, 0.84])
    cosine = np.abs(smooth @ light) / (np.where(length > 0, length, 1) * np.linalg.norm(light))
    shade: FloatArray = 0.74 + 0.26 * cosine
    return shade


class Picture:
    """Draws one state of a film after another on the same canvas.

    Parameters
    ----------
    top : strain at the end of the colour scale; by default from all states.
    """

    def __init__(self, film: Film, camera: Camera | None = None, top: float | None = None) -> None:
        self.film, self.camera = film, camera or Camera()
        self.problem = film.problem
        self.faces, self.owner = surface(self.problem)
        everywhere = np.concatenate([f.positions for f in film.states])
        self.obstacles, patched = patches(film.obstacles, everywhere)
        self.all_faces = np.concatenate([self.faces, patched + self.problem.vertices])
        self.norm = Normalize(0.0, 100 * (colour_top(film) if top is None else top))
        self.figure = Figure(figsize=SIZE, dpi=DPI, facecolor="white")
        self.canvas = FigureCanvasAgg(self.figure)
        self._stage()
        self._bar()
        self._words()

    def _stage(self) -> None:
        """The axes of the mesh, whose window holds every state."""
        ax = self.ax = self.figure.add_axes((0.03, 0.04, 0.75, 0.81))
        ax.set_axis_off()
        ax.set_aspect("equal")
        shown = [f.positions for f in self.film.states] + [self.obstacles]
        seen = np.concatenate([self.camera.view(x)[:, :2] for x in shown])
        low, high = seen.min(axis=0), seen.max(axis=0)
        margin = 0.05 * float((high - low).max())
        width, height = np.array(ax.get_position(original=True).size) * SIZE
        size = high - low + 2 * margin
        size = np.maximum(size, max(size[0] / width, size[1] / height) * np.array([width, height]))
        middle = (low + high) / 2
        ax.set_xlim(middle[0] - size[0] / 2, middle[0] + size[0] / 2)
        ax.set_ylim(middle[1] - size[1] / 2, middle[1] + size[1] / 2)
        self.cloth = PolyCollection([], linewidths=0.35, joinstyle="round")
        ax.add_collection(self.cloth, autolim=False)
        (self.pins,) = ax.plot([], [], linestyle="none", **PIN)
        self._scale_bar(ax, float(size[0]))

    def _scale_bar(self, ax: Axes, width: float) -> None:
        """A length in the picture's plane, about a sixth of its width."""
        length = nice_above(width / 9, ROUNDER)
        left, bottom = ax.get_xlim()[0], ax.get_ylim()[0]
        x, y = left + 0.015 * width, bottom + 0.02 * width
        ax.plot([x, x + length], [y, y], color="#333333", linewidth=1.6, solid_capstyle="butt")
        text = f"{length:g} m" if length >= 1 else f"{100 * length:g} cm"
        if length < 0.01:
            text = f"{1000 * length:g} mm"
        ax.text(x + length / 2, y + 0.012 * width, text, ha="center", size=9, color="#333333")

    def _bar(self) -> None:
        """The colour scale, with the limits marked on it."""
        ax = self.figure.add_axes((0.855, 0.14, 0.028, 0.62))
        strains = self.film.strains
        above = max(float(s.max()) for s in strains) * 100 > self.norm.vmax  # type: ignore[operator]
        bar = self.figure.colorbar(
            ScalarMappable(self.norm, MAP), cax=ax, extend="max" if above else "neither"
        )
        bar.set_label("largest principal strain [%]", size=10)
        bar.ax.tick_params(labelsize=9)
        bounds = self.film.problem.limits.bounds
        limits = sorted({100 * (float(bounds.min()) - 1), 100 * (float(bounds.max()) - 1)})
        for limit in limits:
            ax.axhline(limit, color="white", linewidth=2.6)
            ax.axhline(limit, color=LIMIT_COLOUR, linewidth=1.4)
        apart = limits[-1] - limits[0] > 0.12 * self.norm.vmax  # type: ignore[operator]
        if apart:
            labels = {limits[0]: f"tightest\n{limits[0]:.3g}%", limits[-1]: "loosest\n"}
            labels[limits[-1]] += f"{limits[-1]:.3g}%"
        else:
            values = "\nto ".join(f"{x:.3g}%" for x in limits)
            labels = {sum(limits) / len(limits): f"limit\n{values}"}
        for height, text in labels.items():
            ax.text(
                -0.35,
                height,
                text,
                transform=ax.get_yaxis_transform(),
                ha="right",
                va="center",
                size=9,
                linespacing=1.1,
                color=LIMIT_COLOUR,
            )

    def _words(self) -> None:
        """Titles; those that change with the state are filled in by `draw`."""
        self.heading = self.figure.text(0.03, 0.935, chart(self.film.scene), size=13, weight="bold")
        self.line = self.figure.text(0.03, 0.885, "", size=10.5, color="#333333")
        if len(self.problem.pinned):
            handle = self.ax.legend(
                [self.pins],
                ["pinned"],
                loc="lower right",
                frameon=False,
                fontsize=9,
                handletextpad=0.2,
                borderaxespad=0.0,
            )
            handle.set_zorder(5)

    def draw(self, index: int) -> NDArray[np.uint8]:
        """(height, width, 3) pixels of the state of that index."""
        state, strains = self.film.states[index], self.film.strains[index]
        seen = self.camera.view(np.concatenate([state.positions, self.obstacles]))
        faces = self.all_faces
        depth = seen[faces, 2].mean(axis=1)
        depth[len(self.faces) :] -= self.problem.edge_length  # flat triangles on a ball sink in
        order = np.argsort(depth, kind="stable")  # far ones first
        colours = np.full((len(faces), 3), OBSTACLE_GREY)
        colours[: len(self.faces)] = colormaps[MAP](self.norm(100 * strains[self.owner]))[:, :3]
        colours = (colours * shades(seen, faces)[:, None])[order]
        edges = np.where(order < len(self.faces), 0.8, 1.0)[:, None]  # none seen on obstacles
        self.cloth.set_verts(list(seen[faces[order], :2]))
        self.cloth.set_facecolor(colours)
        self.cloth.set_edgecolor(edges * colours)
        self.pins.set_data(*seen[self.problem.pinned, :2].T)
        clock = f"step {state.step}" if state.time is None else f"t = {state.time:.3f} s"
        self.line.set_text(
            f"{chart(self.film.solver)},  {clock},  largest strain {100 * strains.max():.2f}%"
        )
        for text in (self.heading, self.line):
            self._fit(text)
        self.canvas.draw()
        return np.asarray(self.canvas.buffer_rgba())[:, :, :3].copy()

    def _fit(self, text: Text) -> None:
        """Make a line that is too long for the picture smaller."""
        width = text.get_window_extent(self.canvas.get_renderer()).width
        room = 0.95 * SIZE[0] * DPI
        if width > room:
            text.set_fontsize(float(text.get_fontsize()) * room / width)
