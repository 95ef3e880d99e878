"""A state as a picture: its surface, coloured by the largest principal strain, and a frame.

Camera and colour scale are chosen once for a whole film.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.text import Text
from numpy.typing import NDArray

from strainbench.escape import chart
from strainbench.render.camera import Camera
from strainbench.render.film import Film, measured
from strainbench.render.paint import greyer
from strainbench.render.stage import PIN_COLOUR, Stage

SIZE, DPI = (7.2, 5.2), 150  # [in]: 1080 x 780 pixels, both even as video needs
STAGE = (32, 30, 810, 630)  # [pixels] from the left and from below, width, height
MAP = "viridis_r"  # light where the cloth is slack, so that its folds are seen
INK = "#333333"
LIMIT_COLOUR = "#D55E00"  # Okabe and Ito's vermilion
ROUND = (1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0)
ROUNDER = (1.0, 2.0, 5.0, 10.0)


def nice_above(value: float, steps: Sequence[float] = ROUND) -> float:
    """The next round number, a power of ten times one of `steps`, not below `value` > 0."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(power * next(s for s in steps if s * power >= value * (1 - 1e-9)))


def colour_top(film: Film) -> float:
    """End of the colour scale: above the limits, and above 99.9% of what any state shows."""
    limit = float(film.problem.kind.strains.max(initial=0.0))
    seen = max(float(np.quantile(strains, 0.999)) for strains in film.strains)
    return nice_above(max(seen, 1.1 * limit, 1e-6))


class Picture:
    """Draws one state of a film after another on the same canvas.

    Parameters
    ----------
    top : strain at the end of the colour scale; by default from all states.
    """

    def __init__(self, film: Film, camera: Camera | None = None, top: float | None = None) -> None:
        self.film, self.camera = film, camera or Camera()
        self.stage = Stage(film, self.camera, STAGE[2:])
        self.norm = Normalize(0.0, 100 * (colour_top(film) if top is None else top))
        self.figure = Figure(figsize=SIZE, dpi=DPI, facecolor="white")
        self.canvas = FigureCanvasAgg(self.figure)
        self._axes()
        self._bar()
        self._words()

    def _axes(self) -> None:
        """The axes of the mesh, in metres, over the pixels of the stage."""
        left, bottom, width, height = STAGE
        blank = np.ones((height, width, 3))
        self.image = self.figure.figimage(blank, left, bottom, zorder=-1)
        whole = np.tile(np.array(SIZE) * DPI, 2)
        ax = self.ax = self.figure.add_axes(tuple(STAGE / whole))
        ax.set_axis_off()
        window = self.stage.window
        ax.set_xlim(window.corner[0], window.corner[0] + window.width)
        ax.set_ylim(window.corner[1], window.corner[1] + window.height)
        self._scale_bar(ax, window.width)

    def _scale_bar(self, ax: Axes, width: float) -> None:
        """A length in the picture's plane, about a sixth of its width."""
        length = nice_above(width / 9, ROUNDER)
        left, bottom = ax.get_xlim()[0], ax.get_ylim()[0]
        x, y = left + 0.015 * width, bottom + 0.02 * width
        ax.plot([x, x + length], [y, y], color=INK, linewidth=1.6, solid_capstyle="butt")
        text = f"{length:g} m" if length >= 1 else f"{100 * length:g} cm"
        if length < 0.01:
            text = f"{1000 * length:g} mm"
        ax.text(x + length / 2, y + 0.012 * width, text, ha="center", size=9, color=INK)

    def _bar(self) -> None:
        """The colour scale of both sides, with the limits marked on it."""
        ax = self.figure.add_axes((0.855, 0.14, 0.028, 0.62))
        strains = self.film.strains
        above = max(float(s.max()) for s in strains) * 100 > self.norm.vmax  # type: ignore[operator]
        bar = self.figure.colorbar(
            ScalarMappable(self.norm, MAP), cax=ax, extend="max" if above else "neither"
        )
        bar.set_label("largest principal strain [%]", size=10)
        bar.ax.tick_params(labelsize=9)
        if self.stage.two_sided:
            self._back(ax, 1.06 if above else 1.025)
        self._limits(ax)

    def _back(self, ax: Axes, above: float) -> None:
        """The colours of the back, in the left half of the scale; names at the height `above`."""
        colours = greyer(colormaps[MAP](np.linspace(0, 1, 256))[:, None, :3])
        extent = (0.0, 0.5, 0.0, float(self.norm.vmax))  # type: ignore[arg-type]
        ax.imshow(colours, extent=extent, aspect="auto", origin="lower", zorder=1)
        for x, name, side in ((0.42, "back", "right"), (0.58, "front", "left")):
            ax.text(x, above, name, transform=ax.transAxes, ha=side, size=8, color=INK)

    def _limits(self, ax: Axes) -> None:
        """The limits on the colour scale, with their names beside it."""
        strains = self.film.problem.kind.strains
        if len(strains) == 0:
            return
        limits = sorted({100 * float(strains.min()), 100 * float(strains.max())})
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
        style: dict[str, Any] = {"size": 9, "linespacing": 1.1, "color": LIMIT_COLOUR}
        style |= {"transform": ax.get_yaxis_transform(), "ha": "right", "va": "center"}
        for height, text in labels.items():
            ax.text(-0.35, height, text, **style)

    def _words(self) -> None:
        """Titles; those that change with the state are filled in by `draw`."""
        self.heading = self.figure.text(0.03, 0.945, chart(self.film.scene), size=13, weight="bold")
        self.line = self.figure.text(0.03, 0.9, "", size=10.5, color=INK)
        self.measured = self.figure.text(0.03, 0.862, "", size=10.5, color=INK)
        if len(self.film.problem.pinned):
            head = Line2D([], [], linestyle="none", marker="o", markersize=5, color=PIN_COLOUR)
            place = {"loc": "lower right", "borderaxespad": 0.0, "handletextpad": 0.2}
            self.ax.legend([head], ["pinned"], frameon=False, fontsize=9, **place)

    def draw(self, index: int) -> NDArray[np.uint8]:
        """(height, width, 3) pixels of the state of that index."""
        state = self.film.states[index]
        colours = colormaps[MAP](self.norm(100 * self.film.strains[index]))[:, :3]
        self.image.set_data(self.stage.draw(index, colours))
        clock = f"step {state.step}" if state.time is None else f"t = {state.time:.3f} s"
        depth = 1000 * self.film.inside(index)
        inside = f",  vertices up to {depth:.2g} mm inside an obstacle" if depth > 0 else ""
        self.line.set_text(f"{chart(self.film.solver)},  {clock}{inside}")
        self.measured.set_text(measured(self.film.problem, state.positions))
        for text in (self.heading, self.line, self.measured):
            self._fit(text)
        self.canvas.draw()
        return np.asarray(self.canvas.buffer_rgba())[:, :, :3].copy()

    def _fit(self, text: Text) -> None:
        """Make a line that is too long for the picture smaller."""
        width = text.get_window_extent(self.canvas.get_renderer()).width
        room = 0.95 * SIZE[0] * DPI
        if width > room:
            text.set_fontsize(float(text.get_fontsize()) * room / width)
