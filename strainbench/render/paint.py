"""Surfaces as pixels: what is before is drawn before, in smooth light, both sides told apart."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from strainbench.arrays import FloatArray, IntArray
from strainbench.render.camera import Camera, Window
from strainbench.render.raster import nearest

SAMPLES = 2  # a pixel's side; 3 take twice as long
LIGHT = np.array([-0.42, 0.56, 0.71])  # to the right, upwards, towards the viewer
DARKEST = 0.58  # where no light falls
CREASE = np.cos(np.deg2rad(40.0))  # a surface that turns more at a vertex has an edge there
LINE, LINE_DARK = 0.35, 0.3  # half the width of a triangle's outline [pixels], and how dark it is
FINE = 9.0  # pixels: outlines of triangles that are smaller fade, as they would cover them
JUMP, CONTOUR_DARK = 6.0, 0.4  # a contour's least depth [pixels], and how dark it is
BACK_GREY, BACK = 0.62, 0.5  # what is mixed into the colours of a surface's back, and how much


@dataclass(frozen=True, eq=False)
class Surface:
    """Triangles of one kind.

    Parameters
    ----------
    vertices : (v, 3) [m]
    faces : (f, 3) vertex indices, anticlockwise where the front is seen
    colours : (f, 3) red, green and blue from 0 to 1, or (3,) for all
    outlined : draw the triangles' outlines
    sides : give the back a greyer colour
    """

    vertices: FloatArray
    faces: IntArray
    colours: FloatArray
    outlined: bool = False
    sides: bool = False


def greyer(colours: FloatArray) -> FloatArray:
    """(..., 3) the colours of a surface's back."""
    mixed: FloatArray = (1 - BACK) * colours + BACK * BACK_GREY
    return mixed


def paint(
    surfaces: Sequence[Surface], camera: Camera, window: Window, samples: int = SAMPLES
) -> NDArray[np.uint8]:
    """(height, width, 3) pixels of surfaces on white, each the mean of `samples`^2."""
    starts = np.cumsum([0, *(len(s.vertices) for s in surfaces)])
    faces = np.concatenate([s.faces + k for s, k in zip(surfaces, starts, strict=False)])
    seen = camera.view(np.concatenate([s.vertices for s in surfaces]))
    points = window.pixels(seen)
    width, height = (samples * n for n in window.size)
    face, weights, depth = nearest(points * samples, faces, (width, height))
    hit = face >= 0
    face, weights = face[hit], weights[hit]
    normals, facing = corner_normals(seen, faces)
    shade = _light(normals, face, weights)
    shade *= 1 - _outlines(surfaces, points[faces], face, weights, samples)
    shade *= 1 - CONTOUR_DARK * contours(depth, JUMP * samples)[hit]
    image = np.ones((height, width, 3))
    image[hit] = _colours(surfaces, facing)[face] * shade[:, None]
    blocks = image.reshape(height // samples, samples, width // samples, samples, 3)
    return np.asarray(np.round(255 * blocks.mean(axis=(1, 3))), dtype=np.uint8)


def contours(depth: FloatArray, jump: float) -> NDArray[np.bool_]:
    """(h, w) where a neighbour lies deeper by more than `jump`: the edges of folds."""
    edge = np.zeros(depth.shape, dtype=bool)
    for lines, marked in ((depth, edge), (depth.T, edge.T)):
        marked[1:] |= lines[1:] - lines[:-1] > jump
        marked[:-1] |= lines[:-1] - lines[1:] > jump
    return edge


def corner_normals(seen: FloatArray, faces: IntArray) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Unit normals (f, 3, 3) at each triangle's corners, and whether its front (f,) is seen.

    Those of neighbours are the same but at creases; all point towards the viewer.
    """
    a, b, c = np.moveaxis(seen[faces], 1, 0)
    flat = np.cross(b - a, c - a)
    smooth = np.zeros_like(seen)
    for k in range(3):
        np.add.at(smooth, faces[:, k], flat)
    flat, corners = _unit(flat)[:, None], _unit(smooth)[faces]
    creased = np.sum(flat * corners, axis=2, keepdims=True) < CREASE
    facing = flat[:, 0, 2] > 0
    return np.where(creased, flat, corners) * np.where(facing, 1, -1)[:, None, None], facing


def _unit(vectors: FloatArray) -> FloatArray:
    """(n, 3) of length 1, or 0 where they are."""
    lengths = np.linalg.norm(vectors, axis=1, keepdims=True)
    units: FloatArray = vectors / np.where(lengths > 0, lengths, 1)
    return units


def _colours(surfaces: Sequence[Surface], facing: NDArray[np.bool_]) -> FloatArray:
    """(f, 3) of the sides that are seen."""
    colours = np.concatenate([np.broadcast_to(s.colours, s.faces.shape) for s in surfaces])
    grey = _each(surfaces, [s.sides for s in surfaces]) & ~facing
    return np.where(grey[:, None], greyer(colours), colours)


def _each(surfaces: Sequence[Surface], values: Sequence[bool]) -> NDArray[np.bool_]:
    """(f,) a value of each surface for all of its triangles."""
    return np.repeat(np.array(values), [len(s.faces) for s in surfaces])


def _light(normals: FloatArray, face: IntArray, weights: FloatArray) -> FloatArray:
    """(p,) at points with `weights` (p, 3) in the triangles `face` (p,): 1 towards the light."""
    along = normals @ (LIGHT / np.linalg.norm(LIGHT))
    cosine = np.einsum("pk,pk->p", along[face], weights)
    light: FloatArray = DARKEST + (1 - DARKEST) * (0.5 + 0.5 * cosine) ** 2
    return light


def _outlines(
    surfaces: Sequence[Surface],
    corners: FloatArray,
    face: IntArray,
    weights: FloatArray,
    samples: int,
) -> FloatArray:
    """(p,) how dark the outline of a triangle is at these points, from 0 to 1."""
    sides = np.linalg.norm((np.roll(corners, 1, 1) - np.roll(corners, -1, 1))[..., :2], axis=2)
    doubled = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2]
    heights = np.abs(doubled)[:, None] / np.maximum(sides, 1e-300)  # of each corner
    dark = LINE_DARK * np.minimum(1, heights.min(axis=1) / FINE)
    dark *= _each(surfaces, [s.outlined for s in surfaces])
    near = np.min(heights[face] * weights, axis=1)
    cover: FloatArray = np.clip((LINE - near) * samples + 0.5, 0, 1) * dark[face]
    return cover
