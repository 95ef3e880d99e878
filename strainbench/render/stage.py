"""What of a film is drawn, through one camera and one window for all of its states."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from strainbench.arrays import FloatArray, IntArray
from strainbench.render.camera import Camera, Window
from strainbench.render.export import surface
from strainbench.render.film import Film
from strainbench.render.obstacles import patches, pin_heads
from strainbench.render.paint import SAMPLES, Surface, paint

OBSTACLE_COLOUR = np.full(3, 0.8)
PIN_COLOUR = (0.13, 0.13, 0.14)
PIN, LEAST_PIN = 0.007, 2.8  # radius of a pin's head: of the picture's width, in pixels


class Stage:
    """The cloth or the body, its obstacles and its pins.

    Parameters
    ----------
    size : width and height in pixels
    """

    def __init__(self, film: Film, camera: Camera, size: tuple[int, int]) -> None:
        self.film, self.camera = film, camera
        faces, self.owner = surface(film.problem)
        self.two_sided = film.problem.elements.shape[1] == 3
        self.faces = facing(camera.view(film.states[0].positions), faces)
        everywhere = [state.positions for state in film.states]
        vertices, triangles = patches(film.obstacles, np.concatenate(everywhere))
        self.obstacles = Surface(vertices, triangles, OBSTACLE_COLOUR)
        self.window = Window.around([camera.view(x) for x in [*everywhere, vertices]], size)

    def draw(self, index: int, colours: FloatArray, samples: int = SAMPLES) -> NDArray[np.uint8]:
        """(height, width, 3) pixels of a state whose elements have `colours` (e, 3)."""
        x = self.film.states[index].positions
        body = Surface(x, self.faces, colours[self.owner], outlined=True, sides=self.two_sided)
        radius = max(PIN * self.window.size[0], LEAST_PIN) * self.window.pixel
        heads = pin_heads(x[self.film.problem.pinned], radius)
        pins = Surface(*heads, np.array(PIN_COLOUR))
        return paint([body, self.obstacles, pins], self.camera, self.window, samples)


def facing(seen: FloatArray, faces: IntArray) -> IntArray:
    """(f, 3) the same, turned round where a surface `seen` (n, 3) shows mostly its back."""
    a, b, c = np.moveaxis(seen[faces], 1, 0)
    normals = np.cross(b - a, c - a)
    least = 1e-6 * np.linalg.norm(normals, axis=1).sum()  # 0 is the net of what is closed
    return faces[:, ::-1] if normals[:, 2].sum() < -least else faces
