"""A method looks the same everywhere, and unlike all others."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest

from strainbench.report.identity import BAR, CONTRAST, LOOKS, Family, linear, look, luminance
from strainbench.solver.registry import list_solvers

SIGHTS = {  # Machado, Oliveira, Fernandes 2009, of severity 1, in linear light
    "normal": [1, 0, 0, 0, 1, 0, 0, 0, 1],
    "protan": [0.1523, 1.0526, -0.2049, 0.1145, 0.7863, 0.0992, -0.0039, -0.0481, 1.052],
    "deutan": [0.3673, 0.8606, -0.228, 0.2801, 0.6725, 0.0474, -0.0118, 0.0429, 0.9689],
    "tritan": [1.2555, -0.0767, -0.1788, -0.0784, 0.9308, 0.1476, 0.0047, 0.6914, 0.3039],
}
XYZ = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
NEAR = 12.0  # CIE76, where colour alone does not tell two apart


def rgb(colour):
    return [int(colour[k : k + 2], 16) / 255 for k in (1, 3, 5)]


def lab(colour, sight):
    light = np.clip(np.reshape(SIGHTS[sight], (3, 3)) @ [linear(c) for c in rgb(colour)], 0, 1)
    x, y, z = XYZ @ light / XYZ.sum(axis=1)
    root = [c ** (1 / 3) if c > 0.008856 else 7.787 * c + 16 / 116 for c in (x, y, z)]
    return np.array([116 * root[1] - 16, 500 * (root[0] - root[1]), 200 * (root[1] - root[2])])


def pairs(sight):
    for one, other in combinations(LOOKS.values(), 2):
        if one.family != other.family:
            yield one, other, np.linalg.norm(lab(one.colour, sight) - lab(other.colour, sight))


def corners(shape):
    return shape.count("L") + 1


def genus(shape):
    """What a shape is told by at a glance."""
    if shape == BAR:
        return "bar"
    if "A" in shape:
        return "round" if shape.count("A") == 2 else "many corners"
    names = {3: "triangle", 4: "four corners", 5: "many corners", 6: "many corners"}
    return names.get(corners(shape), "cross")


def test_no_two_methods_share_a_shape():
    assert len({look.shape for look in LOOKS.values()}) == len(LOOKS)


def test_families_keep_apart_in_normal_sight():
    assert min(distance for *_, distance in pairs("normal")) > 25


@pytest.mark.parametrize("sight", ["protan", "deutan", "tritan"])
def test_what_the_colour_blind_confuse_is_told_apart_by_its_genus(sight):
    near = [(one, other) for one, other, distance in pairs(sight) if distance < NEAR]
    assert near
    for one, other in near:
        assert genus(one.shape) != genus(other.shape)


def test_a_family_has_one_genus_of_shapes_and_shares_it_with_none():
    kinds = {f: {genus(x.shape) for x in LOOKS.values() if x.family is f} for f in Family}
    found = [kind for kind in kinds.values() if kind]
    assert all(len(kind) == 1 for kind in found)
    assert len(set.union(*found)) == len(found)


def test_a_variant_has_its_bases_shape_and_another_colour():
    tight = look("clarabel-tight")
    assert tight.shape == LOOKS["clarabel"].shape
    assert tight.colour == "#849FC6"
    assert look("clarabel-default").colour == "#6082B4"
    assert look("cvxpy-scs-default").colour == "#7192B6"  # darker, as it is pale already
    assert look("newton-ipm-warm").colour == "#646464"
    assert look("admm[rho=2]").base == "admm"
    assert look("gauss-seidel-strain-warm").base == "gauss-seidel-strain"
    assert look("cvxpy-ecos-default").base == "cvxpy-ecos"


def test_every_solver_of_ours_has_a_look_of_its_own():
    found = {entry.name: look(entry.name) for entry in list_solvers()}
    assert all(x.family is not Family.YOURS for x in found.values())
    assert len({(x.colour, x.shape) for x in found.values()}) == len(found)


def test_a_method_of_the_users_is_a_star():
    assert look("mine").family is Family.YOURS
    assert look("mine").colour == "#D0021B"
    assert look("clarabelle").family is Family.YOURS
    assert look("other").shape == look("mine").shape
    assert look("theirs").colour != look("mine").colour


@pytest.mark.parametrize("name", [*LOOKS, "clarabel-paper", "mine", "xpbd-20"])
def test_its_name_can_be_read(name):
    assert 1.05 / (0.05 + luminance(tuple(rgb(look(name).ink)))) >= CONTRAST - 0.05
