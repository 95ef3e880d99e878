"""How each method looks, everywhere: a family's genus of shapes and hues, a shape and dashes of its
own. By its name, never by its place in a list.

Shapes are SVG paths in coordinates from -1 to 1, y downwards, as Vega takes them.
"""

from __future__ import annotations

import colorsys
from collections.abc import Iterable
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import cached_property, lru_cache
from math import cos, pi, sin


class Family(StrEnum):
    """Kinds of methods; the shapes of one are of one genus."""

    OURS = "ours"
    CONIC = "conic interior point"
    NLP = "nonlinear programming"
    FIRST_ORDER = "first order, dual"
    LOCAL = "local sweeps, first admissible"
    NONE = "no limits"
    YOURS = "yours"


@dataclass(frozen=True)
class Look:
    """What a method is drawn with.

    Parameters
    ----------
    base : the registered name that it is, or is a variant of; "" for one of the user's
    colour : of marks and lines, #rrggbb
    shape : an SVG path
    dash : lengths of dash and gap in units of the line's width over 1.5; empty if solid
    """

    family: Family
    base: str
    colour: str
    shape: str
    dash: tuple[float, ...] = ()

    @cached_property
    def ink(self) -> str:
        """The colour dark enough for text on white."""
        rgb = _rgb(self.colour)
        while 1.05 / (0.05 + luminance(rgb)) < CONTRAST:
            rgb = _mixed(rgb, BLACK, 0.02)
        return _hex(rgb)


RGB = tuple[float, float, float]
BLACK, WHITE = (0.0, 0.0, 0.0), (1.0, 1.0, 1.0)
CONTRAST = 4.5
BRIGHT = 0.5  # luminance
MIXES = (0.35, 0.5, 0.6)  # how much white or black a variant has
VARIANT_DASHES = ((4, 1.5), (1.5, 1.5), (6, 1.5, 1.5, 1.5))
PALEST = 0.6
TURNS = (40, -40, 0)  # degrees of hue between methods of the user's


def _path(points: Iterable[tuple[float, float]]) -> str:
    return "M" + "L".join(f"{x:.3g},{y:.3g}" for x, y in points) + "Z"


def _regular(corners: int, turn: float = 0.0, inner: float = 1.0, radius: float = 1.05) -> str:
    """Corners on a circle, the first one up; with `inner`, every other one within."""
    angles = [2 * pi * (k / corners + turn) for k in range(corners)]
    radii = [radius * (inner if k % 2 else 1.0) for k in range(corners)]
    return _path((r * sin(a), -r * cos(a)) for a, r in zip(angles, radii, strict=True))


def _arms(count: int, turn: float, width: float = 0.34) -> str:
    """A cross of so many arms."""
    points, half = [], width / sin(pi / count)
    for k in range(count):
        along, between = 2 * pi * (k / count + turn), 2 * pi * ((k + 0.5) / count + turn)
        tip, across = (sin(along), -cos(along)), (cos(along), sin(along))
        points += [
            (tip[0] + s * width * across[0], tip[1] + s * width * across[1]) for s in (-1, 1)
        ]
        points.append((half * sin(between), -half * cos(between)))
    return _path(points)


CIRCLE = "M-.95,0A.95,.95,0,1,1,.95,0A.95,.95,0,1,1,-.95,0Z"
DOME = "M-1,.7A1,1.3,0,1,1,1,.7Z"
RIGHT_TRIANGLE = _path([(1, -1), (1, 1), (-1, 1)])
BAR = _path([(-1, -0.25), (1, -0.25), (1, 0.25), (-1, 0.25)])
STAR = _regular(10, inner=0.42, radius=1.25)


def _conic(base: str, colour: str, points: list[tuple[float, float]], *dash: float) -> Look:
    return Look(Family.CONIC, base, colour, _path(points), dash)


LOOKS = {
    look.base: look
    for look in (
        Look(Family.OURS, "newton-ipm", "#111111", CIRCLE),
        _conic("clarabel", "#0A3F8C", [(-0.85, -0.85), (0.85, -0.85), (0.85, 0.85), (-0.85, 0.85)]),
        _conic("qoco", "#2F86D6", [(0, -1.15), (0.95, 0), (0, 1.15), (-0.95, 0)], 5, 2),
        _conic("cvxpy", "#5B7FB5", [(-0.5, -0.8), (1.2, -0.8), (0.5, 0.8), (-1.2, 0.8)], 2, 2),
        _conic(
            "cvxpy-ecos",
            "#5BA8DC",
            [(-1.2, -0.8), (0.5, -0.8), (1.2, 0.8), (-0.5, 0.8)],
            *(6, 2, 1, 2),
        ),
        _conic("cvxpy-scs", "#8FB9E6", [(-1, -0.9), (1, -0.9), (-1, 0.9), (1, 0.9)], 1, 2),
        _conic("cvxpy-qoco", "#7FA6CF", [(-0.5, -1.1), (0.5, -1.1), (0.5, 1.1), (-0.5, 1.1)], 8, 2),
        _conic(
            "cvxpy-mosek", "#3E6A94", [(-0.6, -0.8), (0.6, -0.8), (1.1, 0.8), (-1.1, 0.8)], 3, 1
        ),
        Look(Family.NLP, "ipopt", "#C04A00", _regular(3, radius=1.2)),
        Look(Family.NLP, "linearized-qp", "#7A4A12", _regular(3, 1 / 2, radius=1.2), (5, 2)),
        Look(Family.NLP, "ipopt-edges", "#E8923A", _regular(3, 1 / 4, radius=1.2), (2, 2)),
        Look(Family.NLP, "ipopt-principal", "#D9793B", RIGHT_TRIANGLE, (1, 2)),
        Look(Family.NLP, "lcp-qp", "#5C3A1E", _path([(-1, -1), (1, 1), (-1, 1)]), (6, 2, 1, 2)),
        Look(Family.NLP, "sequential-cuts", "#9C2B16", _regular(3, 3 / 4, radius=1.2), (8, 2)),
        Look(Family.FIRST_ORDER, "admm", "#00786A", _arms(4, 0)),
        Look(Family.FIRST_ORDER, "dykstra", "#3DB79B", _arms(4, 1 / 8), (5, 2)),
        Look(Family.FIRST_ORDER, "augmented-lagrangian", "#6E9A1F", _arms(3, 1 / 2), (2, 2)),
        Look(Family.LOCAL, "gauss-seidel", "#96296E", _regular(5)),
        Look(Family.LOCAL, "xpbd", "#C2558F", _regular(6), (5, 2)),
        Look(Family.LOCAL, "fast-projection", "#E58AB4", DOME, (2, 2)),
        Look(Family.LOCAL, "gauss-seidel-strain", "#A9799A", _regular(5, 1 / 2), (6, 2, 1, 2)),
        Look(Family.LOCAL, "gauss-seidel-principal", "#D3AFC6", _regular(5, 1 / 4), (1, 2)),
        Look(Family.LOCAL, "gauss-seidel-clamp", "#8A4F78", _regular(5, 1 / 8), (2, 2)),
        Look(Family.LOCAL, "lcp-pgs", "#7B2D5B", _regular(6, 1 / 12), (1, 2)),
        Look(Family.NONE, "none", "#6F6F6F", BAR, (1, 3)),
    )
}
INTEGRATORS: dict[str, tuple[str, tuple[float, ...]]] = {
    "sap": ("#0A3F8C", ()),
    "sar": ("#C04A00", ()),
    "sar-projected": ("#E8923A", (5, 2)),
    "bap": ("#00786A", ()),
    "bar-stable": ("#111111", ()),
    "bar": ("#96296E", (6, 2, 1, 2)),
    "bar-bdf2": ("#C2558F", (2, 2)),
}
"""Colour and dashes of each; lines of energy have no marks."""
VARIANTS = {
    "clarabel": ("default", "tight", "paper"),
    "linearized-qp": ("default", "plain"),
    "xpbd": ("20", "compliant"),
    "lcp-pgs": ("literal", "biot"),
    "lcp-qp": ("literal", "biot"),
}
"""Those of one base that are to be told apart; of any other the sum over its name decides."""
YOURS = Look(Family.YOURS, "", "#D0021B", STAR)


@lru_cache(maxsize=1024)
def look(name: str) -> Look:
    """Of a method, a variant of one (clarabel-tight, admm[rho=2]), or one of the user's."""
    if name in LOOKS:
        return LOOKS[name]
    bases = [b for b in LOOKS if name.startswith(tuple(b + mark for mark in "-[ "))]
    if not bases:
        turn = TURNS[sum(name.encode()) % len(TURNS)]
        return replace(YOURS, colour=_turned(YOURS.colour, turn))
    base = max(bases, key=len)
    return _variant(LOOKS[base], name[len(base) + 1 :])


def integrator_look(name: str, pale: float = 0.0) -> Look:
    """Of an integrator, `pale` from 0 to 1 by how small its step is beside others'."""
    colour, dash = INTEGRATORS.get(name, (YOURS.colour, ()))
    mixed = _hex(_mixed(_rgb(colour), WHITE, PALEST * pale))
    return Look(Family.OURS, "", mixed, CIRCLE, VARIANT_DASHES[0] if pale else dash)


def _variant(base: Look, name: str) -> Look:
    """Of a base's shape, paler or darker, with dashes of its own."""
    known = VARIANTS.get(base.base, ())
    place = known.index(name) if name in known else _place(name) % len(MIXES)
    rgb, share = _rgb(base.colour), MIXES[place]
    paler = _mixed(rgb, WHITE, share)
    mixed = paler if luminance(paler) <= BRIGHT else _mixed(rgb, BLACK, 0.6 * share)
    return replace(base, colour=_hex(mixed), dash=VARIANT_DASHES[place])


def _place(name: str) -> int:
    """From a name alone; 0 for the commonest ones."""
    return 0 if name in ("default", "warm") else sum(name.encode())


def luminance(rgb: RGB) -> float:
    """Relative luminance, from 0 to 1."""
    red, green, blue = (linear(c) for c in rgb)
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue


def linear(channel: float) -> float:
    """A channel of sRGB in linear light."""
    return channel / 12.92 if channel <= 0.04045 else ((channel + 0.055) / 1.055) ** 2.4


def _rgb(colour: str) -> RGB:
    red, green, blue = (int(colour[k : k + 2], 16) / 255 for k in (1, 3, 5))
    return red, green, blue


def _hex(rgb: RGB) -> str:
    return "#" + "".join(f"{round(255 * c):02X}" for c in rgb)


def _mixed(rgb: RGB, other: RGB, share: float) -> RGB:
    red, green, blue = ((1 - share) * c + share * o for c, o in zip(rgb, other, strict=True))
    return red, green, blue


def _turned(colour: str, degrees: float) -> str:
    """The hue turned."""
    hue, lightness, saturation = colorsys.rgb_to_hls(*_rgb(colour))
    return _hex(colorsys.hls_to_rgb((hue + degrees / 360) % 1.0, lightness, saturation))
